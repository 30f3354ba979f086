/* SPDX-License-Identifier: MIT */
/**
 * Modified play models for tests: random ones, and the model in long double, written from the equations in
 * modified_play.h and sharing nothing with lib/hyst but the parameters.
 */
#ifndef TESTS_MODIFIED_PLAY_MODELS_H
#define TESTS_MODIFIED_PLAY_MODELS_H

#include "hyst/modified_play.h"
#include "random.h"

/**
 * A model that hyst_modified_play_build accepts, made wild and then pulled in until it is: any number of divisions,
 * weights of both signs, poles anywhere inside 0.98, harmonics, g, envelopes.
 */
hyst_modified_play_parameters_t modified_play_random(random_t *random, hyst_modified_play_t *model);

/** A plain model of N = 10, 2A = `direct`, all slopes of cells equal, nothing else. */
hyst_modified_play_parameters_t modified_play_plain(double direct, double cell_slope);

/** hyst_modified_play_build, failing the test on a refusal. */
hyst_modified_play_t modified_play_accept(const hyst_modified_play_parameters_t *parameters);

/** Fractions of full scale (1.0 = 2^31 units). */
typedef struct {
    hyst_modified_play_parameters_t p;
    long double play[HYST_MODIFIED_PLAY_MAX_ROWS], position[HYST_MODIFIED_PLAY_FEEDBACK];
    long double drive, rate;
    uint32_t phase;
} reference_play_t;

/** At zero, at rest. */
reference_play_t reference_play(const hyst_modified_play_parameters_t *parameters);

/** Same memory as `state`. */
void reference_play_copy(reference_play_t *reference, const hyst_modified_play_state_t *state);

/** One sample. Returns y, unsaturated. */
long double reference_play_forward(reference_play_t *reference, long double drive);

/** H of the present plays. */
long double reference_play_share(const reference_play_t *reference);

/** One sample of the implicit inverse: bisection on the forward model for the drive in [-1, 1]. */
long double reference_play_inverse(reference_play_t *reference, long double position);

#endif
