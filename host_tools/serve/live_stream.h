/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The stream that the live page draws: which capture is read, how densely, and when.
 *
 * Between runs a capture without end of reference, drive and position is kept armed, as dense as half of the line
 * carries it. When frames were lost, or are about to be, it is armed anew, half as dense. A capture that waits for its
 * trigger when the line comes is left alone, until a run needs the recorder.
 *
 * While a run has the recorder its capture is read, but not one that is longer than the buffer, which the run itself
 * has to read in time, and none with less than LIVE_STREAM_LEAST_HZ.
 */
#ifndef LIVE_STREAM_H
#define LIVE_STREAM_H

#include "amplifier/stream_reader.h"

#define LIVE_STREAM_LEAST_HZ 50.0

typedef struct {
    stream_reader_t reader;
    bool measured, armed, muted;
    bool fresh;          /**< the next frames are the first that are read of their capture */
    bool taken;          /**< the recorder is the server's: something was armed here, or a run has begun */
    uint16_t number;     /**< of the capture that was armed here */
    unsigned decimation; /**< of that */
} live_stream_t;

/** A line has come. */
void live_stream_open(live_stream_t *stream, device_t *device);

/** Between runs, with a snapshot: sees to it that there is a capture to be read. False with a failure of the line.
 * *ready: there is one. */
bool live_stream_keep(live_stream_t *stream, const int64_t now[REGISTER_COUNT], bool *ready, failure_t *failure);

/** Reads a block; *more: there are frames left. A block of another capture than before may turn out to be one that is
 * not to be read: it has no frames then, and there are no more. */
bool live_stream_read(live_stream_t *stream, stream_block_t *block, bool *more, failure_t *failure);

/** As far as it can be done: ends the capture that was armed here. */
void live_stream_close(live_stream_t *stream);

#endif
