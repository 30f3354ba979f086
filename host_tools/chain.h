/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Runs a model: drive in volts in, position in micrometres out, one sample at a time, in double precision.
 *
 * The chain runs in the order of the model's list, except that blocks that modify the hysteresis run just before it.
 * The continuous-time blocks are discretised at the chain's own rate, so a model may be simulated at another rate than
 * it was fitted at.
 */
#ifndef CHAIN_H
#define CHAIN_H

#include "model.h"
#include "recording.h"
#include "smooth_drive.h"

typedef struct chain chain_t;

/** The model may be freed afterwards. `seed` makes noise repeatable. NULL on failure. */
chain_t *chain_open(const model_t *model, double sample_rate_hz, uint64_t seed, failure_t *failure);

/** chain_open on an actuator that is pressed with a force: block preload without a force of its own takes it. */
chain_t *chain_open_preloaded(const model_t *model, double sample_rate_hz, uint64_t seed, double preload_n,
                              failure_t *failure);

/** Goes to the state in which drive_v has been present for ever (hysteresis: its initial memory, or demagnetised at 0
 * V, then a slow move there). */
double chain_settle(chain_t *chain, double drive_v);

/** One sample. Returns the position in um. */
double chain_step(chain_t *chain, double drive_v);

void chain_close(chain_t *chain);

/** Settles at the first drive of the recording, then runs it under the recording's preload. position_um has
 * recording->samples elements. */
bool chain_simulate(const model_t *model, const recording_t *recording, uint64_t seed, double *position_um,
                    failure_t *failure);

/** What the stages of a recording's simulation are opened with. false: the model may not run, or not for it. */
bool chain_setup(const model_t *model, const recording_t *recording, uint64_t seed, stage_setup_t *setup,
                 failure_t *failure);

/**
 * Part of a simulation: stages [first, last) of chain_order on a recording's signal, which they replace. signal[0] is
 * what the stages settle on (chain_settle), signal[1 + k] belongs to sample k; in front of stage 0 all but the drive is
 * 0. For those who change one stage and keep what stands before it.
 */
bool chain_run(const model_t *model, const recording_t *recording, uint64_t seed, size_t first, size_t last,
               signal_t *signal, failure_t *failure);

/** The model's blocks in the order in which they run: order[i] is an index into model->block. Returns how many. */
size_t chain_order(const model_t *model, size_t order[MODEL_MAX_BLOCKS]);

/** One stage of a chain alone, for those who change one and keep what stands before it. */
typedef struct {
    const block_t *block;
    void *state;
    drive_window_t *drive; /**< of a hysteresis that knows what is between samples; NULL for others */
} chain_stage_t;

/** `index` into model->block; the model must have passed model_check and may be freed afterwards. */
chain_stage_t chain_stage_open(const model_t *model, size_t index, const stage_setup_t *setup);
/** As chain_settle and chain_step do it: replace *signal by the output. The first stage takes {.value = drive}. */
void chain_stage_settle(const chain_stage_t *stage, signal_t *signal);
void chain_stage_step(const chain_stage_t *stage, signal_t *signal);
/** Steps through `count` signals, which know what follows them in all `there` are. */
void chain_stage_run(const chain_stage_t *stage, signal_t *signal, size_t count, size_t there);
/** Notes in a recording's signal, as it comes in at the hysteresis, where a smooth drive turns between two samples:
 * those who run that stage several times need not look for it each time. signal[0] is what it settles on. */
void chain_note_turns(signal_t *signal, size_t samples);
/** The values that come out of it for all of a signal, which stays as it is. */
void chain_stage_values(const chain_stage_t *stage, const signal_t *signal, size_t count, double *value);
void chain_stage_close(chain_stage_t *stage);

/** One block alone, without a preload: settles on the first of recording->samples values, then replaces them by the
 * output. `index` into model->block. */
void chain_pass(const model_t *model, size_t index, const recording_t *recording, double *value);

/**
 * First sample of [0, end) from which on the hysteresis output no longer depends on what happened before the recording,
 * or `end`: the outputs that follow a past at the bottom and a past at the top of the drive's range (widened to three
 * times its width) stay within 1e-4 of the output's peak-to-peak value. What slow and mechanical stages remember is not
 * asked.
 */
size_t chain_memory_determined(const model_t *model, const recording_t *recording, size_t end);

/** chain_memory_determined of several recordings. Returns false when that leaves less than a quarter of all samples
 * before end[i]: too little to judge a model by. */
bool chain_determined_from(const model_t *model, const recording_t *recordings, size_t count, const size_t *end,
                           size_t *from);

/** Error of a simulation or of a track, over a run of samples. */
typedef struct {
    double rms_um;
    double max_um;        /**< largest magnitude */
    size_t max_sample;    /**< where */
    double nrmse_percent; /**< rms over peak-to-peak displacement, times 100; 0 / 0 is NAN */
} error_measure_t;

/** Error of `simulated` against `measured`, relative to the peak-to-peak value of `measured` over these samples.
 * samples > 0. */
error_measure_t measure_error(const double *measured, const double *simulated, size_t samples);

#endif
