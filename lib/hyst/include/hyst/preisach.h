/* SPDX-License-Identifier: MIT */
/**
 * Preisach model in Everett form, and its exact inverse.
 *
 *     y = Y_s + E(u, s)
 *
 * s is the drive at which the present branch began (the last reversal that is not forgotten), Y_s the output there, and
 * E the Everett function. E(alpha, beta) is the change of the output when the drive rises from beta to alpha, and
 * -E(alpha, beta) that when it falls from alpha back to beta. So E(alpha, beta) = -E(beta, alpha), and one formula
 * serves both directions. E is X(alpha, beta) of paper 002, equations (2.7), (2.18) and (2.22); docs/MODELS.md,
 * section 7, derives it and says what the print has lost.
 *
 * Discrete form. N + 1 levels divide the drive's full scale [-1, 1) into N equal intervals. The table holds E at pairs
 * of levels; inside a square E is bilinear (2.26), inside a triangle on the diagonal linear (2.25). The latter is the
 * former with the table continued by E(beta, alpha) = -E(alpha, beta).
 *
 * Memory. A stack of the unforgotten reversals, alternately minima and maxima, each nested in the one before, with the
 * outputs at them. Passing an older reversal forgets it and the one after it (wiping out): the branch that began before
 * both goes on. The outermost entry is the lower end of the range. The stack holds HYST_PREISACH_MAX_EXTREMES; one more
 * nested reversal than that merges the two branches between which the drive differs least. This changes the output by
 * at most 2/63 of the drive's half range times the difference between the steepest and the flattest branch
 * (hyst_preisach_advance), and is the only place where the model departs from its definition.
 *
 * Why the inverse is exact. Along a branch y is piecewise linear in u, with corners at the levels and at stacked
 * reversals only, and rising because hyst_preisach_build demands it. Bisection over the stacked outputs finds the
 * branch, bisection over the levels the interval, one division the drive: rounded to nearest, without error. Forward
 * after inverse is the identity up to the rounding of u (half a unit, times the slope) and of y (half a unit)
 * (tests/unit/test_preisach.c).
 *
 * Formats: drive, position Q31; table Q28 (a change of the position by 8 half ranges at most). Outputs inside Q60,
 * exact: the place of a drive within an interval is known to 32 bits, and E at a level is their exact product with the
 * table.
 *
 * Limits of the model. Rate-independent, no creep. Minor loops between the same two drives are congruent wherever they
 * are (the property that, with wiping out, characterises it). The resolution is the grid: the true E is curved, and the
 * error of bilinear interpolation goes with 1/N^2.
 *
 * Preconditions: a hyst_preisach_t that hyst_preisach_build accepted. Every function is total for such a model and any
 * input. May be called from: interrupt, main loop, host (hyst_preisach_build and _carry: not per sample). Reentrant;
 * the caller owns model and state. Worst case per call, whatever the history: advance 6 probes of the stack (and when
 * it is full, one pass over it); solve 6 probes of the stack, 5 of the table, and five 32-bit
 * divisions (hyst_fraction).
 */
#ifndef HYST_PREISACH_H
#define HYST_PREISACH_H

#include "hyst/fixed.h"
#include <stdbool.h>

/** N at most. */
#define HYST_PREISACH_MAX_INTERVALS 30
/** Elements of a table of N intervals. */
#define HYST_PREISACH_ELEMENTS(intervals) ((intervals) * ((intervals) + 1) / 2)
#define HYST_PREISACH_MAX_ELEMENTS        HYST_PREISACH_ELEMENTS(HYST_PREISACH_MAX_INTERVALS)
/** Reversals that are remembered, the lower end of the range included. */
#define HYST_PREISACH_MAX_EXTREMES 64
/** Reversals that one call of hyst_preisach_carry takes over, and the calls that a full stack takes at most. */
#define HYST_PREISACH_CARRY_EXTREMES 8
#define HYST_PREISACH_CARRY_CALLS    9
/** Slopes of a branch, position full scale per drive full scale, that are accepted: 2^-8 to 4. */
#define HYST_PREISACH_MIN_SLOPE (HYST_Q28_ONE / 256)
#define HYST_PREISACH_MAX_SLOPE (4 * (int64_t)HYST_Q28_ONE)

/**
 * Coefficients. Written by hyst_preisach_build only; constant afterwards.
 *
 * Level i is the drive -1 + 2 i / N. The table is E in half ranges of the position, whole, with E(j, i) = -E(i, j) and
 * zeros between: a movement looks up four neighbours, and is not to ask on which side of the diagonal each of them is.
 */
typedef struct {
    uint32_t intervals; /**< N, 1..HYST_PREISACH_MAX_INTERVALS */
    hyst_q31_t offset;  /**< mean of the outputs at the two ends of the drive's range */
    hyst_q28_t everett[HYST_PREISACH_MAX_INTERVALS + 1][HYST_PREISACH_MAX_INTERVALS + 1]; /**< E(level i, level j) */
} hyst_preisach_t;

/** A point of the drive's past, and the output there. */
typedef struct {
    hyst_q31_t drive;
    int64_t output; /**< Q60, |output| < 5 */
} hyst_preisach_point_t;

