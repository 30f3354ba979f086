/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Which samples are held out of drives that repeat themselves: none at a phase that no fit sees. */
#include "diagnosis/noise/samples.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>

enum { MOST_PERIOD = 3600 };

void setUp(void) {
}
void tearDown(void) {
}

/* The part of the held-out samples of a sine that no fitted one is near to: at most a fortieth of a period away. */
static double part_alone(size_t periods, size_t period, double *held_part) {
    const double weight = 0.1;
    const size_t count = periods * period, near = period / 40;
    recording_t recording;
    model_t model;
    samples_t samples;
    failure_t failure;
    bool fitted[MOST_PERIOD] = {false};
    size_t alone = 0;
    recording_create(&recording, "periods", 1000.0, count);
    for (size_t k = 0; k < count; k++) {
        const double drive = sin(2.0 * M_PI * (double)k / (double)period);
        recording.column[COLUMN_DRIVE][k] = 50.0 + 50.0 * drive;
        recording.column[COLUMN_DISPLACEMENT][k] = 5.0 * drive;
    }
    make_bank_model(&model, 1000.0, 0.0, 0, &weight, NULL);
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&samples, &model, &recording, 1, &failure), failure.text);
    for (size_t k = 0; k < count; k++) {
        fitted[k % period] = fitted[k % period] || samples.part[k] == SAMPLE_FITTED;
    }
    for (size_t k = 0; k < count; k++) {
        bool there = false;
        for (size_t d = 0; d <= 2 * near; d++) {
            there = there || fitted[(k + period + d - near) % period];
        }
        alone += samples.part[k] == SAMPLE_HELD_OUT && !there ? 1 : 0;
    }
    *held_part = (double)samples.held / (double)(samples.held + samples.fitted);
    const double part = (double)alone / (double)samples.held;
    samples_close(&samples);
    model_free(&model);
    recording_free(&recording);
    return part;
}

/* Every third of 36 blocks of 6 or 12 periods is always the same part of them: all that is held out would be alone. */
static void test_no_phase_is_only_held_out(void) {
    static const size_t periods[] = {4, 5, 6, 7, 9, 10, 12, 18, 24, 36, 40};
    for (size_t i = 0; i < sizeof periods / sizeof periods[0]; i++) {
        double held_part;
        const size_t period = MOST_PERIOD / periods[i] * 2;
        const double alone = part_alone(periods[i], period, &held_part);
        printf("%zu periods: %.3f of the held-out samples alone, %.3f held out\n", periods[i], alone, held_part);
        TEST_ASSERT_TRUE(alone < 0.1);
        TEST_ASSERT_TRUE(held_part > 0.2 && held_part < 0.45); /* a third, but for whole blocks */
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_no_phase_is_only_held_out);
    return UNITY_END();
}
