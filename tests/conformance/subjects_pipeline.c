/* SPDX-License-Identifier: MIT */
/* iir.h, parameters.h, compensator.h */
#include "conformance.h"
#include <string.h>

static void digest_filter_state(digest_t *digest, const hyst_iir_t *iir, const hyst_iir_state_t *state) {
    hyst_q31_t x1 = state->x1, x2 = state->x2;
    for (uint32_t i = 0; i < iir->sections; i++) {
        const hyst_iir_section_state_t *const s = &state->section[i];
        digest_add_signed(digest, x1);
        digest_add_signed(digest, x2);
        digest_add_signed(digest, s->y1);
        digest_add_signed(digest, s->y2);
        digest_add_signed(digest, s->remainder);
        x1 = s->y1;
        x2 = s->y2;
    }
}

static void digest_fault(digest_t *digest, hyst_parameters_fault_t fault) {
    digest_add(digest, fault.error);
    digest_add(digest, fault.field);
    digest_add(digest, fault.element);
}

void subject_iir(digest_t *digest, generator_t *generator) {
    static hyst_iir_t iir;
    static hyst_iir_state_t state;
    for (unsigned pass = 0; pass < 40; pass++) {
        hyst_iir_section_t section[HYST_IIR_MAX_SECTIONS];
        for (unsigned i = 0; i < HYST_IIR_MAX_SECTIONS; i++) {
            section[i] = generate_section(generator);
        }
        uint32_t element = 0;
        digest_add_signed(digest, hyst_iir_build(&iir, pass % (HYST_IIR_MAX_SECTIONS + 1U), section, &element));
        if ((pass & 1U) != 0) {
            hyst_iir_reset(&state);
        } else {
            hyst_iir_settle(&iir, &state, generate_signed(generator));
        }
        digest_filter_state(digest, &iir, &state);
        excitation_t excitation = {0};
        for (unsigned k = 0; k < 500; k++) {
            bool saturated = false;
            digest_add_signed(digest, hyst_iir_step(&iir, &state, generate_signal(generator, &excitation), &saturated));
            digest_add(digest, saturated ? 1 : 0);
        }
        digest_filter_state(digest, &iir, &state);
    }
}

void subject_iir_refusals(digest_t *digest, generator_t *generator) {
    hyst_iir_t iir;
    for (unsigned pass = 0; pass < 500; pass++) {
        hyst_iir_section_t section[HYST_IIR_MAX_SECTIONS];
        for (unsigned i = 0; i < HYST_IIR_MAX_SECTIONS; i++) {
            section[i] = generate_section(generator);
        }
        hyst_iir_section_t *const victim = &section[generate_below(generator, HYST_IIR_MAX_SECTIONS)];
        const hyst_q28_t wild = extremes[generate_below(generator, EXTREMES)];
        switch (generate_below(generator, 5)) {
        case 0:
            victim->b0 = wild;
            break;
        case 1:
            victim->b1 = wild;
            break;
        case 2:
            victim->b2 = wild;
            break;
        case 3:
            victim->a1 = wild;
            break;
        default:
            victim->a2 = wild;
            break;
        }
        uint32_t element = 0;
        digest_add_signed(
            digest, hyst_iir_build(&iir, generate_below(generator, HYST_IIR_MAX_SECTIONS + 2U), section, &element));
        digest_add(digest, element);
    }
}

/* What the subjects below work on. Static and shared: SRAM has no room for one set each. */
static hyst_parameters_t p[2];
static hyst_compensator_t compensator[2];
static hyst_compensator_state_t running;
static uint32_t image[HYST_IMAGE_MAX_WORDS + 1U];

void subject_image(digest_t *digest, generator_t *generator) {
    static uint32_t again[HYST_IMAGE_MAX_WORDS];
    for (unsigned pass = 0; pass < 50; pass++) {
        generate_parameters(generator, &p[0]);
        const size_t length = hyst_parameters_encode(&p[0], image, HYST_IMAGE_MAX_WORDS);
        digest_add(digest, (uint32_t)length);
        for (size_t i = 0; i < length; i++) {
            digest_add(digest, image[i]);
        }
        digest_fault(digest, hyst_parameters_decode(image, length, &p[1]));
        digest_add(digest, (uint32_t)hyst_parameters_encode(&p[1], again, length));
        digest_add(digest, hyst_crc32(again, length));
        digest_add(digest, (uint32_t)hyst_parameters_encode(&p[1], again, length - 1U));
    }
}

