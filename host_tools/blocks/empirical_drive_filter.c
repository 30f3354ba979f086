/* SPDX-License-Identifier: GPL-3.0-or-later */
/* No physical effect: a linear filter in front of the hysteresis, for a response that no effect of the catalogue has.
 */
#include "chain/catalogue.h"
#include "compile/compile_job.h"
#include "elements/second_order.h"

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    return compile_second_order(job, parameter, compile_equalise);
}

static const probe_t fitted = {.explanation =
                                   "No known effect fits. This linear filter in front of the hysteresis describes "
                                   "it, without a cause.",
                               .excitation = "measured voltage on the same clock; a chirp at two amplitudes",
                               .probe = second_order_probe,
                               .searched = (1U << SECOND_ORDER_PARAMETERS) - 1U,
                               .most = {0.0, 5.0}};

const block_t block_empirical_drive_filter = {.name = "empirical_drive_filter",
                                              .place = PLACE_ELECTRONICS,
                                              .order = 100,
                                              .text = "no physical effect: a linear filter in front of the hysteresis",
                                              .smooths = true,
                                              .parameter = second_order_parameters,
                                              .parameters = SECOND_ORDER_PARAMETERS,
                                              .state_bytes = sizeof(second_order_stage_t),
                                              .open = second_order_stage_open,
                                              .settle = second_order_stage_settle,
                                              .step = second_order_stage_step,
                                              .compile = compile,
                                              .empirical = &fitted};
