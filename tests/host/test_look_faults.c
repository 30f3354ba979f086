/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Each fault of a recording, put into clean recordings of three drives, is found with its numbers; clean ones are
 * silent. A number is right within four of the standard errors that come with it (once in 16000). */
#include "found_faults.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <gsl/gsl_statistics_double.h>
#include <stdlib.h>
#include <string.h>

void setUp(void) {
    memset(late, 0, sizeof late);
}

void tearDown(void) {
}

static void test_clean_recordings_are_silent(void) {
    enum { SEEDS = 4 };
    static const double noise_um[] = {0.005, 0.0005, 0.05}, slow_um[] = {0.0, 0.01};
    for (size_t seed = 0; seed < SEEDS; seed++) {
        for (size_t which = 0; which < DRIVES; which++) {
            scene_open(&scene, which, &rng);
            scene.noise_um = noise_um[seed % 3];
            scene.slow_um = slow_um[seed % 2];
            scene_record(&scene, late, &rng, &recordings[0]);
            look_at_them(1);
            TEST_ASSERT_EQUAL_MESSAGE(0, faults.count, found(which));
            close_all(1);
        }
    }
}

static void test_readings_without_noise_and_in_coarse_steps_are_silent(void) {
    static const double step_um[] = {0.0, 0.02};
    for (size_t i = 0; i < 2; i++) {
        for (size_t which = 0; which < DRIVES; which++) {
            scene_open(&scene, which, &rng);
            scene.noise_um = 0.5 * step_um[i];
            scene_record(&scene, late, &rng, &recordings[0]);
            for (size_t k = 0; step_um[i] > 0.0 && k < SCENE_SAMPLES; k++) {
                double *y = &recordings[0].column[COLUMN_DISPLACEMENT][k];
                *y = step_um[i] * round(*y / step_um[i]);
            }
            look_at_them(1);
            TEST_ASSERT_EQUAL_MESSAGE(0, faults.count, found(which));
            close_all(1);
        }
    }
}

static void test_outliers(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        double *y = record(which);
        for (size_t i = 0; i < 12; i++) {
            y[700 + 831 * i + 17 * i * i] += (i % 2 == 0 ? 1.0 : -1.0) * (1.2 + random_unit(&rng));
        }
        look_at_them(1);
        const fault_t *fault = only(which, &fault_outliers);
        expect_number(fault, "samples", 12.0);
        for (size_t i = 0; i < 12; i++) {
            TEST_ASSERT_EQUAL(700 + 831 * i + 17 * i * i, fault->span[i].from);
        }
        close_all(1);
    }
}

/* A bus that returns 0: the shared reading is named. */
static void test_zero_readings(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        double *y = record(which);
        for (size_t i = 0; i < 8; i++) {
            y[900 + 1203 * i] = 0.0;
        }
        look_at_them(1);
        expect_number(only(which, &fault_outliers), "reading_um", 0.0);
        close_all(1);
    }
}

static void test_stuck_samples(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        double *y = record(which);
        for (size_t i = 0; i < 4; i++) {
            for (size_t k = 1; k < 25; k++) {
                y[1300 + 2100 * i + k] = y[1300 + 2100 * i];
            }
        }
        look_at_them(1);
        const fault_t *fault = only(which, &fault_stuck_samples);
        expect_number(fault, "runs", 4.0);
        expect_number(fault, "longest_s", 25.0 / scene_rate_hz);
        TEST_ASSERT_EQUAL(1301, fault->span[0].from); /* the first of them was a good reading */
        TEST_ASSERT_EQUAL(1325, fault->span[0].to);
        close_all(1);
    }
}

static void test_clipped_converter(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        double *y = record(which), range[2];
        values_range(y, SCENE_SAMPLES, range);
        const double end = range[1] - 0.07 * (range[1] - range[0]);
        for (size_t k = 0; k < SCENE_SAMPLES; k++) {
            y[k] = fmin(y[k], end);
        }
        look_at_them(1);
        expect_number(only(which, &fault_clipped_converter), "high_um", end);
        close_all(1);
    }
}

/* An amplifier's rail cuts the drive that the actuator gets: behind it the readings have their noise. */
static void test_a_rail_of_the_amplifier_is_no_clipped_converter(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        double *y = record(which), range[2];
        values_range(y, SCENE_SAMPLES, range);
        const double end = range[1] - 0.1 * (range[1] - range[0]);
        for (size_t k = 0; k < SCENE_SAMPLES; k++) {
            y[k] = fmin(scene_position(&scene, (double)k), end) + 0.005 * random_normal(&rng);
        }
        scene_round(y, SCENE_SAMPLES);
        look_at_them(1);
        for (size_t i = 0; i < faults.count; i++) {
            TEST_ASSERT_TRUE_MESSAGE(faults.fault[i].kind != &fault_clipped_converter, found(which));
        }
        close_all(1);
    }
}

