/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Tasks on all processors: each done once, whatever their number, nested or not, and never more threads than requested.
 */
#include "base/parallel.h"
#include "unity.h"
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { MOST = 1000, OUTER = 9, INNER = 50 };

typedef struct {
    atomic_int done[MOST];
    atomic_int at_work, most_at_work;
} count_t;

void setUp(void) {
}
void tearDown(void) {
    parallel_limit(0);
}

/* Long enough for another thread to come in between. */
static void take_time(void) {
    for (volatile int i = 0; i < 2000; i++) {
    }
}

static void begin(count_t *count) {
    const int now = 1 + atomic_fetch_add(&count->at_work, 1);
    int most = atomic_load(&count->most_at_work);
    while (now > most && !atomic_compare_exchange_weak(&count->most_at_work, &most, now)) {
    }
}

static void count_task(void *context, size_t index) {
    count_t *count = context;
    begin(count);
    take_time();
    atomic_fetch_add(&count->done[index], 1);
    atomic_fetch_sub(&count->at_work, 1);
}

/* So long that every thread that may work comes in between. */
static void count_sleep(void *context, size_t index) {
    count_t *count = context;
    (void)index;
    begin(count);
    (void)nanosleep(&(struct timespec){.tv_nsec = 2000000}, NULL);
    atomic_fetch_sub(&count->at_work, 1);
}

static void test_every_task_is_done_once(void) {
    static const size_t limits[] = {1, 2, 3, 8, 100}, counts[] = {0, 1, 2, 3, 10, MOST};
    for (size_t l = 0; l < sizeof limits / sizeof limits[0]; l++) {
        parallel_limit(limits[l]);
        for (size_t c = 0; c < sizeof counts / sizeof counts[0]; c++) {
            static count_t count;
            memset(&count, 0, sizeof count);
            parallel(counts[c], count_task, &count);
            for (size_t i = 0; i < MOST; i++) {
                TEST_ASSERT_EQUAL_INT(i < counts[c] ? 1 : 0, atomic_load(&count.done[i]));
            }
            TEST_ASSERT_EQUAL_INT(0, atomic_load(&count.at_work)); /* all had returned */
            TEST_ASSERT_TRUE(atomic_load(&count.most_at_work) <= (int)limits[l]);
        }
    }
}

/* Anything but a whole number above 0 changes nothing. */
static void test_the_environment_limits_threads(void) {
    static const struct {
        const char *threads;
        int most; /* 0: as many as processors */
    } cases[] = {{"1", 1}, {"2", 2}, {"0", 0}, {"-1", 0}, {"1x", 0}, {"", 0}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        static count_t count;
        memset(&count, 0, sizeof count);
        TEST_ASSERT_EQUAL_INT(0, setenv("HYST_THREADS", cases[i].threads, 1));
        parallel_limit(0); /* asks anew */
        parallel(100, count_sleep, &count);
        const long most = cases[i].most > 0 ? cases[i].most : sysconf(_SC_NPROCESSORS_ONLN);
        TEST_ASSERT_TRUE(atomic_load(&count.most_at_work) <= most);
        TEST_ASSERT_TRUE(most == 1 || atomic_load(&count.most_at_work) > 1);
    }
    unsetenv("HYST_THREADS");
}

static void outer_task(void *context, size_t index) {
    count_t *count = context;
    parallel(INNER, count_task, &count[index]);
    for (size_t i = 0; i < INNER; i++) { /* before it returns */
        TEST_ASSERT_EQUAL_INT(1, atomic_load(&count[index].done[i]));
    }
}

/* Nested calls share the processors: no call waits for another one's, and there are never more threads. */
static void test_tasks_may_have_tasks(void) {
    static count_t count[OUTER];
    for (size_t limit = 1; limit <= 4; limit++) {
        memset(count, 0, sizeof count);
        parallel_limit(limit);
        parallel(OUTER, outer_task, count);
        for (size_t o = 0; o < OUTER; o++) {
            for (size_t i = 0; i < INNER; i++) {
                TEST_ASSERT_EQUAL_INT(1, atomic_load(&count[o].done[i]));
            }
            TEST_ASSERT_TRUE(atomic_load(&count[o].most_at_work) <= (int)limit);
        }
    }
}

