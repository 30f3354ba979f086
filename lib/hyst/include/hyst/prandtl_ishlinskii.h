/* SPDX-License-Identifier: MIT */
/**
 * Prandtl-Ishlinskii model: a weighted sum of play operators, with fixed or rate-dependent thresholds, and its exact
 * inverse.
 *
 *     y[k]   = offset + w_0 u[k] + sum_{i=1..n} w_i z_i[k]
 *     z_i[k] = max(u[k] - r_i[k], min(u[k] + r_i[k], z_i[k-1]))              play, see play.h
 *     r_i[k] = a_i + kappa[k],          0 < a_1 < ... < a_n
 *     kappa[k] = min(beta |v[k-1]|, 1 - a_n)                                  the same for all operators
 *     v[k]   = v[k-1] + g (u[k] - u[k-1] - v[k-1])                            smoothed drive rate, per sample
 *
 * Source: paper 004, equations (1) to (11), with one change that makes the inverse exact and stable (docs/MODELS.md,
 * section 3): the rate that widens the thresholds at sample k is the one known before sample k. beta = 0 is the
 * classical model.
 *
 * Why the inverse is exact. At sample k the thresholds are already known, so y is a piecewise linear function of u
 * alone. Its corners lie at z_i + r_i (upwards) and z_i - r_i (downwards), in order of i because the memory stays
 * nested
 * (|z_{i+1} - z_i| <= a_{i+1} - a_i: clamping to nested intervals keeps it, and a common kappa does not change the
 * distances). Its slope behind corner j is S_j = w_0 + ... + w_j. All S_j > 0 makes it increasing; walking the corners
 * and one division invert it. hyst_pi_solve and hyst_pi_advance work on the same memory, so forward after inverse
 * differs from the identity only by the rounding of u to Q31: at most S_max / 2 + 1/2 units of 2^-31
 * (tests/unit/test_prandtl_ishlinskii.c).
 *
 * Why the inverse is stable. Its own past drive widens its thresholds, which is feedback. On a branch with j operators
 * moving the feedback has the characteristic polynomial x^2 - (1 - g + q) x + q with q = g beta (S_j - S_0) / S_j; both
 * roots are inside the unit circle exactly for -(2 - g) / 2 < q < 1. hyst_pi_build demands -0.45 <= q <= 0.9 on every
 * branch. (Without smoothing, g = 1, the numbers of paper 004 give q = 1.3: that inverse oscillates although it is
 * exact.)
 *
 * Why the cost hardly grows with n. The memory over the threshold is a staircase: all operators that one monotone
 * movement of the drive has carried along lie on one line, z_i = level -+ a_i. Only these runs are stored, innermost on
 * top of a stack. Sums over a run come from prefix sums of w_i and w_i a_i, so a whole run is moved, wiped out or
 * passed in one step, and the place where a movement or a search ends is found by bisection. The growth shifts all
 * corners alike: it is taken off the goal once, and a probe is one comparison with a number that the run or the model
 * holds ready (docs/MODELS.md, section 2.1). All of it is exact integer arithmetic: bit for bit the plain loop over n
 * operators (tests/unit/test_bank.c). Worst case per call: 2 (log2 n + 1) probes, whatever the history.
 *
 * Preconditions: a hyst_pi_t that hyst_pi_build accepted. Every function here is total for such a model and any input.
 * May be called from: interrupt, main loop, host (hyst_pi_build walks all operators: not per sample).
 * Reentrant; the caller owns model and state. One state belongs to one context. One division by a known divisor
 * (reciprocal.h) per solve.
 * Measured in docs/TIMING.md.
 */
#ifndef HYST_PRANDTL_ISHLINSKII_H
#define HYST_PRANDTL_ISHLINSKII_H

#include "hyst/fixed.h"
#include <stdbool.h>

#define HYST_PI_MAX_OPERATORS 256

/** Smallest slope S_j that is accepted: 2^-8. Below it the inverse would turn one unit of position into 256 of drive.
 */
#define HYST_PI_MIN_SLOPE (HYST_Q28_ONE / 256)
/** Largest sum of |w_i|, i = 0..n: 4. Bounds every 64-bit sum in this module, see prandtl_ishlinskii.c. */
#define HYST_PI_MAX_WEIGHT_SUM (4 * (int64_t)HYST_Q28_ONE)

/** Runs that one call of hyst_pi_carry takes over, and the calls that all of them take. */
#define HYST_PI_CARRY_RUNS  1
#define HYST_PI_CARRY_CALLS (HYST_PI_MAX_OPERATORS / HYST_PI_CARRY_RUNS)

