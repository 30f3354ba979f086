/* SPDX-License-Identifier: MIT */
/* sine.h, curve.h, bouc_wen.h */
#include "conformance.h"
#include "hyst/bouc_wen.h"
#include "hyst/curve.h"
#include "hyst/sine.h"

void subject_sine(digest_t *digest, generator_t *generator) {
    for (unsigned i = 0; i < EXTREMES; i++) {
        digest_add_signed(digest, hyst_sine((uint32_t)extremes[i]));
    }
    for (unsigned i = 0; i < 5000; i++) {
        digest_add_signed(digest, hyst_sine(generate(generator)));
    }
}

void subject_curve(digest_t *digest, generator_t *generator) {
    static hyst_curve_t curve;
    hyst_curve_identity(&curve);
    for (unsigned pass = 0; pass < 64; pass++) {
        /* Rises of all sizes; one curve in two has a node that may not rise. */
        hyst_q31_t node[HYST_CURVE_NODES];
        node[0] = HYST_Q31_MIN + (hyst_q31_t)generate_below(generator, 1U << 30);
        for (uint32_t i = 1; i < HYST_CURVE_NODES; i++) {
            const uint32_t rise = generate_size(generator, 80U << 20, 7);
            node[i] = hyst_add(node[i - 1U], HYST_CURVE_MIN_RISE + (hyst_q31_t)rise);
        }
        if ((pass & 1U) != 0) {
            node[generate_below(generator, HYST_CURVE_NODES)] = extremes[generate_below(generator, EXTREMES)];
        }
        uint32_t element = 0;
        digest_add_signed(digest, hyst_curve_build(&curve, node, &element));
        digest_add(digest, element);
        excitation_t excitation = {0};
        for (unsigned k = 0; k < 300; k++) {
            const hyst_q31_t signal = generate_signal(generator, &excitation);
            bool saturated = false;
            digest_add_signed(digest, hyst_curve_apply(&curve, signal));
            digest_add_signed(digest, hyst_curve_solve(&curve, signal, &saturated));
            digest_add(digest, saturated ? 1 : 0);
        }
    }
}

static void digest_memory(digest_t *digest, const hyst_bouc_wen_state_t *state) {
    digest_add_wide(digest, state->place);
    digest_add_wide(digest, state->rest);
    digest_add_signed(digest, state->side);
    digest_add_signed(digest, state->drive);
}

/* Forward and inverse on memories of their own from the same signal, and the memory carried from model to model. */
void subject_bouc_wen(digest_t *digest, generator_t *generator) {
    static bouc_wen_arguments_t a;
    static hyst_bouc_wen_t model[2];
    static hyst_bouc_wen_state_t state[2];
    for (unsigned pass = 0; pass < 24; pass++) {
        const hyst_bouc_wen_t *const present = &model[pass & 1U];
        generate_bouc_wen(generator, &a,
                          pass == 0 ? HYST_BOUC_WEN_MAX_CELLS
                                    : generate_below(generator, HYST_BOUC_WEN_MAX_CELLS + 1U));
        uint32_t element = 0;
        digest_add_signed(digest, hyst_bouc_wen_build(&model[pass & 1U], a.cells, generate_signed(generator) / 8,
                                                      a.direct, a.length, a.slope, &element));
        const hyst_q31_t start = generate_signed(generator);
        hyst_bouc_wen_reset(present, &state[0], start);
        hyst_bouc_wen_reset(present, &state[1], start);
        excitation_t excitation = {0};
        for (unsigned k = 0; k < 600; k++) {
            const hyst_q31_t signal = generate_signal(generator, &excitation);
            digest_add_signed(digest, hyst_bouc_wen_forward(present, &state[0], signal));
            bool saturated = false;
            digest_add_signed(digest, hyst_bouc_wen_inverse(present, &state[1], signal, &saturated));
            digest_add(digest, saturated ? 1 : 0);
        }
        digest_memory(digest, &state[0]);
        digest_memory(digest, &state[1]);
        if (pass > 0) {
            uint32_t carried = 0;
            while (!hyst_bouc_wen_carry(present, &state[1], &model[1U - (pass & 1U)], &state[0], &carried)) {
            }
            digest_memory(digest, &state[0]);
        }
    }
}

void subject_bouc_wen_refusals(digest_t *digest, generator_t *generator) {
    static bouc_wen_arguments_t a;
    static hyst_bouc_wen_t model;
    for (unsigned pass = 0; pass < 300; pass++) {
        generate_bouc_wen(generator, &a, 1U + generate_below(generator, HYST_BOUC_WEN_MAX_CELLS));
        uint32_t cells = a.cells;
        const int32_t wild = extremes[generate_below(generator, EXTREMES)];
        const uint32_t place = generate_below(generator, cells);
        switch (generate_below(generator, 4)) {
        case 0:
            a.length[place] = wild;
            break;
        case 1:
            a.slope[place] = wild;
            break;
        case 2:
            a.direct = wild;
            break;
        default:
            cells = HYST_BOUC_WEN_MAX_CELLS + 1U + generate(generator) / 2U;
            break;
        }
        uint32_t element = 0;
        digest_add_signed(digest, hyst_bouc_wen_build(&model, cells, 0, a.direct, a.length, a.slope, &element));
        digest_add(digest, element);
    }
}
