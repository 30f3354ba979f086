/* SPDX-License-Identifier: MIT */
/**
 * Prandtl-Ishlinskii models for tests: random ones, adversarial ones and the one that paper 004 publishes.
 */
#ifndef TESTS_MODELS_H
#define TESTS_MODELS_H

#include "hyst/prandtl_ishlinskii.h"
#include "random.h"

/** The arguments of hyst_pi_build, so that a test can also build its own reference from them. */
typedef struct {
    uint32_t operators;
    hyst_q31_t offset;
    hyst_q28_t weight[HYST_PI_MAX_OPERATORS + 1];
    hyst_q31_t threshold[HYST_PI_MAX_OPERATORS];
    hyst_q20_t beta;
    hyst_q30_t rate_gain;
} pi_arguments_t;

/**
 * Random model: slopes between 2^-8 and 4 with both signs of weights, thresholds anywhere. With rate_dependent, beta is
 * random up to 100 samples and g is the largest that the stability rule allows, times a random factor.
 */
pi_arguments_t pi_random(random_t *random, uint32_t operators, bool rate_dependent);

/**
 * Seed 004, section III.B: ten operators, sampled at 5 kHz. Full scale is 10 V and 40 um; g = `rate_gain`.
 */
pi_arguments_t pi_seed_004(hyst_q30_t rate_gain);

/** hyst_pi_build, failing the test on a refusal. */
hyst_pi_t pi_accept(const pi_arguments_t *arguments);

/** hyst_pi_carry until it is done, which has to be at once for short memories and within its bound for all. */
void pi_carry(const hyst_pi_t *from, const hyst_pi_state_t *from_state, const hyst_pi_t *to, hyst_pi_state_t *to_state);

#endif