/** S_j = w_0 + ... + w_j, >= HYST_PI_MIN_SLOPE: what the position gains behind corner j. */
typedef struct {
    hyst_q28_t value;
    uint32_t reciprocal; /**< of it, see reciprocal.h */
} hyst_pi_slope_t;

/** Coefficients. Written by hyst_pi_build only; constant afterwards. */
typedef struct {
    uint32_t operators;     /**< n, 0..HYST_PI_MAX_OPERATORS */
    uint32_t levels;        /**< of a search: the smallest L with 2^L >= n */
    hyst_q31_t offset;      /**< y at u = 0 with all memory 0, fraction of position full scale */
    int64_t wide_offset;    /**< the same in Q59 */
    uint32_t rate_limit;    /**< the largest |v| at which the growth is not cut to kappa_limit */
    hyst_q31_t kappa_limit; /**< 1 - a_n */
    hyst_q20_t beta;        /**< threshold growth per unit of drive rate, in samples; 0 = rate-independent */
    hyst_q30_t rate_gain;   /**< g, (0, 1] */
    /* In an order in which one load with an index and a constant reaches each of them. */
    int64_t turn[HYST_PI_MAX_OPERATORS]; /**< 2 T_i, T_i = S_{i-1} a_i - (w_1 a_1 + ... + w_{i-1} a_{i-1}), Q59: what
                                            the position changes on the way back from a reversal until the drive begins
                                            to carry operator i again. Rising, 0 < 2 T_i <= 2^62; up to 2^levels the
                                            largest number */
    hyst_q31_t threshold[HYST_PI_MAX_OPERATORS]; /**< a_1..a_n, fraction of drive full scale, strictly rising, > 0; up
                                                    to 2^levels the largest number, so that searches end at n */
    hyst_pi_slope_t slope[HYST_PI_MAX_OPERATORS + 1]; /**< S_0..S_n */
} hyst_pi_t;

/** Index of a direction of the drive. */
enum { HYST_PI_DOWN = 0, HYST_PI_UP = 1 };

/**
 * Neighbouring operators whose memory lies on one line: z_i = level + side a_i. The first two members are what a search
 * compares with; they belong to the run's first (innermost) operator and leave out the thresholds' common growth.
 */
typedef struct {
    int64_t response[2]; /**< position, less offset, at which the drive begins to carry it, Q59, <= 2^62 in magnitude */
    hyst_q31_t corner[2]; /**< drive there, saturated */
    hyst_q31_t level;     /**< units of 2^-31, modulo 2^32 */
    uint16_t end;         /**< one past the last operator of the run */
    int8_t side;   /**< -1 where the drive rose last, +1 where it fell, 0 for memory that was never moved since reset or
                      carry */
    uint8_t first; /**< operator: 0 in the innermost run, else where the next inner one ends */
} hyst_pi_run_t;

/** Memory. */
typedef struct {
    uint32_t runs;                            /**< 1..operators (0 without operators) */
    hyst_q31_t drive;                         /**< u[k-1] */
    hyst_q30_t rate;                          /**< v[k-1], full scale per sample, |v| <= 2 */
    hyst_q31_t growth;                        /**< kappa[k], from that rate */
    hyst_pi_run_t run[HYST_PI_MAX_OPERATORS]; /**< from the outermost to the innermost, run[runs - 1] */
} hyst_pi_state_t;

/** What hyst_pi_find found, for hyst_pi_follow. Belongs to that memory as it is. */
typedef struct {
    int64_t goal;             /**< position that was looked for, less offset and growth, Q59 */
    hyst_q31_t drive;         /**< the answer */
    const hyst_pi_run_t *run; /**< of the last operator that it carries */
    int32_t missed;           /**< rounded, it lies so far beyond the goal, Q59 */
    uint32_t further;         /**< and so far beyond that operator's corner */
    uint16_t last;            /**< that operator */
    int8_t outward;           /**< +1, -1: the way it carries them; 0: it carries none */
    bool unreachable;         /**< no drive reaches the position: the answer is the nearer end of the range */
} hyst_pi_found_t;

/** Rounded to its corner, or cut to the range, the drive does not carry the last operator: then which one? */
static inline bool hyst_pi_leaves_open(const hyst_pi_found_t *found) {
    return found->outward != 0 && found->further == 0;
}

/** Why a model is refused. Values are part of the Modbus interface: append only. */
typedef enum {
    HYST_PI_OK = 0,
    HYST_PI_TOO_MANY_OPERATORS = -1,
    HYST_PI_THRESHOLD_NOT_POSITIVE = -2, /**< a_1 <= 0 */
    HYST_PI_THRESHOLD_NOT_RISING = -3,   /**< a_i <= a_{i-1} */
    HYST_PI_WEIGHT_SUM_TOO_LARGE = -4,   /**< sum |w_i| > 4 */
    HYST_PI_SLOPE_TOO_SMALL = -5,        /**< some S_j < 2^-8: not invertible */
    HYST_PI_RATE_GAIN_OUT_OF_RANGE = -6, /**< g outside (0, 1] */
    HYST_PI_BETA_NEGATIVE = -7,
    HYST_PI_RATE_FEEDBACK_UNSTABLE = -8 /**< g beta (S_j - S_0) / S_j outside [-0.45, 0.9] for some j */
} hyst_pi_status_t;

