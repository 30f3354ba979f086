/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Recordings that begin in the middle of a past: what that left is taken out, and nothing else; and effects that were
 * only there before the drive had been everywhere are found. */
#include "diagnosis/diagnose.h"
#include "diagnosis/noise/held_out.h"
#include "diagnosis/nuisance/past.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 16000, OPERATORS = 40, BLOCK = SAMPLES / HELD_OUT_BLOCKS };
static const double rate_hz = 2000.0, noise_um = 0.003;
static const noise_t white = {.sigma_um = 1.0, .rms_um = 1.0};
static random_t rng;
static recording_t recording;
static model_t model;
static samples_t samples;
static failure_t failure;

/* Three sines about 50 V whose sum grows: the drive is at the ends of its range, 7 and 93 V, in the last of it. */
static void fill_growing(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz, part = (double)k / SAMPLES;
        recording.column[COLUMN_DRIVE][k] =
            50.0 + (28.0 + 15.0 * part) / 2.6 *
                       (1.2 * sin(2.0 * M_PI * 1.37 * t) + 0.8 * sin(2.0 * M_PI * 3.1 * t + 1.0) +
                        0.6 * sin(2.0 * M_PI * 7.7 * t + 2.0));
    }
}

void setUp(void) {
    double weights[OPERATORS + 1] = {0.09}, thresholds[OPERATORS];
    for (size_t i = 0; i < OPERATORS; i++) {
        thresholds[i] = 1.2 * (double)(i + 1);
        weights[i + 1] = 0.0025 * exp(-0.04 * (double)i);
    }
    recording_create(&recording, "begun.csv", rate_hz, SAMPLES);
    fill_growing();
    make_bank_model(&model, rate_hz, 1.0, OPERATORS, weights, thresholds);
}

void tearDown(void) {
    samples_close(&samples);
    model_free(&model);
    recording_free(&recording);
}

/* The bank as a sweep leaves it that ended there and came from the other side. */
static void sweep(double end_v, double sign) {
    double memory_v[OPERATORS];
    const parameter_t *threshold_v = model_parameter(&model.block[0], "thresholds_v");
    for (size_t i = 0; i < OPERATORS; i++) {
        memory_v[i] = end_v + sign * threshold_v->value[i];
    }
    model_set_array(&model.block[0], "initial_memory_v", OPERATORS, memory_v, NULL);
}

static void open_samples(void) {
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&samples, &model, &recording, 1, &failure), failure.text);
}

static double rms(const double *x, size_t count) {
    double sum = 0.0;
    for (size_t k = 0; k < count; k++) {
        sum += x[k] * x[k];
    }
    return sqrt(sum / (double)count);
}

/* What sweeps leave that ended at -40 V and at 140 V, beside one that ended at 8 V: lines between nodes 10 V apart
 * leave 1.6 and 1.1 % of it, and in the held-out samples, which are excluded, 1.5 %. */
static void test_past_explains_what_sweeps_left(void) {
    static const double end_v[] = {-40.0, 140.0}, sign[] = {1.0, -1.0}, most = 0.02;
    open_samples();
    TEST_ASSERT_TRUE(samples.past_matters);
    past_t past;
    past_open(&past, &samples, &white);
    double *one = samples_column(&samples), *other = samples_column(&samples);
    double *fitted = samples_column(&samples), *held = samples_column(&samples);
    for (size_t i = 0; i < 2; i++) {
        sweep(8.0, 1.0);
        TEST_ASSERT_TRUE_MESSAGE(samples_simulate(&samples, &model, one, &failure), failure.text);
        sweep(end_v[i], sign[i]);
        TEST_ASSERT_TRUE_MESSAGE(samples_simulate(&samples, &model, other, &failure), failure.text);
        for (size_t k = 0; k < SAMPLES; k++) {
            other[k] -= one[k] + other[SAMPLES - 1] - one[SAMPLES - 1];
        }
        samples_pick(&samples, SAMPLE_FITTED, other, fitted);
        samples_pick(&samples, SAMPLE_HELD_OUT, other, held);
        const double before = rms(fitted, samples.fitted), held_before = rms(held, samples.held);
        past_take_out(&past, fitted, held);
        printf("sweep that ended at %g V: %.4f um, leaves %.4f; held out %.4f um, leaves %.4f\n", end_v[i], before,
               rms(fitted, samples.fitted), held_before, rms(held, samples.held));
        TEST_ASSERT_TRUE(before > 10.0 * noise_um);
        TEST_ASSERT_TRUE(rms(fitted, samples.fitted) < most * before);
        TEST_ASSERT_TRUE(rms(held, samples.held) < most * held_before);
    }
    free(one);
    free(other);
    free(fitted);
    free(held);
    past_close(&past);
}

