/* SPDX-License-Identifier: MIT */
#include "conformance.h"
#include "console.h"

void digest_add(digest_t *digest, uint32_t word) {
    for (unsigned shift = 0; shift < 32; shift += 8) {
        digest->value = (digest->value ^ (word >> shift & 0xFFU)) * 0x100000001B3U;
    }
}

void digest_add_signed(digest_t *digest, int32_t value) {
    digest_add(digest, (uint32_t)value);
}

void digest_add_wide(digest_t *digest, int64_t value) {
    digest_add(digest, (uint32_t)((uint64_t)value >> 32));
    digest_add(digest, (uint32_t)value);
}

uint32_t generate(generator_t *generator) {
    generator->state ^= generator->state >> 12;
    generator->state ^= generator->state << 25;
    generator->state ^= generator->state >> 27;
    return (uint32_t)((generator->state * 0x2545F4914F6CDD1DU) >> 32);
}

int32_t generate_signed(generator_t *generator) {
    return (int32_t)((int64_t)generate(generator) + INT32_MIN);
}

uint32_t generate_below(generator_t *generator, uint32_t count) {
    return (uint32_t)(((uint64_t)generate(generator) * count) >> 32);
}

uint32_t generate_size(generator_t *generator, uint32_t count, uint32_t halvings) {
    const uint32_t number =
        generate_below(generator, count); /* first: C leaves the order of operands to the compiler */
    return number >> generate_below(generator, halvings);
}

hyst_q31_t generate_signal(generator_t *generator, excitation_t *excitation) {
    if (excitation->samples_left == 0) {
        excitation->samples_left = 1 + generate_below(generator, 64);
        switch (generate_below(generator, 8)) {
        case 0: /* hold */
            excitation->step = 0;
            break;
        case 1: /* creep */
            excitation->step = (int32_t)generate_below(generator, 3) - 1;
            break;
        case 2: /* jump, then hold */
            excitation->value = generate_signed(generator);
            excitation->step = 0;
            break;
        case 3: /* to an end of the range at any speed */
            excitation->step = generate_signed(generator);
            break;
        default: /* ramp */
            excitation->step = generate_signed(generator) / 64;
            break;
        }
    }
    excitation->samples_left--;
    excitation->value = hyst_add(excitation->value, excitation->step);
    return excitation->value;
}

const int32_t extremes[EXTREMES] = {INT32_MIN, INT32_MIN + 1, -0x40000001, -0x40000000, -0x3FFFFFFF, -2, -1, 0, 1,
                                    2,         0x3FFFFFFF,    0x40000000,  0x7FFFFFFE,  INT32_MAX};

void generate_hysteresis(generator_t *generator, hyst_parameters_t *p, uint32_t operators, bool rate_dependent) {
    p->pi_operators = operators;
    p->hysteresis_offset = generate_signed(generator) / 16;

    /* w_0 in [0.25, 0.5); the others share a total variation of 2 at most. A fall is at most half of the slope it
     * leaves. */
    int32_t slope = HYST_Q28_ONE / 4 + (int32_t)generate_below(generator, HYST_Q28_ONE / 4);
    p->pi_weight[0] = slope;
    for (uint32_t j = 1; j <= operators; j++) {
        const int32_t most = 2 * HYST_Q28_ONE / (int32_t)operators;
        int32_t weight = (int32_t)generate_below(generator, (uint32_t)most);
        if (generate_below(generator, 4) == 0) {
            weight = -weight / 2;
        }
        if (slope + weight < HYST_PI_MIN_SLOPE + HYST_Q28_ONE / 8) {
            weight = 0;
        }
        p->pi_weight[j] = weight;
        slope += weight;
    }

    /* Thresholds rise by anything from one unit to twice the even share of 0.45. */
    const uint32_t share = operators > 0 ? (uint32_t)(HYST_Q31_MAX / 10 * 9) / operators : 1;
    int32_t threshold = 0;
    for (uint32_t i = 0; i < operators; i++) {
        threshold += generate_below(generator, 8) == 0 ? 1 : 1 + (int32_t)generate_below(generator, share);
        p->pi_threshold[i] = threshold;
    }

    /* g beta < 1/8, and (S_j - S_0) / S_j is between (1/8 - 1/2) / (1/8) = -3 and 1: q stays within [-0.375, 0.125]. */
    p->pi_beta = 0;
    p->pi_rate_gain = HYST_Q30_ONE;
    if (rate_dependent) {
        p->pi_beta = 1 + (hyst_q20_t)generate_below(generator, 64U * HYST_Q20_ONE);
        p->pi_rate_gain = HYST_Q30_ONE / (1 + p->pi_beta / (HYST_Q20_ONE / 8));
    }
}

