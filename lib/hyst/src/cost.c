/* SPDX-License-Identifier: MIT */
#include "hyst/cost.h"

/* Instructions, docs/TIMING.md: what an empty image takes, with a sweep and all signals; an IIR section; a creep cell;
 * a curve. */
enum { BASE = 835, SECTION = 64, CELL = 42, CURVE = 60 };

/* What the families add. Those that search take so much for every halving. */
enum {
    PLAY = 200,
    PLAY_HALVING = 16,
    PREISACH = 1150,
    BOUC_WEN = 340,
    BOUC_WEN_HALVING = 16,
    MODIFIED_PLAY = 500,
    MODIFIED_PLAY_DIVISION = 25
};

#define ENTRY_CYCLES         24U
#define CONVERSION_PER_S     312500U /* 3.2 us */
#define MILLIHERTZ_PER_HERTZ 1000U

/* Halvings until one of `count` is left, rounded up. */
static uint32_t halvings(uint32_t count) {
    uint32_t n = 0;
    while (count >> n != 0) {
        n++;
    }
    return n;
}

static uint32_t family_instructions(const hyst_parameters_t *p) {
    switch (p->family) {
    case HYST_FAMILY_PREISACH:
        return PREISACH;
    case HYST_FAMILY_BOUC_WEN:
        return BOUC_WEN + BOUC_WEN_HALVING * halvings(p->bouc_wen_cells);
    case HYST_FAMILY_MODIFIED_PLAY:
        return MODIFIED_PLAY + MODIFIED_PLAY_DIVISION * p->modified_play[0].divisions;
    default:
        return p->pi_operators > 0 ? PLAY + PLAY_HALVING * halvings(p->pi_operators) : 0U;
    }
}

uint32_t hyst_cost_instructions(const hyst_parameters_t *parameters) {
    const uint32_t sections = parameters->shape_sections + parameters->inertia_sections + parameters->equalise_sections;
    const uint32_t curves = parameters->drive_curves + parameters->reference_curves;
    return BASE + family_instructions(parameters) + SECTION * sections + CELL * parameters->creep_cells +
           CURVE * curves;
}

uint32_t hyst_cost_cycles(const hyst_parameters_t *parameters) {
    return HYST_COST_CYCLES_PER_INSTRUCTION * hyst_cost_instructions(parameters);
}

uint32_t hyst_cost_budget(uint32_t core_hz, uint32_t sample_rate_mhz) {
    const uint64_t period = (uint64_t)core_hz * MILLIHERTZ_PER_HERTZ / sample_rate_mhz;
    const uint32_t apart = core_hz / CONVERSION_PER_S + ENTRY_CYCLES;
    const uint64_t left = period > apart ? period - apart : 0U;
    return left < UINT32_MAX ? (uint32_t)left : UINT32_MAX;
}
