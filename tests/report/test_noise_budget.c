/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The shares of a residual are found where they are, as large as they are. */
#include "random.h"
#include "report/noise_budget.h"
#include <math.h>
#include <string.h>
#include <unity.h>

enum { SAMPLES = 8192 };
static const double rate_hz = 1000.0, noise_um = 0.01, turn = 6.283185307179586;

static double residual[SAMPLES], left[SAMPLES], hum[SAMPLES], slow[SAMPLES];
static random_t rng;
static noise_t noise;

/* Hum of 50 Hz with 0.03 um rms, something slow of 2 Hz with 0.02 um, white noise. */
void setUp(void) {
    noise = (noise_t){.sigma_um = noise_um, .rms_um = noise_um};
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz;
        hum[k] = 0.03 * sqrt(2.0) * sin(turn * 50.0 * t);
        slow[k] = 5.0 + 0.02 * sqrt(2.0) * sin(turn * 2.0 * t); /* a constant is no matter of frequency */
        left[k] = noise_um * random_normal(&rng);
        residual[k] = hum[k] + slow[k] + left[k];
    }
}

void tearDown(void) {
}

static noise_budget_t work_out(size_t shares) {
    noise_budget_t budget;
    const budget_input_t input = {.residual_um = residual,
                                  .left_um = left,
                                  .shares = shares,
                                  .share_um = {hum, slow},
                                  .name = {"mains_interference", "creep"},
                                  .samples = SAMPLES,
                                  .sample_rate_hz = rate_hz,
                                  .noise = &noise};
    noise_budget(&input, &budget);
    return budget;
}

static void test_shares_stand_in_their_bands(void) {
    const noise_budget_t b = work_out(2);
    TEST_ASSERT_EQUAL_UINT64(4, b.bands); /* 0.12, 1, 10, 100, 500 Hz */
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 10.0, b.band[1].high_hz);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 500.0, b.band[3].high_hz);
    TEST_ASSERT_DOUBLE_WITHIN(3e-4, 0.02, b.band[1].share_um[1]);
    TEST_ASSERT_DOUBLE_WITHIN(3e-4, 0.03, b.band[2].share_um[0]);
    TEST_ASSERT_DOUBLE_WITHIN(3e-4, 0.0, b.band[3].share_um[0]);
    /* White noise: its power is that of the band's width. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, noise_um * sqrt(400.0 / 500.0), b.band[3].noise_um);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, noise_um, b.all.noise_um);
    for (size_t i = 0; i < b.bands; i++) {
        TEST_ASSERT_EQUAL_DOUBLE(0.0, b.band[i].unexplained_um);
    }
    const double whole = sqrt(0.03 * 0.03 + 0.02 * 0.02 + noise_um * noise_um);
    TEST_ASSERT_DOUBLE_WITHIN(5e-4, whole, b.all.total_um);
    TEST_ASSERT_DOUBLE_WITHIN(5e-4, whole, b.all.residual_um);
}

static void test_what_no_block_explains_is_unexplained(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        left[k] += slow[k];
    }
    const noise_budget_t b = work_out(1);
    TEST_ASSERT_DOUBLE_WITHIN(5e-4, 0.02, b.band[1].unexplained_um);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, b.band[3].unexplained_um);
    TEST_ASSERT_DOUBLE_WITHIN(5e-4, 0.02, b.all.unexplained_um);
}

int main(void) {
    rng = random_start("noise_budget", 20261123);
    UNITY_BEGIN();
    RUN_TEST(test_shares_stand_in_their_bands);
    RUN_TEST(test_what_no_block_explains_is_unexplained);
    return UNITY_END();
}
