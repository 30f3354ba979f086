/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A simulation of all recordings with the signals between its stages, so that a model that differs in one block is not
 * simulated from the beginning.
 */
#ifndef SIGNALS_H
#define SIGNALS_H

#include "diagnosis/noise/samples.h"
#include "diagnosis/nuisance/hysteresis_numbers.h"

typedef struct {
    const samples_t *samples;
    const model_t *model;
    size_t stages;
    signal_t **before; /**< [stage]: chain_run's signal, recordings one after the other */
    double *simulated; /**< position, a column */
    double **output;   /**< signals_differentiate; [number]: a column, or NULL where it says nothing of a number */
    size_t outputs;
} signals_t;

/** Both must outlive it, and the model must stay as it is. */
bool signals_open(signals_t *signals, const samples_t *samples, const model_t *model, failure_t *failure);
void signals_close(signals_t *signals);

/** Index in chain_order of the model's hysteresis. */
size_t hysteresis_stage(const model_t *model);
/** Index in chain_order of a block of the model. */
size_t stage_of(const model_t *model, size_t block);

/**
 * Simulates a model that is like the one of the signals before the stage (chain_order) at which it differs: a column.
 * False if it cannot be simulated or is not finite.
 */
bool signals_altered(const signals_t *signals, const model_t *altered, size_t stage, double *position);

/**
 * Derivatives of what the hysteresis puts out, by those of the numbers in which it is linear: all of them in one
 * simulation. signals_derivative is faster then. To be freed by signals_forget.
 */
void signals_differentiate(signals_t *signals, const hysteresis_numbers_t *numbers);
void signals_forget(signals_t *signals);

/**
 * Derivative of the position by one of the numbers of the signals' model, a column. At the end of what the shape allows
 * the step goes the other way; false, and undefined, if it has no such model either.
 */
bool signals_derivative(const signals_t *signals, const hysteresis_numbers_t *numbers, size_t number, double *column);

#endif
