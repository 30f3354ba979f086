/* SPDX-License-Identifier: GPL-3.0-or-later */
/* No physical effect: a linear filter behind the hysteresis, for a response that no effect of the catalogue has. */
#include "chain/catalogue.h"
#include "compile/compile_job.h"
#include "elements/second_order.h"

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    return compile_second_order(job, parameter, compile_shape);
}

static const probe_t fitted = {.explanation =
                                   "No known effect fits. This linear filter behind the hysteresis describes "
                                   "it, without a cause.",
                               .excitation = "a chirp over all frequencies, at two amplitudes",
                               .probe = second_order_probe,
                               .searched = (1U << SECOND_ORDER_PARAMETERS) - 1U,
                               .most = {0.0, 5.0}};

const block_t block_empirical_filter = {.name = "empirical_filter",
                                        .place = PLACE_MECHANICS,
                                        .order = 100,
                                        .text = "no physical effect: a linear filter behind the hysteresis",
                                        .smooths = true,
                                        .parameter = second_order_parameters,
                                        .parameters = SECOND_ORDER_PARAMETERS,
                                        .state_bytes = sizeof(second_order_stage_t),
                                        .open = second_order_stage_open,
                                        .settle = second_order_stage_settle,
                                        .step = second_order_stage_step,
                                        .compile = compile,
                                        .empirical = &fitted};