/* Orthonormal over the samples that are fitted: taken out twice is taken out once. */
static void test_past_is_a_projection(void) {
    open_samples();
    past_t past;
    past_open(&past, &samples, &white);
    TEST_ASSERT_TRUE(past.columns > 0 && past.columns <= PAST_COLUMNS);
    double *once = samples_column(&samples), *twice = samples_column(&samples);
    for (size_t k = 0; k < samples.fitted; k++) {
        once[k] = random_normal(&rng);
    }
    const double before = rms(once, samples.fitted);
    past_take_out(&past, once, NULL);
    memcpy(twice, once, samples.fitted * sizeof(double));
    past_take_out(&past, twice, NULL);
    for (size_t k = 0; k < samples.fitted; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, once[k], twice[k]);
    }
    TEST_ASSERT_TRUE(rms(once, samples.fitted) > 0.99 * before); /* of noise, 18 columns of 8000 samples take nothing */
    free(once);
    free(twice);
    past_close(&past);
}

/* Noise of 1 with a memory. */
static const noise_t slow = {.filter = {.memory = 0.95, .mix = 0.9}, .sigma_um = 1.0, .rms_um = 1.0};

/* The drive goes up to 95 V in its first twelfth, and to 80 V from there on. What each sample is for is the test's. */
static void far_only_at_first(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const double swing = k < SAMPLES / 12 ? 45.0 : 30.0;
        recording.column[COLUMN_DRIVE][k] = 50.0 + swing * sin(2.0 * M_PI * (double)k / 900.0);
    }
    open_samples();
    samples.past_matters = true;
    samples.fitted = samples.held = 0;
}

/* The drive goes up to 95 V while all samples are held out, and never again: of the step from 80 V the fitted samples
 * have what a filter with a memory leaves of it after 1300 samples, 0.9^1300 = 1e-60. Nothing is known of it, and
 * nothing is made of it. */
static void test_what_only_held_out_samples_see_is_left_alone(void) {
    far_only_at_first();
    for (size_t k = 0; k < SAMPLES; k++) {
        samples.part[k] = k < SAMPLES / 6 ? SAMPLE_HELD_OUT : SAMPLE_FITTED;
        *(k < SAMPLES / 6 ? &samples.held : &samples.fitted) += 1;
    }
    past_t past;
    past_open(&past, &samples, &slow);
    double *fitted = samples_column(&samples), *held = samples_column(&samples);
    for (size_t k = 0; k < samples.fitted; k++) {
        fitted[k] = random_normal(&rng);
    }
    for (size_t k = 0; k < samples.held; k++) {
        held[k] = random_normal(&rng);
    }
    past_take_out(&past, fitted, held);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 1.0, rms(fitted, samples.fitted)); /* noise of 1, of 13000 and of 2700 samples */
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 1.0, rms(held, samples.held));
    free(fitted);
    free(held);
    past_close(&past);
}

/* The same while samples are left out: of a step that a filter leaves 1e-60 of, the past that is added to a simulation
 * was 1e37 um. */
