/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What the page shows of the amplifier, as JSON. */
#ifndef LIVE_H
#define LIVE_H

#include "amplifier/stream_reader.h"
#include "hyst/parameters.h"
#include <jansson.h>

/** Time of the loop's samples: the sequence number, which wraps, unwrapped. */
typedef struct {
    bool begun;
    uint32_t last;
    double samples;
} live_clock_t;

/** One snapshot: {"event": "live", "t":, "reference":, "drive":, "position":, "error":, "mode":, "state":, "power":,
 * "limits": [..], "faults": [..], "faults_before": [..], "counters": {..}}. reference and error are null where the
 * position does not follow a reference. */
json_t *live_snapshot(live_clock_t *clock, const int64_t now[REGISTER_COUNT], const hyst_parameters_t *image,
                      double sample_rate_hz);

/** Frames of the stream: {"event": "stream", "t":, "step":, "first":, "lost":, "restarted":, "drive": [..], "position":
 * [..], "reference": [..]}. Frame i is at t + i * step on the time of the snapshots, the last of which said whether
 * there is a reference (else it is null). */
json_t *live_stream(const live_clock_t *clock, const stream_block_t *block, bool follows,
                    const hyst_parameters_t *image, double sample_rate_hz);

/** Whether the position follows a reference. */
bool live_follows(const int64_t now[REGISTER_COUNT]);

/** The line: {"event": "line", "connected":, "why":, "port":, "board":, "sample_rate_hz":, "has_parameters":,
 * "model_id":, "drive_v": [..], "position_um": [..]}. device and image NULL: it is cut. */
json_t *live_line(const char *port, const device_t *device, const hyst_parameters_t *image, const char *why);

#endif
