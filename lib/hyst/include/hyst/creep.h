/* SPDX-License-Identifier: MIT */
/**
 * Creep: the position keeps moving after the drive has stopped, about in proportion to the logarithm of time.
 *
 *     y[k]   = h[k] + sum_{j=1..m} c_j s_j[k]
 *     s_j[k] = s_j[k-1] + l_j (h[k-1] - s_j[k-1])          l_j = 1 - exp(-dt / tau_j)
 *
 * h is what the hysteresis gives, y the position. m first-order cells in parallel, their time constants tau_j spread
 * evenly over the logarithm of time, with equal gains c_j: the step response is then h (1 + gamma log10(t / t_0)) to
 * within a small ripple. (PI, "Fundamentals of piezo technology": dL = dL(0.1 s) (1 + gamma log10(t / 0.1 s)); cells:
 * docs/MODELS.md, section 5.) Each cell is the exact solution of ds/dt = (h - s) / tau for an h that is constant
 * between samples.
 *
 * Why the inverse is exact. The creep at sample k depends on h up to sample k-1, so it is a known number: h = y - sum
 * c_j s_j, the same integers as forward. Forward after inverse is the identity to the bit unless h or y saturates
 * (tests/unit/test_creep.c).
 *
 * Formats: h, y Q31; gain Q31; rate l_j Q31 (at 10 kHz and tau = 1000 s it is 215 units, so tau is met to 0.25 %).
 * State Q61, so that the slowest cell still moves by its due for a difference of 2^-30 of full scale.
 *
 * May be called from: interrupt, main loop, host. Reentrant; the caller owns coefficients and state. Linear in m.
 */
#ifndef HYST_CREEP_H
#define HYST_CREEP_H

#include "hyst/fixed.h"
#include <stdbool.h>

#define HYST_CREEP_MAX_CELLS 16

typedef struct {
    hyst_q31_t gain; /**< c_j */
    hyst_q31_t rate; /**< l_j, > 0, per sample */
} hyst_creep_cell_t;

/** Coefficients. No cells: no creep. */
typedef struct {
    uint32_t cells;
    hyst_creep_cell_t cell[HYST_CREEP_MAX_CELLS];
} hyst_creep_t;

typedef struct {
    int64_t level[HYST_CREEP_MAX_CELLS]; /**< s_j, Q61, |s_j| <= 2^61 */
} hyst_creep_state_t;

/** Why cells are refused. Values are part of the Modbus interface: append only. */
typedef enum {
    HYST_CREEP_OK = 0,
    HYST_CREEP_TOO_MANY_CELLS = -1,
    HYST_CREEP_GAIN_TOO_LARGE = -2,   /**< sum |c_j| >= 1 */
    HYST_CREEP_RATE_NOT_POSITIVE = -3 /**< l_j <= 0 */
} hyst_creep_status_t;

/** Checks and copies. On refusal *creep is untouched and *element is the index of the cell. */
hyst_creep_status_t hyst_creep_build(hyst_creep_t *creep, uint32_t cells, const hyst_creep_cell_t cell[],
                                     uint32_t *element);

/** The steady state for a constant h. */
void hyst_creep_settle(const hyst_creep_t *creep, hyst_creep_state_t *state, hyst_q31_t h);

/** sum c_j s_j: what creep adds to the position at this sample. |result| < 2^31. */
int64_t hyst_creep_offset(const hyst_creep_t *creep, const hyst_creep_state_t *state);

/** Moves the cells on by one sample, during which h was present. */
void hyst_creep_advance(const hyst_creep_t *creep, hyst_creep_state_t *state, hyst_q31_t h);

#endif