static void test_what_only_samples_left_out_see_is_none(void) {
    far_only_at_first();
    for (size_t k = 0; k < SAMPLES; k++) {
        samples.part[k] = k < SAMPLES / 6 ? SAMPLE_LEFT_OUT : k % 3 == 0 ? SAMPLE_HELD_OUT : SAMPLE_FITTED;
        samples.fitted += samples.part[k] == SAMPLE_FITTED ? 1 : 0;
        samples.held += samples.part[k] == SAMPLE_HELD_OUT ? 1 : 0;
    }
    samples.from[0] = 0; /* as where a drive goes further within the first samples that count */
    past_t past;
    past_open(&past, &samples, &slow);
    TEST_ASSERT_EQUAL_UINT64(0, past.columns);
    past_close(&past);
}

static void test_a_swept_recording_has_no_past(void) {
    const double corner[] = {0.0, 100.0, 20.0, 80.0, 40.0};
    fill_lines(recording.column[COLUMN_DRIVE], SAMPLES, corner, 5, 300);
    open_samples();
    TEST_ASSERT_FALSE(samples.past_matters);
    past_t past;
    past_open(&past, &samples, &white);
    TEST_ASSERT_EQUAL_UINT64(0, past.columns);
    double *plain = samples_column(&samples), *with = samples_column(&samples);
    TEST_ASSERT_TRUE_MESSAGE(samples_simulate(&samples, &model, plain, &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(past_simulate(&samples, &white, &model, with, &failure), failure.text);
    TEST_ASSERT_EQUAL_MEMORY(plain, with, SAMPLES * sizeof(double));
    free(plain);
    free(with);
    past_close(&past);
}

/* Of a recording whose ends are late, no more than a fifth is left out. */
static void test_little_is_left_out(void) {
    open_samples();
    TEST_ASSERT_TRUE(samples.from[0] <= SAMPLES / 5);
    TEST_ASSERT_TRUE(samples.fitted + samples.held >= SAMPLES - SAMPLES / 5 - SAMPLES_SKIPPED);
}

static size_t high_samples(samples_part_t part) {
    size_t count = 0;
    for (size_t k = 0; k < SAMPLES; k++) {
        count += samples.part[k] == part && recording.column[COLUMN_DRIVE][k] > 98.0;
    }
    return count;
}

/* Peaks of 100 V in these of three blocks of time, loops between 0 and 80 V elsewhere; all of it after a sweep. */
static void fill_peaks(const bool high[3]) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const size_t block = k * HELD_OUT_BLOCKS / SAMPLES;
        const double top = high[block % 3] || block == 0 ? 100.0 : 80.0;
        recording.column[COLUMN_DRIVE][k] = 0.5 * top * (1.0 - cos(2.0 * M_PI * (double)k / (0.5 * BLOCK)));
    }
}

/* Rails that are reached in blocks of one kind only are in both parts if there is a way; and where they are in both,
 * the last of three blocks is the one that is held out. */
static void test_both_parts_see_the_ends(void) {
    static const bool high[][3] = {{false, true, true}, {true, true, true}, {true, true, false}};
    for (size_t i = 0; i < 3; i++) {
        fill_peaks(high[i]);
        open_samples();
        printf("high in blocks %d%d%d: %zu samples fitted, %zu held out\n", high[i][0], high[i][1], high[i][2],
               high_samples(SAMPLE_FITTED), high_samples(SAMPLE_HELD_OUT));
        TEST_ASSERT_TRUE(high_samples(SAMPLE_FITTED) > 0);
        TEST_ASSERT_TRUE(high_samples(SAMPLE_HELD_OUT) > 0);
        if (i < 2) {
            TEST_ASSERT_EQUAL_INT(SAMPLE_HELD_OUT, samples.part[5 * BLOCK + BLOCK / 2]);
        }
        samples_close(&samples);
    }
}

