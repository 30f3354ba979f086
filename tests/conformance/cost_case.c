/* SPDX-License-Identifier: MIT */
#include "cost_case.h"
#include "console.h"
#include "stm32f405.h"
#include <string.h>

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

void cost_generate(generator_t *generator, hyst_parameters_t *p, cost_kind_t kind, uint32_t size) {
    static bouc_wen_arguments_t cells;
    p->pi_operators = 0;
    p->pi_beta = 0;
    switch (kind) {
    case FIXED_THRESHOLDS:
    case RATE_DEPENDENT:
        generate_hysteresis(generator, p, size, kind == RATE_DEPENDENT);
        break;
    case PREISACH:
        generate_preisach(generator, p, size);
        break;
    case BOUC_WEN:
        generate_bouc_wen(generator, &cells, size);
        p->family = HYST_FAMILY_BOUC_WEN;
        p->bouc_wen_cells = cells.cells;
        p->bouc_wen_direct = cells.direct;
        memcpy(p->bouc_wen_length, cells.length, sizeof cells.length);
        memcpy(p->bouc_wen_slope, cells.slope, sizeof cells.slope);
        break;
    case MODIFIED_PLAY:
        p->family = HYST_FAMILY_MODIFIED_PLAY;
        p->modified_plays = 1;
        generate_modified_play(generator, &p->modified_play[0], size);
        break;
    }
}

void cost_spread_thresholds(hyst_parameters_t *p) {
    for (uint32_t i = 0; i < p->pi_operators; i++) {
        p->pi_threshold[i] = (hyst_q31_t)((int64_t)(HYST_Q31_MAX / 2) * (i + 1U) / (p->pi_operators + 1U));
    }
}

/* 9 cells: 0.1 s to 1000 s, two a decade, what hyst compile makes of a block creep. */
const cost_case_t cost_cases[] = {
    {FIXED_THRESHOLDS, 0, 0, 0, false},
    {FIXED_THRESHOLDS, 0, 4, 0, false},
    {FIXED_THRESHOLDS, 0, 4, 0, true},
    {FIXED_THRESHOLDS, 10, 0, 0, false},
    {RATE_DEPENDENT, 10, 0, 0, false},
    {RATE_DEPENDENT, 10, 4, 0, false},
    {RATE_DEPENDENT, 10, 4, 0, true},
    {FIXED_THRESHOLDS, 16, 0, 0, false},
    {RATE_DEPENDENT, 16, 0, 0, false},
    {FIXED_THRESHOLDS, 16, 4, 0, false},
    {RATE_DEPENDENT, 16, 4, 0, false},
    {RATE_DEPENDENT, 16, 4, 0, true},
    {RATE_DEPENDENT, 16, 4, 9, false},
    {FIXED_THRESHOLDS, 64, 4, 0, false},
    {RATE_DEPENDENT, 64, 4, 0, false},
    {FIXED_THRESHOLDS, HYST_PI_MAX_OPERATORS, 4, 0, false},
    {RATE_DEPENDENT, HYST_PI_MAX_OPERATORS, 4, 0, false},
    {RATE_DEPENDENT, HYST_PI_MAX_OPERATORS, 4, 16, true},
    {PREISACH, 10, 0, 0, false},
    {PREISACH, HYST_PREISACH_MAX_INTERVALS, 0, 0, false},
    {PREISACH, HYST_PREISACH_MAX_INTERVALS, 4, 0, false},
    {PREISACH, HYST_PREISACH_MAX_INTERVALS, 4, 16, true},
    {BOUC_WEN, 16, 0, 0, false},
    {BOUC_WEN, HYST_BOUC_WEN_MAX_CELLS, 0, 0, false},
    {BOUC_WEN, HYST_BOUC_WEN_MAX_CELLS, 4, 0, false},
    {BOUC_WEN, HYST_BOUC_WEN_MAX_CELLS, 4, 16, true},
    {MODIFIED_PLAY, 10, 0, 0, false},
    {MODIFIED_PLAY, HYST_MODIFIED_PLAY_MAX_DIVISIONS, 0, 0, false},
    {MODIFIED_PLAY, HYST_MODIFIED_PLAY_MAX_DIVISIONS, 4, 0, false},
    {MODIFIED_PLAY, HYST_MODIFIED_PLAY_MAX_DIVISIONS, 4, 16, true},
};
const unsigned cost_case_count = sizeof cost_cases / sizeof cost_cases[0];

