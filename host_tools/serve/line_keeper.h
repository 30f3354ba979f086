/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The owner of the serial line: one thread makes all its requests.
 *
 * In between it reads telemetry and, when somebody watches, the stream (live_stream.h). Work (a recording, a track, an
 * upload) runs in its thread, one at a time. A stop passes before all of that: the request on the line is completed,
 * the next one of the work fails, and what follows parks the amplifier and switches it off. While the line is cut it
 * tries to open it again, and a stop that came meanwhile is the first request after that.
 */
#ifndef LINE_KEEPER_H
#define LINE_KEEPER_H

#include "amplifier/stream_reader.h"
#include "hyst/parameters.h"

typedef struct line_keeper line_keeper_t;

/** What others hear of the line. All are called in the keeper's thread and must be quick. */
typedef struct {
    /** The line has come (why NULL), or was lost. `image` is the one in force, NULL without a line. */
    void (*line)(void *context, const device_t *device, const hyst_parameters_t *image, const char *why);
    /** Registers `sequence` to `limits_sticky` of one sample. */
    void (*snapshot)(void *context, const device_t *device, const hyst_parameters_t *image,
                     const int64_t now[REGISTER_COUNT]);
    /** Frames of the stream, each once and in order; what was lost is reported (stream_reader.h). NULL: none are read.
     */
    void (*stream)(void *context, const device_t *device, const hyst_parameters_t *image, const stream_block_t *block);
    /** The amplifier has taken the stop, so many seconds after it was requested; or refused it (why). */
    void (*stopped)(void *context, double seconds, const char *why);
    void *context;
} line_listener_t;

/** Work at the line. */
typedef struct {
    /** Returns false with a line in *failure. Must leave nothing driven then (driving.h). */
    bool (*run)(line_keeper_t *keeper, device_t *device, void *context, failure_t *failure);
    /** Called in the same thread, or by line_keeper_end for work that never began. */
    void (*ended)(void *context, bool good, const failure_t *failure);
    void *context;
} line_work_t;

/** Starts the thread, whether or not the port can be opened yet. `options` and its strings, and the listener, must
 * outlive it. NULL on failure. */
line_keeper_t *line_keeper_start(const device_options_t *options, const line_listener_t *listener, failure_t *failure);

/** Interrupts work, parks the amplifier and switches it off, closes the line. NULL is allowed. */
void line_keeper_end(line_keeper_t *keeper);

/** Any thread. False if other work runs or the line is cut; `ended` is not called then. */
bool line_keeper_give(line_keeper_t *keeper, const line_work_t *work, failure_t *failure);

/** Any thread: whether somebody looks at the stream. Not from the start. */
void line_keeper_watch(line_keeper_t *keeper, bool watched);

/** Any thread: what plays ends, the drive goes to rest, and the stage is switched off there. Never refused. */
void line_keeper_stop(line_keeper_t *keeper);

/** For work, after it has replaced the image in force. */
void line_keeper_new_image(line_keeper_t *keeper, const hyst_parameters_t *image);

#endif
