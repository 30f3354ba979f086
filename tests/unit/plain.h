/* SPDX-License-Identifier: MIT */
/**
 * The Prandtl-Ishlinskii model as a plain loop over all operators, in exact integers: what prandtl_ishlinskii.c must
 * equal bit for bit. Written from the equations in prandtl_ishlinskii.h; shares only the coefficients with lib/hyst.
 */
#ifndef TESTS_PLAIN_H
#define TESTS_PLAIN_H

#include "hyst/prandtl_ishlinskii.h"

typedef struct {
    int32_t memory[HYST_PI_MAX_OPERATORS];
    int32_t drive;
    int32_t rate;
} plain_t;

void plain_reset(const hyst_pi_t *model, plain_t *plain, int32_t drive);
void plain_advance(const hyst_pi_t *model, plain_t *plain, int32_t drive);
int32_t plain_output(const hyst_pi_t *model, const plain_t *plain);
int32_t plain_solve(const hyst_pi_t *model, const plain_t *plain, int32_t position, bool *saturated);

#endif