/* One word is changed; in half of the passes the CRC is made good again, so that the checks behind it are reached. */
void subject_broken_images(digest_t *digest, generator_t *generator) {
    for (unsigned pass = 0; pass < 1500; pass++) {
        generate_parameters(generator, &p[0]);
        size_t length = hyst_parameters_encode(&p[0], image, HYST_IMAGE_MAX_WORDS);
        const bool header = generate_below(generator, 2) != 0;
        const uint32_t word = generate_below(generator, header ? HYST_IMAGE_HEADER_WORDS : (uint32_t)length);
        if (generate_below(generator, 2) != 0) {
            image[word] = (uint32_t)extremes[generate_below(generator, EXTREMES)];
        } else {
            image[word] ^= UINT32_C(1) << generate_below(generator, 32);
        }
        if ((pass & 1U) != 0) {
            image[length - 1U] = hyst_crc32(image, length - 1U);
        } else if (generate_below(generator, 8) == 0) {
            length = generate_below(generator, HYST_IMAGE_MAX_WORDS + 1U);
        }
        hyst_parameters_fault_t fault = hyst_parameters_decode(image, length, &p[0]);
        digest_fault(digest, fault);
        if (fault.error == HYST_PARAMETERS_OK) {
            fault = hyst_parameters_build(&p[0], &compensator[0]);
            digest_fault(digest, fault);
        }
    }
}

static void digest_text(digest_t *digest, const char *text) {
    for (; *text != '\0'; text++) {
        digest_add(digest, (uint32_t)*text);
    }
}

/* Values beyond the last included: the answer is never NULL. */
void subject_texts(digest_t *digest, generator_t *generator) {
    (void)generator;
    for (unsigned i = 0; i <= HYST_PARAMETERS_UNSTABLE + 1U; i++) {
        digest_text(digest, hyst_parameters_error_text((hyst_parameters_error_t)i));
    }
    for (unsigned i = 0; i <= HYST_FIELD_COUNT; i++) {
        digest_text(digest, hyst_field_text((hyst_field_t)i));
    }
}

static void digest_compensator_state(digest_t *digest, const hyst_compensator_t *c, hyst_compensator_state_t *state) {
    const hyst_pi_state_t *memory = &hyst_compensator_memory(state)->prandtl_ishlinskii;
    for (uint32_t i = 0; i < c->hysteresis.prandtl_ishlinskii.operators; i++) {
        digest_add_signed(digest, hyst_pi_memory(&c->hysteresis.prandtl_ishlinskii, memory, i));
    }
    digest_add_signed(digest, memory->drive);
    digest_add_signed(digest, memory->rate);
    digest_filter_state(digest, &c->shape, &state->shape);
    for (uint32_t i = 0; i < c->creep.cells; i++) {
        digest_add_wide(digest, state->creep.level[i]);
    }
    digest_filter_state(digest, &c->equalise, &state->equalise);
    digest_add_wide(digest, hyst_transition_value(state->transition));
}

/* All modes in any order, parameters swapped under way. */
void subject_compensator(digest_t *digest, generator_t *generator) {
    generate_parameters(generator, &p[0]);
    build(&p[0], &compensator[0]);
    hyst_compensator_reset(&compensator[0], &running);
    for (unsigned pass = 0; pass < 100; pass++) {
        const hyst_compensator_t *const active = &compensator[pass & 1U];
        excitation_t excitation = {0};
        hyst_mode_t mode = HYST_MODE_PARK;
        for (unsigned k = 0; k < 250; k++) {
            if (generate_below(generator, 50) == 0) {
                mode = (hyst_mode_t)generate_below(generator, 4);
            }
            unsigned events = 0;
            digest_add_signed(digest, hyst_compensator_step(active, &running, mode,
                                                            generate_signal(generator, &excitation), &events));
            digest_add(digest, events);
        }
        digest_compensator_state(digest, active, &running);
        hyst_compensator_t *const next = &compensator[(pass + 1U) & 1U];
        generate_parameters(generator, &p[0]);
        build(&p[0], next);
        while (!hyst_compensator_adopt(active, next, &running)) {
        }
    }
}

