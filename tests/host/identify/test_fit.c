/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Identification finds again what a synthetic recording was made from, and says how sure it is. */
#include "identify/fit.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { OPERATORS = 6, SAMPLES = 9000, PER_LINE = 100 };

static const double rate_hz = 1000.0, offset_um = 3.0;
static const double weights[OPERATORS + 1] = {0.08, 0.02, 0.0, 0.015, 0.01, 0.0, 0.03};
/* Full sweeps, minor loops, full sweeps: both extremes in every third of the recording. */
static const double corners[] = {0, 100, -100, 100, 20, 70, -40, 40, -80, 60, -100, 100, -30};
static const double noise_um = 0.05;

static model_t truth;
static double thresholds[OPERATORS];

void setUp(void) {
    for (int i = 0; i < OPERATORS; i++) {
        thresholds[i] = 100.0 * (i + 1) / (OPERATORS + 1); /* where a fit with as many operators puts them */
    }
    make_bank_model(&truth, rate_hz, offset_um, OPERATORS, weights, thresholds);
}

void tearDown(void) {
    model_free(&truth);
}

static void make_recording(recording_t *recording, size_t samples) {
    recording_create(recording, "synthetic", rate_hz, samples);
    fill_lines(recording->column[COLUMN_DRIVE], samples, corners, sizeof corners / sizeof corners[0], PER_LINE);
    simulate_into(recording, &truth, 1);
}

/* Noise of variance rms^2 with correlation rho from sample to sample. */
static void add_noise(recording_t *recording, double rms, double rho, uint64_t seed) {
    random_t random = {seed};
    double noise = random_normal(&random);
    for (size_t k = 0; k < recording->samples; k++) {
        recording->column[COLUMN_DISPLACEMENT][k] += rms * noise;
        noise = rho * noise + sqrt(1.0 - rho * rho) * random_normal(&random);
    }
}

static void fit(const recording_t *recordings, size_t count, size_t operators, model_t *model, fit_report_t *report) {
    const fit_options_t options = {.operators = operators};
    failure_t failure = {{0}};
    TEST_ASSERT_TRUE_MESSAGE(
        fit_recordings(&family_prandtl_ishlinskii, recordings, count, &options, model, report, &failure), failure.text);
}

/* A number among the facts of the fit. */
static double fact(const model_t *model, const char *key) {
    const json_t *value = json_object_get(model->fit, key);
    TEST_ASSERT_TRUE_MESSAGE(json_is_number(value), key);
    return json_number_value(value);
}

static bool says(const fit_report_t *report, const char *text) {
    for (size_t i = 0; i < report->notes.count; i++) {
        if (strstr(report->notes.line[i], text) != NULL) {
            return true;
        }
    }
    return false;
}

/* Mean square of (found - true) / sigma over the weights that are off their bounds and the offset; each must be below 5
 * sigma. */
static double normalised_error(const model_t *model, size_t *terms) {
    const parameter_t *found = model_parameter(&model->block[0], "weights");
    const parameter_t *offset = model_parameter(&model->block[0], "offset_um");
    double sum = pow((offset->value[0] - offset_um) / offset->sigma[0], 2.0);
    *terms = 1;
    for (size_t i = 0; i <= OPERATORS; i++) {
        if (found->sigma[i] > 0.0 && weights[i] > 0.0) { /* a true 0 is cut off below: not a normal error */
            const double error = (found->value[i] - weights[i]) / found->sigma[i];
            TEST_ASSERT_TRUE_MESSAGE(fabs(error) < 5.0, "more than 5 standard errors off");
            sum += error * error;
            ++*terms;
        }
    }
    return sum;
}

/* Standard errors must be the size of the errors, for white noise and for noise that is correlated over some 20
 * samples. */
