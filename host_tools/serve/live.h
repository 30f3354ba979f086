/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What the page shows of the amplifier, as JSON. */
#ifndef LIVE_H
#define LIVE_H

#include "amplifier/device.h"
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

/** The line: {"event": "line", "connected":, "why":, "port":, "board":, "sample_rate_hz":, "has_parameters":,
 * "model_id":, "drive_v": [..], "position_um": [..]}. device and image NULL: it is cut. */
json_t *live_line(const char *port, const device_t *device, const hyst_parameters_t *image, const char *why);

#endif
