/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lags of a bank are the same lags one by one, to the last bit. */
#include "elements/lag_bank.h"
#include "random.h"
#include "unity.h"
#include <math.h>
#include <string.h>

enum { BANKS = 200, SAMPLES = 500 };

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static first_order_lag_t some_lag(bool held, double held_since, size_t steps) {
    static const double rate_hz = 1e4;
    first_order_lag_t lag = {0};
    first_order_lag_set(&lag, rate_hz * pow(10.0, 6.0 * random_unit(&rng) - 4.0), rate_hz, steps);
    if (held) {
        first_order_lag_hold(&lag, held_since);
    }
    return lag;
}

static void expect_the_same(bool held) {
    first_order_lag_t lag[LAG_BANK_PLACES];
    lag_bank_t bank = {0};
    drive_window_t drive = {0};
    double value[SAMPLES + SIGNAL_AHEAD];
    size_t smooth = 0;
    const size_t lags = (size_t)random_between(&rng, 0, LAG_BANK_PLACES), steps = (size_t)random_between(&rng, 0, 8);
    const double held_since = random_unit(&rng), begin = random_normal(&rng);
    for (size_t j = 0; j < lags; j++) {
        lag[j] = some_lag(held, held_since, steps);
        lag_bank_add(&bank, &lag[j]);
        lag[j].output = begin;
    }
    lag_bank_settle(&bank, begin);
    drive_window_settle(&drive, begin);
    for (size_t k = 0; k < SAMPLES + SIGNAL_AHEAD; k++) { /* smooth stretches, and jumps */
        value[k] = k % 50 < 30 ? sin(0.1 * (double)k) : random_normal(&rng);
    }
    for (size_t k = 0; k < SAMPLES; k++) {
        double sum = 0.0;
        signal_t signal = {.value = value[k], .known_ahead = SIGNAL_AHEAD};
        memcpy(signal.ahead, &value[k + 1], sizeof signal.ahead);
        drive_window_next(&drive, &signal);
        for (size_t j = 0; j < lags; j++) {
            sum += first_order_lag_next(&lag[j], &drive);
        }
        TEST_ASSERT_TRUE(lag_bank_next(&bank, &drive) == sum);
        smooth += drive.smooth > 0.5 ? 1 : 0;
    }
    TEST_ASSERT_TRUE(smooth > SAMPLES / 4 && smooth < SAMPLES);
}

static void test_a_bank_is_its_lags(void) {
    rng = random_start("lag_bank", 20281128);
    for (int i = 0; i < BANKS; i++) {
        expect_the_same(i % 2 == 1);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_bank_is_its_lags);
    return UNITY_END();
}
