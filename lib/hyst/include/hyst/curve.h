/* SPDX-License-Identifier: MIT */
/**
 * A static curve that rises: piecewise linear between 33 equidistant nodes over the whole range of a signal.
 *
 *     node i stands at x = -1 + i / 16, i = 0..32, and holds the value there
 *
 * Use: what is curved but has no memory. In front of the hysteresis the curve from drive to effective drive
 * (asymmetry). The compensator needs both directions of it: hyst_curve_solve to undo it, hyst_curve_apply to keep a
 * memory in step with what was really applied. Both read one table, so apply after solve is the identity up to the
 * rounding of x (half a unit, times the slope) and of the result (half a unit); tests/unit/test_curve.c. At the other
 * end the curve from a sensor's reading to the position (the inverse of the sensor's), which is only applied.
 *
 * A smooth curve is met to h^2 / 8 times its curvature between nodes, h = 1/16: a quadratic part of 1 % of the half
 * range (y = x + 0.01 x^2) to 1e-5.
 *
 * Formats: x and nodes Q31. The last node belongs to x = 1, one unit beyond the format, so it is never quite reached.
 * May be called from: interrupt, main loop, host (hyst_curve_build: not per sample). Reentrant, no state. apply: one
 * product; solve: 5 probes and one division.
 */
#ifndef HYST_CURVE_H
#define HYST_CURVE_H

#include "hyst/fixed.h"
#include <stdbool.h>

#define HYST_CURVE_INTERVALS 32
#define HYST_CURVE_NODES     (HYST_CURVE_INTERVALS + 1)

/** Smallest rise from one node to the next: a slope of 2^-8. */
#define HYST_CURVE_MIN_RISE ((hyst_q31_t)1 << 19)

/** Written by hyst_curve_build only; constant afterwards. */
typedef struct {
    hyst_q31_t node[HYST_CURVE_NODES];
} hyst_curve_t;

/** What hyst_curve_solve_by divides with. Written by hyst_curve_invert only. */
typedef struct {
    uint32_t reciprocal[HYST_CURVE_INTERVALS]; /**< of node[i + 1] - node[i], see reciprocal.h */
} hyst_curve_inverse_t;

/** Why a curve is refused. Values are part of the Modbus interface: append only. */
typedef enum {
    HYST_CURVE_OK = 0,
    HYST_CURVE_NOT_RISING = -1 /**< node i is less than HYST_CURVE_MIN_RISE above node i-1: not invertible */
} hyst_curve_status_t;

/** Checks and copies. On refusal *curve is untouched and *element is the index of the offending node. */
hyst_curve_status_t hyst_curve_build(hyst_curve_t *curve, const hyst_q31_t node[HYST_CURVE_NODES], uint32_t *element);

/** The straight line y = x, up to one unit at its upper end. */
void hyst_curve_identity(hyst_curve_t *curve);

/** Value of the curve at x. Cannot saturate: it lies between two nodes. */
hyst_q31_t hyst_curve_apply(const hyst_curve_t *curve, hyst_q31_t x);

/**
 * The x at which the curve has the value y, rounded to nearest. Where y lies outside the curve, the nearer end of the
 * range is returned and *saturated is set (else it is left alone).
 */
hyst_q31_t hyst_curve_solve(const hyst_curve_t *curve, hyst_q31_t y, bool *saturated);

/** Reciprocals of a curve that hyst_curve_build accepted. Not per sample. */
void hyst_curve_invert(const hyst_curve_t *curve, hyst_curve_inverse_t *inverse);

/** As hyst_curve_solve, in a third of its instructions. */
hyst_q31_t hyst_curve_solve_by(const hyst_curve_t *curve, const hyst_curve_inverse_t *inverse, hyst_q31_t y,
                               bool *saturated);

#endif
