/* SPDX-License-Identifier: MIT */
/**
 * The Bouc-Wen model with a search for each place it looks at, and the compiler's division: what lib/hyst, which keeps
 * what it has found and divides by reciprocals, must equal bit for bit (tests/unit/test_bouc_wen_plain.c).
 */
#ifndef TESTS_BOUC_WEN_PLAIN_H
#define TESTS_BOUC_WEN_PLAIN_H

#include "hyst/bouc_wen.h"

void bouc_wen_plain_reset(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive);
void bouc_wen_plain_advance(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive);
hyst_q31_t bouc_wen_plain_output(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state);
hyst_q31_t bouc_wen_plain_solve(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state, hyst_q31_t position,
                                bool *saturated);

#endif
