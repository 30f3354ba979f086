/* SPDX-License-Identifier: MIT */
/**
 * Modified play model of a bimorph (paper 001), its exact inverse and the source's own compensator.
 *
 *     y[k] = offset + 2A u[k] + H[u[k]] + c1 y[k-1] + c2 y[k-2] + c3 y[k-3] + g y[k-1] u[k-1]
 *          + (A11 u + A31 u^3 + A51 u^5)[k-1] sin(theta[k-1]) + (A12 u + A32 u^3 + A52 u^5)[k-1] cos(theta[k-1])
 *     theta[k] = theta[k-1] + 2 pi f dt
 *
 *     H = sum over i = 1..N-1, j = 0..N-1-i of omega_ij ramp((p_i - center_ij) N)       ramp(x): x within -1 .. 1
 *     p_i[k] = max(u[k] - r_i - alpha |v[k-1]|, min(u[k] + r_i + beta |v[k-1]|, p_i[k-1])),    r_i = i / N
 *     center_ij = (2 j + 1 - (N - i)) / N
 *     v[k] = v[k-1] + q (u[k] - u[k-1] - v[k-1])                                        smoothed rate, per sample
 *
 * Source: paper 001, equations (5) to (11), (22), (30) to (36), with what its print has lost put back, and two changes,
 * all derived in docs/MODELS.md, section 9. First, the shape of a cell is the integral of the relay over the cell, a
 * ramp; the printed (4) makes all cells of a row the same function. Second, the rate that widens the plays is the one
 * known before the sample: with the printed u[k+1] - u[k] the operator would fall when its input rises.
 *
 * Why the inverse is exact. At sample k everything but 2A u + H is known. The plays stay nested (alpha |v| and beta |v|
 * are common to all rows), so a rising drive begins to carry row 1, then row 2 and so on. As r_i and the cells share
 * one grid of 1 / N, the rows that are carried pass from cell to cell at the same drives. The slope between two such
 * events is one of N x N sums of omega for rising and as many for falling drives; all positive makes y a rising
 * function of u. What 2A u + H is at such an event is a sum as well: over the rows that are carried one of a table,
 * over the others one of the memory. So the solver finds the last row that is carried by bisection, and divides once.
 * Forward after inverse is the identity up to the rounding of u (half a unit, times the slope) and of y (half a unit):
 * tests/unit/test_modified_play.c.
 *
 * Why the inverse is stable. Its y history is the reference: a sum of past references, which cannot diverge. What feeds
 * back is its own past drive, through g y u and the harmonics (at most L = |g| + |A1| + 3 |A3| + 5 |A5| per drive, A1 =
 * hypot(A11, A12) ..) and through the rate. hyst_modified_play_build demands, without endy slope S of a branch and e =
 * q alpha (S - 2A), or beta on falling branches,
 *
 *     L <= 0.9 S,      e + L (1 - q) <= 0.9 S,      (2 - q) (S - L) + 2 e >= 0.1 S
 *
 * that is, both roots of the loop inside the unit circle without endy constant gain up to L (docs/MODELS.md, 9.4; a
 * condition per branch, as in section 3.4). Of the model itself it demands that c1 + g u, c2, c3 is a stable filter for
 * every constant u (Jury).
 *
 * Rounding. y is rounded to Q31 and fed back; the 28 bits below are carried into the next sample, as in iir.h.
 *
 * Limits. The harmonic terms belong to one frequency f and to a drive that is in phase with theta: parameters that were
 * identified with a sine describe that sine. docs/MODELS.md says what this does to the compensation.
 *
 * Formats: drive, position, plays Q31; coefficients Q28, slopes omega N Q28; alpha, beta Q20 samples; q Q30.
 * Preconditions: a hyst_modified_play_t that hyst_modified_play_build accepted. Total for such a model and any input.
 * May be called from: interrupt, main loop, host (hyst_modified_play_build: not per sample). Reentrant; the caller owns
 * model and state. Cost per call goes with the rows that move.
 */
#ifndef HYST_MODIFIED_PLAY_H
#define HYST_MODIFIED_PLAY_H

#include "hyst/fixed.h"
#include <stdbool.h>

#define HYST_MODIFIED_PLAY_MAX_DIVISIONS 16
#define HYST_MODIFIED_PLAY_MAX_ROWS      (HYST_MODIFIED_PLAY_MAX_DIVISIONS - 1)
/** Cells of a plane of N divisions. */
#define HYST_MODIFIED_PLAY_CELLS(divisions) ((divisions) * ((divisions)-1) / 2)
#define HYST_MODIFIED_PLAY_MAX_CELLS        HYST_MODIFIED_PLAY_CELLS(HYST_MODIFIED_PLAY_MAX_DIVISIONS)
#define HYST_MODIFIED_PLAY_FEEDBACK         3 /**< c1, c2, c3 */
#define HYST_MODIFIED_PLAY_HARMONICS        3 /**< of u, u^3, u^5 */

