/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "interface/interface_work.h"
#include "base/progress.h"
#include "base/stop_signal.h"
#include "interface/hyst_interface.h"
#include "numerics/blas.h"
#include <pthread.h>

static int threads_before;
static pthread_mutex_t one_at_a_time = PTHREAD_MUTEX_INITIALIZER;

/* Helpers of a thread that works have none: they do not report. */
static _Thread_local hyst_host_progress_t *asked_progress;
static _Thread_local void *asked_context;
static _Thread_local volatile sig_atomic_t *device_flag;
static _Thread_local bool long_work; /* this thread does some */

static void begin(void *context, const char *what) {
    (void)context;
    (void)what;
}

static void update(void *context, const char *what, double fraction) {
    (void)context;
    if (asked_progress == NULL || asked_progress(asked_context, what, fraction) == 0) {
        return;
    }
    if (device_flag != NULL) {
        *device_flag = STOP_BY_PROGRAM;
    } else if (long_work) {
        progress_cancel(true);
    }
}

static const progress_listener_t listener = {begin, update, begin, NULL};

void hyst_host_on_progress(hyst_host_progress_t *progress, void *context) {
    asked_progress = progress;
    asked_context = context;
}

void hyst_host_cancel(int cancel) {
    progress_cancel(cancel != 0);
}

static void listen_once(void) {
    progress_listen(&listener);
}

void interface_listen(volatile sig_atomic_t *flag) {
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    device_flag = flag;
    (void)pthread_once(&once, listen_once);
}

void interface_work_begin(void) {
    pthread_mutex_lock(&one_at_a_time);
    interface_listen(NULL);
    long_work = true;
    threads_before = blas_threads(1);
}

void interface_work_end(void) {
    (void)blas_threads(threads_before);
    long_work = false;
    pthread_mutex_unlock(&one_at_a_time);
}
