/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/progress.h"
#include <stdatomic.h>
#include <stddef.h>

static const progress_listener_t *listening;
static atomic_bool cancelled;

void progress_listen(const progress_listener_t *listener) {
    listening = listener;
}

void progress_begin(progress_t *progress, const char *what) {
    progress->what = what;
    progress->fraction = 0.0;
    if (listening != NULL) {
        listening->begin(listening->context, what);
    }
}

void progress_update(progress_t *progress, double fraction) {
    progress->fraction = fraction < 0.0 ? 0.0 : fraction > 1.0 ? 1.0 : fraction;
    if (listening != NULL && progress->what != NULL) {
        listening->update(listening->context, progress->what, progress->fraction);
    }
}

void progress_name(progress_t *progress, const char *what) {
    progress->what = what;
    progress_update(progress, progress->fraction);
}

void progress_end(progress_t *progress) {
    if (listening != NULL && progress->what != NULL) {
        listening->end(listening->context, progress->what);
    }
}

void progress_cancel(bool cancel) {
    atomic_store_explicit(&cancelled, cancel, memory_order_relaxed);
}

bool progress_cancelled(void) {
    return atomic_load_explicit(&cancelled, memory_order_relaxed);
}

bool progress_go_on(failure_t *failure) {
    return !progress_cancelled() || fail(failure, "interrupted");
}
