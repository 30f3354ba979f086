/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "serve/live_stream.h"

/* Of the line. The rest is for snapshots, for a stop, and for what takes longer than when it was measured. */
#define SHARE 0.4

void live_stream_open(live_stream_t *stream, device_t *device) {
    *stream = (live_stream_t){.reader = {.device = device}};
}

static bool arm(live_stream_t *stream, failure_t *failure) {
    device_t *const device = stream->reader.device;
    stream_block_t block;
    stream->armed = stream->muted = false;
    stream->taken = true;
    if (!stream_arm(device, CAPTURE_DEFAULT_SIGNALS, stream->decimation, CAPTURE_AT_ONCE, failure)) {
        return false;
    }
    device_lock(device);
    /* A command of another client between these two would be one of a line that two share. */
    if (!stream_read(&stream->reader, &block, failure)) {
        return false;
    }
    stream->reader.begun = false; /* so that its frames are known as those of a new one */
    stream->reader.next = 0;
    stream->number = stream->reader.number;
    stream->armed = true;
    return true;
}

bool live_stream_keep(live_stream_t *stream, const int64_t now[REGISTER_COUNT], bool *ready, failure_t *failure) {
    *ready = false;
    const int64_t state = now[INDEX_capture_state];
    if (state == CAPTURE_ARMED && !stream->taken) {
        return true;
    }
    if (!stream->measured) {
        stream_pace_t pace;
        if (!stream_measure(stream->reader.device, &pace, failure)) {
            return false;
        }
        stream->decimation = stream_decimation(&pace, CAPTURE_DEFAULT_SIGNALS, SHARE);
        stream->measured = true;
    }
    const bool runs = stream->armed && (state == CAPTURE_RUNNING || state == CAPTURE_ARMED);
    *ready = runs || arm(stream, failure);
    return *ready;
}

/* Whether this capture is one for the page. */
static bool check(live_stream_t *stream, const stream_block_t *block, failure_t *failure) {
    device_t *const device = stream->reader.device;
    int64_t length;
    if (stream->reader.number == stream->number) {
        return true;
    }
    stream->armed = false; /* a run has armed another one */
    if (!device_read(device, INDEX_capture_length, &length, failure)) {
        return false;
    }
    stream->muted = (uint64_t)length * block->width > CAPTURE_WORDS ||
                    device_sample_rate_hz(device) / block->decimation < LIVE_STREAM_LEAST_HZ ||
                    block->signals != CAPTURE_DEFAULT_SIGNALS;
    return true;
}

bool live_stream_read(live_stream_t *stream, stream_block_t *block, bool *more, failure_t *failure) {
    *more = false;
    block->frames = 0;
    if (stream->muted) {
        return true;
    }
    if (!stream_read(&stream->reader, block, failure) || (block->restarted && !check(stream, block, failure))) {
        return false;
    }
    if (stream->muted) {
        block->frames = 0;
        return true;
    }
    stream->fresh = stream->fresh || block->restarted;
    block->restarted = stream->fresh;
    stream->fresh = stream->fresh && block->frames == 0;
    *more = block->behind > 0;
    const uint32_t room = CAPTURE_WORDS / block->width;
    if (stream->armed && (block->lost > 0 || block->behind > room / 2U)) { /* half as dense from now on */
        stream->decimation = 2U * stream->decimation < UINT16_MAX ? 2U * stream->decimation : UINT16_MAX;
        stream->armed = false;
        *more = false;
    }
    return true;
}

void live_stream_close(live_stream_t *stream) {
    failure_t ignored;
    if (stream->armed && device_unlock(stream->reader.device, CONTROL_PARAMETERS, &ignored)) {
        (void)device_command(stream->reader.device, COMMAND_END_CAPTURE, &ignored);
    }
}
