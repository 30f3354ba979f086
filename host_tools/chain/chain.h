/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Simulates a model in double precision, one sample at a time: drive in V in, position in um out.
 *
 * The chain runs in the order of the model's list, except that blocks that modify the hysteresis run just before it.
 * The continuous-time blocks are discretised at the chain's own rate, so a model may be simulated at another rate than
 * it was fitted at.
 */
#ifndef CHAIN_H
#define CHAIN_H

#include "chain/model.h"
#include "chain/smooth_drive.h"
#include "recording/recording.h"

typedef struct chain chain_t;

/** The model may be freed afterwards. `seed` makes noise repeatable. NULL on failure. */
chain_t *chain_open(const model_t *model, double sample_rate_hz, uint64_t seed, failure_t *failure);

/** chain_open under a preload force. A block preload without a force parameter uses it. */
chain_t *chain_open_preloaded(const model_t *model, double sample_rate_hz, uint64_t seed, double preload_n,
                              failure_t *failure);

/** Goes to the steady state at drive_v. A hysteresis starts from its initial memory, or demagnetised at 0 V, and moves
 * there slowly. Returns the position in um. */
double chain_settle(chain_t *chain, double drive_v);

/** One sample. Returns the position in um. */
double chain_step(chain_t *chain, double drive_v);

void chain_close(chain_t *chain);

/** Settles at the first drive of the recording, behind the drives that its header key drive_before_v has, then runs it
 * under the recording's preload. position_um has recording->samples elements. */
bool chain_simulate(const model_t *model, const recording_t *recording, uint64_t seed, double *position_um,
                    failure_t *failure);

/** The same; a position that is not finite is a failure that names its first sample. */
bool chain_simulate_finite(const model_t *model, const recording_t *recording, uint64_t seed, double *position_um,
                           failure_t *failure);

/** What a recording says of its drive between samples. */
void chain_between_samples(const recording_t *recording, stage_setup_t *setup);

/** The setup for the stages that simulate a recording. false: the model is invalid, or does not suit the recording. */
bool chain_setup(const model_t *model, const recording_t *recording, uint64_t seed, stage_setup_t *setup,
                 failure_t *failure);

/**
 * Part of a simulation: stages [first, last) of chain_order on a recording's signal, which they replace. signal[0] is
 * the value the stages settle on (chain_settle), and signal[1 + k] belongs to sample k. At the input of stage 0 all but
 * the drive is 0. For callers that vary one stage and reuse the output of the earlier ones.
 */
bool chain_run(const model_t *model, const recording_t *recording, uint64_t seed, size_t first, size_t last,
               signal_t *signal, failure_t *failure);

/** The model's blocks in the order in which they run: order[i] is an index into model->block. Returns how many. */
size_t chain_order(const model_t *model, size_t order[MODEL_MAX_BLOCKS]);

/** A single stage of a chain, for callers that vary one and reuse the output of the earlier ones. */
typedef struct {
    const block_t *block;
    void *state;
    drive_window_t *drive; /**< of a hysteresis that follows the drive between samples; NULL for others */
    size_t befores;        /**< of a hysteresis: drives before the recording, behind what stands in front of it, */
    double *before_v;      /**< through which it is led when it settles; NULL: none */
} chain_stage_t;

/** `index` into model->block; the model must have passed model_check and may be freed afterwards. */
chain_stage_t chain_stage_open(const model_t *model, size_t index, const stage_setup_t *setup);
/** As chain_settle and chain_step do it: replace *signal by the output. The first stage takes {.value = drive}. */
void chain_stage_settle(const chain_stage_t *stage, signal_t *signal);
void chain_stage_step(const chain_stage_t *stage, signal_t *signal);
/** Steps through `count` signals. `there` is the number available, later ones included, for the look-ahead. */
void chain_stage_run(const chain_stage_t *stage, signal_t *signal, size_t count, size_t there);
/** Marks where a smooth drive reverses between two samples, in the signal at the input of the hysteresis. Callers that
 * run that stage several times then search for reversals once. signal[0] is the value it settles on. */
void chain_note_turns(signal_t *signal, size_t samples);
/** The output values of the stage for a whole signal, which is not changed. */
void chain_stage_values(const chain_stage_t *stage, const signal_t *signal, size_t count, double *value);
void chain_stage_close(chain_stage_t *stage);

/** One block alone, without a preload: settles on the first of recording->samples values, then replaces them by the
 * output. `index` into model->block. */
void chain_pass(const model_t *model, size_t index, const recording_t *recording, double *value);

/**
 * First sample of [0, end) from which on the hysteresis output no longer depends on the drive before the recording, or
 * `end`. Criterion: the outputs after a past at the bottom and after a past at the top of the drive's range (widened to
 * three times its width) stay within 1e-4 of the peak-to-peak output. The memory of slow and mechanical stages is
 * ignored.
 */
size_t chain_memory_determined(const model_t *model, const recording_t *recording, size_t end);

/** chain_memory_determined of several recordings. Returns false when that leaves less than a quarter of all samples
 * before end[i], too few to assess a model. */
bool chain_determined_from(const model_t *model, const recording_t *recordings, size_t count, const size_t *end,
                           size_t *from);

/** Error of a simulation or of tracking over a range of samples. */
typedef struct {
    double rms_um;
    double max_um;        /**< largest magnitude */
    size_t max_sample;    /**< where */
    double nrmse_percent; /**< rms over peak-to-peak displacement, times 100; 0 / 0 is NAN */
} error_measure_t;

/** Moves `simulated` to the zero of `measured`: by the mean of their difference, which is returned. samples > 0. */
double error_take_zero(const double *measured, double *simulated, size_t samples);

/** Error of `simulated` against `measured`, relative to the peak-to-peak value of `measured` over these samples.
 * samples > 0. */
error_measure_t measure_error(const double *measured, const double *simulated, size_t samples);

#endif
