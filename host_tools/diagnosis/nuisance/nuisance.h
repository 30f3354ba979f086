/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The nuisance subspace: what a model's own numbers, and a hysteresis of another shape, can imitate, to first order.
 * docs/DIAGNOSIS.md.
 *
 *     offset of each recording; derivatives by the numbers of the model's hysteresis; what an unknown past left
 *     (past.h); of a drive that repeats one loop again and again, the harmonics; the drive and play operators behind
 *     the model's electronics; [their squares, cubes and products with the drive, and free functions of the drive on
 *     rising and falling branches: a hysteresis that is asymmetric or not congruent]; all through the model's slow,
 *     mechanical and sensor blocks
 */
#ifndef NUISANCE_H
#define NUISANCE_H

#include "diagnosis/nuisance/signals.h"

typedef struct {
    bool past;             /**< with what an unknown past left */
    bool plays;            /**< with the harmonics, the drive and the play operators */
    bool shapes;           /**< with the columns in brackets */
    bool trends;           /**< with half waves over each recording: for finding the noise's filter */
    const double *line_hz; /**< with a cosine and a sine at each of these, likewise */
    size_t lines;
} nuisance_options_t;

/** What a column stands for: the model's own numbers; play operators; a hysteresis of another shape; trends and lines.
 * They come in this order. */
typedef enum { NUISANCE_OWN, NUISANCE_PLAYS, NUISANCE_SHAPES, NUISANCE_TRENDS } nuisance_layer_t;

/** Given one column after the other (samples.h). */
typedef void nuisance_take_t(void *context, const double *column, nuisance_layer_t layer);

/** A number that can change in neither direction has a column of zeros. */
void nuisance(const signals_t *signals, const nuisance_options_t *options, nuisance_take_t *take, void *context);
/** Hz of a drive that does nothing but one loop again and again, 0 otherwise: then a rate-independent hysteresis can
 * imitate whatever repeats itself with it. */
double nuisance_loop_hz(const samples_t *samples);
/** No more columns than this. */
size_t nuisance_most(const signals_t *signals, const nuisance_options_t *options);

#endif