static void test_recovers_weights_within_their_standard_errors(void) {
    const double correlations[] = {0.0, 0.9};
    for (size_t c = 0; c < 2; c++) {
        double sum = 0.0, ratio;
        size_t terms = 0;
        for (uint64_t seed = 1; seed <= 20; seed++) {
            recording_t recording;
            model_t model;
            fit_report_t report;
            size_t more;
            make_recording(&recording, SAMPLES);
            add_noise(&recording, noise_um, correlations[c], seed);
            fit(&recording, 1, OPERATORS, &model, &report);
            sum += normalised_error(&model, &more);
            terms += more;
            /* (1 + rho) / (1 - rho), estimated with an error of some 10 % from 6000 samples */
            TEST_ASSERT_DOUBLE_WITHIN(0.4 * (1.0 + correlations[c]) / (1.0 - correlations[c]),
                                      (1.0 + correlations[c]) / (1.0 - correlations[c]),
                                      fact(&model, "residual_autocorrelation_samples"));
            model_free(&model);
            fit_report_free(&report);
            recording_free(&recording);
        }
        ratio = sqrt(sum / (double)terms);
        printf("seeds 1 to 20, correlation %.1f: errors are %.2f standard errors rms (%zu values)\n", correlations[c],
               ratio, terms);
        /* 120 values are known to 1 / sqrt(240) = 6 %; zeros that rest on their bound make the others better than
         * stated. */
        TEST_ASSERT_TRUE(ratio > 0.6 && ratio < 1.3);
    }
}

static void test_held_out_error_is_the_noise_when_the_model_is_right(void) {
    recording_t recording;
    model_t model;
    fit_report_t report;
    make_recording(&recording, SAMPLES);
    const double range = 2.0 * (0.08 * 100.0 + 0.02 * 85.714 + 0.015 * 57.143 + 0.01 * 42.857 + 0.03 * 14.286);
    add_noise(&recording, noise_um, 0.0, 77);
    fit(&recording, 1, 0, &model, &report);
    printf("seed 77: held out %.4f %%, noise %.4f %%, %.0f operators\n", report.held_out_nrmse_percent,
           100.0 * noise_um / range, fact(&model, "operators"));
    /* 3000 samples know the noise to 1.3 %; thresholds off the true ones and the noise in the range cost the rest. */
    TEST_ASSERT_DOUBLE_WITHIN(0.10, 1.0, report.held_out_nrmse_percent / (100.0 * noise_um / range));
    TEST_ASSERT_TRUE(fact(&model, "offset_drift_um_per_decade") == 0.0);
    model_free(&model);
    fit_report_free(&report);
    recording_free(&recording);
}

/* A recording that begins in the middle of things: the samples before the first full sweep tell what came before. */
static void test_finds_the_initial_memory(void) {
    recording_t whole, part;
    model_t model;
    fit_report_t report;
    failure_t failure;
    const size_t cut = 850; /* behind 100 and -80, on the way up: minor memory of several corners */
    double squares = 0.0, demagnetised = 0.0, *simulated;
    make_recording(&whole, SAMPLES + cut);
    recording_create(&part, "cut", rate_hz, SAMPLES);
    memcpy(part.column[COLUMN_DRIVE], whole.column[COLUMN_DRIVE] + cut, SAMPLES * sizeof(double));
    memcpy(part.column[COLUMN_DISPLACEMENT], whole.column[COLUMN_DISPLACEMENT] + cut, SAMPLES * sizeof(double));
    add_noise(&part, noise_um, 0.0, 5);
    fit(&part, 1, OPERATORS, &model, &report);
    TEST_ASSERT_TRUE(report.recording[0].determined_s > 0.1);
    simulated = allocate(SAMPLES, sizeof(double));
    const size_t end = (size_t)(report.recording[0].determined_s * rate_hz);
    TEST_ASSERT_TRUE(chain_simulate(&model, &part, 1, simulated, &failure));
    for (size_t k = 0; k < end; k++) {
        squares += pow(simulated[k] - part.column[COLUMN_DISPLACEMENT][k], 2.0) / (double)end;
    }
    model_set_array(&model.block[0], "initial_memory_v", 0, NULL, NULL);
    TEST_ASSERT_TRUE(chain_simulate(&model, &part, 1, simulated, &failure));
    for (size_t k = 0; k < end; k++) {
        demagnetised += pow(simulated[k] - part.column[COLUMN_DISPLACEMENT][k], 2.0) / (double)end;
    }
    printf("seed 5: %zu samples before the memory is determined: rms %.3f um, without the estimate %.3f um, noise %.3f "
           "um\n",
           end, sqrt(squares), sqrt(demagnetised), noise_um);
    TEST_ASSERT_TRUE(sqrt(squares) < 1.3 * noise_um); /* the noise and a tenth of it for the weights */
    TEST_ASSERT_TRUE(sqrt(demagnetised) > 3.0 * noise_um);
    free(simulated);
    model_free(&model);
    fit_report_free(&report);
    recording_free(&whole);
    recording_free(&part);
}

