/* SPDX-License-Identifier: MIT */
/* preisach.h */
#include "conformance.h"
#include "hyst/preisach.h"

static void digest_memory(digest_t *digest, const hyst_preisach_state_t *state) {
    digest_add(digest, state->extremes);
    for (uint32_t k = 0; k < state->extremes; k++) {
        digest_add_signed(digest, state->extreme[k].drive);
        digest_add_wide(digest, state->extreme[k].output);
    }
    digest_add_wide(digest, state->now.output);
}

static hyst_parameters_t parameters;
static hyst_preisach_t model[2];
static hyst_preisach_state_t state[2];

/* Forward and inverse on memories of their own from the same signal, the stack filled by ever closer reversals, and the
 * memory carried from grid to grid. */
void subject_preisach(digest_t *digest, generator_t *generator) {
    for (unsigned pass = 0; pass < 24; pass++) {
        const hyst_preisach_t *const present = &model[pass & 1U];
        const uint32_t intervals =
            pass == 0 ? HYST_PREISACH_MAX_INTERVALS : 1U + generate_below(generator, HYST_PREISACH_MAX_INTERVALS);
        generate_preisach(generator, &parameters, intervals);
        uint32_t element = 0;
        digest_add_signed(digest, hyst_preisach_build(&model[pass & 1U], intervals, generate_signed(generator) / 2,
                                                      parameters.preisach_everett, &element));
        const hyst_q31_t start = generate_signed(generator);
        hyst_preisach_reset(present, &state[0], start);
        hyst_preisach_reset(present, &state[1], start);
        excitation_t excitation = {0};
        for (unsigned k = 0; k < 600; k++) {
            const hyst_q31_t signal = generate_signal(generator, &excitation);
            digest_add_signed(digest, hyst_preisach_forward(present, &state[0], signal));
            bool saturated = false;
            digest_add_signed(digest, hyst_preisach_inverse(present, &state[1], signal, &saturated));
            digest_add(digest, saturated ? 1 : 0);
        }
        for (int64_t swing = HYST_Q31_MAX; swing != 0; swing = -(swing * 15 / 16)) {
            digest_add_signed(digest, hyst_preisach_forward(present, &state[0], (hyst_q31_t)swing));
        }
        digest_memory(digest, &state[0]);
        digest_memory(digest, &state[1]);
        if (pass > 0) {
            const hyst_preisach_t *const before = &model[1U - (pass & 1U)];
            uint32_t carried = 0;
            while (!hyst_preisach_carry(present, &state[1], before, &state[0], &carried)) {
            }
            digest_memory(digest, &state[0]);
        }
    }
}

void subject_preisach_refusals(digest_t *digest, generator_t *generator) {
    for (unsigned pass = 0; pass < 200; pass++) {
        uint32_t intervals = 1U + generate_below(generator, HYST_PREISACH_MAX_INTERVALS);
        generate_preisach(generator, &parameters, intervals);
        const uint32_t place = generate_below(generator, HYST_PREISACH_ELEMENTS(intervals));
        switch (generate_below(generator, 4)) {
        case 0:
            parameters.preisach_everett[place] = extremes[generate_below(generator, EXTREMES)];
            break;
        case 1:
            intervals = HYST_PREISACH_MAX_INTERVALS + 1U + generate(generator) / 2U;
            break;
        default:
            parameters.preisach_everett[place] =
                hyst_add(parameters.preisach_everett[place], generate_signed(generator) / 64);
            break;
        }
        uint32_t element = 0;
        digest_add_signed(digest, hyst_preisach_build(&model[0], intervals, 0, parameters.preisach_everett, &element));
        digest_add(digest, element);
    }
}
