/* SPDX-License-Identifier: MIT */
/*
 * Instructions that the h405's sample interrupt takes on the emulated Cortex-M4, from entry to exit, in compensate
 * mode, with source, telemetry and capture, without the wait for the conversion (cost_board.c). Under `-icount shift=0`
 * QEMU's virtual time advances one nanosecond an instruction, and its TIM5 counts nanoseconds. Instructions are not
 * cycles: a Cortex-M4 takes more than one for loads, taken branches and divisions, and waits for flash. docs/TIMING.md
 * says what to make of the numbers, cost_step.c measures the library's part.
 *
 * Lines: "sample", the case (cost_case.h), worst and mean with a sine, worst and mean with breakpoints, worst and mean
 * of the samples that adopt; "adoption", what, samples that share it, worst of them; "source", which, worst and mean;
 * "signals", three or all that are captured, the case, worst and mean.
 */
#include "amplifier.h"
#include "console.h"
#include "cost_adoption.h"
#include "cost_loop.h"
#include "loop/capture.h"

/* cost_profile.elf and cost_profile_empty.elf are one line alone, for `profile`. */
#ifndef FIRST_CASE
#define FIRST_CASE 0
#define LAST_CASE  cost_case_count
#define ADOPTIONS  cost_adoptions
#endif

static hyst_parameters_t p; /* one for all: RAM is short */

static void measure(const cost_case_t *line, generator_t *generator) {
    static hyst_q31_t steps[128];
    cost_t sine = {0};
    cost_t breakpoints = {0};
    cost_t adopting = {0};
    for (unsigned model = 0; model < COST_MODELS; model++) {
        cost_reference_t reference = {.depth = 0};
        cost_case_parameters(generator, &p, line, model);
        for (unsigned i = 0; i < 128; i++) {
            steps[i] = cost_reference(generator, &reference, cost_history(model), 2U * i + (i & 1U));
        }
        cost_measure_loop(&sine, &adopting, &p, COST_SINE, steps);
        cost_measure_loop(&breakpoints, &adopting, &p, COST_STEPS, steps);
    }
    console_write("sample ");
    cost_print_case(line);
    cost_print(&sine);
    cost_print(&breakpoints);
    cost_print(&adopting);
    console_write("\n");
}

static void measure_source(const char *name, source_kind_t source, uint16_t signals) {
    cost_t cost = {0};
    cost_measure_source(&cost, source, signals);
    console_write("source ");
    console_write(name);
    cost_print(&cost);
    console_write("\n");
}

/* What sources take beside each other, with the first line's model, which has least of its own; and what all signals
 * of the capture take beside three, with each family, as one of them is its output. */
static void measure_sources(generator_t *generator) {
    cost_t adopting = {0};
    for (unsigned i = 0; i < cost_case_count; i++) {
        if (i > 0 && (cost_cases[i].cells == 0 || !cost_cases[i].extras)) {
            continue;
        }
        cost_case_parameters(generator, &p, &cost_cases[i], 0);
        (void)cost_adopt(&adopting, &p, NULL);
        for (unsigned all = 0; all < 2; all++) {
            cost_t cost = {0};
            cost_measure_source(&cost, SOURCE_SINE, all != 0 ? CAPTURE_ALL : CAPTURE_DEFAULT_SIGNALS);
            console_write(all != 0 ? "signals all " : "signals three ");
            cost_print_case(&cost_cases[i]);
            cost_print(&cost);
            console_write("\n");
        }
        if (i == 0) {
            measure_source("sweep", SOURCE_SWEEP, CAPTURE_DEFAULT_SIGNALS);
            measure_source("multisine", SOURCE_MULTISINE, CAPTURE_DEFAULT_SIGNALS);
        }
    }
}

int main(void) {
    generator_t generator = {.state = 1};
    const board_start_t start = {0};
    cost_board_init();
    amplifier_init(&start);
    cost_unlock();
    for (unsigned i = FIRST_CASE; i < LAST_CASE; i++) {
        measure(&cost_cases[i], &generator);
    }
    for (unsigned i = 0; i != ADOPTIONS; i++) {
        cost_t cost = {0};
        const uint32_t samples = cost_measure_adoption(&cost, &generator, &p, i);
        console_write("adoption ");
        console_write(cost_adoption_name(i));
        cost_print_number(samples);
        cost_print_number(cost.worst);
        console_write("\n");
    }
    if (ADOPTIONS != 0) {
        measure_sources(&generator);
    }
    console_exit(0);
}
