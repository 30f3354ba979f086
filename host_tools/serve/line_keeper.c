/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "serve/line_keeper.h"
#include "amplifier/amplifier_image.h"
#include "amplifier/device/opening.h"
#include "amplifier/device/restart.h"
#include "amplifier/device/sample_number.h"
#include "base/monotonic_clock.h"
#include "base/provenance.h"
#include "loop/telemetry.h"
#include "serve/live_stream.h"
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Between snapshots: 20 a second are smooth to the eye, and a fifth of the line at 115200 baud. */
#define SNAPSHOT_S 0.05
/* While work has the line: a streamed capture leaves room for about this many (device_registers_per_sample). */
#define SNAPSHOT_WORKING_S 0.1
/* Between blocks of the stream that has been read up to its end; and the longest that reading it may keep work waiting,
 * and a snapshot. */
#define STREAM_S         0.02
#define STREAM_WORKING_S 0.06
#define STREAM_IDLE_S    0.1
/* Between looks whether it is still the same start, and the same image, as a snapshot does not say. */
#define SAME_S 1.0
/* Between attempts to open a line that is cut. */
#define AGAIN_S 0.5

struct line_keeper {
    const device_options_t *options;
    const line_listener_t *listener;
    pthread_t thread;
    /* Shared, under the lock. */
    pthread_mutex_t lock;
    pthread_cond_t wake;
    bool ending, connected, working, watched;
    bool stop;           /* requested, not yet taken by the amplifier */
    double stop_since_s; /* when it was requested */
    line_work_t work;    /* while working */
    /* The thread's own. */
    device_t *device; /* NULL: the line is cut */
    provenance_note_t *note;
    hyst_parameters_t image;
    bool cut;      /* while the work runs, which therefore ends */
    bool gave_way; /* a stop or work has come while the stream was read */
    live_stream_t stream;
    int64_t now[REGISTER_COUNT]; /* the last snapshot */
    double snapshot_due_s, same_due_s;
    bool said_cut; /* that the line cannot be opened */
};

static void set_connected(line_keeper_t *keeper, bool connected) {
    pthread_mutex_lock(&keeper->lock);
    keeper->connected = connected;
    pthread_mutex_unlock(&keeper->lock);
}

static void say_line(line_keeper_t *keeper) {
    const line_listener_t *const l = keeper->listener;
    keeper->said_cut = false;
    set_connected(keeper, true);
    l->line(l->context, keeper->device, &keeper->image, NULL);
}

/* Once. */
static void say_cut(line_keeper_t *keeper, const char *why) {
    const line_listener_t *const l = keeper->listener;
    set_connected(keeper, false);
    if (!keeper->said_cut) {
        keeper->said_cut = true;
        l->line(l->context, NULL, NULL, why);
    }
}

static bool take_snapshot(line_keeper_t *keeper, failure_t *failure) {
    const bool ok = device_read_span(keeper->device, INDEX_sequence, INDEX_reference_limited, keeper->now, failure);
    if (ok) {
        const line_listener_t *const l = keeper->listener;
        l->snapshot(l->context, keeper->device, &keeper->image, keeper->now);
    }
    return ok;
}

static void wanted(line_keeper_t *keeper, bool *stop, bool *ending) {
    pthread_mutex_lock(&keeper->lock);
    *stop = keeper->stop;
    *ending = keeper->ending;
    pthread_mutex_unlock(&keeper->lock);
}

static bool streams(line_keeper_t *keeper) {
    pthread_mutex_lock(&keeper->lock);
    const bool watched = keeper->watched;
    pthread_mutex_unlock(&keeper->lock);
    return watched && keeper->listener->stream != NULL;
}

