/* SPDX-License-Identifier: MIT */
/* preisach.h */
#include "conformance.h"
#include "hyst/preisach.h"

/* A table that hyst_preisach_build accepts: each element between the bounds that its neighbours leave, one in four on
 * the lower one. */
static void generate_table(generator_t *generator, uint32_t intervals, hyst_q28_t everett[]) {
    const int32_t n = (int32_t)intervals;
    const int32_t least = (2 * HYST_PREISACH_MIN_SLOPE + n - 1) / n;
    const int32_t largest = (int32_t)((2 * HYST_PREISACH_MAX_SLOPE - 1) / n) >> generate_below(generator, 6);
    for (uint32_t distance = 1; distance <= intervals; distance++) {
        for (uint32_t j = 0; j + distance <= intervals; j++) {
            const uint32_t i = j + distance;
            const uint32_t at = i * (i - 1U) / 2U + j;
            const int32_t below = distance > 1 ? everett[at + 1U - i] : 0;
            const int32_t beside = distance > 1 ? everett[at + 1U] : 0;
            const int32_t low = (below > beside ? below : beside) + least;
            /* At most largest * N <= INT32_MAX. */
            const int32_t room = (below < beside ? below : beside) + largest - low;
            everett[at] = low;
            if (generate_below(generator, 4) != 0) {
                everett[at] += (int32_t)generate_below(generator, (uint32_t)room + 1U);
            }
        }
    }
}

static void digest_memory(digest_t *digest, const hyst_preisach_state_t *state) {
    digest_add(digest, state->extremes);
    for (uint32_t k = 0; k < state->extremes; k++) {
        digest_add_signed(digest, state->extreme[k].drive);
        digest_add_wide(digest, state->extreme[k].output);
    }
    digest_add_wide(digest, state->now.output);
}

static hyst_q28_t table[HYST_PREISACH_MAX_ELEMENTS];
static hyst_preisach_t model[2];
static hyst_preisach_state_t state[2];

/* Forward and inverse on memories of their own from the same signal, the stack filled by ever closer reversals, and the
 * memory carried from grid to grid. */
void subject_preisach(digest_t *digest, generator_t *generator) {
    for (unsigned pass = 0; pass < 24; pass++) {
        const hyst_preisach_t *const present = &model[pass & 1U];
        const uint32_t intervals =
            pass == 0 ? HYST_PREISACH_MAX_INTERVALS : 1U + generate_below(generator, HYST_PREISACH_MAX_INTERVALS);
        generate_table(generator, intervals, table);
        uint32_t element = 0;
        digest_add_signed(
            digest, hyst_preisach_build(&model[pass & 1U], intervals, generate_signed(generator) / 2, table, &element));
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
            hyst_preisach_carry(present, &state[1], before, &state[0]);
            digest_memory(digest, &state[0]);
        }
    }
}

void subject_preisach_refusals(digest_t *digest, generator_t *generator) {
    for (unsigned pass = 0; pass < 200; pass++) {
        uint32_t intervals = 1U + generate_below(generator, HYST_PREISACH_MAX_INTERVALS);
        generate_table(generator, intervals, table);
        const uint32_t place = generate_below(generator, HYST_PREISACH_ELEMENTS(intervals));
        switch (generate_below(generator, 4)) {
        case 0:
            table[place] = extremes[generate_below(generator, EXTREMES)];
            break;
        case 1:
            intervals = HYST_PREISACH_MAX_INTERVALS + 1U + generate(generator) / 2U;
            break;
        default:
            table[place] = hyst_add(table[place], generate_signed(generator) / 64);
            break;
        }
        uint32_t element = 0;
        digest_add_signed(digest, hyst_preisach_build(&model[0], intervals, 0, table, &element));
        digest_add(digest, element);
    }
}
