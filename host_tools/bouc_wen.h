/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The hysteretic part of the Bouc-Wen model (docs/MODELS.md, section 8):
 *
 *     dh/du = 1 - (gamma + beta sgn(u' h)) |h|^n
 *
 * The equation knows no time, only the way that the drive u has gone. A sample's way is integrated in steps that are
 * short against the curve (fourth order), so that the sample rate does not matter; |h|^n comes from a table of cubics.
 * For gamma >= -0.8 beta that is right to 2e-5 of the largest h, and to 2e-6 for n from 2 to 6
 * (tests/host/test_bouc_wen.c); below, where n is large and h as well, a branch becomes steeper than the steps are
 * short.
 */
#ifndef BOUC_WEN_H
#define BOUC_WEN_H

enum { BOUC_WEN_CELLS = 256 };

typedef struct {
    double beta, gamma, exponent;    /**< |gamma| <= beta, exponent >= 1 */
    double bend;                     /**< how much the curve bends, at most, in a way of 1 */
    double input, h;                 /**< of the last sample */
    double cells_per_h;              /**< the table ends above the limit of h, or at 4 */
    double power[BOUC_WEN_CELLS][4]; /**< |h|^n in each cell: coefficients of the part of the cell that is passed */
} bouc_wen_t;

/** At rest at u = 0 with h = 0. */
void bouc_wen_open(bouc_wen_t *model, double beta, double gamma, double exponent);

/** h = 0 at u = 0, then a move to u. Returns h. */
double bouc_wen_settle(bouc_wen_t *model, double u);
/** One sample. Returns h. */
double bouc_wen_step(bouc_wen_t *model, double u);

#endif
