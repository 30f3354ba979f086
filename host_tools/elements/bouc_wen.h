/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The hysteretic part of the Bouc-Wen model (docs/MODELS.md, section 8):
 *
 *     dh/du = 1 - (gamma + beta sgn(u' h)) |h|^n
 *
 * The equation is rate-independent: it depends on the path of the drive u, not on time. The path between samples is
 * integrated by a fourth-order method in steps that are small against the curvature, so that the sample rate does not
 * matter. |h|^n comes from a table of cubics.
 *
 * For gamma >= -0.8 beta the error is below 2e-5 of the largest h, and below 2e-6 for n from 2 to 6
 * (tests/host/test_bouc_wen.c). For smaller gamma, large n and large h, branches become too steep for these steps.
 */
#ifndef BOUC_WEN_H
#define BOUC_WEN_H

enum { BOUC_WEN_CELLS = 256 };

typedef struct {
    double beta, gamma, exponent; /**< |gamma| <= beta, exponent >= 1 */
    double bend;                  /**< largest curvature per unit of path */
    double input, h;              /**< of the last sample */
    double cells_per_h;           /**< the table ends above the limit of h, or at 4 */
    double power[BOUC_WEN_CELLS]
                [4]; /**< |h|^n in each cell: coefficients of a cubic in the position within the cell, 0 to 1 */
} bouc_wen_t;

/** At rest at u = 0 with h = 0. */
void bouc_wen_open(bouc_wen_t *model, double beta, double gamma, double exponent);

/** h = 0 at u = 0, then a move to u. Returns h. */
double bouc_wen_settle(bouc_wen_t *model, double u);
/** One sample. Returns h. */
double bouc_wen_step(bouc_wen_t *model, double u);

#endif
