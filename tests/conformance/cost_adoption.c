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
    {"256 plays to 256 plays                      ", FIXED_THRESHOLDS, 256, FIXED_THRESHOLDS, 256},
    {"256 plays to 256 rate-dependent plays       ", FIXED_THRESHOLDS, 256, RATE_DEPENDENT, 256},
    {"256 plays to 10 plays                       ", FIXED_THRESHOLDS, 256, FIXED_THRESHOLDS, 10},
    {"64 plays to 256 plays                       ", FIXED_THRESHOLDS, 64, FIXED_THRESHOLDS, 256},
    {"10 plays to 10 plays                        ", FIXED_THRESHOLDS, 10, FIXED_THRESHOLDS, 10},
    {"Preisach, 30 intervals to 30                ", PREISACH, 30, PREISACH, 30},
    {"Preisach, 30 intervals to 7                 ", PREISACH, 30, PREISACH, 7},
    {"Bouc-Wen, 64 cells to 64                    ", BOUC_WEN, 64, BOUC_WEN, 64},
    {"modified play, 16 divisions to 16           ", MODIFIED_PLAY, 16, MODIFIED_PLAY, 16},
    {"modified play, 15 divisions to 16           ", MODIFIED_PLAY, 15, MODIFIED_PLAY, 16},
    {"256 plays to Preisach, 30 intervals         ", FIXED_THRESHOLDS, 256, PREISACH, 30},
    {"256 plays to Bouc-Wen, 64 cells             ", FIXED_THRESHOLDS, 256, BOUC_WEN, 64},
    {"256 plays to modified play, 16 divisions    ", FIXED_THRESHOLDS, 256, MODIFIED_PLAY, 16},
    {"Preisach, 30 intervals to 256 plays         ", PREISACH, 30, FIXED_THRESHOLDS, 256},
};

const unsigned cost_adoptions = sizeof adoptions / sizeof adoptions[0];

const char *cost_adoption_name(unsigned index) {
    return adoptions[index].name;
}

/* A hysteresis of that kind in place of the one that is there. `size`: operators, intervals, cells or divisions. */
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

/* Thresholds at equal distances up to half the range: then `peel` leaves one more operator behind with every reversal.
 */
static void spread_thresholds(hyst_parameters_t *p) {
    for (uint32_t i = 0; i < p->pi_operators; i++) {
        p->pi_threshold[i] = (hyst_q31_t)((int64_t)(HYST_Q31_MAX / 2) * (i + 1U) / (p->pi_operators + 1U));
    }
}

/* Its longest stroke is half the range: the setpoint's slew reaches no farther in a sample. */
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

/* Everything there is, so that it costs what it can, and none of it does much, so that the history is what was asked
 * for. */
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
        spread_thresholds(parameters);
        parameters->transition_slew = HYST_Q31_MAX / 1000;
        (void)cost_adopt(&ignored, parameters, beginning_of_peel);
        cost_hold(HYST_MODE_DIRECT, beginning_of_peel, SETTLING);
        parameters->transition_slew = 1;
        (void)cost_adopt(&ignored, parameters, beginning_of_peel);
        cost_hold(HYST_MODE_DIRECT, peel, DEPTH);
        cost_hold(HYST_MODE_COMPENSATE, ever_smaller, 2);
        set_hysteresis(generator, parameters, a->to, a->to_size);
        if ((i & 1U) == 0) {
            spread_thresholds(parameters);
        }
        const uint32_t samples = cost_adopt(cost, parameters, (i & 4U) == 0 ? ever_smaller : far_jumps);
        most = samples > most ? samples : most;
    }
    return most;
}
