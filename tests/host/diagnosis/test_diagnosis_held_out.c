/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Which samples are held out of drives that repeat themselves: none on a path that no fit sees. */
#include "diagnosis/noise/samples.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_PERIOD = 3600, MOST_PERIODS = 40, WIDTHS = 5 };

void setUp(void) {
}
void tearDown(void) {
}

/* The part of the held-out samples that no fitted one is near to on the same path: at most a fortieth of a period away.
 * path: of each period, its number. Frees the recording. */
static double part_alone(recording_t *recording, size_t period, const size_t *path, double *held_part) {
    static bool fitted[WIDTHS][MOST_PERIOD];
    const double weight = 0.1;
    const size_t near = period / 40;
    model_t model;
    samples_t samples;
    failure_t failure;
    size_t alone = 0;
    memset(fitted, 0, sizeof fitted);
    make_bank_model(&model, 1000.0, 0.0, 0, &weight, NULL);
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&samples, &model, recording, 1, &failure), failure.text);
    for (size_t k = 0; k < recording->samples; k++) {
        fitted[path[k / period]][k % period] |= samples.part[k] == SAMPLE_FITTED;
    }
    for (size_t k = 0; k < recording->samples; k++) {
        bool there = false;
        for (size_t d = 0; d <= 2 * near; d++) {
            there = there || fitted[path[k / period]][(k + period + d - near) % period];
        }
        alone += samples.part[k] == SAMPLE_HELD_OUT && !there ? 1 : 0;
    }
    *held_part = (double)samples.held / (double)(samples.held + samples.fitted);
    const double part = (double)alone / (double)samples.held;
    samples_close(&samples);
    model_free(&model);
    recording_free(recording);
    return part;
}

/* Of a sine. */
static double part_alone_of_periods(size_t periods, size_t period, double *held_part) {
    static const size_t one_path[MOST_PERIODS];
    recording_t recording;
    recording_create(&recording, "periods", 1000.0, periods * period);
    for (size_t k = 0; k < recording.samples; k++) {
        const double drive = sin(2.0 * M_PI * (double)k / (double)period);
        recording.column[COLUMN_DRIVE][k] = 50.0 + 50.0 * drive;
        recording.column[COLUMN_DISPLACEMENT][k] = 5.0 * drive;
    }
    return part_alone(&recording, period, one_path, held_part);
}

/* Every third of 36 blocks of 6 or 12 periods is always the same part of them: all that is held out would be alone. */
static void test_no_phase_is_only_held_out(void) {
    static const size_t periods[] = {4, 5, 6, 7, 9, 10, 12, 18, 24, 36, 40};
    for (size_t i = 0; i < sizeof periods / sizeof periods[0]; i++) {
        double held_part;
        const size_t period = MOST_PERIOD / periods[i] * 2;
        const double alone = part_alone_of_periods(periods[i], period, &held_part);
        printf("%zu periods: %.3f of the held-out samples alone, %.3f held out\n", periods[i], alone, held_part);
        TEST_ASSERT_TRUE(alone < 0.1);
        TEST_ASSERT_TRUE(held_part > 0.2 && held_part < 0.45); /* a third, but for whole blocks */
    }
}

/* Triangles of 1000 samples, of one width after another, so often each: 12 together. Every third of 36 blocks is the
 * same third of each triangle. Returns the part of the held-out samples whose place on their triangle no fit sees. */
static double part_alone_of_widths(const size_t times[WIDTHS]) {
    enum { PERIOD = 1000, PERIODS = 12, COUNT = PERIOD * PERIODS };
    static const double width_v[WIDTHS] = {120.0, 48.0, 30.0, 72.0, 96.0};
    recording_t recording;
    double held_part;
    size_t width_of[PERIODS], periods = 0;
    for (size_t i = 0; i < WIDTHS; i++) {
        for (size_t n = 0; n < times[i]; n++) {
            width_of[periods++] = i;
        }
    }
    TEST_ASSERT_EQUAL_UINT(PERIODS, periods);
    recording_create(&recording, "widths", 1000.0, COUNT);
    for (size_t k = 0; k < COUNT; k++) {
        const double phase = (double)(k % PERIOD) / PERIOD, up = phase < 0.5 ? 4.0 * phase - 1.0 : 3.0 - 4.0 * phase;
        recording.column[COLUMN_DRIVE][k] = 40.0 + 0.5 * width_v[width_of[k / PERIOD]] * up;
        recording.column[COLUMN_DISPLACEMENT][k] = 0.1 * recording.column[COLUMN_DRIVE][k];
    }
    return part_alone(&recording, PERIOD, width_of, &held_part);
}

/* A drive that goes several paths, each again and again, has no period. */
static void test_no_path_is_only_held_out(void) {
    static const size_t times[][WIDTHS] = {{3, 2, 2, 2, 3}, {4, 2, 2, 2, 2}, {6, 6, 0, 0, 0}, {4, 4, 4, 0, 0}};
    for (size_t i = 0; i < sizeof times / sizeof times[0]; i++) {
        const double alone = part_alone_of_widths(times[i]);
        printf("widths %zu: %.3f of the held-out samples alone\n", i, alone);
        TEST_ASSERT_TRUE(alone < 0.1);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_no_phase_is_only_held_out);
    RUN_TEST(test_no_path_is_only_held_out);
    return UNITY_END();
}