void generate_preisach(generator_t *generator, hyst_parameters_t *p, uint32_t intervals) {
    const int32_t n = (int32_t)intervals;
    const int32_t least = (2 * HYST_PREISACH_MIN_SLOPE + n - 1) / n;
    const int32_t largest = (int32_t)((2 * HYST_PREISACH_MAX_SLOPE - 1) / n) >> generate_below(generator, 6);
    p->family = HYST_FAMILY_PREISACH;
    p->preisach_intervals = intervals;
    for (uint32_t distance = 1; distance <= intervals; distance++) {
        for (uint32_t j = 0; j + distance <= intervals; j++) {
            const uint32_t i = j + distance;
            hyst_q28_t *const here = &p->preisach_everett[i * (i - 1U) / 2U + j];
            const int32_t below = distance > 1 ? *(here + 1 - i) : 0;
            const int32_t beside = distance > 1 ? *(here + 1) : 0;
            const int32_t low = (below > beside ? below : beside) + least;
            /* At most largest * N <= INT32_MAX. */
            const int32_t room = (below < beside ? below : beside) + largest - low;
            *here = low;
            if (generate_below(generator, 4) != 0) {
                *here += (int32_t)generate_below(generator, (uint32_t)room + 1U);
            }
        }
    }
}

void generate_bouc_wen(generator_t *generator, bouc_wen_arguments_t *a, uint32_t cells) {
    const bool falling = generate_below(generator, 2) != 0;
    a->cells = cells;
    a->direct = HYST_Q28_ONE / 2 + (hyst_q28_t)generate_below(generator, HYST_Q28_ONE / 2);
    for (uint32_t i = 0; i < cells; i++) {
        a->length[i] = 1 + (hyst_q31_t)(generate_below(generator, 3U << 30) / cells / 2U);
        const hyst_q28_t slope =
            1 + (hyst_q28_t)generate_size(generator, HYST_Q28_ONE / 2 - HYST_BOUC_WEN_MIN_SLOPE, 20);
        a->slope[i] = falling ? -slope : slope;
    }
}

/* A number of at most `size` in magnitude. */
static int32_t within(generator_t *generator, int32_t size) {
    return (int32_t)generate_below(generator, 2U * (uint32_t)size + 1U) - size;
}

void generate_modified_play(generator_t *generator, hyst_modified_play_parameters_t *p, uint32_t divisions) {
    *p = (hyst_modified_play_parameters_t){.divisions = divisions};
    p->offset = generate_signed(generator) / 32;
    p->direct = HYST_Q28_ONE / 4 + (hyst_q28_t)generate_below(generator, HYST_Q28_ONE / 4);
    for (uint32_t cell = 0; cell < HYST_MODIFIED_PLAY_CELLS(divisions); cell++) {
        p->slope[cell] = within(generator, HYST_Q28_ONE / 16 * 3 / (int32_t)divisions);
    }
    const hyst_q28_t pole = within(generator, HYST_Q28_ONE / 4 * 3);
    if (generate_below(generator, 2) != 0) {
        p->feedback[0] = HYST_Q28_ONE + pole;
        p->feedback[1] = -HYST_Q28_ONE / 4 - pole;
        p->feedback[2] = pole / 4;
    }
    p->bilinear = within(generator, HYST_Q28_ONE / 128);
    for (uint32_t i = 0; i < HYST_MODIFIED_PLAY_HARMONICS; i++) {
        p->sine[i] = within(generator, HYST_Q28_ONE / 512);
        p->cosine[i] = within(generator, HYST_Q28_ONE / 512);
    }
    if (generate_below(generator, 2) != 0) {
        p->alpha = (hyst_q20_t)generate_below(generator, HYST_Q20_ONE / 8);
        p->beta = (hyst_q20_t)generate_below(generator, HYST_Q20_ONE / 8);
        p->rate_gain = 1 + (hyst_q30_t)generate_below(generator, HYST_Q30_ONE);
    }
    p->phase = generate(generator);
    p->phase_step = generate(generator);
    p->phase_step >>= generate_below(generator, 16);
}

