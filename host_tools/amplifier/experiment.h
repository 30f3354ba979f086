/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * One run on the amplifier: condition, go to the start, play a waveform or a probe, capture the response. `record` and
 * `track` do this in different modes.
 */
#ifndef EXPERIMENT_H
#define EXPERIMENT_H

#include "amplifier/device/device.h"
#include "amplifier/probe_plan.h"
#include "amplifier/waveform.h"
#include "hyst/parameters.h"
#include "recording/recording.h"

typedef struct {
    waveform_t waveform;  /**< in V when mode is direct, else in um */
    hyst_mode_t mode;     /**< direct, linear or compensate */
    bool condition;       /**< sweep the whole drive range first */
    unsigned long frames; /**< most rows of the recording; 0: as many as the amplifier's buffer holds */
} experiment_t;

/** Event counts between start and end of the waveform: the counters of registers.def, in samples. */
typedef struct {
#define COUNTER(name, address, note, text) int64_t name;
#include "registers/registers.def"
} experiment_events_t;

/** What this amplifier cannot play or capture. It can be said before the drive moves, and driving_run begins; the
 * functions below refuse it, too. */
bool experiment_check(const device_t *device, const experiment_t *experiment, failure_t *failure);

/** Rows that its recording has at most: of a waveform with these frames (0: no limit), or of a probe. */
size_t experiment_rows_most(const device_t *device, unsigned long frames, bool probe);

/**
 * Runs it. `image` is the one in force, or a copy with other scales; its scales turn codes into units.
 *
 * *recording receives drive, displacement and, unless the mode is direct, reference; row by row they belong to the same
 * instant, and row 0 is the first sample of the waveform. Every n-th sample is kept, where n is the smallest number
 * with which the waveform fits into these rows. Then the amplifier
 * is disarmed: it ramps to park and switches off.
 *
 * Shows progress. On failure *recording is empty, unless all that failed was to disarm the amplifier: then it is
 * complete, has samples, and is to be freed.
 */
bool experiment_run(device_t *device, const hyst_parameters_t *image, const experiment_t *experiment,
                    recording_t *recording, experiment_events_t *events, failure_t *failure);

typedef struct {
    unsigned parts;      /**< PROBE_ bits */
    double slew_v_per_s; /**< steepest line */
    bool condition;      /**< sweep the whole drive range first */
    /** Then rest at the start, so many times as long as the probe takes: what creeps from before is in the recording.
     */
    double rest;
} experiment_probe_t;

/**
 * The same with a probe (probe_plan.h) between the ends of the image's drive range, in direct mode. It may be longer
 * than the amplifier's buffer: the recording is then read while it runs, without gaps, at the highest rate that the
 * line carries with some reserve. A slower line is a failure, not a gap.
 */
bool experiment_run_probe(device_t *device, const hyst_parameters_t *image, const experiment_probe_t *probe,
                          recording_t *recording, experiment_events_t *events, failure_t *failure);

typedef struct {
    hyst_mode_t mode; /**< direct, linear or compensate */
    bool condition;   /**< sweep the whole drive range first */
    double start;     /**< level before the first corner, in V when mode is direct, else in um */
    const breakpoint_t *corner;
    size_t corners;
    unsigned long passes; /**< 0: until somebody stops it */
} experiment_table_t;

/** As experiment_check. */
bool experiment_check_table(const device_t *device, const experiment_table_t *table, failure_t *failure);

/** Uploads the corners, reads them back and compares, starts them, and leaves the amplifier playing. */
bool experiment_start_table(device_t *device, const hyst_parameters_t *image, const experiment_table_t *table,
                            failure_t *failure);

/** As experiment_check, of what is not captured. */
bool experiment_check_start(const device_t *device, const experiment_t *experiment, failure_t *failure);

/** Starts the waveform, so many passes of it (0: until somebody stops it; of a triangle a pass is all its cycles), and
 * leaves the amplifier playing. experiment->frames does not matter. */
bool experiment_start(device_t *device, const hyst_parameters_t *image, const experiment_t *experiment,
                      unsigned long passes, failure_t *failure);

#endif
