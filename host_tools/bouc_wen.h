/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The hysteretic part of the Bouc-Wen model (docs/MODELS.md, section 8):
 *
 *     dh/du = 1 - (gamma + beta sgn(u' h)) |h|^n
 *
 * The equation knows no time, only the way that the drive u has gone. A sample's way is integrated in steps that are
 * short against the curve (Runge and Kutta's fourth order), so that the sample rate does not matter.
 */
#ifndef BOUC_WEN_H
#define BOUC_WEN_H

typedef struct {
    double beta, gamma, exponent; /**< |gamma| <= beta, exponent >= 1 */
    double bend;                  /**< how much the curve bends, at most, in a way of 1 */
    double input, h;              /**< of the last sample */
} bouc_wen_t;

/** At rest at u = 0 with h = 0. */
void bouc_wen_open(bouc_wen_t *model, double beta, double gamma, double exponent);

/** h = 0 at u = 0, then a move to u. Returns h. */
double bouc_wen_settle(bouc_wen_t *model, double u);
/** One sample. Returns h. */
double bouc_wen_step(bouc_wen_t *model, double u);

#endif
