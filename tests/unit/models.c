/* SPDX-License-Identifier: MIT */
#include "models.h"
#include "unity.h"
#include <math.h>

/* Largest g <= 1 with -0.45 <= g beta (S_j - S_0) / S_j <= 0.9 for all j. */
static double largest_rate_gain(const pi_arguments_t *a) {
    double gain = 1.0;
    double slope = a->weight[0];
    for (uint32_t j = 1; j <= a->operators; j++) {
        slope += a->weight[j];
        const double feedback = a->beta / 0x1p20 * (slope - a->weight[0]) / slope;
        if (feedback * gain > 0.9) {
            gain = 0.9 / feedback;
        }
        if (feedback * gain < -0.45) {
            gain = -0.45 / feedback;
        }
    }
    return gain;
}

pi_arguments_t pi_random(random_t *random, uint32_t operators, bool rate_dependent) {
    pi_arguments_t a = {.operators = operators, .offset = random_q31(random) / 8, .rate_gain = HYST_Q30_ONE};
    /* Slopes wander, so that weights have both signs; their total variation stays below 4. */
    double slope = random_unit(random) < 0.5 ? 0.02 + 0.9 * random_unit(random) : 2.0 * random_unit(random) + 0.02;
    const double step = (3.9 - slope) / (operators + 1.0);
    const double fall = random_unit(random); /* how often slopes shrink again */
    a.weight[0] = (hyst_q28_t)(slope * HYST_Q28_ONE);
    for (uint32_t j = 1; j <= operators; j++) {
        double next = slope + step * ((1.0 + fall) * random_unit(random) - fall);
        next = fmax(next, 1.0 / 250.0);
        a.weight[j] = (hyst_q28_t)((next - slope) * HYST_Q28_ONE);
        slope = next;
    }
    /* Thresholds: distinct, from a few units of 2^-31 to full scale; gaps of very different size. */
    const double reach = random_unit(random) * 0.9 + 0.05;
    double at = 0.0;
    for (uint32_t i = 0; i < operators; i++) {
        const double gap = random_unit(random) < 0.1 ? 0x1p-30 : 2.0 * reach / operators * random_unit(random);
        at = fmin(at + gap, 0.999 - (operators - i) * 0x1p-29);
        a.threshold[i] = (hyst_q31_t)(at * 0x1p31) + (hyst_q31_t)(2 * i + 1);
    }
    if (rate_dependent) {
        a.beta = (hyst_q20_t)(exp(random_unit(random) * log(100.0)) * HYST_Q20_ONE);
        a.rate_gain = (hyst_q30_t)(largest_rate_gain(&a) * (0.3 + 0.69 * random_unit(random)) * HYST_Q30_ONE);
    }
    return a;
}

pi_arguments_t pi_seed_004(hyst_q30_t rate_gain) {
    static const double published[] = {0.8515, 0.6893,  0.01442, 0.2657, 0.0111, 0.1761,
                                       0.0001, -0.0573, 0.0007,  -0.5,   0.8895};
    pi_arguments_t a = {.operators = 10, .rate_gain = rate_gain};
    for (uint32_t j = 0; j <= a.operators; j++) {
        a.weight[j] = (hyst_q28_t)lround(published[j] * 10.0 / 40.0 * HYST_Q28_ONE);
    }
    for (uint32_t i = 0; i < a.operators; i++) {
        a.threshold[i] = (hyst_q31_t)lround(0.42067 * (i + 1) / 10.0 * 0x1p31);
    }
    a.beta = (hyst_q20_t)lround(4.1317e-4 / 0.2e-3 * HYST_Q20_ONE);
    return a;
}

hyst_pi_t pi_accept(const pi_arguments_t *a) {
    hyst_pi_t model;
    uint32_t element = 0;
    const hyst_pi_status_t status =
        hyst_pi_build(&model, a->operators, a->offset, a->weight, a->threshold, a->beta, a->rate_gain, &element);
    TEST_ASSERT_EQUAL_INT_MESSAGE(HYST_PI_OK, status, "the test's model must be accepted");
    return model;
}

void pi_carry(const hyst_pi_t *from, const hyst_pi_state_t *from_state, const hyst_pi_t *to,
              hyst_pi_state_t *to_state) {
    uint32_t carried = 0;
    uint32_t calls = 1;
    while (!hyst_pi_carry(from, from_state, to, to_state, &carried)) {
        TEST_ASSERT_EQUAL_UINT32(calls * HYST_PI_CARRY_RUNS, carried);
        calls++;
    }
    TEST_ASSERT_TRUE(calls <= HYST_PI_CARRY_CALLS);
    TEST_ASSERT_TRUE(calls == 1 || from_state->runs > HYST_PI_CARRY_RUNS);
}
