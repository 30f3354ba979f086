/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * First-order low pass, dy/dt = 2 pi cutoff_hz (u - y), exact for what u does between samples: the cubic through the
 * four samples about it, or a straight line (smooth_drive.h). A zero-order hold would be half a sample late, which
 * misreads a cutoff at a 25th of the sample rate by 9 %; and with lines alone a lag that is short against a sample
 * would be that of the slope half a sample ago, and look like another kind of lag.
 */
#ifndef FIRST_ORDER_LAG_H
#define FIRST_ORDER_LAG_H

#include "smooth_drive.h"

/** The one parameter of such a block, cutoff_hz. */
extern const parameter_info_t first_order_lag_parameters[1];

typedef struct {
    double output;
    double decays; /**< decay rate times sample time */
    double decay;  /**< y[k] = decay y[k-1] + sum of weight_i u[k-i] */
    double cubic[4], line[2];
} first_order_lag_t;

/** Sets the coefficients. */
void first_order_lag_set(first_order_lag_t *lag, double cutoff_hz, double sample_rate_hz);
/** One sample: returns the output. */
double first_order_lag_next(first_order_lag_t *lag, const drive_window_t *drive);

/** The state of a block that is such a lag, and its functions. */
typedef struct {
    drive_window_t drive;
    first_order_lag_t lag;
} first_order_stage_t;

void first_order_stage_open(void *memory, const parameter_t *parameter, const stage_setup_t *setup);
void first_order_stage_settle(void *memory, signal_t *signal);
void first_order_stage_step(void *memory, signal_t *signal);

/** Where output and input met in the last step, the input a straight line from sample to sample: there the output
 * turned. `last`, the output before the step, if they did not. */
double first_order_stage_turn(const first_order_stage_t *stage, double last);

#endif