/** Memory. */
typedef struct {
    uint32_t extremes; /**< 1..HYST_PREISACH_MAX_EXTREMES; odd: the drive rose last, even: it fell */
    hyst_preisach_point_t
        extreme[HYST_PREISACH_MAX_EXTREMES]; /**< [0] the lower end, [1] a maximum, [2] a minimum .. */
    hyst_preisach_point_t now;
    uint32_t smallest; /**< in a full stack: the reversal behind which the smallest gap lies (preisach.c, note_gaps) */
    uint32_t least;    /**< that gap, units of 2^-31 */
} hyst_preisach_state_t;

/** Why a model is refused. Values are part of the Modbus interface: append only. */
typedef enum {
    HYST_PREISACH_OK = 0,
    HYST_PREISACH_INTERVALS_OUT_OF_RANGE = -1, /**< N = 0 or N > HYST_PREISACH_MAX_INTERVALS */
    HYST_PREISACH_RISING_TOO_FLAT = -2,  /**< E(i,j) - E(i-1,j) is less than 2^-8 of the interval: not invertible */
    HYST_PREISACH_FALLING_TOO_FLAT = -3, /**< E(i,j) - E(i,j+1) is: not invertible */
    HYST_PREISACH_TOO_STEEP = -4         /**< one of these differences is more than 4 times the interval */
} hyst_preisach_status_t;

/**
 * Checks the table and fills *model. `everett` has HYST_PREISACH_ELEMENTS(intervals) elements: element i (i - 1) / 2 +
 * j is E(level i, level j) for 0 <= j < i <= N, row by row E(1,0); E(2,0), E(2,1); E(3,0) ... All are positive. On
 * refusal *model is untouched and *element is the index of the offending element (0 where none applies).
 *
 * A branch that rises from beta has, above level i-1, a slope between those at the two levels beside beta, and these
 * are the differences E(i,j) - E(i-1,j); likewise E(i,j) - E(i,j+1) on falling branches. So all branches rise exactly
 * if all these differences are positive; the weights of single relays (second differences) may be negative.
 */
hyst_preisach_status_t hyst_preisach_build(hyst_preisach_t *model, uint32_t intervals, hyst_q31_t offset,
                                           const hyst_q28_t everett[], uint32_t *element);

/** E(to, from): change of the output on a branch that leads from one drive directly to the other, Q60. */
int64_t hyst_preisach_everett(const hyst_preisach_t *model, hyst_q31_t to, hyst_q31_t from);

/**
 * Demagnetised memory followed by a slow move to `drive`. Demagnetised means: a swing over the whole range whose
 * reversals come closer by one level each until they meet in the middle. At most 31 reversals: not per sample.
 */
void hyst_preisach_reset(const hyst_preisach_t *model, hyst_preisach_state_t *state, hyst_q31_t drive);

/**
 * Moves the memory by one sample to the drive that was really applied. When the stack is full, the output at this
 * sample may differ from that of hyst_preisach_solve by the bound above.
 */
void hyst_preisach_advance(const hyst_preisach_t *model, hyst_preisach_state_t *state, hyst_q31_t drive);

/** Output at the present memory and drive, saturated to Q31. */
hyst_q31_t hyst_preisach_output(const hyst_preisach_t *model, const hyst_preisach_state_t *state);

/**
 * The drive that would bring the output to `position` at this sample. The memory is not moved: follow with
 * hyst_preisach_advance. Where no drive in Q31 reaches the position, the nearer end of the range is returned and
 * *saturated is set (else it is left alone).
 */
hyst_q31_t hyst_preisach_solve(const hyst_preisach_t *model, const hyst_preisach_state_t *state, hyst_q31_t position,
                               bool *saturated);

/** Forward model, one sample: advance, then output. */
hyst_q31_t hyst_preisach_forward(const hyst_preisach_t *model, hyst_preisach_state_t *state, hyst_q31_t drive);

/** Exact inverse, one sample: solve, then advance with the answer. */
hyst_q31_t hyst_preisach_inverse(const hyst_preisach_t *model, hyst_preisach_state_t *state, hyst_q31_t position,
                                 bool *saturated);

/**
 * Carries the memory of one model over to another: the reversals are drives and stay as they are, whatever the grids;
 * their outputs are those of the new table. to_state may not be from_state.
 *
 * Set *carried to 0, then call until the answer is true: HYST_PREISACH_CARRY_EXTREMES reversals a call. Between two
 * calls from_state may be advanced once (not more, and not reset). What is carried stays right, but for the merging of
 * a full stack: then two reversals less are carried, and the outputs of those behind them are moved. The result is that
 * of all reversals carried after the last sample. Done after HYST_PREISACH_CARRY_CALLS calls at most: a sample that
 * merges leaves room, so that the next one does not, and two calls get 14 reversals further at least.
 */
bool hyst_preisach_carry(const hyst_preisach_t *from, const hyst_preisach_state_t *from_state,
                         const hyst_preisach_t *to, hyst_preisach_state_t *to_state, uint32_t *carried);

#endif