/** Slopes of a branch within one sample that are accepted. A resonance far below the sample rate makes them small. */
#define HYST_MODIFIED_PLAY_MIN_SLOPE (HYST_Q28_ONE / 4096)
#define HYST_MODIFIED_PLAY_MAX_SLOPE (4 * (int64_t)HYST_Q28_ONE)
/** Largest sum of |c|, |g|, |A| of the harmonics and |2A|. */
#define HYST_MODIFIED_PLAY_MAX_COEFFICIENTS (10 * (int64_t)HYST_Q28_ONE)

/** What describes a model. */
typedef struct {
    uint32_t divisions;                               /**< N, 1..HYST_MODIFIED_PLAY_MAX_DIVISIONS; 1 has no cells */
    hyst_q31_t offset;                                /**< added at every sample */
    hyst_q28_t direct;                                /**< 2A */
    hyst_q28_t slope[HYST_MODIFIED_PLAY_MAX_CELLS];   /**< omega_ij N: row by row, i = 1.., j = 0..N-1-i */
    hyst_q20_t alpha, beta;                           /**< samples, >= 0; both 0: rate-independent plays */
    hyst_q30_t rate_gain;                             /**< q, (0, 1]; ignored without alpha and beta */
    hyst_q28_t feedback[HYST_MODIFIED_PLAY_FEEDBACK]; /**< c1, c2, c3 */
    hyst_q28_t bilinear;                              /**< g */
    hyst_q28_t sine[HYST_MODIFIED_PLAY_HARMONICS];    /**< A11, A31, A51 */
    hyst_q28_t cosine[HYST_MODIFIED_PLAY_HARMONICS];  /**< A12, A32, A52 */
    uint32_t phase; /**< theta at the sample of hyst_modified_play_reset, and at the first sample of a source's sine,
                       turns / 2^32 */
    uint32_t phase_step; /**< f dt in turns / 2^32 */
} hyst_modified_play_parameters_t;

/** Where the entries of zone z begin in the tables of a model: zone z has those of m = 0..z + 1 rows, m < N. */
#define HYST_MODIFIED_PLAY_ZONE(zone) ((zone) * ((zone) + 3U) / 2U)
#define HYST_MODIFIED_PLAY_ENTRIES                                                                                     \
    (HYST_MODIFIED_PLAY_ZONE((unsigned)HYST_MODIFIED_PLAY_MAX_DIVISIONS) + HYST_MODIFIED_PLAY_MAX_DIVISIONS)

/**
 * Coefficients. Written by hyst_modified_play_build only; constant afterwards.
 *
 * The tables are for a drive that carries the first m rows. Its reach is how far it has come in its direction, less
 * what widens the plays, counted from -N pitch: u - alpha |v| + N pitch going up [0], -u - beta |v| + N pitch going
 * down [1]. Zone z < N begins at 2 z pitch and is column z in that direction, zone N is behind all columns. As row m
 * ends at 1 - r_m, it is carried in zones m - 1 (within N units of the end), m and so on: entry
 * HYST_MODIFIED_PLAY_ZONE(z) + m.
 */
typedef struct {
    hyst_modified_play_parameters_t parameters;
    hyst_q31_t pitch; /**< 1 / N, rounded down: r_i = i pitch */
    /** 2A reach (going down: -2A reach) and the share of the first m rows in H, where the zone begins. Q59, below 2^62
     * + 2^60 */
    int64_t level[2][HYST_MODIFIED_PLAY_ENTRIES];
    hyst_q28_t branch[2][HYST_MODIFIED_PLAY_ENTRIES]; /**< slope of y over u in that zone */
} hyst_modified_play_t;

/** Memory. */
typedef struct {
    hyst_q31_t play[HYST_MODIFIED_PLAY_MAX_ROWS];     /**< p_i, [i - 1] */
    hyst_q31_t position[HYST_MODIFIED_PLAY_FEEDBACK]; /**< y[k], y[k-1], y[k-2] */
    int32_t remainder;                                /**< what rounding y[k] left over, Q59, |.| <= 2^27 */
    hyst_q31_t drive;                                 /**< u[k] */
    hyst_q30_t rate;                                  /**< v[k], |v| <= 2 */
    uint32_t phase;                                   /**< theta[k], see hyst_modified_play_set_phase */
    int64_t known;                                    /**< all of y[k+1] but 2A u + H, Q59 */
    /** What the rows behind the first m have in H[u[k]], Q59: [0] is H, [N - 1] is 0; behind that, nothing is said. */
    int64_t share[HYST_MODIFIED_PLAY_MAX_ROWS + 1];
} hyst_modified_play_state_t;

