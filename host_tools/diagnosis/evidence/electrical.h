/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What the voltage and the current that were measured beside the position say of the chain's electronics.
 *
 * Position alone hardly tells a lag before the hysteresis from one behind it. The voltage at the actuator is the
 * chain's signal between the two: what the electronics do is in it, what comes later is not. The current is its
 * derivative, with the capacitance for a factor:
 *
 *     voltage = offset + gain v,    current = offset + (C + C' v) dv/dt + G v + S (second difference of v)
 *
 * v: the drive behind the model's electronics; one offset a recording. The factors are fitted, so a monitor output of
 * another scale will do; one that lags only if its lag is well below that in question. The voltage has
 * to be sampled together with the position. When within a sample the current was is not known: S allows for half of
 * one either way, and so the current says nothing of a lag that is as short. The chain's pure delay may be before the
 * point where they are measured or behind it, and is taken to be where that fits better.
 */
#ifndef ELECTRICAL_H
#define ELECTRICAL_H

#include "diagnosis/noise/samples.h"

/** Whether any of the recordings has the column. */
bool column_measured(const samples_t *samples, column_t column);

/** How much of the change that one chain's electronics make to the other's is in a measured column. */
typedef struct {
    bool measured;      /**< false: there is no such column, or the chains do not differ in it */
    double part, sigma; /**< 1: all of the change, 0: none; standard error (regression.h) */
} electrical_change_t;

/** column: COLUMN_VOLTAGE or COLUMN_CURRENT. Over all included samples. */
electrical_change_t electrical_change(const samples_t *samples, column_t column, const model_t *without,
                                      const model_t *with);

/** Standard error below which a share of a predicted change means nothing: the prediction is not better than that. */
extern const double electrical_least_sigma;

/** By three standard errors. */
typedef enum {
    CHANGE_NOT_SEEN, /**< not measured */
    CHANGE_UNDECIDED,
    CHANGE_PRESENT,  /**< more than half of it */
    CHANGE_ABSENT,   /**< less than half */
    CHANGE_TOO_LARGE /**< more than 1.5 of it: the measurement itself lags, because the position lags at least
                        as much as the voltage. It decides nothing. */
} change_verdict_t;
change_verdict_t electrical_verdict(const electrical_change_t *change);

/**
 * 2 log likelihood by which both columns prefer the electronics of `with` to those of `without`; negative when they
 * contradict them, 0 when there is neither column or the electronics are the same.
 */
double electrical_preference(const samples_t *samples, const model_t *without, const model_t *with);
/** The same for one block in which the two differ: 0 outside of the electronics. A pure delay is not contradicted: the
 * chain with a delay behind the voltage is the same one. */
double electrical_likelihood(const samples_t *samples, const model_t *without, const model_t *with,
                             const block_t *block);

/** What the model's electronics leave of a measured column: its square. For finding their numbers. */
double electrical_left(const samples_t *samples, column_t column, const model_t *model);

/** The measured voltage less offset and over gain, on the scale of the simulated one, and behind the model's pure
 * delay if that is behind it; the simulated one in recordings without. A column. */
void electrical_measured_voltage(const samples_t *samples, const model_t *model, double *voltage);
/** The measured current less what the equation explains of it, in A; 0 in excluded samples and in
 * recordings without. A column. */
void electrical_unexplained_current(const samples_t *samples, const model_t *model, double *current);

/** Whether a change that is present is clearly less than all of it. */
bool electrical_only_part(const electrical_change_t *change);

#endif
