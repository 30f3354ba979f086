/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The measurements of paper 000 on its twin: sines from 0 V up at every frequency, voltage and preload, what their
 * loops show, and how far a model is off.
 */
#ifndef CAMPAIGN_000_H
#define CAMPAIGN_000_H

#include "chain/model.h"
#include "recording/recording.h"
#include <stdint.h>

#define CAMPAIGN_000_RATE_HZ 20000.0 /* chosen: the paper does not report it */

enum { CAMPAIGN_FREQUENCIES = 6, CAMPAIGN_VOLTAGES = 2, CAMPAIGN_PRELOADS = 4 };
enum { CAMPAIGN_RUNS = CAMPAIGN_FREQUENCIES * CAMPAIGN_VOLTAGES * CAMPAIGN_PRELOADS };

/** One recording and what its last period shows. */
typedef struct {
    double volts, frequency_hz, preload_n;
    recording_t recording;
    size_t period; /**< samples */
    double stroke_um;
    double width_um;          /**< largest distance of the two branches at one drive */
    double asymmetry_percent; /**< rms of the loop's even part, of the stroke */
} run_t;

/** Runs in the order of preload, voltage, frequency. */
typedef struct {
    size_t frequencies;
    double frequency_hz[CAMPAIGN_FREQUENCIES];
    run_t run[CAMPAIGN_RUNS];
} campaign_t;

/** Errors over the last two periods, in percent of the peak-to-peak value. */
typedef struct {
    double rms;
    double turning; /**< rms within a twentieth of a period of the drive's turning points */
    double between; /**< rms elsewhere */
} loop_error_t;

/** Records and measures a run whose volts, frequency_hz and preload_n are set. The recording is the caller's to free.
 */
void campaign_record(run_t *run, uint64_t seed);

/** Records everything. Reduced: the first, a middle and the last frequency. */
void campaign_open(campaign_t *campaign, bool reduced);
void campaign_free(campaign_t *campaign);
run_t *campaign_run(campaign_t *campaign, size_t preload, size_t voltage, size_t frequency);

/** Of the simulated position. */
bool position_error(const model_t *model, const run_t *run, loop_error_t *error, failure_t *failure);

/** Of the drive that the stop form gives for the measured position, which is what the paper's figures show. The model's
 * first block is stop_prandtl_ishlinskii or inertial_hysteresis. */
loop_error_t drive_error(const model_t *model, const run_t *run);

#endif
