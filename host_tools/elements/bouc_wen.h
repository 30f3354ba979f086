/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The hysteretic part of the Bouc-Wen model (docs/MODELS.md, section 8):
 *
 *     dh/du = 1 - (gamma + beta sgn(u' h)) |h|^n
 *
 * The equation is rate-independent: it depends on the path of the drive u, not on time. While the drive goes one way, h
 * depends on the way alone, and every such branch is a piece of one curve. So the curve is integrated once, and a move
 * of any length is a look into it: neither the sample rate nor how steep the branches are matters.
 *
 * The error is below 1e-6 of the largest h, or of its limit (tests/host/test_bouc_wen.c).
 */
#ifndef BOUC_WEN_H
#define BOUC_WEN_H

#include <stddef.h>

enum { BOUC_WEN_CELLS = 1024, BOUC_WEN_NODES = BOUC_WEN_CELLS + 1 };

typedef struct {
    double beta, gamma, exponent; /**< |gamma| <= beta, exponent >= 1 */
    double input, h;              /**< of the last sample */
    double limit;                 /**< of |h|; infinite for gamma = -beta */
    /** The curve at evenly spaced values of h in the drive's direction, from -reach to reach: the way from its
     * beginning, and dh/du. Its end is the limit, if that is not far beyond; else it grows when h comes there. */
    double reach, way[BOUC_WEN_NODES], slope[BOUC_WEN_NODES];
    double direction, gone; /**< of the present branch: 1, -1, or 0 before the first move; way from the beginning */
    size_t cell;            /**< in which that is */
} bouc_wen_t;

/** At rest at u = 0 with h = 0. */
void bouc_wen_open(bouc_wen_t *model, double beta, double gamma, double exponent);

/** At rest at u = 0 with this h. */
void bouc_wen_put(bouc_wen_t *model, double h);
/** h = 0 at u = 0, then a move to u. Returns h. */
double bouc_wen_settle(bouc_wen_t *model, double u);
/** One sample. Returns h. */
double bouc_wen_step(bouc_wen_t *model, double u);

#endif