/* What is masked of missing codes stands at an edge of a gap, and some of it should stand inside. */
static void expect_only_edges(const fault_t *fault, const double *y) {
    TEST_ASSERT_GREATER_THAN(0, (int)fault->spans);
    for (size_t s = 0; s < fault->spans; s++) {
        for (size_t k = fault->span[s].from; k < fault->span[s].to; k++) {
            bool at_edge = false;
            for (size_t i = 0; i < 3; i++) {
                /* Readings were rounded to a step, and the next ones are within some steps of an edge. */
                at_edge = at_edge || fabs(fabs(y[k] - 1.2 - 0.7 * (double)i) - 0.1) < 0.02;
            }
            TEST_ASSERT_TRUE(at_edge);
        }
    }
}

static void test_missing_codes(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        double *y = record(which);
        for (size_t k = 0; k < SCENE_SAMPLES; k++) {
            for (size_t i = 0; i < 3; i++) {
                const double middle = 1.2 + 0.7 * (double)i;
                if (fabs(y[k] - middle) < 0.1) {
                    y[k] = middle + (y[k] < middle ? -0.1 : 0.1);
                }
            }
        }
        scene_round(y, SCENE_SAMPLES);
        look_at_them(1);
        const fault_t *fault = only(which, &fault_missing_codes);
        /* A gap that is crossed in less than three samples is no evidence. */
        TEST_ASSERT_TRUE(number(fault, "gaps")->value >= 1.0 && number(fault, "gaps")->value <= 3.0);
        expect_number(fault, "gap_um", 0.2);
        TEST_ASSERT_EQUAL(FAULT_MASKABLE, fault->kind->handling);
        expect_only_edges(fault, y);
        close_all(1);
    }
}

/* Stairs, up once and down once, that go from hold to hold faster than a gap shows: what is missing shows in holds
 * within a gap, whose readings stay at its edge. A reading that sticks in one hold is stuck, and no code is missing. */
static void test_missing_codes_where_the_drive_holds(void) {
    enum { STEPS = 40, STEP_SAMPLES = 50, HELD_SAMPLES = 45, STUCK_FROM = 209, STUCK = 30 };
    for (int stuck = 0; stuck < 2; stuck++) {
        double *y = record(0), *u = recordings[0].column[COLUMN_DRIVE];
        recordings[0].samples = STEPS * STEP_SAMPLES;
        for (size_t k = 0; k < recordings[0].samples; k++) {
            const size_t step = k / STEP_SAMPLES, on_the_way = k % STEP_SAMPLES;
            const double way = on_the_way < HELD_SAMPLES ? 0.0 : (double)(on_the_way - HELD_SAMPLES + 1) / 6.0;
            u[k] = 5.0 * (STEPS / 2.0 - fabs(STEPS / 2.0 - (double)step - way));
            y[k] = 0.1 * u[k] + 0.003 * random_normal(&rng);
            for (int i = 1; stuck == 0 && i <= 4; i++) {
                const double middle = 2.0 * i + 0.03;
                y[k] = fabs(y[k] - middle) < 0.075 ? middle + (y[k] < middle ? -0.075 : 0.075) : y[k];
            }
            y[k] = stuck != 0 && k > STUCK_FROM && k <= STUCK_FROM + STUCK ? y[k - 1] : y[k];
        }
        scene_round(y, recordings[0].samples);
        look_at_them(1);
        const fault_t *fault = only(0, stuck != 0 ? &fault_stuck_samples : &fault_missing_codes);
        if (stuck == 0) {
            expect_number(fault, "gaps", 4.0);
            expect_number(fault, "gap_um", 0.15);
        }
        close_all(1);
    }
}

/* A converter of few codes, whose values were written with two decimals: their distances differ a little. */
static void test_few_codes_are_not_missing(void) {
    static const double step_um = 0.3777;
    for (size_t which = 0; which < DRIVES; which++) {
        double *y = record(which);
        for (size_t k = 0; k < SCENE_SAMPLES; k++) {
            y[k] = round(100.0 * step_um * round(y[k] / step_um)) / 100.0;
        }
        look_at_them(1);
        for (size_t f = 0; f < faults.count; f++) {
            TEST_ASSERT_TRUE_MESSAGE(faults.fault[f].kind != &fault_missing_codes, "missing codes");
        }
        close_all(1);
    }
}