/**
 * Checks the parameters and fills *model. weight has operators + 1 elements, threshold has operators elements.
 * On refusal *model is untouched and *element is the index of the offending weight or threshold (0 where none applies).
 * rate_gain is ignored (and stored as 1) when beta is 0.
 */
hyst_pi_status_t hyst_pi_build(hyst_pi_t *model, uint32_t operators, hyst_q31_t offset, const hyst_q28_t weight[],
                               const hyst_q31_t threshold[], hyst_q20_t beta, hyst_q30_t rate_gain, uint32_t *element);

/** Demagnetised memory (all z_i = 0 at u = 0) followed by a slow move to `drive`. The smoothed rate is 0. */
void hyst_pi_reset(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t drive);

/** Moves the memory by one sample to the drive that was really applied. */
void hyst_pi_advance(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t drive);

/** Memory z_i of one operator, index 0..operators - 1. For tests and displays; a search over the runs. */
hyst_q31_t hyst_pi_memory(const hyst_pi_t *model, const hyst_pi_state_t *state, uint32_t index);

/** Output y[k] at the present memory and drive, saturated to Q31. */
hyst_q31_t hyst_pi_output(const hyst_pi_t *model, const hyst_pi_state_t *state);

/**
 * The drive that would bring the output to `position` at this sample. The memory is not moved: follow with
 * hyst_pi_advance. Where no drive in Q31 reaches the position, the nearer end of the range is returned and *saturated
 * is set (else it is left alone).
 */
hyst_q31_t hyst_pi_solve(const hyst_pi_t *model, const hyst_pi_state_t *state, hyst_q31_t position, bool *saturated);

/** As hyst_pi_solve, and tells hyst_pi_follow what it found. */
hyst_q31_t hyst_pi_find(const hyst_pi_t *model, const hyst_pi_state_t *state, hyst_q31_t position,
                        hyst_pi_found_t *found);

/** As hyst_pi_advance. `found` is what hyst_pi_find made of this memory: where its answer is the drive that was
 * applied, nothing is searched. */
void hyst_pi_follow(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t drive, const hyst_pi_found_t *found);

/** A straight line: no operators, and no rate that their thresholds would grow with. */
static inline bool hyst_pi_is_line(const hyst_pi_t *model) {
    return model->operators == 0 && model->beta == 0;
}

/** hyst_pi_solve of a straight line, which needs no memory to know. hyst_pi_follow_line is its hyst_pi_advance. */
hyst_q31_t hyst_pi_solve_line(const hyst_pi_t *model, hyst_q31_t position, bool *saturated);
static inline void hyst_pi_follow_line(hyst_pi_state_t *state, hyst_q31_t drive) {
    state->drive = drive;
}

/** Forward model, one sample: advance, then output. */
hyst_q31_t hyst_pi_forward(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t drive);

/** Exact inverse, one sample: solve, then advance with the answer. */
hyst_q31_t hyst_pi_inverse(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t position, bool *saturated);

/**
 * Carries the memory of one model over to another whose thresholds may differ, HYST_PI_CARRY_RUNS runs a call. The
 * memory of a play bank is a curve over the threshold, of slope at most 1. The new operators read it off the runs'
 * lines, and where old thresholds leave it open, off a continuation of them that keeps the slope. Equal thresholds keep
 * the memory to the bit. Drive and rate are kept. to_state may not be from_state.
 *
 * Set *carried to 0, then call until the answer is true. *carried counts the runs that are through. Between two calls
 * from_state may be advanced once (not more, and not reset): a sample changes the inner end of the memory, and what
 * calls before it made of the rest stays right. The result is that of all runs carried after the last sample. Done
 * after HYST_PI_CARRY_CALLS calls at most, whatever the history, and after one if no more than HYST_PI_CARRY_RUNS
 * nested movements are remembered. Cost per call: 2 HYST_PI_CARRY_RUNS + 2 bisections of the new thresholds, and at
 * most HYST_PI_MAX_OPERATORS outdated runs thrown away.
 */
bool hyst_pi_carry(const hyst_pi_t *from, const hyst_pi_state_t *from_state, const hyst_pi_t *to,
                   hyst_pi_state_t *to_state, uint32_t *carried);

#endif
