/* SPDX-License-Identifier: MIT */
/*
 * Instructions that a sample takes on the emulated Cortex-M4, in compensate mode: the library's part
 * (hyst_compensator_step) and the whole of it (loop_sample, with source, telemetry and capture). Under `-icount
 * shift=0` QEMU's virtual time advances one nanosecond an instruction, and its TIM5 counts nanoseconds. Instructions
 * are not cycles: a Cortex-M4 takes more than one for loads, taken branches and divisions, and waits for flash.
 * docs/TIMING.md says what to make of the numbers.
 */
#include "amplifier.h"
#include "conformance.h"
#include "console.h"
#include "cost_adoption.h"
#include "cost_loop.h"
#include "stm32f405.h"

#define MODELS  16U
#define SAMPLES 1000U

uint32_t cost_counter(void) {
    return TIM5->CNT;
}

uint32_t cost_of_looking(void) {
    const uint32_t before = cost_counter();
    return cost_counter() - before;
}

void cost_add(cost_t *cost, uint32_t taken) {
    cost->worst = taken > cost->worst ? taken : cost->worst;
    cost->sum += taken;
    cost->calls++;
}

/* Ever smaller reversals stack up as many runs of operators as there can be; then a few samples that go anywhere. They
 * begin at a quarter of the range, which every model reaches: a drive at its limit forgets them. */
static hyst_q31_t nested_reversals(generator_t *generator, unsigned k) {
    const unsigned phase = k % 320U;
    if (phase >= 300U) {
        return generate_signed(generator);
    }
    const hyst_q31_t amplitude = HYST_Q31_MAX / 1200 * (hyst_q31_t)(300U - phase);
    return (k & 1U) != 0 ? amplitude : -amplitude;
}

static void measure(cost_t *cost, generator_t *generator, const hyst_compensator_t *compensator, bool nested) {
    static hyst_compensator_state_t state;
    excitation_t excitation = {0};
    hyst_compensator_reset(compensator, &state);
    for (unsigned k = 0; k < SAMPLES; k++) {
        const hyst_q31_t reference = nested ? nested_reversals(generator, k) : generate_signal(generator, &excitation);
        unsigned events = 0;
        const uint32_t before = cost_counter();
        (void)hyst_compensator_step(compensator, &state, HYST_MODE_COMPENSATE, reference, &events);
        cost_add(cost, cost_counter() - before - cost_of_looking());
    }
}

static void print_number(uint32_t number) {
    char text[12];
    unsigned at = sizeof text;
    text[--at] = '\0';
    unsigned digits = 0;
    do {
        text[--at] = (char)('0' + number % 10U);
        number /= 10U;
        digits++;
    } while (number > 0);
    while (digits++ < 10U) {
        text[--at] = ' ';
    }
    console_write(&text[at]);
}

static void print_cost(const cost_t *cost) {
    print_number(cost->worst);
    print_number((uint32_t)(cost->sum / cost->calls));
}

/* 0.1 s to 1000 s, two a decade: what hyst compile makes of a block creep. */
#define COMPILED_CELLS 9U

static hyst_parameters_t p; /* one for all: RAM is short */

static void measure_models(uint32_t size, cost_kind_t kind, uint32_t sections, uint32_t cells, generator_t *generator) {
    static hyst_compensator_t compensator;
    static hyst_q31_t steps[128];
    cost_t step = {0};
    cost_t loop_sine = {0};
    cost_t loop_steps = {0};
    cost_t loop_adopting = {0};
    for (unsigned model = 0; model < MODELS; model++) {
        const bool nested = (model & 1U) != 0;
        generate_parameters(generator, &p);
        cost_generate(generator, &p, kind, size);
        p.shape_sections = sections / 2U;
        p.equalise_sections = sections / 2U;
        p.creep_cells = cells;
        build(&p, &compensator);
        measure(&step, generator, &compensator, nested);
        for (unsigned i = 0; i < 128; i++) {
            steps[i] = nested ? nested_reversals(generator, 2U * i + (i & 1U)) : generate_signed(generator);
        }
        cost_measure_loop(&loop_sine, &loop_adopting, &p, COST_SINE, steps);
        cost_measure_loop(&loop_steps, &loop_adopting, &p, COST_STEPS, steps);
    }
    static const char *const names[] = {"     fixed", "      rate", "  preisach", "  bouc-wen", "  modified"};
    print_number(size);
    console_write(names[kind]);
    print_number(sections);
    print_number(cells);
    print_cost(&step);
    print_cost(&loop_sine);
    print_cost(&loop_steps);
    print_cost(&loop_adopting);
    console_write("\n");
}

static void measure_adoptions(generator_t *generator) {
    console_write("\nadoption                                           samples     worst\n");
    for (unsigned i = 0; i < cost_adoptions; i++) {
        cost_t cost = {0};
        const uint32_t samples = cost_measure_adoption(&cost, generator, &p, i);
        console_write(cost_adoption_name(i));
        print_number(samples);
        print_number(cost.worst);
        console_write("\n");
    }
}

int main(void) {
    static const uint32_t operators[] = {0, 10, 16, 64, HYST_PI_MAX_OPERATORS};
    generator_t generator = {.state = 1};
    amplifier_init(0);
    console_write(
        "                                        compensator_step    loop_sample, sine   loop_sample, steps   "
        "loop_sample, adopt\n"
        "      size      kind  sections     cells     worst      mean     worst      mean     worst      mean     "
        "worst      mean\n");
    for (unsigned n = 0; n < sizeof operators / sizeof operators[0]; n++) {
        for (uint32_t sections = 0; sections <= 4; sections += 4) {
            measure_models(operators[n], FIXED_THRESHOLDS, sections, 0, &generator);
            measure_models(operators[n], RATE_DEPENDENT, sections, 0, &generator);
        }
    }
    measure_models(10, FIXED_THRESHOLDS, 0, COMPILED_CELLS, &generator);
    measure_models(10, RATE_DEPENDENT, 4, HYST_CREEP_MAX_CELLS, &generator);
    measure_models(HYST_PI_MAX_OPERATORS, RATE_DEPENDENT, 4, HYST_CREEP_MAX_CELLS, &generator);
    measure_models(10, PREISACH, 0, 0, &generator);
    measure_models(HYST_PREISACH_MAX_INTERVALS, PREISACH, 0, 0, &generator);
    measure_models(HYST_PREISACH_MAX_INTERVALS, PREISACH, 4, HYST_CREEP_MAX_CELLS, &generator);
    measure_models(16, BOUC_WEN, 0, 0, &generator);
    measure_models(HYST_BOUC_WEN_MAX_CELLS, BOUC_WEN, 0, 0, &generator);
    measure_models(HYST_BOUC_WEN_MAX_CELLS, BOUC_WEN, 4, HYST_CREEP_MAX_CELLS, &generator);
    measure_models(10, MODIFIED_PLAY, 0, 0, &generator);
    measure_models(HYST_MODIFIED_PLAY_MAX_DIVISIONS, MODIFIED_PLAY, 0, 0, &generator);
    measure_models(HYST_MODIFIED_PLAY_MAX_DIVISIONS, MODIFIED_PLAY, 4, HYST_CREEP_MAX_CELLS, &generator);
    measure_adoptions(&generator);
    console_exit(0);
}
