/* SPDX-License-Identifier: MIT */
/**
 * Bouc-Wen model as two mirrored branch curves, and its exact inverse.
 *
 *     y = offset + d u + s h,      dh/du = A - (beta sgn(u' h) + gamma) |h|^n
 *
 * (u drive, y position, u' its rate.) The equation holds no time: between two reversals h runs along one fixed curve
 * over the drive that has been travelled. Let H(v) be the curve of rising drives, dH/dv = A - (beta sgn H + gamma)
 * |H|^n. The equation stays the same when u and h change sign together, so falling drives run along the mirrored
 * curve:
 *
 *     rising     h = +H(v),   v grows by what the drive rises
 *     falling    h = -H(v),   v grows by what the drive falls
 *     reversal   h stays, v becomes the place where the other curve has this h:  H(v_new) = -H(v_old)
 *
 * This is the model, not an approximation in time: one long step and many short ones lead to the same h, whatever the
 * sample rate. (An explicit step h += Du (A - ...|h|) is faithful only for (beta + gamma) |Du| << 1 and passes its
 * limit beyond 1. docs/MODELS.md, section 8.)
 *
 * Discrete form. s H is piecewise linear: cell i = 0..n-1 is length_i of travelled drive long and contributes slope_i
 * to the position per drive. Its ends are -E and +E, E = sum slope_i length_i / 2, which the build function works out;
 * a branch that is through stays there. Any exponent n, and any curve of that symmetry, is a choice of cells; the host
 * makes them from A, beta, gamma, n. s < 0 (loops of the other sense) is slope_i < 0.
 *
 * Why the inverse is exact. At a given memory the position is a function of the drive alone: upwards d u + H from one
 * place on the curve, downwards the same from another. It is piecewise linear and rising if all d + slope_i > 0 and
 * d > 0. Bisection over at most 64 cells and one division invert it. s H is kept in Q59, where sums over cells are
 * exact. At a reversal the place on the new curve is rounded to a unit of drive and what is left of h is carried along
 * as `rest`, so that the position does not jump. Forward after inverse differs from the identity by the rounding of u
 * (half a unit, times the slope) and of y (half a unit): tests/unit/test_bouc_wen.c.
 *
 * Limits of the model. Rate-independent, no creep, loops symmetric. Small loops neither close nor stay where they are
 * (the equation violates what real ceramics obey): after a change of amplitude they drift for some periods. Cells
 * follow the exponential of n = 1 to 0.5 to 2.7 E / cells^2 when they are placed where it bends (measured, six pairs of
 * beta and gamma).
 *
 * Formats: drive, position, length Q31; slopes and d Q28.
 * Preconditions: a hyst_bouc_wen_t that hyst_bouc_wen_build accepted. Total for such a model and any input.
 * May be called from: interrupt, main loop, host (hyst_bouc_wen_build: not per sample). Reentrant; the caller owns
 * model and state. Worst case per call: advance 14 probes and one division by a known divisor (reciprocal.h; nothing
 * between reversals); solve 21 and two; follow after find none.
 */
#ifndef HYST_BOUC_WEN_H
#define HYST_BOUC_WEN_H

#include "hyst/fixed.h"
#include <stdbool.h>

#define HYST_BOUC_WEN_MAX_CELLS 64

/** Slopes of a branch, position full scale per drive full scale, that are accepted: 2^-8 to 4. */
#define HYST_BOUC_WEN_MIN_SLOPE (HYST_Q28_ONE / 256)
#define HYST_BOUC_WEN_MAX_SLOPE (4 * (int64_t)HYST_Q28_ONE)

/** Coefficients. Written by hyst_bouc_wen_build only; constant afterwards. */
typedef struct {
    uint32_t cells;                                         /**< n, 0..HYST_BOUC_WEN_MAX_CELLS; 0 is a straight line */
    hyst_q31_t offset;                                      /**< y at u = 0, h = 0 */
    hyst_q28_t direct;                                      /**< d */
    hyst_q28_t slope[HYST_BOUC_WEN_MAX_CELLS];              /**< of s H in cell i, all of one sign */
    uint32_t share_reciprocal[HYST_BOUC_WEN_MAX_CELLS];     /**< of |slope|, see reciprocal.h */
    uint32_t climb_reciprocal[HYST_BOUC_WEN_MAX_CELLS + 1]; /**< of d + slope; [n] of d */
    int64_t place[HYST_BOUC_WEN_MAX_CELLS + 1]; /**< v at the beginning of cell i, Q31, 0 to 2^37; [n] the end */
    int64_t share[HYST_BOUC_WEN_MAX_CELLS + 1]; /**< s H there, Q59, from -E to +E, E <= 2^59 */
    int64_t climb[HYST_BOUC_WEN_MAX_CELLS + 1]; /**< d v + s H - s H(0) there, Q59, 0 to 2^62, rising */
} hyst_bouc_wen_t;