/* Up to the end of the stream, for at most so long. */
static bool read_stream(line_keeper_t *keeper, double seconds, failure_t *failure) {
    const line_listener_t *const l = keeper->listener;
    const double until_s = monotonic_s() + seconds;
    bool more = true;
    while (more && monotonic_s() < until_s) {
        stream_block_t block;
        bool stop;
        bool ending;
        wanted(keeper, &stop, &ending);
        if (stop || ending) {
            return true;
        }
        if (!live_stream_read(&keeper->stream, &block, &more, failure)) {
            return false;
        }
        if (block.frames > 0) {
            l->stream(l->context, keeper->device, &keeper->image, &block);
        }
    }
    return true;
}

/* What others get of the line before a request of the work. */
static bool look_aside(line_keeper_t *keeper, failure_t *failure) {
    if (monotonic_s() >= keeper->snapshot_due_s) {
        if (!take_snapshot(keeper, failure)) {
            return false;
        }
        keeper->snapshot_due_s = monotonic_s() + SNAPSHOT_WORKING_S;
    }
    return !streams(keeper) || keeper->now[INDEX_capture_state] != CAPTURE_RUNNING ||
           read_stream(keeper, STREAM_WORKING_S, failure);
}

/* Before each request of the work (device_turn_t). It fails until the work has ended. */
static bool turn(void *context, failure_t *failure) {
    line_keeper_t *const keeper = context;
    bool stop;
    bool ending;
    wanted(keeper, &stop, &ending);
    if (!stop && !ending) {
        if (keeper->cut) {
            return fail(failure, "the line was cut");
        }
        if (!look_aside(keeper, failure)) { /* no need to wait until the work has tried in vain, too */
            keeper->cut = true;
            say_cut(keeper, failure->text);
            return false;
        }
        wanted(keeper, &stop, &ending); /* it may have come meanwhile */
    }
    return (!stop && !ending) || fail(failure, stop ? "stopped" : "the server ends");
}

/* The same between runs: work goes before it, too. */
static bool give_way(void *context, failure_t *failure) {
    line_keeper_t *const keeper = context;
    pthread_mutex_lock(&keeper->lock);
    keeper->gave_way = keeper->stop || keeper->ending || keeper->working;
    pthread_mutex_unlock(&keeper->lock);
    return !keeper->gave_way || fail(failure, "something else goes before");
}

static bool keep_stream(line_keeper_t *keeper, failure_t *failure) {
    bool ready;
    device_take_turns(keeper->device, give_way, keeper);
    keeper->gave_way = false;
    bool ok = live_stream_keep(&keeper->stream, keeper->now, &ready, failure);
    if (ok && ready) {
        keeper->now[INDEX_capture_state] = CAPTURE_RUNNING; /* it may have been armed after the snapshot */
        ok = read_stream(keeper, STREAM_IDLE_S, failure);
    }
    device_take_turns(keeper->device, NULL, NULL);
    return ok || keeper->gave_way;
}

static void close_line(line_keeper_t *keeper, const char *why) {
    device_close(keeper->device);
    keeper->device = NULL;
    say_cut(keeper, why);
}

static void open_line(line_keeper_t *keeper) {
    failure_t failure;
    keeper->device = device_open(keeper->options, &failure);
    if (keeper->device == NULL || !amplifier_image_read(keeper->device, &keeper->image, &failure)) {
        close_line(keeper, failure.text);
        return;
    }
    live_stream_open(&keeper->stream, keeper->device);
    keeper->snapshot_due_s = 0.0;
    keeper->same_due_s = monotonic_s() + SAME_S;
    say_line(keeper);
}

/* As every run ends: to park, and off there, whoever has armed it. */
static void do_stop(line_keeper_t *keeper) {
    failure_t failure;
    failure_t gone;
    const bool taken = device_command(keeper->device, COMMAND_DISARM, &failure);
    pthread_mutex_lock(&keeper->lock);
    const double since_s = keeper->stop_since_s;
    pthread_mutex_unlock(&keeper->lock);
    if (!taken && !take_snapshot(keeper, &gone)) {
        close_line(keeper, gone.text); /* it stays requested */
        return;
    }
    pthread_mutex_lock(&keeper->lock);
    keeper->stop = false;
    pthread_mutex_unlock(&keeper->lock);
    keeper->listener->stopped(keeper->listener->context, monotonic_s() - since_s, taken ? NULL : failure.text);
}

