/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * How the position settles where the drive rests: the decays and rings that all rests share, without a model.
 *
 * Linear systems settle as sums of z^k, with the same few z after each step. Windows of a rest are then noise beside
 * a space of few dimensions, and z is how that space goes on from one sample to the next (ESPRIT: Roy and Kailath, IEEE
 * Trans. ASSP 37, 1989). White noise lifts all dimensions alike. It is done with the samples, and with means over 4,
 * 16, .. of them for what is slower. z that do not decay within a rest (hum, a drift) do not count, nor do those whose
 * terms, fitted to each rest, explain no more than chance.
 */
#ifndef LOOK_SETTLING_H
#define LOOK_SETTLING_H

#include "look/signal/numbers.h"

enum { SETTLING_MOST = 8, SETTLING_COLUMNS = 2 * SETTLING_MOST };

/** exp(-decay k) cos and sin(turn k), k in samples; turn 0: an exponential alone. */
typedef struct {
    double decay, turn;
} settling_term_t;

typedef struct {
    size_t count;
    settling_term_t term[SETTLING_MOST];
} settling_t;

/** y in each span begins somewhere behind a step of the drive. */
void settling_find(const double *y, const look_span_t *span, size_t spans, settling_t *settling);

/** Columns of `count` samples each, `count` apart, of all terms, or of those that ring. Returns how many, at most
 * SETTLING_COLUMNS. */
typedef enum { SETTLING_ALL, SETTLING_RINGS } settling_pick_t;
size_t settling_columns(const settling_t *settling, settling_pick_t pick, size_t count, double *columns);

/** Takes a parabola and all terms out of `count` values that begin where a span began. What is left is raised by the
 * degrees of freedom that it has lost. */
void settling_take_out(const settling_t *settling, double *value, size_t count);

#endif