/* Only small loops, from demagnetised: no sweep ever determines the larger operators, and the fit must say so and still
 * predict. */
static void test_copes_when_the_memory_is_never_determined(void) {
    static const double small[] = {0, 10, -20, 30, -40, 50, -60};
    recording_t recording;
    model_t model;
    fit_report_t report;
    recording_create(&recording, "growing", rate_hz, 900);
    fill_lines(recording.column[COLUMN_DRIVE], 900, small, 7, 150);
    simulate_into(&recording, &truth, 1);
    add_noise(&recording, 0.01, 0.0, 9);
    fit(&recording, 1, 8, &model, &report);
    TEST_ASSERT_TRUE(says(&report, "the drive never erases the initial memory"));
    printf("seed 9: growing loops: held out %.3f %%\n", report.held_out_nrmse_percent);
    /* The held-out third is a larger loop than any before it: the weights of larger thresholds were never seen. */
    TEST_ASSERT_TRUE(report.held_out_nrmse_percent < 10.0);
    model_free(&model);
    fit_report_free(&report);
    recording_free(&recording);
}

static void test_two_recordings_are_one_fit(void) {
    recording_t recordings[2];
    model_t model;
    fit_report_t report;
    size_t terms;
    for (uint64_t i = 0; i < 2; i++) {
        make_recording(&recordings[i], SAMPLES);
        recordings[i].sample_rate_hz *= i == 0 ? 1.0 : 10.0; /* the same path, faster: plays do not know */
        add_noise(&recordings[i], noise_um, 0.0, 30 + i);
    }
    fit(recordings, 2, OPERATORS, &model, &report);
    TEST_ASSERT_EQUAL_DOUBLE(10.0 * rate_hz, model.sample_rate_hz);
    TEST_ASSERT_TRUE(normalised_error(&model, &terms) < 3.0 * (double)terms);
    TEST_ASSERT_EQUAL_UINT64(0, model_parameter(&model.block[0], "initial_memory_v")->count);
    model_free(&model);
    fit_report_free(&report);
    recording_free(&recordings[0]);
    recording_free(&recordings[1]);
}

static void test_takes_out_a_drift_of_the_offset(void) {
    recording_t recording;
    model_t model;
    fit_report_t report;
    make_recording(&recording, SAMPLES);
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_DISPLACEMENT][k] += 0.4 * log10(0.1 + (double)k / rate_hz);
    }
    add_noise(&recording, 0.02, 0.0, 4);
    fit(&recording, 1, OPERATORS, &model, &report);
    TEST_ASSERT_DOUBLE_WITHIN(
        0.02, 0.4, fact(&model, "offset_drift_um_per_decade")); /* 6000 samples of 0.02 um, a decade of time */
    /* The offset is that of the end of the training data, 6 s. */
    TEST_ASSERT_DOUBLE_WITHIN(0.02, offset_um + 0.4 * log10(6.1),
                              model_parameter(&model.block[0], "offset_um")->value[0]);
    model_free(&model);
    fit_report_free(&report);
    recording_free(&recording);
}