static void do_work(line_keeper_t *keeper, const line_work_t *work) {
    failure_t failure = {""};
    keeper->cut = false;
    keeper->stream.taken = true;
    keeper->snapshot_due_s = 0.0;
    device_take_turns(keeper->device, turn, keeper);
    const bool good = work->run(keeper, keeper->device, work->context, &failure);
    device_take_turns(keeper->device, NULL, NULL);
    keeper->snapshot_due_s = keeper->same_due_s = 0.0;
    pthread_mutex_lock(&keeper->lock);
    keeper->working = false;
    pthread_mutex_unlock(&keeper->lock);
    work->ended(work->context, good, &failure);
}

/* Waits until something is wanted, at most so long. */
static void wait(line_keeper_t *keeper, double seconds, bool wakes_for_stop) {
    struct timespec until;
    (void)clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_nsec += (long)(seconds * 1e9);
    until.tv_sec += until.tv_nsec / 1000000000;
    until.tv_nsec %= 1000000000;
    pthread_mutex_lock(&keeper->lock);
    while (!keeper->ending && !keeper->working && !(keeper->stop && wakes_for_stop) &&
           pthread_cond_timedwait(&keeper->wake, &keeper->lock, &until) == 0) {
    }
    pthread_mutex_unlock(&keeper->lock);
}

/* At once where the sample's number went back, or the line was cut meanwhile. */
static bool still_the_same(line_keeper_t *keeper, int64_t sequence_before, failure_t *failure) {
    int64_t model_id;
    if (!keeper->said_cut && samples_between(sequence_before, keeper->now[INDEX_sequence]) >= 0 &&
        monotonic_s() < keeper->same_due_s) {
        return true;
    }
    keeper->same_due_s = monotonic_s() + SAME_S;
    return device_check_start(keeper->device, failure) &&
           device_read(keeper->device, INDEX_active_model_id, &model_id, failure) &&
           (model_id == keeper->image.model_id || fail(failure, "another image is in force now"));
}

static void poll_line(line_keeper_t *keeper) {
    failure_t failure;
    const double now_s = monotonic_s();
    const bool due = now_s >= keeper->snapshot_due_s;
    const bool watched = streams(keeper);
    if (due) {
        const int64_t before = keeper->now[INDEX_sequence];
        if (!take_snapshot(keeper, &failure) || !still_the_same(keeper, before, &failure)) {
            close_line(keeper, failure.text); /* it is opened again, with what is in force */
            return;
        }
        if (keeper->said_cut) { /* during work, and it has come back */
            say_line(keeper);
        }
        keeper->snapshot_due_s = now_s + SNAPSHOT_S;
    }
    if (watched && !keep_stream(keeper, &failure)) {
        close_line(keeper, failure.text);
        return;
    }
    wait(keeper, watched ? STREAM_S : SNAPSHOT_S, true);
}

/* Nothing looks after it any more: to park, and off there. What is off stays off. */
static void leave(line_keeper_t *keeper) {
    failure_t ignored;
    if (keeper->device != NULL) {
        (void)device_command(keeper->device, COMMAND_DISARM, &ignored);
    }
    if (keeper->device != NULL) {
        live_stream_close(&keeper->stream);
    }
    device_close(keeper->device);
    keeper->device = NULL;
}

/* Work that was given at the instant in which the line was lost, or something else was wanted. */
static void refuse_work(line_keeper_t *keeper, const line_work_t *work) {
    failure_t failure = {0};
    (void)fail(&failure, keeper->device == NULL ? "there is no line to the amplifier" : "stopped before it began");
    pthread_mutex_lock(&keeper->lock);
    keeper->working = false;
    pthread_mutex_unlock(&keeper->lock);
    work->ended(work->context, false, &failure);
}

