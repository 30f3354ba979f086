/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * One run on the amplifier: condition, go to the start, play a waveform or a probe, capture what happened. `record` and
 * `track` are this with different modes.
 */
#ifndef EXPERIMENT_H
#define EXPERIMENT_H

#include "device.h"
#include "hyst/parameters.h"
#include "probe_plan.h"
#include "recording.h"
#include "waveform.h"

typedef struct {
    waveform_t waveform;  /**< in V when mode is direct, else in um */
    hyst_mode_t mode;     /**< direct, linear or compensate */
    bool condition;       /**< sweep the whole drive range first */
    unsigned long frames; /**< most rows of the recording; 0: as many as the amplifier's buffer holds */
} experiment_t;

/** Samples in which something happened between start and end of the waveform. */
typedef struct {
    int64_t drive_limited, unreachable, filter_saturated, overruns, converter_timeouts;
} experiment_events_t;

/**
 * Runs it. `image` is the one in force, or a copy with other scales; its scales turn codes into units.
 *
 * *recording receives drive, displacement and, unless the mode is direct, reference; row by row they belong to the same
 * instant, and row 0 is the first sample of the waveform. Every n-th sample is kept, where n is the smallest number
 * with which the waveform fits into these rows. The amplifier goes on holding the waveform's last level.
 *
 * Shows progress. On failure nothing needs to be freed.
 */
bool experiment_run(device_t *device, const hyst_parameters_t *image, const experiment_t *experiment,
                    recording_t *recording, experiment_events_t *events, failure_t *failure);

typedef struct {
    unsigned parts;      /**< PROBE_ bits */
    double slew_v_per_s; /**< steepest line */
    bool condition;      /**< sweep the whole drive range first */
    double rest_s;       /**< then rest at the start: what was before creeps on into the recording */
} experiment_probe_t;

/**
 * The same with a probe (probe_plan.h) between the ends of the image's drive range, in direct mode. It may be longer
 * than the amplifier's buffer: the recording is read while it is made, as one without a gap, at the highest rate that
 * the line carries with some reserve. A line that turns out slower than that is a failure, not a gap.
 */
bool experiment_run_probe(device_t *device, const hyst_parameters_t *image, const experiment_probe_t *probe,
                          recording_t *recording, experiment_events_t *events, failure_t *failure);

/** "note: ..." lines on stderr about events that a user should know of. */
void experiment_print_events(const experiment_events_t *events);

#endif