cost_history_t cost_history(unsigned model) {
    return (cost_history_t)(model % COST_HISTORIES);
}

void cost_case_parameters(generator_t *generator, hyst_parameters_t *p, const cost_case_t *line, unsigned model) {
    const cost_history_t history = cost_history(model);
    generate_parameters(generator, p);
    cost_generate(generator, p, line->kind, line->size);
    p->shape_sections = line->sections / 2U;
    p->equalise_sections = line->sections / 2U;
    p->creep_cells = line->cells;
    p->drive_curves = p->reference_curves = p->inertia_sections = line->extras ? 1 : 0;
    if (history >= COST_STAIRS) {
        cost_spread_thresholds(p);
        /* Filters of gain 1, so that the history is what was requested; they cost the same. */
        for (unsigned i = 0; i < HYST_IIR_MAX_SECTIONS; i++) {
            p->shape[i] = p->equalise[i] = (hyst_iir_section_t){.b0 = HYST_Q28_ONE};
        }
        p->inertia[0] = (hyst_iir_section_t){.b0 = 1};
        p->transition_slew = HYST_Q31_MAX;
        p->drive_low = history == COST_LIMITED ? HYST_Q31_MIN / 4 : HYST_Q31_MIN;
        p->drive_high = history == COST_LIMITED ? HYST_Q31_MAX / 4 : HYST_Q31_MAX;
        p->drive_park = 0;
    }
}

/* They begin at a quarter of the range, which every model reaches: a drive at its limit forgets them. */
static hyst_q31_t nested(generator_t *generator, unsigned k) {
    const unsigned phase = k % 320U;
    if (phase >= 300U) {
        return generate_signed(generator);
    }
    const hyst_q31_t amplitude = HYST_Q31_MAX / 1200 * (hyst_q31_t)(300U - phase);
    return (k & 1U) != 0 ? amplitude : -amplitude;
}

/* Every reversal is a random part smaller than the one before; after up to 63 of them one that goes anywhere. */
static hyst_q31_t stairs(generator_t *generator, cost_reference_t *r) {
    if (r->depth == 0) {
        r->depth = generate_below(generator, 64);
        r->value = generate_signed(generator);
    } else {
        r->depth--;
        const int64_t part = 32768 - (int64_t)generate_below(generator, 32768U >> generate_below(generator, 6));
        r->value = (hyst_q31_t)(-r->value * part / 32768);
    }
    return r->value;
}

hyst_q31_t cost_reference(generator_t *generator, cost_reference_t *r, cost_history_t history, unsigned k) {
    switch (history) {
    case COST_NESTED:
        return nested(generator, k);
    case COST_STAIRS:
    case COST_LIMITED:
        return stairs(generator, r);
    case COST_ANYTHING:
    case COST_HISTORIES:
        break;
    }
    return generate_signal(generator, &r->excitation);
}

void cost_print_number(uint32_t number) {
    char text[12];
    unsigned at = sizeof text;
    text[--at] = '\0';
    do {
        text[--at] = (char)('0' + number % 10U);
        number /= 10U;
    } while (number > 0);
    text[--at] = ' ';
    console_write(&text[at]);
}

void cost_print_case(const cost_case_t *line) {
    static const char *const names[] = {"play", "play_rate", "preisach", "bouc_wen", "modified_play"};
    console_write(names[line->kind]);
    cost_print_number(line->size);
    cost_print_number(line->sections);
    cost_print_number(line->cells);
    console_write(line->extras ? " curves" : " plain");
}

void cost_print(const cost_t *cost) {
    cost_print_number(cost->worst);
    cost_print_number((uint32_t)(cost->sum / cost->calls));
}
