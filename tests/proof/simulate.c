/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "simulate.h"
#include "strength.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static passage_t passage_through(const case_t *item, size_t recording, const excitation_t *excitation) {
    passage_t passage = {.count = excitation->instants,
                         .step_s = 1.0 / (excitation->sample_rate_hz * OVERSAMPLING),
                         .drive_v = excitation->drive_v,
                         .actuator = &item->actuator,
                         .preload_n = item->preload_n[recording]};
    for (size_t k = 1; k < excitation->instants; k++) {
        const double rate = fabs(excitation->drive_v[k] - excitation->drive_v[k - 1]) / passage.step_s;
        passage.largest_rate_v_per_s = fmax(passage.largest_rate_v_per_s, rate);
    }
    return passage;
}

static void apply(const case_t *item, stage_t stage, passage_t *passage) {
    for (size_t place = 0; place < catalogue_effect_count + unknown_effect_count; place++) {
        const effect_t *effect = place < catalogue_effect_count ? &catalogue_effects[place]
                                                                : &unknown_effects[place - catalogue_effect_count];
        for (size_t e = 0; e < item->effects; e++) {
            if (item->effect[e].effect == effect && effect->stage == stage) {
                passage->seed = item->effect[e].seed;
                effect->apply(passage, item->effect[e].parameter);
            }
        }
    }
}

double *simulate(const case_t *item, size_t recording, const excitation_t *excitation) {
    const actuator_t *actuator = &item->actuator;
    passage_t passage = passage_through(item, recording, excitation);
    double *fine = proof_allocate(excitation->instants, sizeof *fine);
    double *growth_v = proof_allocate(excitation->instants, sizeof *growth_v);
    double *reading = proof_allocate(excitation->samples, sizeof *reading);
    random_t random = {item->seed + 1 + recording};
    double noise = random_normal(&random);

    memcpy(fine, excitation->drive_v, excitation->instants * sizeof *fine);
    passage.value = fine;
    passage.growth_v = growth_v;
    apply(item, STAGE_ELECTRONICS, &passage);
    apply(item, STAGE_HYSTERESIS, &passage);
    actuator_move(actuator, growth_v, fine, excitation->instants);
    apply(item, STAGE_POSITION, &passage);

    for (size_t k = 0; k < excitation->samples; k++) {
        const double rho = actuator->noise_correlation;
        reading[k] = fine[k * OVERSAMPLING] + actuator->noise_um * noise;
        noise = rho * noise + sqrt(1.0 - rho * rho) * random_normal(&random);
    }
    passage.value = reading;
    passage.count = excitation->samples;
    passage.step_s = 1.0 / excitation->sample_rate_hz;
    apply(item, STAGE_SAMPLES, &passage);
    for (size_t k = 0; k < excitation->samples; k++) {
        reading[k] = actuator->converter_step_um * floor(reading[k] / actuator->converter_step_um + 0.5);
    }
    free(fine);
    free(growth_v);
    return reading;
}

/* What the effect of that case, which has one, changes in the readings, over the noise: after a refit of gain and
 * offset, and after one of a bank of plays. */
static void measure(const case_t *alone, const excitation_t *excitation, double *const *without, double *strength,
                    double *visible) {
    refit_t gain = {0}, bank = {0};
    for (size_t r = 0; r < alone->recordings; r++) {
        double *change = simulate(alone, r, excitation);
        for (size_t k = 0; k < excitation->samples; k++) {
            change[k] -= without[r][k];
        }
        refit_add_gain(&gain, excitation->samples, without[r], change);
        refit_add_bank(&bank, excitation, alone->actuator.from_above, without[r], change);
        free(change);
    }
    *strength = refit_left(&gain) / alone->actuator.noise_um;
    *visible = refit_left(&bank) / alone->actuator.noise_um;
}

/* Secants in the logarithms, since strength goes with some power of size; bisection where they leave the bracket. */
static void reach(const case_t *item, presence_t *presence, const excitation_t *excitation, double *const *without) {
    enum { MOST_STEPS = 16 };
    const passage_t passage = passage_through(item, 0, excitation);
    const double wanted = presence->strength;
    case_t alone = *item;
    double size = presence->effect->typical, too_small = 0.0, too_large = HUGE_VAL, before_size = 0.0, before = 0.0;
    alone.effects = 1;
    for (int i = 0; i < MOST_STEPS; i++) {
        random_t random = {presence->seed};
        double power = 1.0;
        presence->effect->set(&passage, size, &random, presence->parameter);
        alone.effect[0] = *presence;
        measure(&alone, excitation, without, &presence->strength, &presence->visible);
        const double reached = fmax(presence->strength, 1e-3 * wanted);
        if (wanted == 0.0 || fabs(reached / wanted - 1.0) < 0.02) {
            return;
        }
        *(reached < wanted ? &too_small : &too_large) = size;
        if (before_size > 0.0 && size != before_size) {
            power = fmax(0.3, fmin(4.0, log(reached / before) / log(size / before_size)));
        }
        before_size = size;
        before = reached;
        size = fmin(presence->effect->most, size * fmax(0.1, fmin(10.0, pow(wanted / reached, 1.0 / power))));
        if (too_small > 0.0 && too_large < HUGE_VAL && (size <= too_small || size >= too_large)) {
            size = sqrt(too_small * too_large);
        }
    }
}

void reach_strengths(case_t *item, const excitation_t *excitation) {
    case_t bare = *item;
    double *without[CASE_RECORDINGS] = {NULL};
    bare.effects = 0;
    for (size_t r = 0; r < item->recordings; r++) {
        without[r] = simulate(&bare, r, excitation);
    }
    for (size_t e = 0; e < item->effects; e++) {
        reach(item, &item->effect[e], excitation, without);
    }
    for (size_t r = 0; r < item->recordings; r++) {
        free(without[r]);
    }
}
