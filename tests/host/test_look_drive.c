/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What kind of drive it was, what it repeats, and what it does between samples. */
#include "one_look.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <string.h>

static drive_kind_t kind_of_drive(void) {
    drive_look_t driven;
    TEST_ASSERT_TRUE(drive_look(&recording, &driven, &failure));
    const drive_kind_t kind = driven.kind;
    drive_look_free(&driven);
    return kind;
}

static void test_kinds_of_drive(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = 20.0 * (double)(k / 2048 % 3);
        position()[k] = 0.1 * drive()[k] + 0.001 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_STEPS, look.drive.kind);
    TEST_ASSERT_EQUAL(7, look.drive.steps);
    TEST_ASSERT_EQUAL(3, look.drive.levels);
    TEST_ASSERT_EQUAL(BETWEEN_HELD, look.drive.between);
    look_free(&look);
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz;
        drive()[k] = 10.0 * sin(2.0 * M_PI * (1.0 + 3.0 * t) * t);
        position()[k] = 0.1 * drive()[k] + 0.001 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_SWEEP, look.drive.kind);
    look_free(&look);
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = 50.0 + 30.0 * (fabs((double)(k % 400) - 200.0) / 100.0 - 1.0);
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_TRIANGLE, look.drive.kind);
    look_free(&look);
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = 5.0 + 90.0 * (double)k / SAMPLES;
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_LINES, look.drive.kind);
    look_free(&look);
}

static void expect_wave(size_t samples, bool triangle, double shift) {
    drive_look_t driven;
    char text[100];
    for (size_t k = 0; k < SAMPLES; k++) {
        const double part = fmod(((double)k + shift) / (double)samples, 1.0);
        drive()[k] = 50.0 + 50.0 * (triangle ? 4.0 * fabs(part - 0.5) - 1.0 : sin(2.0 * M_PI * part));
        drive()[k] = 1e-5 * round(1e5 * drive()[k]); /* as a file has it */
    }
    TEST_ASSERT_TRUE(drive_look(&recording, &driven, &failure));
    snprintf(text, sizeof text, "%zu samples a period, shifted by %g: %s, noise %g V", samples, shift,
             drive_kind_text(driven.kind), driven.noise_v);
    TEST_ASSERT_EQUAL_MESSAGE(triangle ? DRIVE_TRIANGLE : DRIVE_SINE, driven.kind, text);
    TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(0.0, driven.noise_v, text);
    drive_look_free(&driven);
}

/* Sines and triangles of 8 to 100 samples a period are what they are, with extremes on samples or between them. None is
 * measured: a triangle's corner has the ratio of differences that noise has. */
static void test_waves_of_few_samples(void) {
    static const size_t samples[] = {8, 10, 12, 16, 20, 40, 100};
    for (size_t i = 0; i < sizeof samples / sizeof *samples; i++) {
        for (size_t triangle = 0; triangle < 2; triangle++) {
            expect_wave(samples[i], triangle != 0, 0.0);
            expect_wave(samples[i], triangle != 0, random_unit(&rng));
        }
    }
}

static void test_a_period_between_samples(void) {
    const double period = rate_hz / 7.31;
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = round(1e4 * (50.0 + 40.0 * sin(2.0 * M_PI * (double)k / period))) / 1e4;
        position()[k] = 0.1 * drive()[k] + 0.001 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_SINE, look.drive.kind);
    TEST_ASSERT_EQUAL(BETWEEN_SMOOTH, look.drive.between);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, period, look.drive.period); /* rounding: 3e-7 of the range; a cubic: 1e-4 */
    look_free(&look);
}

/* Few periods, and long ones: what does not end with a period shifts the maximum of the autocovariance by many samples.
 */
static void test_few_long_periods_without_rounding(void) {
    const double period = (double)SAMPLES / 4.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = 60.0 - 60.0 * cos(2.0 * M_PI * (double)k / period);
        position()[k] = 0.1 * drive()[k] + 0.001 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_SINE, look.drive.kind);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, period, look.drive.period); /* a cubic between samples is exact to far less */
    look_free(&look);
}

/* A sine that swells for the first quarter: its period is that of the rest, not twice that. What is printed is in the
 * file's own times. */
static void test_a_sine_that_swells_at_first(void) {
    recording.start_s = -2.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz;
        drive()[k] = 60.0 + 50.0 * fmin(1.0, t / 2.0) * sin(2.0 * M_PI * 2.0 * t) + 0.04 * random_normal(&rng);
        position()[k] = 0.1 * drive()[k];
    }
    see();
    /* The drive's noise is 0.3 samples of its mean slope, over thousands of samples. */
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 1000.0, look.drive.period);
    const char *text = said();
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "8.192 s, from t = -2 s\n"), text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, " .. 6.19"), text); /* where the last pass ends */
    look_free(&look);
}

