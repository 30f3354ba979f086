/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What an unknown past may have left in a recording that begins in the middle of it.
 *
 * A hysteresis that was driven beyond what a recording reaches keeps, of each such drive, what the recording does not
 * undo. It shows once: where the drive goes further up, or down, than since the recording began. So it is a function of
 * the highest and one of the lowest drive until then, whatever the hysteresis; each is taken for a line between evenly
 * spread nodes, and for 0 at the end of the recording. Where the past does not matter (samples.h) there is none.
 */
#ifndef PAST_H
#define PAST_H

#include "diagnosis/noise/noise.h"

enum { PAST_COLUMNS = 18 };

/** One of these functions: a column, through none of a model's blocks. */
void past_column(const samples_t *samples, size_t index, double *column);

/** What they explain of a whitened residual, as the samples that are fitted determine it. */
typedef struct {
    size_t columns, all, fitted, held;
    double *of_fitted, *of_held; /**< whitened, the samples of either part; orthonormal over those that are fitted */
    double *raw;                 /**< the same columns, not whitened */
} past_t;

void past_open(past_t *past, const samples_t *samples, const noise_t *noise);
void past_close(past_t *past);
/** Takes it out of rows of both parts (samples_pick), whitened. held may be NULL. */
void past_take_out(const past_t *past, double *fitted, double *held);
/** A model's simulation, a column, with what explains most of the residual that it leaves added to it: what is left
 * then is what the model is judged by. */
bool past_simulate(const samples_t *samples, const noise_t *noise, const model_t *model, double *column,
                   failure_t *failure);

#endif
