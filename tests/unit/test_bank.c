/* SPDX-License-Identifier: MIT */
/* The bank of runs equals the plain loop over all operators bit for bit, and its cost is bounded. */
#include "models.h"
#include "plain.h"
#include "unity.h"
#include <stdio.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

/* Drives that make histories of every kind: jumps, creeping, reversals of shrinking size (deep staircases), ends,
 * repeated values. */
typedef struct {
    int32_t drive;
    double amplitude;
    int32_t ramp;
    unsigned kind;
} drives_t;

static int32_t next_drive(drives_t *d) {
    if (random_unit(&rng) < 0.01) {
        d->kind = (unsigned)(random_bits(&rng) % 6U);
        d->amplitude = 0x1p31;
        d->ramp = random_q31(&rng) >> (random_bits(&rng) % 31U);
    }
    switch (d->kind) {
    case 0:
        return random_q31(&rng);
    case 1:
        return hyst_add(d->drive, random_between(&rng, -3, 3));
    case 2: /* spiral inwards: every reversal leaves a run */
        d->amplitude *= -(0.9 + 0.0999 * random_unit(&rng));
        return hyst_saturate((int64_t)d->amplitude);
    case 3:
        return hyst_add(d->drive, d->ramp);
    case 4:
        return random_unit(&rng) < 0.5 ? INT32_MAX : INT32_MIN;
    default:
        return d->drive;
    }
}

static void same_memory(const hyst_pi_t *model, const hyst_pi_state_t *state, const plain_t *plain) {
    for (uint32_t i = 0; i < model->operators; i++) {
        TEST_ASSERT_EQUAL_INT32(plain->memory[i], hyst_pi_memory(model, state, i));
    }
    TEST_ASSERT_EQUAL_INT32(plain->rate, state->rate);
    TEST_ASSERT_EQUAL_INT32(plain->drive, state->drive);
}

static void compare(uint32_t operators, bool rate_dependent, int samples) {
    const pi_arguments_t a = pi_random(&rng, operators, rate_dependent);
    const hyst_pi_t model = pi_accept(&a);
    hyst_pi_state_t state;
    plain_t plain;
    const int32_t start = random_q31(&rng);
    hyst_pi_reset(&model, &state, start);
    plain_reset(&model, &plain, start);
    same_memory(&model, &state, &plain);
    drives_t drives = {.drive = start, .amplitude = 0x1p31, .ramp = 1, .kind = 0};
    for (int k = 0; k < samples; k++) {
        const int32_t wanted =
            random_unit(&rng) < 0.5 ? random_q31(&rng) : hyst_add(plain_output(&model, &plain), random_q31(&rng) >> 12);
        bool bank_saturated = false;
        bool plain_saturated = false;
        const int32_t bank = hyst_pi_solve(&model, &state, wanted, &bank_saturated);
        TEST_ASSERT_EQUAL_INT32(plain_solve(&model, &plain, wanted, &plain_saturated), bank);
        TEST_ASSERT_EQUAL_INT(plain_saturated, bank_saturated);
        drives.drive = random_unit(&rng) < 0.2 ? bank : next_drive(&drives);
        hyst_pi_advance(&model, &state, drives.drive);
        plain_advance(&model, &plain, drives.drive);
        TEST_ASSERT_EQUAL_INT32(plain_output(&model, &plain), hyst_pi_output(&model, &state));
        TEST_ASSERT_TRUE(state.runs <= operators);
        if (k % 64 == 0) {
            same_memory(&model, &state, &plain);
        }
    }
    same_memory(&model, &state, &plain);
}

static void compare_all(bool rate_dependent) {
    for (int run = 0; run < 400; run++) {
        const uint32_t size = run % 4 == 0 ? HYST_PI_MAX_OPERATORS : (uint32_t)(random_bits(&rng) % 40U);
        compare(size, rate_dependent, 3000);
    }
}

static void test_equals_the_plain_loop_with_fixed_thresholds(void) {
    compare_all(false);
}

static void test_equals_the_plain_loop_with_rate_dependent_thresholds(void) {
    compare_all(true);
}

/* The deepest staircase there is, one run an operator, then one movement that wipes all of them out. */
static void test_the_deepest_staircase(void) {
    pi_arguments_t a = pi_random(&rng, HYST_PI_MAX_OPERATORS, false);
    for (uint32_t i = 0; i < a.operators; i++) {
        a.threshold[i] = (hyst_q31_t)(i + 1) * (1 << 22);
    }
    const hyst_pi_t model = pi_accept(&a);
    hyst_pi_state_t state;
    plain_t plain;
    hyst_pi_reset(&model, &state, 0);
    plain_reset(&model, &plain, 0);
    for (int i = HYST_PI_MAX_OPERATORS; i > 0; i--) {
        const int32_t drive = (i % 2 == 0 ? 1 : -1) * (i * (1 << 22) + (1 << 21));
        hyst_pi_advance(&model, &state, drive);
        plain_advance(&model, &plain, drive);
    }
    same_memory(&model, &state, &plain);
    TEST_ASSERT_EQUAL_UINT32(HYST_PI_MAX_OPERATORS, state.runs);
    hyst_pi_advance(&model, &state, INT32_MAX);
    plain_advance(&model, &plain, INT32_MAX);
    same_memory(&model, &state, &plain);
    TEST_ASSERT_EQUAL_UINT32(1, state.runs);
}

int main(void) {
    rng = random_start("test_bank", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_equals_the_plain_loop_with_fixed_thresholds);
    RUN_TEST(test_equals_the_plain_loop_with_rate_dependent_thresholds);
    RUN_TEST(test_the_deepest_staircase);
    return UNITY_END();
}
