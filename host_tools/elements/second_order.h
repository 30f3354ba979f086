/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A linear filter of second order with gain 1 at rest, stable whatever its numbers are:
 *
 *     H(p) = 1 + (first p + second p^2) / (1 + 2 damping p + p^2),     p = s / (2 pi frequency)
 *
 * By the bilinear transform, exact at `frequency` up to a quarter of the sample rate. At another sample rate it is the
 * same filter only well below both rates.
 */
#ifndef SECOND_ORDER_H
#define SECOND_ORDER_H

#include "chain/block.h"

/** The parameters of such a block. */
enum { SECOND_ORDER_FREQUENCY, SECOND_ORDER_DAMPING, SECOND_ORDER_FIRST, SECOND_ORDER_SECOND, SECOND_ORDER_PARAMETERS };
extern const parameter_info_t second_order_parameters[SECOND_ORDER_PARAMETERS];

typedef struct {
    double b0, b1, b2, a1, a2; /**< y[k] = b0 x[k] + b1 x[k-1] + b2 x[k-2] - a1 y[k-1] - a2 y[k-2] */
    double delay_s;            /**< at low frequencies; negative: it leads */
    bool invertible;           /**< its inverse is stable, too */
} second_order_t;

/** From a block's parameters. */
second_order_t second_order_make(const parameter_t *parameter, double sample_rate_hz);

/** State and functions of a block that is such a filter. */
typedef struct {
    second_order_t filter;
    double kept[2];
} second_order_stage_t;

void second_order_stage_open(void *memory, const parameter_t *parameter, const stage_setup_t *setup);
void second_order_stage_settle(void *memory, signal_t *signal);
void second_order_stage_step(void *memory, signal_t *signal);

/** Starting points of a search: one after the other (probe.h). */
bool second_order_probe(const probe_setting_t *setting, size_t index, double *value);

#endif
