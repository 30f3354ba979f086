/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The problem of recursion_fit.h and an estimate of it. */
#ifndef RECURSION_PROBLEM_H
#define RECURSION_PROBLEM_H

#include "base/progress.h"
#include "elements/recursion.h"
#include "numerics/sine_fit.h"
#include "recording/recording.h"

/** Most columns of a hysteresis. */
#define RECURSION_FIT_COLUMNS 512
/** Most shape parameters of a hysteresis. */
#define RECURSION_FIT_SHAPES 4

/** A hysteresis as a sum of columns with unknown weights. */
typedef struct {
    size_t columns;                           /**< the first one is the drive */
    const double *lower;                      /**< of their weights, in the simulation estimate; -HUGE_VAL: none */
    size_t shapes;                            /**< number of parameters on which the columns depend */
    double shape_start[RECURSION_FIT_SHAPES]; /**< in the unbounded scale of the search */
    /** At rest, with these shapes (in the search's scale). */
    void (*open)(void *state, const double *shape);
    /** One sample: fills the columns. */
    void (*step)(void *state, double u, double *column);
    void *state;
} recursion_basis_t;

typedef struct {
    const recording_t *recording;
    sine_t drive;    /**< its phase belongs to sample 0 */
    size_t from, to; /**< samples included; those before let the initial memory decay */
    recursion_basis_t basis;
    bool bilinear; /**< whether g is fitted; 0 otherwise */
    /** Keeps the simulation estimate invertible: lower bounds on the weights, a least direct weight of the drive, and
     * harmonics that leave the inverse stable. Otherwise all parameters are unbounded, as in the paper. */
    bool invertible;
    progress_t *progress;
} recursion_problem_t;

typedef struct {
    double feedback[RECURSION_FEEDBACK], bilinear;
    double harmonic[RECURSION_HARMONICS], offset_um;
    double shape[RECURSION_FIT_SHAPES];
    double weight[RECURSION_FIT_COLUMNS];
    double one_step_rms_um;  /**< one-step prediction, from the measured last positions */
    double simulated_rms_um; /**< simulation; HUGE_VAL: it diverges */
} recursion_estimate_t;

#endif
