/* SPDX-License-Identifier: MIT */
/* fixed.h, play.h, prandtl_ishlinskii.h */
#include "conformance.h"
#include "hyst/play.h"

/* What a subject works on. Static and shared: SRAM has no room for one set each. */
static hyst_parameters_t p;
static hyst_compensator_t compensator[2];

static void digest_model_state(digest_t *digest, const hyst_pi_t *model, const hyst_pi_state_t *state) {
    for (uint32_t i = 0; i < model->operators; i++) {
        digest_add_signed(digest, hyst_pi_memory(model, state, i));
    }
    digest_add_signed(digest, state->drive);
    digest_add_signed(digest, state->rate);
}

static void fixed(digest_t *digest, int32_t a, int32_t b, int32_t c) {
    digest_add_signed(digest, hyst_add(a, b));
    digest_add_signed(digest, hyst_subtract(a, b));
    const int64_t product = hyst_product(a, b);
    digest_add_wide(digest, product);
    digest_add_signed(digest, hyst_saturate(product));
    digest_add_signed(digest, hyst_saturate((int64_t)a + b + c));
    for (unsigned shift = 1; shift <= 62; shift += 3) {
        digest_add_wide(digest, hyst_round_shift(product, shift));
    }
    digest_add_signed(digest, a <= b ? hyst_clamp(c, a, b) : hyst_clamp(c, b, a));
}

void subject_fixed(digest_t *digest, generator_t *generator) {
    for (unsigned i = 0; i < EXTREMES; i++) {
        for (unsigned j = 0; j < EXTREMES; j++) {
            fixed(digest, extremes[i], extremes[j], extremes[(i + j) % EXTREMES]);
        }
    }
    for (unsigned i = 0; i < 5000; i++) {
        const int32_t a = generate_signed(generator);
        const int32_t b = generate_signed(generator);
        fixed(digest, a, b, generate_signed(generator));
    }
}

void subject_play_and_stop(digest_t *digest, generator_t *generator) {
    for (unsigned pass = 0; pass < 40; pass++) {
        /* Thresholds from 0 to the largest. */
        const hyst_q31_t threshold =
            pass < EXTREMES && extremes[pass] >= 0 ? extremes[pass] : generate_signed(generator) & INT32_MAX;
        excitation_t excitation = {0};
        hyst_q31_t play = 0;
        hyst_q31_t stop = 0;
        hyst_q31_t previous = 0;
        for (unsigned k = 0; k < 1000; k++) {
            const hyst_q31_t input = generate_signal(generator, &excitation);
            play = hyst_play(threshold, input, play);
            stop = hyst_stop(threshold, input, previous, stop);
            previous = input;
            digest_add_signed(digest, play);
            digest_add_signed(digest, stop);
        }
    }
}

/* Wild arguments: nearly all are refused, each for the first of its reasons. */
void subject_pi_refusals(digest_t *digest, generator_t *generator) {
    static hyst_pi_t model;
    for (unsigned pass = 0; pass < 500; pass++) {
        generate_hysteresis(generator, &p, generate_below(generator, HYST_PI_MAX_OPERATORS + 1U), (pass & 1U) != 0);
        uint32_t operators = p.pi_operators;
        const int32_t wild = extremes[generate_below(generator, EXTREMES)];
        const uint32_t place = generate_below(generator, operators + 1U);
        switch (generate_below(generator, 6)) {
        case 0:
            p.pi_weight[place] = wild;
            break;
        case 1:
            p.pi_threshold[place % HYST_PI_MAX_OPERATORS] = wild;
            break;
        case 2:
            p.pi_beta = wild;
            break;
        case 3:
            p.pi_rate_gain = wild;
            break;
        case 4:
            operators = HYST_PI_MAX_OPERATORS + 1U + generate(generator) / 2U;
            break;
        default:
            p.pi_weight[place] += generate_signed(generator) / 4;
            break;
        }
        uint32_t element = 0;
        const hyst_pi_status_t status = hyst_pi_build(&model, operators, p.hysteresis_offset, p.pi_weight,
                                                      p.pi_threshold, p.pi_beta, p.pi_rate_gain, &element);
        digest_add_signed(digest, status);
        digest_add(digest, element);
    }
}

static hyst_pi_state_t state[2]; /* for all subjects: RAM is short */

/* Forward and inverse on memories of their own, from the same signal. */
void subject_pi(digest_t *digest, generator_t *generator, uint32_t operators, bool rate_dependent) {
    hyst_pi_state_t *const forward = &state[0];
    hyst_pi_state_t *const inverse = &state[1];
    const hyst_pi_t *const model = &compensator[0].hysteresis.prandtl_ishlinskii;
    hyst_parameters_default(&p);
    for (unsigned pass = 0; pass < 8; pass++) {
        generate_hysteresis(generator, &p, operators, rate_dependent);
        build(&p, &compensator[0]);
        excitation_t excitation = {0};
        const hyst_q31_t start = pass == 0 ? 0 : generate_signed(generator);
        hyst_pi_reset(model, forward, start);
        hyst_pi_reset(model, inverse, start);
        for (unsigned k = 0; k < 1000; k++) {
            const hyst_q31_t signal = generate_signal(generator, &excitation);
            digest_add_signed(digest, hyst_pi_forward(model, forward, signal));
            bool saturated = false;
            digest_add_signed(digest, hyst_pi_inverse(model, inverse, signal, &saturated));
            digest_add(digest, saturated ? 1 : 0);
        }
        digest_model_state(digest, model, forward);
        digest_model_state(digest, model, inverse);
    }
}

void subject_pi_carry(digest_t *digest, generator_t *generator) {
    static const uint32_t counts[] = {0, 1, 10, HYST_PI_MAX_OPERATORS};
    hyst_parameters_default(&p);
    for (unsigned pass = 0; pass < 64; pass++) {
        const hyst_pi_t *const from = &compensator[0].hysteresis.prandtl_ishlinskii;
        const hyst_pi_t *const to = &compensator[1].hysteresis.prandtl_ishlinskii;
        generate_hysteresis(generator, &p, counts[pass & 3U], (pass & 16U) != 0);
        build(&p, &compensator[0]);
        generate_hysteresis(generator, &p, counts[pass >> 2U & 3U], (pass & 32U) != 0);
        build(&p, &compensator[1]);
        excitation_t excitation = {0};
        hyst_pi_reset(from, &state[0], 0);
        for (unsigned k = 0; k < 200; k++) {
            hyst_pi_advance(from, &state[0], generate_signal(generator, &excitation));
        }
        uint32_t carried = 0;
        while (!hyst_pi_carry(from, &state[0], to, &state[1], &carried)) {
        }
        digest_model_state(digest, to, &state[1]);
    }
}