static void test_a_dense_density_is_not_negative_and_predicts(void) {
    recording_t recording;
    model_t model;
    fit_report_t report;
    make_recording(&recording, SAMPLES);
    add_noise(&recording, noise_um, 0.0, 8);
    fit(&recording, 1, 400, &model, &report);
    const parameter_t *found = model_parameter(&model.block[0], "weights");
    TEST_ASSERT_EQUAL_UINT64(401, found->count);
    for (size_t i = 0; i < found->count; i++) {
        TEST_ASSERT_TRUE(found->value[i] >= 0.0);
    }
    TEST_ASSERT_NULL(found->sigma);
    printf("seed 8: dense fit: training rms %.4f um, noise %.4f um\n", fact(&model, "residual_rms_um"), noise_um);
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * noise_um, noise_um, fact(&model, "residual_rms_um"));
    model_free(&model);
    fit_report_free(&report);
    recording_free(&recording);
}

static void expect_refusal(recording_t *recordings, size_t count, const char *line) {
    const fit_options_t options = {0};
    model_t model;
    fit_report_t report;
    failure_t failure = {{0}};
    TEST_ASSERT_FALSE_MESSAGE(
        fit_recordings(&family_prandtl_ishlinskii, recordings, count, &options, &model, &report, &failure), line);
    expect_line(&failure, line);
}

static void test_refuses_what_cannot_be_fitted(void) {
    recording_t recordings[2];
    make_recording(&recordings[0], SAMPLES);
    make_recording(&recordings[1], 20);
    expect_refusal(&recordings[1], 1, "synthetic: 20 samples are too few");
    recording_free(&recordings[1]);
    make_recording(&recordings[1], SAMPLES);
    memset(recordings[0].column[COLUMN_DRIVE], 0, SAMPLES * sizeof(double));
    expect_refusal(recordings, 1, "the drive does not change");
    memset(recordings[1].column[COLUMN_DISPLACEMENT], 0, SAMPLES * sizeof(double));
    expect_refusal(&recordings[1], 1, "the displacement does not change");
    recording_free(&recordings[0]);
    recording_free(&recordings[1]);
}

/* Beyond the first mode of the mechanics the position goes against the drive; a sign that is turned somewhere turns it
 * at every rate. Which of two recordings comes first does not matter. */
static void test_only_the_slowest_recording_tells_the_sign(void) {
    const fit_options_t options = {.operators = OPERATORS};
    for (int turned = 0; turned < 2; turned++) { /* 0: the fast one */
        for (size_t slow = 0; slow < 2; slow++) {
            recording_t recordings[2];
            model_t model;
            fit_report_t report;
            failure_t failure = {{0}};
            make_recording(&recordings[slow], SAMPLES);
            recording_create(&recordings[1 - slow], "fast", rate_hz, SAMPLES);
            fill_lines(recordings[1 - slow].column[COLUMN_DRIVE], SAMPLES, corners, sizeof corners / sizeof corners[0],
                       PER_LINE / 4);
            simulate_into(&recordings[1 - slow], &truth, 1);
            const size_t which = turned == 0 ? 1 - slow : slow;
            for (size_t k = 0; k < SAMPLES; k++) {
                recordings[which].column[COLUMN_DISPLACEMENT][k] *= -1.0;
            }
            const bool good =
                fit_recordings(&family_prandtl_ishlinskii, recordings, 2, &options, &model, &report, &failure);
            TEST_ASSERT_TRUE_MESSAGE(good == (turned == 0), failure.text);
            if (good) {
                fit_report_free(&report);
                model_free(&model);
            } else {
                TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "synthetic: the displacement falls"), failure.text);
            }
            recording_free(&recordings[0]);
            recording_free(&recordings[1]);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_recovers_weights_within_their_standard_errors);
    RUN_TEST(test_held_out_error_is_the_noise_when_the_model_is_right);
    RUN_TEST(test_finds_the_initial_memory);
    RUN_TEST(test_copes_when_the_memory_is_never_determined);
    RUN_TEST(test_two_recordings_are_one_fit);
    RUN_TEST(test_takes_out_a_drift_of_the_offset);
    RUN_TEST(test_a_dense_density_is_not_negative_and_predicts);
    RUN_TEST(test_refuses_what_cannot_be_fitted);
    RUN_TEST(test_only_the_slowest_recording_tells_the_sign);
    return UNITY_END();
}
