/* SPDX-License-Identifier: MIT */
/* The exact inverse of the Preisach model: composition with the forward model over random and adversarial samples. */
#include "composition.h"
#include "preisach_models.h"
#include "unity.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

/*
 * References: reachable ones from a walk of the drive, and what hurts: outputs at stacked reversals and at levels, one
 * unit beside them, stand-still, full-scale jumps, both ends, and reversals that come ever closer, which fill the
 * stack.
 */
typedef enum { REST, STEPS, RAMP, JUMP, REVERSAL, LEVEL, CLOSER, EXTREME, ANY_POSITION, KINDS } kind_t;

static hyst_q31_t reachable(const hyst_preisach_t *model, const hyst_preisach_state_t *state, hyst_q31_t drive) {
    hyst_preisach_state_t probe = *state;
    return hyst_preisach_forward(model, &probe, drive);
}

static hyst_q31_t level(const hyst_preisach_t *model, uint32_t i) {
    return hyst_saturate(INT32_MIN + ((int64_t)i << 32) / model->intervals);
}

static hyst_q31_t reference_sample(const hyst_preisach_t *model, const hyst_preisach_state_t *state, kind_t kind,
                                   hyst_q31_t *ramp) {
    const hyst_q31_t beside = random_between(&rng, -1, 1);
    switch (kind) {
    case REST:
        return hyst_preisach_output(model, state);
    case STEPS:
        return hyst_add(hyst_preisach_output(model, state), random_between(&rng, -3, 4));
    case RAMP:
        if (random_unit(&rng) < 0.01) {
            *ramp = random_q31(&rng) >> (random_bits(&rng) % 31U);
        }
        return reachable(model, state, hyst_add(state->now.drive, *ramp));
    case JUMP:
        return reachable(model, state, random_q31(&rng));
    case REVERSAL:
        return hyst_add(hyst_saturate(hyst_round_shift(
                            state->extreme[random_between(&rng, 0, (int32_t)state->extremes - 1)].output, 29)),
                        beside);
    case LEVEL:
        return hyst_add(reachable(model, state, level(model, (uint32_t)(random_bits(&rng) % (model->intervals + 1U)))),
                        beside);
    case CLOSER: { /* 97 % of the way back to the reversal before */
        const int64_t back = (int64_t)state->extreme[state->extremes - 1U].drive - state->now.drive;
        return reachable(model, state, hyst_saturate(state->now.drive + back * 97 / 100));
    }
    case EXTREME:
        return random_unit(&rng) < 0.5 ? INT32_MIN : INT32_MAX;
    case ANY_POSITION:
    case KINDS:
        break;
    }
    return random_q31(&rng);
}

typedef struct {
    uint64_t composed, saturated, merged;
    int64_t worst; /* units of 2^-31, without the samples at which branches were merged */
    uint32_t deepest;
} composition_t;

static void compose(const hyst_preisach_t *model, int samples, composition_t *total) {
    hyst_preisach_state_t inverse, forward;
    hyst_preisach_reset(model, &inverse, 0);
    hyst_preisach_reset(model, &forward, 0);
    const slopes_t slopes = preisach_slopes(model);
    /* Rounding the drive moves the output by at most half the steepest slope, rounding the output adds 1/2. The output
     * inside is floored at 2^-60, a few times a sample: far below 2^-26 units. The error is an integer. */
    const double bound = floor(0.5 * slopes.steepest + 0.5 + 0x1p-26);
    const double merge_bound = 0x1p32 / 63.0 * (slopes.steepest - slopes.flattest) + bound;
    hyst_q31_t ramp = 1;
    kind_t kind = REST;
    for (int k = 0; k < samples; k++) {
        if (random_unit(&rng) < 0.01) {
            kind = (kind_t)(random_bits(&rng) % KINDS);
        }
        const hyst_q31_t wanted = reference_sample(model, &inverse, kind, &ramp);
        const bool full = inverse.extremes == HYST_PREISACH_MAX_EXTREMES;
        bool saturated = false;
        const hyst_q31_t drive = hyst_preisach_inverse(model, &inverse, wanted, &saturated);
        const hyst_q31_t got = hyst_preisach_forward(model, &forward, drive);
        total->deepest = inverse.extremes > total->deepest ? inverse.extremes : total->deepest;
        const bool merged = full && inverse.extremes == HYST_PREISACH_MAX_EXTREMES - 1U;
        if (saturated) {
            /* No drive reaches it: the answer is the end of the range, on the right side. */
            TEST_ASSERT_TRUE((drive == INT32_MAX && got <= wanted) || (drive == INT32_MIN && got >= wanted));
            total->saturated++;
            continue;
        }
        const double error = fabs((double)got - wanted);
        if (merged) {
            total->merged++;
            TEST_ASSERT_TRUE_MESSAGE(error <= merge_bound, "merging moved the output by more than its bound");
            continue;
        }
        TEST_ASSERT_TRUE_MESSAGE(error <= bound, "composition error above its bound");
        total->worst = (int64_t)error > total->worst ? (int64_t)error : total->worst;
        total->composed++;
    }
}

