/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The linear part of the identification in stop form: from positions to drives.
 *
 *     V = offset + k x + sum w_i stop_i[x] + c x' + m x'',      x = X (1 + compliance F)
 *
 * with w_i, c, m >= 0 and k above 0, for given thresholds and compliance. Rate and acceleration are differences of the
 * position. Drive and all other columns pass the same averages, so that the equation holds as the block
 * inertial_hysteresis integrates it. The same smoothing of all columns keeps sensor noise out of the acceleration.
 * docs/MODELS.md, section 11.
 */
#ifndef STOP_FIT_H
#define STOP_FIT_H

#include "identify/family.h"

#define STOP_FIT_MAX_OPERATORS 64

typedef struct {
    const family_job_t *job;
    const double *preload_n; /**< one per recording */
    size_t operators;        /**< at most STOP_FIT_MAX_OPERATORS */
    bool inertial;
} stop_problem_t;

typedef struct {
    double offset_v;
    double weight[STOP_FIT_MAX_OPERATORS + 1]; /**< k, then one per stop operator */
    double threshold_um[STOP_FIT_MAX_OPERATORS];
    double damping, mass;
    double rms_v;
    size_t smoothing; /**< length in samples of each of four moving averages */
} stop_fit_t;

/** Fits to the training samples for this compliance. */
bool stop_fit(const stop_problem_t *problem, double compliance_per_n, stop_fit_t *fit, failure_t *failure);

/**
 * The fit function of both stop families: thresholds evenly up to half the displacement range, and with recordings
 * under different preloads a block preload, whose compliance is searched.
 */
bool stop_family_fit(const family_job_t *job, const block_t *block, bool inertial, model_t *model,
                     family_notes_t *notes, failure_t *failure);

#endif