/* A drift that is over when the drive has been at both ends of its range. */
static void test_an_early_drift_is_found(void) {
    static const double drift_um = 0.1, time_constant_s = 1.2;
    answer_t diagnosis;
    sweep(0.0, 1.0);
    simulate_into(&recording, &model, 1);
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_DISPLACEMENT][k] +=
            noise_um * random_normal(&rng) - drift_um * expm1(-(double)k / (rate_hz * time_constant_s));
    }
    TEST_ASSERT_TRUE_MESSAGE(diagnose(NULL, &recording, 1, &diagnosis, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT64(1, diagnosis.findings);
    TEST_ASSERT_EQUAL_STRING("thermal_drift", diagnosis.finding[0].block->name);
    TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
    const model_block_t *found = model_find(&diagnosis.model, "thermal_drift");
    for (size_t p = 0; p < 2; p++) {
        const parameter_t *number = &found->parameter[p];
        printf("%s %.4g +- %.2g\n", found->block->parameter[p].name, number->value[0], number->sigma[0]);
        TEST_ASSERT_DOUBLE_WITHIN(3.0 * number->sigma[0], p == 0 ? drift_um : time_constant_s, number->value[0]);
    }
    answer_free(&diagnosis);
}

/* And none where there is nothing but a past. */
/* Of a drive that goes further in each swing, the drives before it may have left anything that comes with time: no
 * reply is without a word about it. */
static void test_a_drift_in_swings_that_grow_is_no_silence(void) {
    answer_t diagnosis;
    sweep(0.0, 1.0);
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_DRIVE][k] =
            50.0 + (10.0 + 35.0 * (double)k / SAMPLES) * sin(2.0 * M_PI * (double)k / 900.0);
    }
    simulate_into(&recording, &model, 1);
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_DISPLACEMENT][k] +=
            noise_um * random_normal(&rng) + 0.3 * fmax(0.0, (double)k / SAMPLES - 0.4);
    }
    TEST_ASSERT_TRUE_MESSAGE(diagnose(NULL, &recording, 1, &diagnosis, &failure), failure.text);
    printf("verdict %d, %zu findings, past %.3g %%, held out %.3g %%\n", (int)diagnosis.verdict, diagnosis.findings,
           diagnosis.past_percent, diagnosis.held_out_percent);
    TEST_ASSERT_TRUE(diagnosis.findings > 0 || diagnosis.verdict == UNKNOWN_PHYSICS ||
                     answer_rests_on_past(&diagnosis));
    answer_free(&diagnosis);
}

static void test_a_past_is_no_effect(void) {
    static const double end_v[] = {-40.0, 140.0};
    for (size_t i = 0; i < (INSTRUMENTED ? 1 : 2); i++) { /* both ends run the same code */
        answer_t diagnosis;
        sweep(end_v[i], i == 0 ? 1.0 : -1.0);
        simulate_into(&recording, &model, 1);
        for (size_t k = 0; k < SAMPLES; k++) {
            recording.column[COLUMN_DISPLACEMENT][k] += noise_um * random_normal(&rng);
        }
        TEST_ASSERT_TRUE_MESSAGE(diagnose(NULL, &recording, 1, &diagnosis, &failure), failure.text);
        TEST_ASSERT_EQUAL_UINT64(0, diagnosis.findings);
        TEST_ASSERT_EQUAL_INT(NOTHING_MISSING, diagnosis.verdict);
        answer_free(&diagnosis);
    }
}

int main(void) {
    rng = random_start("diagnosis_past", 20261122);
    UNITY_BEGIN();
    RUN_TEST(test_past_explains_what_sweeps_left);
    RUN_TEST(test_past_is_a_projection);
    RUN_TEST(test_what_only_held_out_samples_see_is_left_alone);
    RUN_TEST(test_what_only_samples_left_out_see_is_none);
    RUN_TEST(test_a_swept_recording_has_no_past);
    RUN_TEST(test_little_is_left_out);
    RUN_TEST(test_both_parts_see_the_ends);
    RUN_TEST(test_a_past_is_no_effect);
    if (!INSTRUMENTED) { /* two long diagnoses, with the code that the one before and test_diagnose run */
        RUN_TEST(test_an_early_drift_is_found);
        RUN_TEST(test_a_drift_in_swings_that_grow_is_no_silence);
    }
    return UNITY_END();
}
