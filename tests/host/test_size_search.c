/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The search for a size: which sizes are tried, what comes of those that cannot be, and that two are tried at once. */
#include "base/parallel.h"
#include "numerics/size_search.h"
#include "unity.h"
#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include <time.h>

enum { MOST = 20 };

static double tried[MOST];
static size_t tries;

void setUp(void) {
    tries = 0;
    parallel_limit(1); /* in order */
}
void tearDown(void) {
    parallel_limit(0);
}

static void note(double size) {
    TEST_ASSERT_TRUE(tries < MOST);
    tried[tries++] = size;
}

static double from_five(void *context, double size) {
    (void)context;
    note(size);
    return fabs(size - 5.0);
}

static void test_a_size_between_is_found(void) {
    static const double expected[] = {1.0, 2.0, 4.0, 8.0, 3.0, 6.0, 3.5, 5.0, 4.5, 5.5, 4.75, 5.25};
    double least = 0.0;
    TEST_ASSERT_EQUAL_DOUBLE(5.0, size_search(from_five, NULL, 1.0, &least));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, least);
    TEST_ASSERT_EQUAL(sizeof expected / sizeof expected[0], tries);
    TEST_ASSERT_EQUAL_DOUBLE_ARRAY(expected, tried, tries);
}

static void test_a_smaller_size_is_found(void) {
    double least = 0.0;
    TEST_ASSERT_EQUAL_DOUBLE(5.0, size_search(from_five, NULL, 8.0, &least)); /* 8, 6, 5 */
    TEST_ASSERT_EQUAL_DOUBLE(0.0, least);
}

static double the_larger_the_less(void *context, double size) {
    (void)context;
    note(size);
    return -size;
}

static void test_a_size_is_doubled_four_times(void) {
    double least = 0.0;
    TEST_ASSERT_EQUAL_DOUBLE(16.0, size_search(the_larger_the_less, NULL, 1.0, &least));
    TEST_ASSERT_EQUAL_DOUBLE(-16.0, least);
}

static double only_four(void *context, double size) {
    (void)context;
    note(size);
    return size == 4.0 ? 1.0 : HUGE_VAL;
}

static void test_what_cannot_be_is_not_taken(void) {
    double least = 0.0;
    TEST_ASSERT_EQUAL_DOUBLE(4.0, size_search(only_four, NULL, 2.0, &least));
    TEST_ASSERT_EQUAL_DOUBLE(1.0, least);
    tries = 0;
    (void)size_search(only_four, NULL, 0.1, &least);
    TEST_ASSERT_TRUE(isinf(least));
}

/* Each of two sizes waits for the other one to begin. */
typedef struct {
    pthread_mutex_t lock;
    pthread_cond_t begun;
    size_t there;
    bool met;
} meeting_t;

static double meet(void *context, double size) {
    meeting_t *meeting = context;
    struct timespec end;
    clock_gettime(CLOCK_REALTIME, &end);
    end.tv_sec += 10;
    pthread_mutex_lock(&meeting->lock);
    if (++meeting->there == 2) {
        meeting->met = true;
        pthread_cond_broadcast(&meeting->begun);
    }
    while (!meeting->met && pthread_cond_timedwait(&meeting->begun, &meeting->lock, &end) == 0) {
    }
    pthread_mutex_unlock(&meeting->lock);
    return size;
}

static void test_two_sizes_are_tried_at_once(void) {
    meeting_t meeting = {.lock = PTHREAD_MUTEX_INITIALIZER, .begun = PTHREAD_COND_INITIALIZER};
    double least = 0.0;
    parallel_limit(2);
    /* Alone the first one would leave after ten seconds, and the second would still set `met`: the first two have to
     * have been there within that time. */
    const time_t before = time(NULL);
    (void)size_search(meet, &meeting, 1.0, &least);
    TEST_ASSERT_TRUE(meeting.met);
    TEST_ASSERT_TRUE(time(NULL) - before < 8);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_size_between_is_found);
    RUN_TEST(test_a_smaller_size_is_found);
    RUN_TEST(test_a_size_is_doubled_four_times);
    RUN_TEST(test_what_cannot_be_is_not_taken);
    RUN_TEST(test_two_sizes_are_tried_at_once);
    return UNITY_END();
}