/* A reading of so few levels that single ones stand apart from their neighbours by all that there is: its step is seen,
 * and nothing is wrong. The step is known to the file's digit over the levels. */
static void test_a_coarse_reading_is_silent(void) {
    static const double levels[] = {5.0, 8.0, 15.0};
    for (size_t which = 0; which < DRIVES; which++) {
        for (size_t i = 0; i < sizeof levels / sizeof levels[0]; i++) {
            double *y = record(which), least, most;
            gsl_stats_minmax(&least, &most, y, 1, SCENE_SAMPLES);
            const double step_um = (most - least) / levels[i];
            for (size_t k = 0; k < SCENE_SAMPLES; k++) {
                y[k] = round(100.0 * step_um * round(y[k] / step_um)) / 100.0;
            }
            look_at_them(1);
            TEST_ASSERT_EQUAL_MESSAGE(0, faults.count, found(which));
            TEST_ASSERT_DOUBLE_WITHIN(0.01 / levels[i], step_um, looks[0].noise.step_um);
            close_all(1);
        }
    }
}

static void test_dropped_samples(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        memset(late, 0, sizeof late);
        shift_from(4231, -3.0);
        record(which);
        look_at_them(1);
        const fault_t *fault = only(which, &fault_dropped_samples);
        expect_number(fault, "samples", 3.0);
        expect_near(fault, 4231);
        close_all(1);
    }
}

static void test_repeated_samples(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        memset(late, 0, sizeof late);
        shift_from(6120, 4.0);
        record(which);
        look_at_them(1);
        const fault_t *fault = only(which, &fault_repeated_samples);
        expect_number(fault, "samples", 4.0);
        expect_near(fault, 6120);
        close_all(1);
    }
}

/* The one that explains most lies between them, and is none of them. The other drives do not tell them apart. */
static void test_several_near_each_other(void) {
    static const size_t at[] = {5170, 7105, 7240};
    enum { COUNT = sizeof at / sizeof at[0] };
    for (size_t which = 0; which < DRIVES; which++) {
        memset(late, 0, sizeof late);
        for (size_t i = 0; i < COUNT; i++) {
            shift_from(at[i], 2.0);
        }
        record(which);
        look_at_them(1);
        const fault_t *fault = only(which, &fault_repeated_samples);
        expect_number(fault, "samples", 2.0 * COUNT);
        if (which == 0) {
            expect_number(fault, "instants", COUNT);
        }
        close_all(1);
    }
}

static void test_two_clocks(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        for (size_t k = 0; k < SCENE_SAMPLES; k++) { /* 300 parts in a million: 3.6 samples */
            const double x = 300e-6 * (double)k;
            late[k] = x - round(x);
        }
        record(which);
        look_at_them(1);
        const fault_t *fault = only(which, &fault_clock_mismatch);
        expect_number(fault, "jump_samples", -1.0);
        expect_number(fault, "parts_per_million", 300.0);
        close_all(1);
    }
}

/* A lag that goes up and down without a jump, as a filter's does with the frequency of the drive, is no two clocks. */
static void test_a_lag_in_waves_is_no_clock(void) {
    static const double waves[] = {1.6, 2.3, 3.0};
    for (size_t which = 0; which < DRIVES; which++) {
        for (size_t i = 0; i < 3; i++) {
            for (size_t k = 0; k < SCENE_SAMPLES; k++) {
                late[k] = 0.5 + 0.5 * sin(2.0 * M_PI * waves[i] * (double)k / SCENE_SAMPLES);
            }
            record(which);
            look_at_them(1);
            for (size_t f = 0; f < faults.count; f++) {
                TEST_ASSERT_FALSE_MESSAGE(faults.fault[f].kind == &fault_clock_mismatch, found(which));
            }
            close_all(1);
        }
    }
}

/* On one path over and over (drive 0) lag and hysteresis are one: nothing is said. Half a sample is seen where the
 * drive is smooth and has many frequencies. */
static void test_early_readings(void) {
    size_t seen = 0;
    static const double early[] = {0.5, 6.5, 11.0};
    for (size_t which = 0; which < DRIVES; which++) {
        for (size_t i = 0; i < 3; i++) {
            memset(late, 0, sizeof late);
            shift_from(0, -early[i]);
            record(which);
            look_at_them(1);
            const fault_t *fault = only_or_none(which, &fault_sampling_offset);
            if (fault != NULL) {
                expect_number(fault, "late_samples", -early[i]);
                seen++;
            }
            close_all(1);
        }
    }
    TEST_ASSERT_TRUE(seen >= 3 || DRIVES == 1); /* which is the one on which nothing is said */
}