static composition_t composition(uint32_t intervals, uint64_t samples) {
    composition_t total = {0};
    while (total.composed < samples) {
        preisach_arguments_t a = preisach_random(&rng, intervals);
        if (random_unit(&rng) < 0.3) {
            a = preisach_smooth(intervals, 0.3 + random_unit(&rng), 0.15 * random_unit(&rng));
        }
        const hyst_preisach_t model = preisach_accept(&a);
        compose(&model, 20000, &total);
    }
    printf("%2" PRIu32 " intervals: %" PRIu64 " samples (and %" PRIu64 " out of reach, %" PRIu64
           " with a merge), deepest stack %" PRIu32 ", worst error %" PRId64 " * 2^-31\n",
           intervals, total.composed, total.saturated, total.merged, total.deepest, total.worst);
    return total;
}

static void test_composition(void) {
    static const uint32_t grids[] = {1, 2, 3, 7, 16, 20, 29, HYST_PREISACH_MAX_INTERVALS};
    const size_t count = sizeof grids / sizeof grids[0];
    uint64_t saturated = 0;
    uint64_t merged = 0;
    for (size_t k = 0; k < count; k++) {
        const composition_t total = composition(grids[k], composition_samples() / count + 1U);
        saturated += total.saturated;
        merged += total.merged;
    }
    TEST_ASSERT_TRUE(saturated > 0 && merged > 0); /* the adversary did get there */
}

/* Inverse after forward: the drive is found again to within the rounding of the position, 1/2 unit divided by the
 * flattest slope, and its own. */
static void test_inverse_of_forward(void) {
    for (int run = 0; run < 300; run++) {
        const preisach_arguments_t a = preisach_random(&rng, 1U + (uint32_t)(random_bits(&rng) % 30U));
        const hyst_preisach_t model = preisach_accept(&a);
        const double bound = 0.5 / preisach_slopes(&model).flattest + 0.5 + 0x1p-18; /* 2^-26 over 2^-8 */
        hyst_preisach_state_t state;
        hyst_preisach_reset(&model, &state, 0);
        for (int k = 0; k < 500; k++) {
            const hyst_q31_t drive = random_q31(&rng);
            hyst_preisach_state_t next = state;
            const hyst_q31_t position = hyst_preisach_forward(&model, &next, drive);
            if (position < INT32_MAX && position > INT32_MIN) {
                bool saturated = false;
                const hyst_q31_t found = hyst_preisach_solve(&model, &state, position, &saturated);
                TEST_ASSERT_TRUE(fabs((double)found - drive) <= bound);
            }
            state = next;
        }
    }
}

/* Out of reach and back: the end of the range meanwhile, exact at the next reachable sample. */
static void test_recovers_from_saturation_at_once(void) {
    const preisach_arguments_t a = preisach_smooth(30, 0.3, 0.05);
    const hyst_preisach_t model = preisach_accept(&a);
    hyst_preisach_state_t state;
    hyst_preisach_reset(&model, &state, 0);
    for (int k = 0; k < 100; k++) {
        bool saturated = false;
        TEST_ASSERT_EQUAL_INT32(INT32_MAX, hyst_preisach_inverse(&model, &state, INT32_MAX, &saturated));
        TEST_ASSERT_TRUE(saturated);
        saturated = false;
        (void)hyst_preisach_inverse(&model, &state, k * 1000000, &saturated);
        TEST_ASSERT_FALSE(saturated);
        TEST_ASSERT_INT32_WITHIN(1, k * 1000000, hyst_preisach_output(&model, &state));
        TEST_ASSERT_EQUAL_INT32(INT32_MIN, hyst_preisach_inverse(&model, &state, INT32_MIN, &saturated));
        TEST_ASSERT_TRUE(saturated);
    }
}

/* A steep last interval: the answer lies above the last drive of Q31 by less than half a unit of it. */
static void test_an_answer_that_rounds_beyond_the_range(void) {
    enum { N = 30, STEP = HYST_Q28_ONE / 30 };
    preisach_arguments_t a = {.intervals = N, .offset = 0};
    for (uint32_t i = 1; i <= N; i++) {
        for (uint32_t j = 0; j < i; j++) {
            /* Slope 0.5, and 3.5 in the last interval. */
            a.everett[i * (i - 1U) / 2U + j] = STEP * (int32_t)(i - j) + (i == N ? 6 * STEP : 0);
        }
    }
    const hyst_preisach_t model = preisach_accept(&a);
    hyst_preisach_state_t state;
    hyst_preisach_reset(&model, &state, INT32_MIN);
    const hyst_q31_t top = 4 * a.everett[HYST_PREISACH_ELEMENTS(N) - N]; /* E(N,0) / 2, which no drive reaches */
    bool saturated = false;
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, hyst_preisach_solve(&model, &state, top - 1, &saturated));
    TEST_ASSERT_TRUE(saturated);
    saturated = false;
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, hyst_preisach_solve(&model, &state, top - 3, &saturated));
    TEST_ASSERT_FALSE(saturated);
}

int main(void) {
    rng = random_start("test_preisach_inverse", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_composition);
    RUN_TEST(test_inverse_of_forward);
    RUN_TEST(test_an_answer_that_rounds_beyond_the_range);
    RUN_TEST(test_recovers_from_saturation_at_once);
    return UNITY_END();
}
