/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The hysteretic part of the Bouc-Wen model in the explicit step that the amplifier takes (docs/MODELS.md, section 8):
 *
 *     h[k] = h[k-1] + du (1 - (gamma + beta sgn(du h[k-1])) |h[k-1]|^n),    du = u[k] - u[k-1]
 *
 * and no further than the limit (beta + gamma)^(-1/n), which the differential equation never passes. The step is
 * faithful to dh/du where |du| n (beta + gamma)^(1/n) is well below 1: where it is not, h arrives at the limit early.
 */
#ifndef BOUC_WEN_H
#define BOUC_WEN_H

typedef struct {
    double beta, gamma, exponent; /**< |gamma| <= beta, exponent >= 1 */
    double limit;                 /**< infinite for beta = gamma = 0 */
    double input, h;              /**< of the last sample */
} bouc_wen_t;

/** At rest at u = 0 with h = 0. */
void bouc_wen_open(bouc_wen_t *model, double beta, double gamma, double exponent);

/** h = 0 at u = 0, then a slow move to u. Returns h. */
double bouc_wen_settle(bouc_wen_t *model, double u);
/** One sample. Returns h. */
double bouc_wen_step(bouc_wen_t *model, double u);

#endif