/* A compensator of any family, with filters of gain 1, so that the histories below reach it as they are. */
static void any_family(generator_t *generator, hyst_parameters_t *parameters) {
    bouc_wen_arguments_t cells = {0}; /* on the stack: SRAM is full */
    generate_parameters(generator, parameters);
    const uint32_t family = generate_below(generator, 4);
    if (family == 1) {
        generate_preisach(generator, parameters, 1U + generate_below(generator, HYST_PREISACH_MAX_INTERVALS));
    } else if (family == 2) {
        generate_bouc_wen(generator, &cells, 1U + generate_below(generator, HYST_BOUC_WEN_MAX_CELLS));
        parameters->family = HYST_FAMILY_BOUC_WEN;
        parameters->bouc_wen_cells = cells.cells;
        parameters->bouc_wen_direct = cells.direct;
        memcpy(parameters->bouc_wen_length, cells.length, sizeof cells.length);
        memcpy(parameters->bouc_wen_slope, cells.slope, sizeof cells.slope);
    } else if (family == 3) {
        parameters->family = HYST_FAMILY_MODIFIED_PLAY;
        parameters->modified_plays = 1;
        generate_modified_play(generator, &parameters->modified_play[0],
                               1U + generate_below(generator, HYST_MODIFIED_PLAY_MAX_DIVISIONS));
    } else {
        const bool rate_dependent = generate_below(generator, 2) != 0;
        generate_hysteresis(generator, parameters, generate_below(generator, HYST_PI_MAX_OPERATORS + 1U),
                            rate_dependent);
    }
    if (family != 0) {
        parameters->pi_operators = 0;
        parameters->pi_beta = 0;
    }
    for (unsigned i = 0; i < HYST_IIR_MAX_SECTIONS; i++) {
        parameters->shape[i] = parameters->equalise[i] = (hyst_iir_section_t){.b0 = HYST_Q28_ONE};
    }
    parameters->transition_slew = 1 + (hyst_q31_t)(generate(generator) >> (1U + generate_below(generator, 31)));
}

/* Back by a part of 1/64 or less, rarely more; once in a while to anywhere. */
static hyst_q31_t next_reversal(generator_t *generator, hyst_q31_t reference) {
    if (generate_below(generator, 40) == 0) {
        return generate_signed(generator);
    }
    const int64_t part = 32768 - (int64_t)generate_below(generator, 32768U >> generate_below(generator, 6));
    return (hyst_q31_t)(-reference * part / 32768);
}

/* Every family in reversals that shrink to nothing and jumps across the range, in all modes, with transitions that take
 * from one sample to for ever, and another family after it. */
void subject_compensator_families(digest_t *digest, generator_t *generator) {
    any_family(generator, &p[0]);
    build(&p[0], &compensator[0]);
    hyst_compensator_reset(&compensator[0], &running);
    for (unsigned pass = 0; pass < 100; pass++) {
        hyst_compensator_t *const active = &compensator[pass & 1U];
        hyst_compensator_t *const next = &compensator[(pass + 1U) & 1U];
        hyst_mode_t mode = HYST_MODE_COMPENSATE;
        hyst_q31_t reference = generate_signed(generator);
        for (unsigned k = 0; k < 250; k++) {
            if (generate_below(generator, 50) == 0) {
                mode = generate_below(generator, 2) != 0 ? HYST_MODE_COMPENSATE
                                                         : (hyst_mode_t)generate_below(generator, 4);
            }
            reference = next_reversal(generator, reference);
            unsigned events = 0;
            digest_add_signed(digest, hyst_compensator_step(active, &running, mode, reference, &events));
            digest_add(digest, events);
            digest_add_wide(digest, hyst_transition_value(running.transition));
            digest_add_signed(digest, hyst_hysteresis_output(&active->hysteresis, hyst_compensator_memory(&running)));
        }
        any_family(generator, &p[0]);
        build(&p[0], next);
        while (!hyst_compensator_adopt(active, next, &running)) {
        }
    }
}

/* Limits that move along with the drive, as the loop's do: in most samples the drive that is applied is not the one
 * that was found, and the memory has to follow it all the same. In every other pass with filters that ring and
 * saturate. */
void subject_compensator_windows(digest_t *digest, generator_t *generator) {
    for (unsigned pass = 0; pass < 60; pass++) {
        any_family(generator, &p[0]);
        for (unsigned i = 0; i < HYST_IIR_MAX_SECTIONS && (pass & 1U) != 0; i++) {
            p[0].shape[i] = generate_section(generator);
            p[0].equalise[i] = generate_section(generator);
        }
        build(&p[0], &compensator[0]);
        hyst_compensator_reset(&compensator[0], &running);
        const hyst_q31_t low = compensator[0].drive_low;
        const hyst_q31_t high = compensator[0].drive_high;
        const hyst_q31_t reach = 1 + (hyst_q31_t)(generate(generator) >> (1U + generate_below(generator, 16)));
        hyst_q31_t reference = generate_signed(generator);
        for (unsigned k = 0; k < 400; k++) {
            const hyst_q31_t down = hyst_subtract(running.drive, reach);
            const hyst_q31_t up = hyst_add(running.drive, reach);
            compensator[0].drive_low = down > low ? down : low;
            compensator[0].drive_high = up < high ? up : high;
            reference = next_reversal(generator, reference);
            unsigned events = 0;
            digest_add_signed(
                digest, hyst_compensator_step(&compensator[0], &running, HYST_MODE_COMPENSATE, reference, &events));
            digest_add(digest, events);
            digest_add_wide(digest, hyst_transition_value(running.transition));
            digest_add_signed(digest,
                              hyst_hysteresis_output(&compensator[0].hysteresis, hyst_compensator_memory(&running)));
        }
    }
}