/** Memory. */
typedef struct {
    int64_t place;    /**< v, Q31, 0..place[n] */
    int64_t rest;     /**< s h less what the curve has at v, Q59, |rest| <= 2^29 + 1: half a unit of drive, times 4 */
    int32_t side;     /**< +1: the drive rose last, -1: it fell; s h = side * (curve + rest) */
    hyst_q31_t drive; /**< u[k] */
} hyst_bouc_wen_state_t;

/** What hyst_bouc_wen_find found, for hyst_bouc_wen_follow. Belongs to that memory as it is. */
typedef struct {
    int64_t place, rest; /**< after turning round */
    bool turned;         /**< they are known */
} hyst_bouc_wen_found_t;

/** Why a model is refused. Values are part of the Modbus interface: append only. */
typedef enum {
    HYST_BOUC_WEN_OK = 0,
    HYST_BOUC_WEN_TOO_MANY_CELLS = -1,
    HYST_BOUC_WEN_LENGTH_NOT_POSITIVE = -2, /**< length_i <= 0 */
    HYST_BOUC_WEN_SLOPE_SIGN = -3,          /**< slope_i = 0, or of another sign than slope_0 */
    HYST_BOUC_WEN_TOO_FLAT = -4,            /**< d or d + slope_i < 2^-8: not invertible */
    HYST_BOUC_WEN_TOO_STEEP = -5,           /**< d or d + slope_i > 4 */
    HYST_BOUC_WEN_BRANCH_TOO_LONG = -6      /**< E > 1, or the whole branch climbs by more than 8 */
} hyst_bouc_wen_status_t;

/**
 * Checks the parameters and fills *model. length and slope have `cells` elements. On refusal *model is untouched and
 * *element is the index of the offending cell (0 where none applies).
 */
hyst_bouc_wen_status_t hyst_bouc_wen_build(hyst_bouc_wen_t *model, uint32_t cells, hyst_q31_t offset, hyst_q28_t direct,
                                           const hyst_q31_t length[], const hyst_q28_t slope[], uint32_t *element);

/** h = 0 at u = 0, then a slow move to `drive`. */
void hyst_bouc_wen_reset(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive);

/** Moves the memory by one sample to the drive that was really applied. */
void hyst_bouc_wen_advance(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive);

/** Output at the present memory and drive, saturated to Q31. */
hyst_q31_t hyst_bouc_wen_output(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state);

/**
 * The drive that would bring the output to `position` at this sample. The memory is not moved: follow with
 * hyst_bouc_wen_advance. Where no drive in Q31 reaches the position, the nearer end of the range is returned and
 * *saturated is set (else it is left alone).
 */
hyst_q31_t hyst_bouc_wen_solve(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state, hyst_q31_t position,
                               bool *saturated);

/** As hyst_bouc_wen_solve, and tells hyst_bouc_wen_follow what it found. */
hyst_q31_t hyst_bouc_wen_find(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state, hyst_q31_t position,
                              bool *saturated, hyst_bouc_wen_found_t *found);

/** As hyst_bouc_wen_advance. `found` is what hyst_bouc_wen_find made of this memory: a turn is not worked out twice. */
void hyst_bouc_wen_follow(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive,
                          const hyst_bouc_wen_found_t *found);

/** Forward model, one sample: advance, then output. */
hyst_q31_t hyst_bouc_wen_forward(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive);

/** Exact inverse, one sample: solve, then advance with the answer. */
hyst_q31_t hyst_bouc_wen_inverse(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t position,
                                 bool *saturated);

/**
 * Carries the memory of one model over to another: h keeps its size relative to the branch's ends, the drive and the
 * direction stay. Models with the same curve keep it to the bit. to_state may not be from_state.
 *
 * Set *carried to 0, then call until the answer is true: a call compares HYST_BOUC_WEN_CARRY_CORNERS corners of the
 * curves, and the first one of them that differs is the end of comparing. Between two calls from_state may be advanced.
 * The result is that of the memory as it is in the last call. Done after HYST_BOUC_WEN_CARRY_CALLS calls at most.
 */
bool hyst_bouc_wen_carry(const hyst_bouc_wen_t *from, const hyst_bouc_wen_state_t *from_state,
                         const hyst_bouc_wen_t *to, hyst_bouc_wen_state_t *to_state, uint32_t *carried);

#define HYST_BOUC_WEN_CARRY_CORNERS 8U
#define HYST_BOUC_WEN_CARRY_CALLS   (HYST_BOUC_WEN_MAX_CELLS / HYST_BOUC_WEN_CARRY_CORNERS + 1U)

#endif
