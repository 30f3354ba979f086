/* SPDX-License-Identifier: MIT */
/* modified_play.h */
#include "conformance.h"
#include "hyst/modified_play.h"

static hyst_modified_play_parameters_t parameters;
static hyst_modified_play_t model[2];
static hyst_modified_play_state_t state[2];

static void digest_memory(digest_t *digest, const hyst_modified_play_t *of, const hyst_modified_play_state_t *memory) {
    for (uint32_t row = 0; row + 1U < of->parameters.divisions; row++) {
        digest_add_signed(digest, memory->play[row]);
    }
    for (uint32_t i = 0; i < HYST_MODIFIED_PLAY_FEEDBACK; i++) {
        digest_add_signed(digest, memory->position[i]);
    }
    digest_add_signed(digest, memory->remainder);
    digest_add_signed(digest, memory->drive);
    digest_add_signed(digest, memory->rate);
    digest_add(digest, memory->phase);
}

/* Forward, both inverses, and the memory carried from model to model. */
void subject_modified_play(digest_t *digest, generator_t *generator) {
    for (unsigned pass = 0; pass < 24; pass++) {
        const hyst_modified_play_t *const present = &model[pass & 1U];
        generate_modified_play(generator, &parameters,
                               pass == 0 ? HYST_MODIFIED_PLAY_MAX_DIVISIONS
                                         : 1U + generate_below(generator, HYST_MODIFIED_PLAY_MAX_DIVISIONS));
        uint32_t element = 0;
        digest_add_signed(digest, hyst_modified_play_build(&model[pass & 1U], &parameters, &element));
        const hyst_q31_t start = generate_signed(generator);
        hyst_modified_play_reset(present, &state[0], start);
        hyst_modified_play_reset(present, &state[1], start);
        excitation_t excitation = {0};
        for (unsigned k = 0; k < 600; k++) {
            const hyst_q31_t signal = generate_signal(generator, &excitation);
            digest_add_signed(digest, hyst_modified_play_forward(present, &state[0], signal));
            bool saturated = false;
            digest_add_signed(digest, hyst_modified_play_direct_inverse(present, &state[1], signal, &saturated));
            digest_add_signed(digest, hyst_modified_play_inverse(present, &state[1], signal, &saturated));
            digest_add(digest, saturated ? 1 : 0);
        }
        digest_memory(digest, present, &state[0]);
        digest_memory(digest, present, &state[1]);
        if (pass > 0) {
            const hyst_modified_play_t *const before = &model[1U - (pass & 1U)];
            hyst_modified_play_carry(present, &state[1], before, &state[0]);
            digest_memory(digest, before, &state[0]);
        }
    }
}

void subject_modified_play_refusals(digest_t *digest, generator_t *generator) {
    for (unsigned pass = 0; pass < 300; pass++) {
        generate_modified_play(generator, &parameters,
                               2U + generate_below(generator, HYST_MODIFIED_PLAY_MAX_DIVISIONS - 1U));
        const int32_t wild = extremes[generate_below(generator, EXTREMES)];
        const uint32_t place = generate_below(generator, HYST_MODIFIED_PLAY_CELLS(parameters.divisions));
        switch (generate_below(generator, 8)) {
        case 0:
            parameters.divisions = generate(generator);
            break;
        case 1:
            parameters.slope[place] = wild;
            break;
        case 2:
            parameters.feedback[place % HYST_MODIFIED_PLAY_FEEDBACK] = generate_signed(generator);
            break;
        case 3:
            parameters.bilinear = wild / (1 << generate_below(generator, 8));
            break;
        case 4:
            parameters.sine[place % HYST_MODIFIED_PLAY_HARMONICS] = wild / (1 << generate_below(generator, 8));
            break;
        case 5:
            parameters.alpha = wild;
            break;
        case 6:
            parameters.rate_gain = wild;
            break;
        default:
            parameters.slope[place] = generate_signed(generator) / 8;
            break;
        }
        uint32_t element = 0;
        digest_add_signed(digest, hyst_modified_play_build(&model[0], &parameters, &element));
        digest_add(digest, element);
    }
}
