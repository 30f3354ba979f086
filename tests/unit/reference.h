/* SPDX-License-Identifier: MIT */
/**
 * The Prandtl-Ishlinskii model and its published analytic inverse in long double, written from the equations of seed
 * 004 and of prandtl_ishlinskii.h, sharing no code with lib/hyst. Values are fractions of full scale (1.0 = 2^31
 * units).
 */
#ifndef TESTS_REFERENCE_H
#define TESTS_REFERENCE_H

#include "models.h"

typedef struct {
    uint32_t operators;
    long double offset, weight[HYST_PI_MAX_OPERATORS + 1], threshold[HYST_PI_MAX_OPERATORS];
    long double beta, rate_gain, kappa_limit;
    long double memory[HYST_PI_MAX_OPERATORS], drive, rate;
} reference_pi_t;

/** From the same arguments as hyst_pi_build; demagnetised, at drive 0. */
reference_pi_t reference_pi(const pi_arguments_t *arguments);

/** One sample of the forward model, unsaturated. */
long double reference_pi_forward(reference_pi_t *model, long double drive);

/** One sample of the implicit inverse: bisection on the forward model for the drive in [-1, 1] that gives `position`.
 */
long double reference_pi_inverse(reference_pi_t *model, long double position);

/** Paper 004, equations (16) to (23), rate-independent: the inverse as another Prandtl-Ishlinskii model of the
 * position.
 */
reference_pi_t reference_pi_analytic_inverse(const reference_pi_t *model);

#endif
