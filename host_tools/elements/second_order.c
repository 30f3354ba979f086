/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/second_order.h"
#include <gsl/gsl_math.h>

const parameter_info_t second_order_parameters[SECOND_ORDER_PARAMETERS] = {
    {.name = "frequency_hz", .unit = "Hz", .low = 1e-3, .high = 1e9, .text = "of the denominator"},
    {.name = "damping_ratio", .unit = "1", .low = 1e-3, .high = 100.0, .text = "of the denominator"},
    {.name = "numerator_1",
     .proportional = true,
     .unit = "1",
     .low = -1e3,
     .high = 1e3,
     .text = "numerator less denominator, of s / (2 pi frequency)"},
    {.name = "numerator_2",
     .proportional = true,
     .unit = "1",
     .low = -1e3,
     .high = 1e3,
     .text = "numerator less denominator, of its square"}};

/* Of the sample rate: up to there the transform is exact at the filter's own frequency. */
static const double highest_exact = 0.25;

second_order_t second_order_make(const parameter_t *parameter, double sample_rate_hz) {
    const double hz = parameter[SECOND_ORDER_FREQUENCY].value[0], exact_hz = fmin(hz, highest_exact * sample_rate_hz);
    const double d1 = 2.0 * parameter[SECOND_ORDER_DAMPING].value[0];
    const double n1 = d1 + parameter[SECOND_ORDER_FIRST].value[0], n2 = 1.0 + parameter[SECOND_ORDER_SECOND].value[0];
    const double k = exact_hz / hz / tan(M_PI * exact_hz / sample_rate_hz),
                 k2 = k * k; /* p = k (1 - 1/z) / (1 + 1/z) */
    const double a0 = 1.0 + d1 * k + k2;
    return (second_order_t){.b0 = (1.0 + n1 * k + n2 * k2) / a0,
                            .b1 = 2.0 * (1.0 - n2 * k2) / a0,
                            .b2 = (1.0 - n1 * k + n2 * k2) / a0,
                            .a1 = 2.0 * (1.0 - k2) / a0,
                            .a2 = (1.0 - d1 * k + k2) / a0,
                            .delay_s = (d1 - n1) / (2.0 * M_PI * hz),
                            .invertible = n1 > 0.0 && n2 > 0.0};
}

void second_order_stage_open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    ((second_order_stage_t *)memory)->filter = second_order_make(parameter, setup->sample_rate_hz);
}

void second_order_stage_settle(void *memory, signal_t *signal) {
    second_order_stage_t *stage = memory;
    const second_order_t *f = &stage->filter;
    stage->kept[1] = (f->b2 - f->a2) * signal->value;
    stage->kept[0] = (f->b1 - f->a1) * signal->value + stage->kept[1];
}

void second_order_stage_step(void *memory, signal_t *signal) {
    second_order_stage_t *stage = memory;
    const second_order_t *f = &stage->filter;
    const double x = signal->value, y = f->b0 * x + stage->kept[0];
    stage->kept[0] = f->b1 * x - f->a1 * y + stage->kept[1];
    stage->kept[1] = f->b2 * x - f->a2 * y;
    signal->value = y;
    signal->turned = false; /* where the input turned between samples the output did not */
}

bool second_order_probe(const probe_setting_t *setting, size_t index, double *value) {
    enum { FREQUENCIES = 12, FORMS = 4 };
    const size_t form = index % FORMS;
    value[SECOND_ORDER_DAMPING] = form < 2 ? 0.1 : 0.7;
    value[SECOND_ORDER_FIRST] = form % 2 == 0 ? 0.01 : 0.0;
    value[SECOND_ORDER_SECOND] = form % 2 == 0 ? 0.0 : 0.01;
    return probe_between(setting->sample_rate_hz / 3.0, 3.0 / setting->longest_s, FREQUENCIES, index / FORMS,
                         &value[SECOND_ORDER_FREQUENCY]);
}
