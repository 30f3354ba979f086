/* SPDX-License-Identifier: MIT */
/**
 * The play bank of runs without keys: every probe of a search works out the position at its corner
 * from the run's line and prefix sums, advance searches anew whatever solve found, and the compiler divides. What
 * lib/hyst makes faster must equal it bit for bit, run by run: tests/unit/test_bank_runs.c.
 */
#ifndef TESTS_RUN_BANK_H
#define TESTS_RUN_BANK_H

#include "hyst/prandtl_ishlinskii.h"

typedef struct {
    uint32_t operators;
    hyst_q31_t offset;
    hyst_q28_t slope[HYST_PI_MAX_OPERATORS + 1];
    hyst_q31_t threshold[HYST_PI_MAX_OPERATORS];
    int64_t moment[HYST_PI_MAX_OPERATORS + 1]; /**< sums of w_i a_i */
    hyst_q31_t kappa_limit;
    hyst_q20_t beta;
    hyst_q30_t rate_gain;
} run_bank_t;

typedef struct {
    int64_t level, outer;
    uint16_t end;
    int8_t side;
} run_bank_run_t;

typedef struct {
    uint32_t runs;
    run_bank_run_t run[HYST_PI_MAX_OPERATORS];
    hyst_q31_t drive;
    hyst_q30_t rate;
} run_bank_state_t;

/** The same coefficients. */
run_bank_t run_bank_of(const hyst_pi_t *model);

void run_bank_reset(const run_bank_t *model, run_bank_state_t *state, hyst_q31_t drive);
void run_bank_advance(const run_bank_t *model, run_bank_state_t *state, hyst_q31_t drive);
hyst_q31_t run_bank_memory(const run_bank_t *model, const run_bank_state_t *state, uint32_t index);
hyst_q31_t run_bank_output(const run_bank_t *model, const run_bank_state_t *state);
hyst_q31_t run_bank_solve(const run_bank_t *model, const run_bank_state_t *state, hyst_q31_t position, bool *saturated);
bool run_bank_carry(const run_bank_t *from, const run_bank_state_t *from_state, const run_bank_t *to,
                    run_bank_state_t *to_state, uint32_t *carried);

#endif