/* Up or down, evenly or by the logarithm, to 20 .. 900 Hz: ways of a few samples have few durations, and 183 of 240
 * were no sweeps. Noise has no trend. */
static void test_fast_sweeps(void) {
    for (size_t run = 0; run < 24; run++) {
        const double from_hz = 0.5 + 5.0 * random_unit(&rng), to_hz = 20.0 + 880.0 * random_unit(&rng);
        const double ratio = log(to_hz / from_hz), duration = SAMPLES / rate_hz;
        double noise[2] = {0.0, 0.0};
        for (size_t k = 0; k < SAMPLES; k++) {
            const double part = run % 4 < 2 ? (double)k / SAMPLES : 1.0 - (double)k / SAMPLES;
            const double cycles = run % 2 == 0 ? from_hz * (exp(ratio * part) - 1.0) / ratio
                                               : part * (from_hz + 0.5 * (to_hz - from_hz) * part);
            noise[0] = 0.7 * noise[0] + random_normal(&rng);
            noise[1] = 0.7 * noise[1] + noise[0];
            drive()[k] = 50.0 - 40.0 * cos(2.0 * M_PI * duration * cycles);
            position()[k] = noise[1];
        }
        TEST_ASSERT_EQUAL(DRIVE_SWEEP, kind_of_drive());
        memcpy(drive(), position(), SAMPLES * sizeof *drive());
        TEST_ASSERT_EQUAL(DRIVE_RANDOM, kind_of_drive());
    }
}

/* From each pass to the next it loses 0.35 % of its amplitude, 0.17 % of its range: what differs is no noise. */
static void test_a_sine_that_dies_away_slowly_is_not_repeated(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz;
        drive()[k] = 50.0 + 40.0 * pow(0.9965, 5.0 * t) * sin(2.0 * M_PI * 5.0 * t);
        position()[k] = 0.1 * drive()[k] + 0.001 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_SWELLING, look.drive.kind);
    TEST_ASSERT_EQUAL_UINT64(0, drive_periods(&look.drive));
    look_free(&look);
}

/* The last percent of its amplitude comes slowly; the passes after that are one path. */
static void test_a_sine_that_settles_is_repeated_from_there_on(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz;
        drive()[k] = 50.0 + 40.0 * (1.0 - 0.02 * exp(-t / 1.0)) * sin(2.0 * M_PI * 5.0 * t);
        position()[k] = 0.1 * drive()[k] + 0.001 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_SINE, look.drive.kind);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 400.0, look.drive.period);
    TEST_ASSERT_TRUE(look.drive.repeat.from > 0);
    look_free(&look);
}

/* A converter at 1/24 of the recording's rate: its staircase is neither noise, nor rests, nor steps. */
static void test_a_converter_slower_than_the_recording(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)(k - k % 24) / rate_hz;
        drive()[k] = 50.0 + 45.0 * sin(2.0 * M_PI * 3.1 * t) * (1.0 + 0.3 * sin(2.0 * M_PI * 0.17 * t));
        position()[k] = 0.1 * drive()[k] + 0.005 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_EQUAL_UINT64(24, look.drive.held_samples);
    TEST_ASSERT_EQUAL_INT(BETWEEN_HELD, look.drive.between);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, look.drive.noise_v);
    TEST_ASSERT_EQUAL_UINT64(0, look.drive.steps);
    look_free(&look);
}

static void test_header_key_says_what_is_between_samples(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = random_normal(&rng);
        position()[k] = drive()[k];
    }
    recording_set_key(&recording, "drive_between_samples", "line");
    see();
    TEST_ASSERT_EQUAL(BETWEEN_LINE, look.drive.between);
    TEST_ASSERT_TRUE(look.drive.between_given);
    look_free(&look);
    recording_set_key(&recording, "drive_between_samples", "wavy");
    TEST_ASSERT_FALSE(look_at(&recording, &look, &failure));
    TEST_ASSERT_NOT_NULL(strstr(failure.text, "wavy"));
}

int main(void) {
    rng = random_start("look_drive", 20260717U);
    UNITY_BEGIN();
    RUN_TEST(test_kinds_of_drive);
    RUN_TEST(test_fast_sweeps);
    RUN_TEST(test_waves_of_few_samples);
    RUN_TEST(test_a_period_between_samples);
    RUN_TEST(test_few_long_periods_without_rounding);
    RUN_TEST(test_a_sine_that_swells_at_first);
    RUN_TEST(test_a_sine_that_dies_away_slowly_is_not_repeated);
    RUN_TEST(test_a_sine_that_settles_is_repeated_from_there_on);
    RUN_TEST(test_a_converter_slower_than_the_recording);
    RUN_TEST(test_header_key_says_what_is_between_samples);
    return UNITY_END();
}
