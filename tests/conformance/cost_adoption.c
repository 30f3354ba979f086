/* SPDX-License-Identifier: MIT */
#include "cost_adoption.h"
#include <string.h>

enum { REPETITIONS = 8, SETTLING = 2500, DEPTH = HYST_PI_MAX_OPERATORS };

typedef struct {
    const char *name;
    cost_kind_t from;
    uint32_t from_size;
    cost_kind_t to;
    uint32_t to_size;
} adoption_t;

static const adoption_t adoptions[] = {
    {"play_256_to_play_256", FIXED_THRESHOLDS, 256, FIXED_THRESHOLDS, 256},
    {"play_256_to_play_rate_256", FIXED_THRESHOLDS, 256, RATE_DEPENDENT, 256},
    {"play_256_to_play_10", FIXED_THRESHOLDS, 256, FIXED_THRESHOLDS, 10},
    {"play_64_to_play_256", FIXED_THRESHOLDS, 64, FIXED_THRESHOLDS, 256},
    {"play_10_to_play_10", FIXED_THRESHOLDS, 10, FIXED_THRESHOLDS, 10},
    {"preisach_30_to_preisach_30", PREISACH, 30, PREISACH, 30},
    {"preisach_30_to_preisach_7", PREISACH, 30, PREISACH, 7},
    {"bouc_wen_64_to_bouc_wen_64", BOUC_WEN, 64, BOUC_WEN, 64},
    {"modified_play_16_to_modified_play_16", MODIFIED_PLAY, 16, MODIFIED_PLAY, 16},
    {"modified_play_15_to_modified_play_16", MODIFIED_PLAY, 15, MODIFIED_PLAY, 16},
    {"play_256_to_preisach_30", FIXED_THRESHOLDS, 256, PREISACH, 30},
    {"play_256_to_bouc_wen_64", FIXED_THRESHOLDS, 256, BOUC_WEN, 64},
    {"play_256_to_modified_play_16", FIXED_THRESHOLDS, 256, MODIFIED_PLAY, 16},
    {"preisach_30_to_play_256", PREISACH, 30, FIXED_THRESHOLDS, 256},
};

const unsigned cost_adoptions = sizeof adoptions / sizeof adoptions[0];

const char *cost_adoption_name(unsigned index) {
    return adoptions[index].name;
}

/* On thresholds that are spread evenly. Its longest stroke is half the range: the setpoint's slew reaches no farther in
 * a sample. */
static hyst_q31_t peel(uint32_t k) {
    const int64_t amplitude = HYST_Q31_MAX / 2 * (4 * (int64_t)(DEPTH - k) + 1) / (4 * DEPTH + 4);
    return (hyst_q31_t)(k % 2U == 0 ? amplitude : -amplitude);
}

static hyst_q31_t beginning_of_peel(uint32_t k) {
    (void)k;
    return peel(0);
}

/* Reversals within the innermost loop, each inside the one before. */
static hyst_q31_t ever_smaller(uint32_t k) {
    const hyst_q31_t amplitude = HYST_Q31_MAX / DEPTH / 16 - (hyst_q31_t)(k % 1000U) * 1000;
    return k % 2U == 0 ? amplitude : -amplitude;
}

/* From one end of the range to the other. */
static hyst_q31_t far_jumps(uint32_t k) {
    return k % 2U == 0 ? HYST_Q31_MAX / 4 * 3 : -(HYST_Q31_MAX / 4 * 3);
}

/* Everything there is, so that it costs what it can, and none of it does much, so that the history is as
 * requested. */
static void furnish(hyst_parameters_t *p) {
    p->transition_slew = 1;
    p->shape_sections = p->equalise_sections = 2;
    for (unsigned i = 0; i < 2; i++) {
        p->shape[i] = p->equalise[i] =
            (hyst_iir_section_t){.b0 = HYST_Q28_ONE - 80530637, .a1 = -80530637}; /* 1 at rest */
    }
    p->inertia_sections = 1;
    p->inertia[0] = (hyst_iir_section_t){.b0 = 1, .a1 = -80530637};
    p->creep_cells = HYST_CREEP_MAX_CELLS;
    for (unsigned i = 0; i < HYST_CREEP_MAX_CELLS; i++) {
        p->creep[i] = (hyst_creep_cell_t){.gain = 1, .rate = HYST_Q31_MAX / 2};
    }
    p->drive_curves = p->reference_curves = 1;
    hyst_curve_identity(p->drive_curve);
    hyst_curve_identity(p->reference_curve);
}

static void set_hysteresis(generator_t *generator, hyst_parameters_t *p, cost_kind_t kind, uint32_t size) {
    hyst_parameters_default(p);
    cost_generate(generator, p, kind, size);
    furnish(p);
}

uint32_t cost_measure_adoption(cost_t *cost, generator_t *generator, hyst_parameters_t *parameters, unsigned index) {
    const adoption_t *a = &adoptions[index];
    uint32_t most = 0;
    for (unsigned i = 0; i < REPETITIONS; i++) {
        cost_t ignored = {0};
        set_hysteresis(generator, parameters, a->from, a->from_size);
        if ((i & 2U) != 0) { /* then they appear with the adoption, and have to be settled */
            parameters->shape_sections = parameters->equalise_sections = parameters->inertia_sections = 0;
            parameters->creep_cells = 0;
        }
        cost_spread_thresholds(parameters);
        parameters->transition_slew = HYST_Q31_MAX / 1000;
        (void)cost_adopt(&ignored, parameters, beginning_of_peel);
        cost_hold(HYST_MODE_DIRECT, beginning_of_peel, SETTLING);
        parameters->transition_slew = 1;
        (void)cost_adopt(&ignored, parameters, beginning_of_peel);
        cost_hold(HYST_MODE_DIRECT, peel, DEPTH);
        cost_hold(HYST_MODE_COMPENSATE, ever_smaller, 2);
        set_hysteresis(generator, parameters, a->to, a->to_size);
        if ((i & 1U) == 0) {
            cost_spread_thresholds(parameters);
        }
        const uint32_t samples = cost_adopt(cost, parameters, (i & 4U) == 0 ? ever_smaller : far_jumps);
        most = samples > most ? samples : most;
    }
    return most;
}
