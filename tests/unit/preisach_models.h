/* SPDX-License-Identifier: MIT */
/**
 * Preisach models for tests: random and adversarial tables, and the model in long double as paper 002 writes it, which
 * shares no code with lib/hyst.
 */
#ifndef TESTS_PREISACH_MODELS_H
#define TESTS_PREISACH_MODELS_H

#include "hyst/preisach.h"
#include "random.h"

/** The arguments of hyst_preisach_build. */
typedef struct {
    uint32_t intervals;
    hyst_q31_t offset;
    hyst_q28_t everett[HYST_PREISACH_MAX_ELEMENTS];
} preisach_arguments_t;

/** Smallest and largest difference of neighbouring elements that is accepted. */
int32_t preisach_least_step(uint32_t intervals);
int64_t preisach_largest_step(uint32_t intervals);

/**
 * A table that is just acceptable everywhere: each element is drawn between the bounds that its neighbours leave, and
 * often lies on one of them. Weights of both signs, slopes from 2^-8 to 4.
 */
preisach_arguments_t preisach_random(random_t *random, uint32_t intervals);

/** Smooth: E = slope d + curve d^2 over the distance d of the two drives (full scale 2), with an even part. */
preisach_arguments_t preisach_smooth(uint32_t intervals, double slope, double curve);

/** hyst_preisach_build, failing the test on a refusal. */
hyst_preisach_t preisach_accept(const preisach_arguments_t *arguments);

/** hyst_preisach_carry until it is done. */
void preisach_carry(const hyst_preisach_t *from, const hyst_preisach_state_t *from_state, const hyst_preisach_t *to,
                    hyst_preisach_state_t *to_state);

/** Steepest and flattest branch of a table, position full scale per drive full scale. */
typedef struct {
    double flattest, steepest;
} slopes_t;
slopes_t preisach_slopes(const hyst_preisach_t *model);

#define REFERENCE_EXTREMES 4096

/**
 * The model in long double. The past is a list of the unforgotten reversals, of any length, and every output is the
 * whole sum of paper 002, (2.18) and (2.22), from the lower end of the range. Values are fractions of full scale.
 */
typedef struct {
    uint32_t intervals;
    long double lowest; /**< output at the lower end */
    long double everett[HYST_PREISACH_MAX_ELEMENTS];
    uint32_t extremes;
    long double extreme[REFERENCE_EXTREMES]; /**< maximum, minimum, maximum ... */
    long double drive;
} preisach_reference_t;

/** At the lower end. The arguments need not be acceptable. */
void preisach_reference_begin(preisach_reference_t *reference, const preisach_arguments_t *arguments);

/** One sample, unsaturated. */
long double preisach_reference_forward(preisach_reference_t *reference, long double drive);

#endif