static void *keep(void *context) {
    line_keeper_t *const keeper = context;
    (void)provenance_enter(keeper->note);
    for (;;) {
        pthread_mutex_lock(&keeper->lock);
        const bool ending = keeper->ending;
        const bool stop = keeper->stop;
        const bool working = keeper->working;
        const line_work_t work = keeper->work;
        pthread_mutex_unlock(&keeper->lock);
        if (working && (ending || stop || keeper->device == NULL)) {
            refuse_work(keeper, &work);
        } else if (ending) {
            break;
        } else if (keeper->device == NULL) {
            open_line(keeper);
            if (keeper->device == NULL) {
                wait(keeper, AGAIN_S, false);
            }
        } else if (stop) {
            do_stop(keeper);
        } else if (working) {
            do_work(keeper, &work);
        } else {
            poll_line(keeper);
        }
    }
    leave(keeper);
    return NULL;
}

line_keeper_t *line_keeper_start(const device_options_t *options, const line_listener_t *listener, failure_t *failure) {
    line_keeper_t *keeper = allocate(1, sizeof *keeper);
    keeper->options = options;
    keeper->listener = listener;
    keeper->note = provenance_note();
    provenance_note_add(keeper->note, provenance_entered());
    pthread_condattr_t clock;
    (void)pthread_condattr_init(&clock);
    (void)pthread_condattr_setclock(&clock, CLOCK_MONOTONIC);
    (void)pthread_cond_init(&keeper->wake, &clock);
    (void)pthread_condattr_destroy(&clock);
    (void)pthread_mutex_init(&keeper->lock, NULL);
    const int error = pthread_create(&keeper->thread, NULL, keep, keeper);
    if (error != 0) {
        (void)fail(failure, "cannot start a thread: %s", strerror(error));
        provenance_note_free(keeper->note);
        free(keeper);
        return NULL;
    }
    return keeper;
}

void line_keeper_end(line_keeper_t *keeper) {
    if (keeper == NULL) {
        return;
    }
    pthread_mutex_lock(&keeper->lock);
    keeper->ending = true;
    pthread_cond_signal(&keeper->wake);
    pthread_mutex_unlock(&keeper->lock);
    (void)pthread_join(keeper->thread, NULL);
    (void)pthread_cond_destroy(&keeper->wake);
    (void)pthread_mutex_destroy(&keeper->lock);
    provenance_note_free(keeper->note);
    free(keeper);
}

bool line_keeper_give(line_keeper_t *keeper, const line_work_t *work, failure_t *failure) {
    pthread_mutex_lock(&keeper->lock);
    const bool ok = keeper->working      ? fail(failure, "the amplifier is busy: wait for it, or press Stop")
                    : !keeper->connected ? fail(failure, "there is no line to the amplifier")
                                         : true;
    if (ok) {
        keeper->work = *work;
        keeper->working = true;
        pthread_cond_signal(&keeper->wake);
    }
    pthread_mutex_unlock(&keeper->lock);
    return ok;
}

void line_keeper_watch(line_keeper_t *keeper, bool watched) {
    pthread_mutex_lock(&keeper->lock);
    keeper->watched = watched;
    pthread_mutex_unlock(&keeper->lock);
}

void line_keeper_stop(line_keeper_t *keeper) {
    pthread_mutex_lock(&keeper->lock);
    if (!keeper->stop) {
        keeper->stop = true;
        keeper->stop_since_s = monotonic_s();
    }
    pthread_cond_signal(&keeper->wake);
    pthread_mutex_unlock(&keeper->lock);
}

void line_keeper_new_image(line_keeper_t *keeper, const hyst_parameters_t *image) {
    keeper->image = *image;
    say_line(keeper);
}
