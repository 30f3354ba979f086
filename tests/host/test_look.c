/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Single readings, changes that are none, and recordings that are too short. */
#include "one_look.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <string.h>

/* One reading is 1 um off, or 40 deviations, where the position moves by 0.06 um a sample. The error of the prediction
 * is the noise, and a little of the neighbours'. It was 0.3 um too small, or not seen. */
static void test_size_of_a_wrong_reading_in_motion(void) {
    static const double size_um[] = {1.0, 0.2};
    for (size_t i = 0; i < 2; i++) {
        for (size_t k = 0; k < SAMPLES; k++) {
            drive()[k] = 50.0 - 50.0 * cos(2.0 * M_PI * (double)k / 500.0);
            position()[k] = 0.1 * drive()[k] + 0.005 * random_normal(&rng);
        }
        position()[2222] += size_um[i];
        see();
        TEST_ASSERT_EQUAL_UINT64(1, look.wrong.count);
        TEST_ASSERT_EQUAL_UINT64(2222, look.wrong.at[0]);
        TEST_ASSERT_DOUBLE_WITHIN(6.0 * 0.005, size_um[i], look.wrong.largest_um);
        look_free(&look);
    }
}

/* A lossy actuator has another gain at another speed, as no sensor has that is switched: 4 Hz, then 40 Hz. */
static void test_another_speed_is_no_switch(void) {
    model_t bank;
    make_fine_bank_model(&bank, rate_hz, 50);
    for (size_t k = 0; k < SAMPLES; k++) {
        const double hz = k < SAMPLES / 2 ? 4.0 : 40.0, t = (double)k / rate_hz;
        drive()[k] = 50.0 + 48.0 * sin(2.0 * M_PI * hz * t) * (1.0 - 0.2 * sin(7.0 * t));
    }
    measure_with(&recording, &bank, &block_dielectric_loss, (const double[]){0.05}, 0.01, &rng);
    see();
    TEST_ASSERT_EQUAL_UINT64(0, look.changes.switches);
    look_free(&look);
    model_free(&bank);
}

static void test_too_short(void) {
    recording.samples = 63;
    TEST_ASSERT_FALSE(look_at(&recording, &look, &failure));
    TEST_ASSERT_NOT_NULL(strstr(failure.text, "63 samples"));
}

int main(void) {
    rng = random_start("look", 20260717U);
    UNITY_BEGIN();
    RUN_TEST(test_size_of_a_wrong_reading_in_motion);
    RUN_TEST(test_another_speed_is_no_switch);
    RUN_TEST(test_too_short);
    return UNITY_END();
}
