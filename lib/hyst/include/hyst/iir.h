/* SPDX-License-Identifier: MIT */
/**
 * Cascade of second-order IIR sections (biquads), direct form 1 with first-order error feedback.
 *
 *     y[k] = b0 x[k] + b1 x[k-1] + b2 x[k-2] - a1 y[k-1] - a2 y[k-2]          per section, a0 = 1
 *
 * Signals Q31, coefficients Q28 (range -8 to 8, step 3.7e-9). The sum is exact in 64 bits; the 28 bits that rounding
 * would drop are carried into the next sample, so the quantisation noise is shaped by (1 - z^-1) and a constant input
 * settles to its exact gain. Direct form 1: the state is plain past inputs and outputs, so any coefficients can follow
 * any others without a jump of the state. The output saturates; a saturation drops the carried remainder and is
 * reported.
 *
 * Bound: |b0| + |b1| + |b2| + |a1| + |a2| < 15 (checked by hyst_iir_build), so |sum| < 15 * 2^28 * 2^31 + 2^28 < 2^63.
 *
 * May be called from: interrupt, main loop, host. Reentrant; the caller owns coefficients and state.
 */
#ifndef HYST_IIR_H
#define HYST_IIR_H

#include "hyst/fixed.h"
#include <stdbool.h>

#define HYST_IIR_MAX_SECTIONS 4

typedef struct {
    hyst_q28_t b0, b1, b2, a1, a2;
} hyst_iir_section_t;

/** Two coefficients that are used together: one load fetches both. The first is the lower word. */
typedef uint64_t hyst_iir_pair_t;

static inline hyst_q28_t hyst_iir_first(hyst_iir_pair_t pair) {
    return (hyst_q28_t)(uint32_t)pair;
}

static inline hyst_q28_t hyst_iir_second(hyst_iir_pair_t pair) {
    return (hyst_q28_t)(uint32_t)(pair >> 32);
}

/** A section as it is used: five products are added up. Written by hyst_iir_build only. */
typedef struct {
    hyst_iir_pair_t b;       /**< b1, b2 */
    hyst_iir_pair_t minus_a; /**< -a1, -a2 */
    hyst_q28_t b0;
    uint32_t gain;       /**< |b0 + b1 + b2|, Q28, < 15 */
    uint32_t negative;   /**< 1 if b0 + b1 + b2 is, else 0 */
    uint32_t at_rest;    /**< 1 + a1 + a2 > 0, what b0 + b1 + b2 is divided by at rest, Q28, < 4 */
    uint32_t reciprocal; /**< of it, see reciprocal.h */
} hyst_iir_coefficients_t;

/** Coefficients of a cascade of 0 to HYST_IIR_MAX_SECTIONS sections; none is a plain wire. */
typedef struct {
    uint32_t sections;
    hyst_iir_coefficients_t section[HYST_IIR_MAX_SECTIONS];
} hyst_iir_t;

/** What a section remembers: the past of its output, which is that of the next section's input. */
typedef struct {
    hyst_q31_t y1, y2;
    int32_t remainder; /**< Q59 part of the last sum below Q31, [0, 2^28) */
} hyst_iir_section_state_t;

typedef struct {
    hyst_q31_t x1, x2; /**< past of the cascade's input */
    hyst_iir_section_state_t section[HYST_IIR_MAX_SECTIONS];
} hyst_iir_state_t;

/** Why a cascade is refused. Values are part of the Modbus interface: append only. */
typedef enum {
    HYST_IIR_OK = 0,
    HYST_IIR_TOO_MANY_SECTIONS = -1,
    HYST_IIR_COEFFICIENTS_TOO_LARGE = -2, /**< sum of magnitudes >= 15 */
    HYST_IIR_UNSTABLE = -3                /**< outside the triangle |a2| < 1, |a1| < 1 + a2 */
} hyst_iir_status_t;

/** Checks and copies. On refusal *iir is untouched and *element is the index of the section. */
hyst_iir_status_t hyst_iir_build(hyst_iir_t *iir, uint32_t sections, const hyst_iir_section_t section[],
                                 uint32_t *element);

/** All state zero. */
void hyst_iir_reset(hyst_iir_state_t *state);

/** The steady state for a constant input x (each section at its DC gain, saturated). */
void hyst_iir_settle(const hyst_iir_t *iir, hyst_iir_state_t *state, hyst_q31_t x);

/** hyst_iir_settle for x, then hyst_iir_step with the same x: the same integers, for little more than a step alone. */
hyst_q31_t hyst_iir_begin(const hyst_iir_t *iir, hyst_iir_state_t *state, hyst_q31_t x, bool *saturated);

/** hyst_iir_step of a cascade that has sections. x comes first: it is passed where the result is. */
hyst_q31_t hyst_iir_pass(hyst_q31_t x, const hyst_iir_t *iir, hyst_iir_state_t *state, bool *saturated);

/** One sample. *saturated is set when a section saturated, else left alone. */
static inline hyst_q31_t hyst_iir_step(const hyst_iir_t *iir, hyst_iir_state_t *state, hyst_q31_t x, bool *saturated) {
    return iir->sections > 0 ? hyst_iir_pass(x, iir, state, saturated) : x;
}

#endif
