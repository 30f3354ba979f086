/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * First-order low pass, dy/dt = 2 pi cutoff_hz (u - y), exact for the interpolated input: a cubic through four samples,
 * or a straight line (smooth_drive.h).
 *
 * A zero-order hold would delay the input by half a sample, which biases a cutoff at a 25th of the sample rate by 9 %.
 * With lines alone, a lag much shorter than a sample would depend on the slope half a sample earlier, and resemble
 * another kind of lag.
 */
#ifndef FIRST_ORDER_LAG_H
#define FIRST_ORDER_LAG_H

#include "chain/smooth_drive.h"

/** The only parameter of such a block, cutoff_hz. */
extern const parameter_info_t first_order_lag_parameters[1];

typedef struct {
    double output;
    double decays; /**< decay rate times sample time */
    double decay;  /**< y[k] = decay y[k-1] + sum of weight_i u[k-i] */
    double cubic[4], line[2];
    bool held;      /**< the input is (stage_setup_t.held): then only these count */
    double hold[2]; /**< of this sample's input and of the last one's */
} first_order_lag_t;

/** Sets the coefficients. steps: above 1, the input goes from sample to sample in so many (stage_setup_t.steps). */
void first_order_lag_set(first_order_lag_t *lag, double cutoff_hz, double sample_rate_hz, size_t steps);
/** The same for an input that is held, since part of a sample. */
void first_order_lag_hold(first_order_lag_t *lag, double held_since);
/** One sample: returns the output. */
double first_order_lag_next(first_order_lag_t *lag, const drive_window_t *drive);

/** State and functions of a block that is a first-order lag. */
typedef struct {
    drive_window_t drive;
    first_order_lag_t lag;
} first_order_stage_t;

void first_order_stage_open(void *memory, const parameter_t *parameter, const stage_setup_t *setup);
void first_order_stage_settle(void *memory, signal_t *signal);
void first_order_stage_step(void *memory, signal_t *signal);

/** The value at which output and input crossed in the last step, the input being linear between samples: there the
 * output reversed. Returns `last`, the output before the step, if they did not cross. */
double first_order_stage_turn(const first_order_stage_t *stage, double last);

#endif