/* Tasks that wait for each other, and whether each has seen the other one. */
typedef struct {
    atomic_int arrived, met, deaf;
    size_t which; /* of two tasks, the one that has two itself */
} meeting_t;

static void wait_for(atomic_int *arrived, int many) {
    for (long i = 0; i < 2000000000L && atomic_load(arrived) < many; i++) { /* seconds, where nobody comes */
    }
}

static void together_task(void *context, size_t index) {
    meeting_t *meeting = context;
    (void)index;
    atomic_fetch_add(&meeting->arrived, 1);
    wait_for(&meeting->arrived, 2);
    atomic_fetch_add(&meeting->met, atomic_load(&meeting->arrived) == 2 ? 1 : 0);
}

/* Two tasks that each wait for the other: they run at the same time, or after seconds one is seen alone. */
static void test_two_tasks_run_at_the_same_time(void) {
    meeting_t meeting = {0};
    parallel_limit(2);
    parallel(2, together_task, &meeting);
    TEST_ASSERT_EQUAL_INT(2, atomic_load(&meeting.met));
}

static void one_has_two(void *context, size_t index) {
    meeting_t *meeting = context;
    if (index == meeting->which) {
        parallel(2, together_task, meeting);
    } else {
        wait_for(&meeting->arrived, 1);
    }
}

/* Both threads are taken when the inner two begin. The one that has nothing more to do, be it the caller's or another
 * one, takes the second of them. */
static void test_a_thread_that_becomes_idle_helps_within(void) {
    parallel_limit(2);
    for (size_t which = 0; which < 2; which++) {
        meeting_t meeting = {.which = which};
        parallel(2, one_has_two, &meeting);
        TEST_ASSERT_EQUAL_INT(2, atomic_load(&meeting.met));
    }
}

static void note_mask(void *context, size_t index) {
    meeting_t *meeting = context;
    sigset_t mask;
    (void)index;
    together_task(meeting, index);
    pthread_sigmask(SIG_SETMASK, NULL, &mask);
    atomic_fetch_add(&meeting->deaf, sigismember(&mask, SIGTERM) == 1 ? 1 : 0);
}

/* A signal that ends a command interrupts what the command's own thread waits for. */
static void test_signals_go_to_the_thread_that_called(void) {
    meeting_t meeting = {0};
    parallel_limit(2);
    parallel(2, note_mask, &meeting);
    TEST_ASSERT_EQUAL_INT(1, atomic_load(&meeting.deaf));
}

/* Threads do not go along into a child process: there it works alone, or with others of its own. First of the tests,
 * with one other thread, which has run: threads that start allocate, and the sanitizers' allocator of gcc 12 leaves a
 * child the locks that others held. */
static void test_a_child_process_has_its_own(void) {
    parallel_limit(2);
    meeting_t meeting = {0};
    parallel(2, together_task, &meeting);
    const pid_t child = fork();
    if (child == 0) {
        meeting_t again = {0};
        parallel(2, together_task, &again);
        _exit(atomic_load(&again.met) == 2 ? 0 : 1);
    }
    int status = -1;
    TEST_ASSERT_EQUAL_INT(child, waitpid(child, &status, 0));
    TEST_ASSERT_EQUAL_INT(0, status);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_child_process_has_its_own);
    RUN_TEST(test_every_task_is_done_once);
    RUN_TEST(test_the_environment_limits_threads);
    RUN_TEST(test_tasks_may_have_tasks);
    RUN_TEST(test_two_tasks_run_at_the_same_time);
    RUN_TEST(test_a_thread_that_becomes_idle_helps_within);
    RUN_TEST(test_signals_go_to_the_thread_that_called);
    return UNITY_END();
}
