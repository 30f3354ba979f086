/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * First-order low pass, dy/dt = 2 pi cutoff_hz (u - y), discretised with a first-order hold (u linear between samples).
 * A zero-order hold would be half a sample late, which misreads a cutoff at a 25th of the sample rate by 9 %.
 */
#ifndef FIRST_ORDER_LAG_H
#define FIRST_ORDER_LAG_H

#include "block.h"

/** The one parameter of such a block, cutoff_hz. */
extern const parameter_info_t first_order_lag_parameters[1];

typedef struct {
    double input, output;
    double decay, present, past; /**< y[k] = decay y[k-1] + present u[k] + past u[k-1] */
} first_order_lag_t;

/** Sets the coefficients. */
void first_order_lag_set(first_order_lag_t *lag, double cutoff_hz, double sample_rate_hz);

/* The functions of a block whose state this is. */
void first_order_lag_open(void *memory, const parameter_t *parameter, const stage_setup_t *setup);
void first_order_lag_settle(void *memory, signal_t *signal);
void first_order_lag_step(void *memory, signal_t *signal);

#endif