hyst_iir_section_t generate_section(generator_t *generator) {
    /* |a2| < 1, then |a1| < 1 + a2; one in four within 2^-12 of the edge. The sum of magnitudes stays below 3 * 3 + 1
     * + 2. */
    hyst_q28_t a2 = generate_signed(generator) / 8;
    if (generate_below(generator, 4) == 0) {
        a2 = HYST_Q28_ONE - 1 - (hyst_q28_t)generate_below(generator, HYST_Q28_ONE / 4096);
    }
    if (a2 == -HYST_Q28_ONE) {
        a2++;
    }
    const int32_t room = HYST_Q28_ONE + a2; /* 1 to 2^29 */
    const hyst_q28_t a1 = (hyst_q28_t)generate_below(generator, 2U * (uint32_t)room - 1U) - (room - 1);
    hyst_iir_section_t section = {.a1 = a1, .a2 = a2};
    section.b0 = generate_signed(generator) / 3;
    section.b1 = generate_signed(generator) / 3;
    section.b2 = generate_signed(generator) / 3;
    return section;
}

/* From -1 on, slopes between 1/4 and 1. */
static void generate_curve(generator_t *generator, uint32_t *curves, hyst_curve_t *curve) {
    *curves = generate_below(generator, 2);
    for (uint32_t i = 0; i < HYST_CURVE_NODES; i++) {
        const hyst_q31_t before = i > 0 ? curve->node[i - 1U] : HYST_Q31_MIN;
        curve->node[i] = before + (1 << 25) + (hyst_q31_t)generate_below(generator, 3U << 25);
    }
}

void generate_parameters(generator_t *generator, hyst_parameters_t *p) {
    static const uint32_t operators[] = {0, 1, 10, HYST_PI_MAX_OPERATORS};
    hyst_parameters_default(p);
    p->model_id = generate(generator);
    p->drive_low = HYST_Q31_MIN + (int32_t)generate_below(generator, 0x40000000U);
    p->drive_high = HYST_Q31_MAX - (int32_t)generate_below(generator, 0x40000000U);
    p->drive_park = p->drive_low / 2 + p->drive_high / 2;
    p->linear_offset = generate_signed(generator) / 8;
    p->linear_gain = 1 + (hyst_q28_t)generate_below(generator, INT32_MAX);
    p->transition_slew = 1 + (hyst_q31_t)generate_below(generator, 0x04000000U);
    p->lookahead_samples = generate_below(generator, HYST_LOOKAHEAD_MAX + 1U);
    /* One call a statement: C leaves the order of a call's arguments to the compiler. */
    const uint32_t n = operators[generate_below(generator, 4)];
    const bool rate_dependent = generate_below(generator, 2) != 0;
    generate_hysteresis(generator, p, n, rate_dependent);
    generate_curve(generator, &p->drive_curves, p->drive_curve);
    generate_curve(generator, &p->reference_curves, p->reference_curve);
    p->inertia_sections = generate_below(generator, HYST_INERTIA_MAX_SECTIONS + 1U);
    p->inertia[0] = generate_section(generator);
    p->shape_sections = generate_below(generator, HYST_IIR_MAX_SECTIONS + 1U);
    p->equalise_sections = generate_below(generator, HYST_IIR_MAX_SECTIONS + 1U);
    for (uint32_t i = 0; i < HYST_IIR_MAX_SECTIONS; i++) {
        p->shape[i] = generate_section(generator);
        p->equalise[i] = generate_section(generator);
    }
    p->creep_cells = generate_below(generator, HYST_CREEP_MAX_CELLS + 1U);
    for (uint32_t i = 0; i < HYST_CREEP_MAX_CELLS; i++) {
        p->creep[i].gain = generate_signed(generator) / (HYST_CREEP_MAX_CELLS + 1);
        p->creep[i].rate = 1 + (hyst_q31_t)generate_size(generator, INT32_MAX, 31);
    }
}

void build(const hyst_parameters_t *parameters, hyst_compensator_t *compensator) {
    if (hyst_parameters_build(parameters, compensator).error != HYST_PARAMETERS_OK) {
        console_write("conformance: lib/hyst refuses a generated parameter set\n");
        console_exit(1);
    }
}
