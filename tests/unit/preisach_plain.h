/* SPDX-License-Identifier: MIT */
/**
 * The Preisach model with a division bit by bit, and a full stack's gaps looked up one by one: what lib/hyst must equal
 * bit for bit (tests/unit/test_preisach_plain.c).
 */
#ifndef TESTS_PREISACH_PLAIN_H
#define TESTS_PREISACH_PLAIN_H

#include "hyst/preisach.h"

void preisach_plain_reset(const hyst_preisach_t *model, hyst_preisach_state_t *state, hyst_q31_t drive);
void preisach_plain_advance(const hyst_preisach_t *model, hyst_preisach_state_t *state, hyst_q31_t drive);
hyst_q31_t preisach_plain_output(const hyst_preisach_t *model, const hyst_preisach_state_t *state);
hyst_q31_t preisach_plain_solve(const hyst_preisach_t *model, const hyst_preisach_state_t *state, hyst_q31_t position,
                                bool *saturated);

#endif
