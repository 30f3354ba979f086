/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/parallel.h"
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <unistd.h>

enum { MOST_THREADS = 64 };

/* Running threads, including the main one; and the limit, 0: not yet determined. */
static atomic_size_t running = 1, most;

typedef struct {
    size_t count;
    parallel_task_t *task;
    void *context;
    atomic_size_t next; /* next task without a thread */
} job_t;

static size_t most_threads(void) {
    if (atomic_load(&most) == 0) {
        const long processors = sysconf(_SC_NPROCESSORS_ONLN);
        atomic_store(&most, processors < 1 ? 1 : processors < MOST_THREADS ? (size_t)processors : MOST_THREADS);
    }
    return atomic_load(&most);
}

void parallel_limit(size_t threads) {
    atomic_store(&most, threads < MOST_THREADS ? threads : MOST_THREADS);
}

size_t parallel_parts(double multiplications) {
    enum { PARTS = 4 };
    static const double worth_threads = 1e6;
    return multiplications < worth_threads ? 1 : PARTS;
}

static bool take_processor(void) {
    size_t now = atomic_load(&running);
    while (now < most_threads()) {
        if (atomic_compare_exchange_weak(&running, &now, now + 1)) {
            return true;
        }
    }
    return false;
}

static void work(job_t *job) {
    for (size_t index = atomic_fetch_add(&job->next, 1); index < job->count; index = atomic_fetch_add(&job->next, 1)) {
        job->task(job->context, index);
    }
}

static void *help(void *job) {
    work(job);
    atomic_fetch_sub(&running, 1);
    return NULL;
}

void parallel(size_t count, parallel_task_t *task, void *context) {
    job_t job = {.count = count, .task = task, .context = context};
    pthread_t helper[MOST_THREADS];
    size_t helpers = 0;
    while (helpers + 1 < count && helpers < MOST_THREADS && take_processor()) {
        if (pthread_create(&helper[helpers], NULL, help, &job) != 0) {
            atomic_fetch_sub(&running, 1);
            break;
        }
        helpers++;
    }
    work(&job);
    for (size_t i = 0; i < helpers; i++) {
        pthread_join(helper[i], NULL);
    }
}
