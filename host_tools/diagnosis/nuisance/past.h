/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What is taken out of recordings before a model is judged by them, since it says nothing about the actuator.
 *
 * *What an unknown past left* in a recording that begins in the middle of it. A hysteresis that was driven beyond what
 * a recording reaches keeps, of each such drive, what the recording does not undo. It shows once: where the drive goes
 * further up, or down, than since the recording began. So it is a function of the highest and one of the lowest drive
 * until then, whatever the hysteresis; each is taken for a line between evenly spread nodes, and for 0 at the end of
 * the recording. Each recording has its past. Where the past does not matter (samples.h) there is none.
 *
 * *The zero* of each recording but the first, whose zero is the model's: a sensor is set to zero anew from day
 * to day.
 */
#ifndef PAST_H
#define PAST_H

#include "diagnosis/noise/noise.h"

/** Functions of the past that one recording may have. */
enum { PAST_COLUMNS = 18 };

/** Whether an unknown past can show in the samples of a recording that count. */
bool past_shows(const samples_t *samples, size_t recording);
/** One of these functions: a column, 0 in all other recordings, through none of a model's blocks. */
void past_column(const samples_t *samples, size_t recording, size_t index, double *column);
/** All of one recording: 1, and 0 in the others. */
void past_zero_column(const samples_t *samples, size_t recording, double *column);

/** Of one recording, which shares no sample with the others. */
typedef struct {
    size_t columns;
    size_t begin, fitted_begin, held_begin; /**< of its samples: in a column, and in the rows of either part */
    size_t all, fitted, held;               /**< how many */
    double *of_fitted, *of_held; /**< whitened, the samples of either part; orthonormal over those that are fitted */
    double *raw;                 /**< the same columns, not whitened */
} past_of_one_t;

/** What they explain of a whitened residual, as the samples that are fitted determine it. */
typedef struct {
    size_t count, columns; /**< recordings; columns of all together */
    past_of_one_t *of;
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