/* A delay is physics. */
static void test_late_readings_are_no_fault(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        memset(late, 0, sizeof late);
        shift_from(0, 2.4);
        record(which);
        look_at_them(1);
        TEST_ASSERT_EQUAL_MESSAGE(0, faults.count, found(which));
        close_all(1);
    }
}

static void test_time_jitter(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        for (size_t k = 0; k < SCENE_SAMPLES; k++) {
            late[k] = 0.8 * random_normal(&rng);
        }
        record(which);
        look_at_them(1);
        expect_number(only(which, &fault_time_jitter), "rms_samples", 0.8);
        close_all(1);
    }
}

/* Of a converter slower than the recording the position has stairs. Their height goes with the speed, and neighbours do
 * not predict them: that is no jitter. */
static void test_stairs_of_a_slow_converter_are_no_jitter(void) {
    static const size_t held_samples[] = {2, 5, 10};
    for (size_t i = 0; i < 3; i++) {
        for (size_t which = 0; which < DRIVES; which++) {
            scene_open(&scene, which, &rng);
            scene_hold(&scene, held_samples[i]);
            scene_record(&scene, late, &rng, &recordings[0]);
            look_at_them(1);
            TEST_ASSERT_EQUAL_MESSAGE(0, faults.count, found(which));
            close_all(1);
        }
    }
}

static void test_gain_switch(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        double *y = record(which);
        for (size_t k = 5417; k < SCENE_SAMPLES; k++) {
            y[k] = 1.06 * y[k] + 0.05;
        }
        scene_round(y, SCENE_SAMPLES);
        look_at_them(1);
        const fault_t *fault = only(which, &fault_gain_switch);
        expect_number(fault, "gain", 1.06);
        expect_number(fault, "offset_um", 0.05);
        expect_number(fault, "at_s", 5417.0 / scene_rate_hz);
        close_all(1);
    }
}

static void test_sensor_rezero(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        double *y = record(which);
        for (size_t k = 7003; k < SCENE_SAMPLES; k++) {
            y[k] -= 0.21;
        }
        look_at_them(1);
        const fault_t *fault = only(which, &fault_sensor_rezero);
        expect_number(fault, "at_s", 7003.0 / scene_rate_hz);
        close_all(1);
    }
}

static void test_columns(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        double *y = record(which), *u = recordings[0].column[COLUMN_DRIVE];
        recordings[0].column[COLUMN_DRIVE] = y;
        recordings[0].column[COLUMN_DISPLACEMENT] = u;
        look_at_them(1);
        TEST_ASSERT_TRUE_MESSAGE(fault_found(&faults, &fault_swapped_columns, 0), found(which));
        close_all(1);
        y = record(which);
        for (size_t k = 0; k < SCENE_SAMPLES; k++) {
            y[k] = -y[k];
        }
        look_at_them(1);
        only(which, &fault_inverted_column);
        close_all(1);
        record(which);
        for (size_t k = 0; k < SCENE_SAMPLES; k++) {
            recordings[0].column[COLUMN_DRIVE][k] *= 1000.0;
        }
        look_at_them(1);
        only(which, &fault_scale_error);
        close_all(1);
    }
}

static void test_file_offset(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        scene_open(&scene, which, &rng);
        scene_record(&scene, late, &rng, &recordings[0]);
        scene_record(&scene, late, &rng, &recordings[1]);
        for (size_t k = 0; k < SCENE_SAMPLES; k++) {
            recordings[1].column[COLUMN_DISPLACEMENT][k] += 2.5;
        }
        look_at_them(2);
        const fault_t *fault = only(which, &fault_file_offset);
        TEST_ASSERT_EQUAL(1, fault->recording);
        expect_number(fault, "offset_um", 2.5);
        close_all(2);
        scene_open(&scene, which, &rng);
        scene_record(&scene, late, &rng, &recordings[0]);
        scene_record(&scene, late, &rng, &recordings[1]);
        look_at_them(2);
        TEST_ASSERT_EQUAL_MESSAGE(0, faults.count, found(which));
        close_all(2);
    }
}

/* Two halves of the range, one after a sweep from the bottom and one after a sweep from the top: what is between them
 * is more than the width of either loop, and is the past all the same. */
