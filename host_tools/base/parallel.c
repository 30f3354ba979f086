/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/parallel.h"
#include <pthread.h>
#include <signal.h>
#include <stdbool.h>
#include <stdlib.h>
#include <unistd.h>

enum { MOST_THREADS = 64 };

/* A call of parallel(). It lies on the stack of the thread that called, which leaves when all tasks have returned. The
 * first four stay as they are; the others are read and written under `lock` only. */
typedef struct job {
    size_t count;
    parallel_task_t *task;
    void *context;
    struct job *within; /* the call whose task made this one; NULL: none */
    size_t begun, returned;
    pthread_cond_t changed; /* all have returned, or there is work within it */
    struct job *newer;
} job_t;

/* What all threads share: under `lock` only. */
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t work_is_there = PTHREAD_COND_INITIALIZER;
static job_t *oldest;     /* of the jobs with tasks that no thread has begun */
static size_t most;       /* threads; 0: not yet determined */
static size_t helpers;    /* threads that were started. They stay */
static size_t at_work;    /* of the helpers */
static size_t wait_there; /* of the helpers, for work */

/* The job whose task this thread runs. */
static _Thread_local job_t *inside;

/* By the environment; 0: it says nothing, or no whole number. */
static long wanted_threads(void) {
    const char *const text = getenv("HYST_THREADS");
    char *end = NULL;
    const long threads = text != NULL ? strtol(text, &end, 10) : 0;
    return end != NULL && *end == '\0' && threads > 0 ? threads : 0;
}

static size_t most_threads(void) {
    if (most == 0) {
        const long wanted = wanted_threads(), threads = wanted > 0 ? wanted : sysconf(_SC_NPROCESSORS_ONLN);
        most = threads < 1 ? 1 : threads < MOST_THREADS ? (size_t)threads : MOST_THREADS;
    }
    return most;
}

void parallel_limit(size_t threads) {
    pthread_mutex_lock(&lock);
    most = threads < MOST_THREADS ? threads : MOST_THREADS;
    pthread_mutex_unlock(&lock);
}

size_t parallel_parts(double multiplications) {
    enum { PARTS = 4 };
    static const double worth_threads = 1e6;
    return multiplications < worth_threads ? 1 : PARTS;
}

static bool is_within(const job_t *job, const job_t *outer) {
    while (job != NULL && job != outer) {
        job = job->within;
    }
    return job == outer;
}

/* The oldest one of those within `outer`; NULL: of all. An old one's tasks are the larger ones. */
static job_t *find_work(const job_t *outer) {
    job_t *job = oldest;
    while (job != NULL && !is_within(job, outer)) {
        job = job->newer;
    }
    return job;
}

static void put_last(job_t *job) {
    job_t **place = &oldest;
    while (*place != NULL) {
        place = &(*place)->newer;
    }
    *place = job;
}

static void take_out(const job_t *job) {
    job_t **place = &oldest;
    while (*place != job) {
        place = &(*place)->newer;
    }
    *place = job->newer;
}

/* With the lock, which is free while the task runs. */
static void run_one(job_t *job) {
    const size_t index = job->begun++;
    if (job->begun == job->count) {
        take_out(job);
    }
    job_t *outer = inside;
    inside = job;
    pthread_mutex_unlock(&lock);
    job->task(job->context, index);
    pthread_mutex_lock(&lock);
    inside = outer;
    if (++job->returned == job->count) {
        pthread_cond_signal(&job->changed);
    }
}

static void *help(void *nothing) {
    (void)nothing;
    pthread_mutex_lock(&lock);
    for (;;) {
        job_t *job = at_work + 1 < most_threads() ? find_work(NULL) : NULL;
        if (job != NULL) {
            at_work++;
            run_one(job);
            at_work--;
        } else {
            wait_there++;
            pthread_cond_wait(&work_is_there, &lock);
            wait_there--;
        }
    }
    return NULL;
}

/* Signals are for the threads that others know. */
static bool start_helper(void) {
    pthread_t thread;
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    const bool started = pthread_create(&thread, NULL, help, NULL) == 0;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (started) {
        pthread_detach(thread);
        helpers++;
    }
    return started;
}

/* A child process has the thread that made it, and no other one. */
static void begin_in_child(void) {
    lock = (pthread_mutex_t)PTHREAD_MUTEX_INITIALIZER;
    work_is_there = (pthread_cond_t)PTHREAD_COND_INITIALIZER;
    oldest = NULL;
    helpers = at_work = wait_there = 0;
}

static void begin_once(void) {
    (void)pthread_atfork(NULL, NULL, begin_in_child);
}

/* Helpers for so many tasks; and who waits for what this job is a part of. */
static void call_for_help(const job_t *job, size_t tasks) {
    const size_t idle = most_threads() - 1 - at_work, wanted = tasks < idle ? tasks : idle;
    for (size_t i = 0; i < wanted && i < wait_there; i++) {
        pthread_cond_signal(&work_is_there);
    }
    for (size_t i = wait_there; i < wanted && helpers + 1 < most_threads() && start_helper(); i++) {
    }
    for (job_t *outer = job->within; outer != NULL; outer = outer->within) {
        pthread_cond_signal(&outer->changed);
    }
}

/* All tasks that no thread has begun; then, until the others have returned, what is within them. */
static void run_all(job_t *job) {
    put_last(job);
    call_for_help(job, job->count - 1);
    while (job->returned < job->count) {
        job_t *next = job->begun < job->count ? job : find_work(job);
        if (next != NULL) {
            run_one(next);
        } else {
            pthread_cond_wait(&job->changed, &lock);
        }
    }
}

void parallel(size_t count, parallel_task_t *task, void *context) {
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_mutex_lock(&lock);
    const bool alone = count < 2 || most_threads() == 1;
    if (!alone) {
        (void)pthread_once(&once, begin_once);
        job_t job = {
            .count = count, .task = task, .context = context, .within = inside, .changed = PTHREAD_COND_INITIALIZER};
        run_all(&job);
        pthread_cond_destroy(&job.changed);
    }
    pthread_mutex_unlock(&lock);
    for (size_t i = 0; alone && i < count; i++) {
        task(context, i);
    }
}