/** Why a model is refused. Values are part of the Modbus interface: append only. */
typedef enum {
    HYST_MODIFIED_PLAY_OK = 0,
    HYST_MODIFIED_PLAY_DIVISIONS_OUT_OF_RANGE = -1,
    HYST_MODIFIED_PLAY_COEFFICIENTS_TOO_LARGE = -2, /**< sum of |c|, |g|, |A|, |2A| above 10 */
    HYST_MODIFIED_PLAY_WEIGHTS_TOO_LARGE = -3,      /**< sum |omega_ij| above 2 */
    HYST_MODIFIED_PLAY_TOO_FLAT = -4,               /**< a branch's slope below 2^-12: not invertible */
    HYST_MODIFIED_PLAY_TOO_STEEP = -5,              /**< a branch's slope above 4 */
    HYST_MODIFIED_PLAY_RATE_OUT_OF_RANGE = -6,      /**< alpha or beta negative, or q outside (0, 1] */
    HYST_MODIFIED_PLAY_FILTER_UNSTABLE = -7,        /**< c1 - |g| or c1 + |g| with c2, c3 */
    HYST_MODIFIED_PLAY_INVERSE_UNSTABLE = -8        /**< the past drive feeds back more than a branch's slope bears */
} hyst_modified_play_status_t;

/**
 * Checks the parameters and fills *model. On refusal *model is untouched and *element is the index of the offending
 * cell: for slopes, of the last cell that the branch is made of (0 where none applies).
 */
hyst_modified_play_status_t hyst_modified_play_build(hyst_modified_play_t *model,
                                                     const hyst_modified_play_parameters_t *parameters,
                                                     uint32_t *element);

/**
 * Demagnetised plays (all 0 at u = 0), then a slow move to `drive`, where the position rests without its harmonics.
 * theta is the model's phase.
 */
void hyst_modified_play_reset(const hyst_modified_play_t *model, hyst_modified_play_state_t *state, hyst_q31_t drive);

/** Sets theta[k], to lock it to a source. */
void hyst_modified_play_set_phase(const hyst_modified_play_t *model, hyst_modified_play_state_t *state, uint32_t phase);

/** Moves the memory by one sample, with the drive that was really applied. */
void hyst_modified_play_advance(const hyst_modified_play_t *model, hyst_modified_play_state_t *state, hyst_q31_t drive);

/** Output of the last sample, saturated to Q31. */
hyst_q31_t hyst_modified_play_output(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state);

/**
 * The drive that brings the output to `position` at the next sample. The memory is not moved: follow with
 * hyst_modified_play_advance. Where no drive in Q31 reaches the position, the nearer end of the range is returned and
 * *saturated is set (else it is left alone).
 */
hyst_q31_t hyst_modified_play_solve(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state,
                                    hyst_q31_t position, bool *saturated);

/**
 * The source's compensator, direct inverse multiplication, (37): u = (position - rest) / 2A with the plays of the last
 * sample in place of those that u will move. It misses by what H changes within the sample, sum omega_ij (ramp[k] -
 * ramp[k-1]): nothing at a standstill, (S - 2A) (u[k] - u[k-1]) on a branch of slope S. On a branch the miss comes back
 * times -(S - 2A) / 2A in the next sample: where plays outweigh 2A, the drive chatters. For comparison with solve; used
 * and followed up like it.
 */
hyst_q31_t hyst_modified_play_direct_inverse(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state,
                                             hyst_q31_t position, bool *saturated);

/** Forward model, one sample: advance, then output. */
hyst_q31_t hyst_modified_play_forward(const hyst_modified_play_t *model, hyst_modified_play_state_t *state,
                                      hyst_q31_t drive);

/** Exact inverse, one sample: solve, then advance with the answer. */
hyst_q31_t hyst_modified_play_inverse(const hyst_modified_play_t *model, hyst_modified_play_state_t *state,
                                      hyst_q31_t position, bool *saturated);

/**
 * Carries the memory of one model over to another. Positions, drive, rate and phase stay; plays are read off the old
 * ones as a curve over the threshold, which keeps them to the bit for equal N. to_state may not be from_state.
 */
void hyst_modified_play_carry(const hyst_modified_play_t *from, const hyst_modified_play_state_t *from_state,
                              const hyst_modified_play_t *to, hyst_modified_play_state_t *to_state);

#endif