static void test_another_past_is_no_offset(void) {
    enum { PLAYS = 40, BEFORE = 200, AFTER = 4000 };
    static const double sweep[2][3] = {{-20.0, 130.0, -20.0}, {130.0, -20.0, 130.0}}, middle_v[2] = {25.0, 85.0};
    double weights[PLAYS + 1] = {0.1}, thresholds[PLAYS];
    model_t model;
    for (size_t i = 0; i < PLAYS; i++) {
        thresholds[i] = 75.0 * (double)(i + 1) / (PLAYS + 1);
        weights[i + 1] = thresholds[i] < 45.0 ? 0.01 : 0.03;
    }
    make_bank_model(&model, 1000.0, 0.0, PLAYS, weights, thresholds);
    for (size_t i = 0; i < 2; i++) {
        recording_create(&recordings[i], "half.csv", 1000.0, 2 * BEFORE + AFTER);
        double *drive = recordings[i].column[COLUMN_DRIVE];
        fill_lines(drive, 2 * BEFORE, sweep[i], 3, BEFORE);
        for (size_t k = 0; k < AFTER; k++) {
            drive[2 * BEFORE + k] = middle_v[i] - (i == 0 ? 45.0 : -45.0) * cos(2.0 * M_PI * (double)k / 400.0);
        }
        simulate_into(&recordings[i], &model, 1);
        for (size_t k = 0; k < 2 * BEFORE + AFTER; k++) {
            recordings[i].column[COLUMN_DISPLACEMENT][k] += 0.02 * random_normal(&rng);
        }
        recording_keep(&recordings[i], 2 * BEFORE, AFTER);
    }
    look_at_them(2);
    for (size_t i = 0; i < faults.count; i++) {
        TEST_ASSERT_TRUE(faults.fault[i].kind != &fault_file_offset);
    }
    faults_free(&faults);
    looks_free(looks, 2);
    recording_free(&recordings[0]);
    recording_free(&recordings[1]);
    model_free(&model);
}

static void test_noisy_drive(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        record(which);
        for (size_t k = 0; k < SCENE_SAMPLES; k++) {
            recordings[0].column[COLUMN_DRIVE][k] += 0.2 * random_normal(&rng);
        }
        scene_round(recordings[0].column[COLUMN_DRIVE], SCENE_SAMPLES);
        look_at_them(1);
        expect_number(only(which, &fault_noisy_drive), "noise_v", 0.2);
        close_all(1);
    }
}

/* What can be left out is, and is bridged; the rest of the readings stays as it is. */
static void test_masking(void) {
    double *y = record(2), before;
    y[3000] += 1.0;
    before = y[3001];
    look_at_them(1);
    TEST_ASSERT_EQUAL(1, faults_mask(&faults, recordings));
    TEST_ASSERT_EQUAL(1, recordings[0].masked[3000]);
    TEST_ASSERT_EQUAL(0, recordings[0].masked[3001]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5 * (y[2999] + y[3001]), y[3000]);
    TEST_ASSERT_TRUE(before == y[3001]);
    close_all(1);
}

int main(void) {
    rng = random_start("look_faults", 20260718U);
    UNITY_BEGIN();
    RUN_TEST(test_clean_recordings_are_silent);
    RUN_TEST(test_readings_without_noise_and_in_coarse_steps_are_silent);
    RUN_TEST(test_outliers);
    RUN_TEST(test_zero_readings);
    RUN_TEST(test_stuck_samples);
    RUN_TEST(test_clipped_converter);
    RUN_TEST(test_a_rail_of_the_amplifier_is_no_clipped_converter);
    RUN_TEST(test_missing_codes);
    RUN_TEST(test_dropped_samples);
    RUN_TEST(test_repeated_samples);
    RUN_TEST(test_several_near_each_other);
    RUN_TEST(test_two_clocks);
    RUN_TEST(test_a_lag_in_waves_is_no_clock);
    RUN_TEST(test_early_readings);
    RUN_TEST(test_late_readings_are_no_fault);
    RUN_TEST(test_time_jitter);
    RUN_TEST(test_gain_switch);
    RUN_TEST(test_sensor_rezero);
    RUN_TEST(test_columns);
    RUN_TEST(test_file_offset);
    RUN_TEST(test_another_past_is_no_offset);
    RUN_TEST(test_noisy_drive);
    RUN_TEST(test_masking);
    RUN_TEST(test_missing_codes_where_the_drive_holds);
    if (!INSTRUMENTED) { /* what is silent runs the code of the first test */
        RUN_TEST(test_stairs_of_a_slow_converter_are_no_jitter);
        RUN_TEST(test_few_codes_are_not_missing);
        RUN_TEST(test_a_coarse_reading_is_silent);
    }
    return UNITY_END();
}
