/* SPDX-License-Identifier: MIT */
/*
 * Instructions that the library's part of a sample takes on the emulated Cortex-M4: hyst_compensator_step in compensate
 * mode. cost.c measures the whole of it and says what an instruction is; two programs, because SRAM has no room for the
 * memories of both. A line: "step", the case (cost_case.h), worst, mean, and the same of samples that begin to
 * compensate, in which the filters settle.
 */
#include "console.h"
#include "cost_case.h"

#define SAMPLES 2000U

static void measure(cost_t *cost, cost_t *first, generator_t *generator, const hyst_compensator_t *compensator,
                    cost_history_t history) {
    static hyst_compensator_state_t state;
    cost_reference_t source = {.depth = 0};
    hyst_compensator_reset(compensator, &state);
    for (unsigned k = 0; k < SAMPLES; k++) {
        const hyst_q31_t reference = cost_reference(generator, &source, history, k);
        unsigned events = 0;
        const uint32_t before = cost_counter();
        (void)hyst_compensator_step(compensator, &state, HYST_MODE_COMPENSATE, reference, &events);
        cost_add(k == 0 ? first : cost, cost_counter() - before - cost_of_looking());
    }
}

int main(void) {
    static hyst_parameters_t p;
    static hyst_compensator_t compensator;
    generator_t generator = {.state = 1};
    for (unsigned i = 0; i < cost_case_count; i++) {
        cost_t cost = {0};
        cost_t first = {0};
        for (unsigned model = 0; model < COST_MODELS; model++) {
            cost_case_parameters(&generator, &p, &cost_cases[i], model);
            build(&p, &compensator);
            measure(&cost, &first, &generator, &compensator, cost_history(model));
        }
        console_write("step ");
        cost_print_case(&cost_cases[i]);
        cost_print(&cost);
        cost_print(&first);
        console_write("\n");
    }
    console_exit(0);
}
