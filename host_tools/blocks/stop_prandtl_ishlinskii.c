/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The inverse of a weighted sum of stop operators of the position: the position x at which
 *
 *     offset_v + k x + sum w_i stop_i[x] = drive
 *
 * Solved exactly at every sample. docs/MODELS.md, section 11.
 */
#include "chain/catalogue.h"
#include "compile/compile_stop_bank.h"
#include "elements/stop_bank.h"

static const parameter_info_t parameters[] = {STOP_PARAMETER_TABLE};

typedef struct {
    stop_spring_t spring;
    double array[];
} state_t;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    (void)setup;
    stop_spring_open(&state->spring, state->array, parameter);
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    signal->value = stop_spring_settle(&state->spring, signal->value);
}

static void step(void *memory, signal_t *signal) {
    stop_spring_t *spring = &((state_t *)memory)->spring;
    const double x = stop_bank_solve(&spring->bank, spring->memory, 0.0, signal->value - spring->offset_v);
    stop_bank_advance(&spring->bank, spring->memory, x);
    signal->value = x;
}

const block_t block_stop_prandtl_ishlinskii = {.name = "stop_prandtl_ishlinskii",
                                               .place = PLACE_HYSTERESIS,
                                               .order = 60,
                                               .text =
                                                   "hysteresis whose drive is a weighted sum of stops of the position",
                                               .parameter = parameters,
                                               .parameters = STOP_PARAMETERS,
                                               .check = stop_bank_check,
                                               .state_bytes = sizeof(state_t),
                                               .further_bytes = stop_spring_bytes,
                                               .open = open,
                                               .settle = settle,
                                               .step = step,
                                               .compile = stop_bank_compile};
