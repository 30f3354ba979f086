/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Refining finds again what a recording was made from, knows how sure it is, and says what it cannot know. */
#include "chain/catalogue.h"
#include "identify/refine.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 2000, RUNS = 120, UNKNOWNS = 8 };

static const double rate_hz = 2000.0;
static const double weights[] = {0.08, 0.03, 0.02}, thresholds[] = {15.0, 40.0};
static const double corners[] = {0, 100, -100, 60, -30, 90, -100, 100, 0, 50, -80};

void setUp(void) {
}
void tearDown(void) {
}

/* Amplifier, hysteresis, mode. */
static void make_chain(model_t *model) {
    model_create(model, rate_hz);
    model_set(model_append(model, &block_amplifier_bandwidth), "cutoff_hz", 120.0);
    model_block_t *bank = model_append(model, &block_prandtl_ishlinskii);
    model_set(bank, "offset_um", 2.0);
    model_set_array(bank, "weights", 3, weights, NULL);
    model_set_array(bank, "thresholds_v", 2, thresholds, NULL);
    model_block_t *mode = model_append(model, &block_resonance);
    model_set(mode, "frequency_hz", 150.0);
    model_set(mode, "damping_ratio", 0.1);
}

static void list_unknowns(const model_t *model, refine_unknown_t *unknown) {
    unknown[0] = refine_unknown(model, "amplifier_bandwidth", "cutoff_hz", 0);
    unknown[1] = refine_unknown(model, "prandtl_ishlinskii", "offset_um", 0);
    unknown[2] = refine_unknown(model, "prandtl_ishlinskii", "weights", 0);
    unknown[3] = refine_unknown(model, "prandtl_ishlinskii", "weights", 1);
    unknown[4] = refine_unknown(model, "prandtl_ishlinskii", "weights", 2);
    unknown[5] = refine_unknown(model, "prandtl_ishlinskii", "thresholds_v", 0);
    unknown[6] = refine_unknown(model, "resonance", "frequency_hz", 0);
    unknown[7] = refine_unknown(model, "resonance", "damping_ratio", 0);
}

static double *number(const model_t *model, const refine_unknown_t *unknown) {
    return &model->block[unknown->block].parameter[unknown->parameter].value[unknown->element];
}

/* Drive lines with 50 samples each, and the displacement of the model. */
static void make_recording(recording_t *recording, const model_t *model, size_t samples, size_t per_line) {
    recording_create(recording, "synthetic", rate_hz, samples);
    fill_lines(recording->column[COLUMN_DRIVE], samples, corners, sizeof corners / sizeof corners[0], per_line);
    simulate_into(recording, model, 1);
}

static void add_noise(recording_t *recording, double rms, double rho, random_t *random) {
    double noise = random_normal(random);
    for (size_t k = 0; k < recording->samples; k++) {
        recording->column[COLUMN_DISPLACEMENT][k] += rms * noise;
        noise = rho * noise + sqrt(1.0 - rho * rho) * random_normal(random);
    }
}

static void refine_well(model_t *model, const refine_job_t *job, refine_report_t *report) {
    failure_t failure = {{0}};
    TEST_ASSERT_TRUE_MESSAGE(refine(model, job, report, &failure), failure.text);
    TEST_ASSERT_TRUE(report->converged);
}

/* One run of the Monte Carlo: starts 20 % off, adds up (error / sigma)^2 and counts the errors above 3 sigma. */
static void run_once(const model_t *truth, const recording_t *clean, double rho, random_t *random, double *square_sum,
                     size_t *outside) {
    refine_unknown_t unknown[UNKNOWNS];
    recording_t recording;
    refine_report_t report;
    model_t model;
    recording_create(&recording, "noisy", rate_hz, SAMPLES);
    memcpy(recording.column[COLUMN_DRIVE], clean->column[COLUMN_DRIVE], SAMPLES * sizeof(double));
    memcpy(recording.column[COLUMN_DISPLACEMENT], clean->column[COLUMN_DISPLACEMENT], SAMPLES * sizeof(double));
    add_noise(&recording, 0.05, rho, random);
    model_copy(&model, truth);
    list_unknowns(&model, unknown);
    for (size_t u = 0; u < UNKNOWNS; u++) {
        *number(&model, &unknown[u]) *= 1.0 + 0.4 * (random_unit(random) - 0.5);
    }
    const refine_job_t job = {
        .recordings = &recording, .count = 1, .unknown = unknown, .unknowns = UNKNOWNS, .most_iterations = 50};
    refine_well(&model, &job, &report);
    for (size_t u = 0; u < UNKNOWNS; u++) {
        const double error = (*number(&model, &unknown[u]) - *number(truth, &unknown[u])) / report.sigma[u];
        TEST_ASSERT_EQUAL_INT(REFINE_DETERMINED, report.state[u]);
        *square_sum += error * error;
        *outside += fabs(error) > 3.0 ? 1 : 0;
    }
    refine_report_free(&report);
    model_free(&model);
    recording_free(&recording);
}

/*
 * For white noise and for noise that is correlated over some 4 samples. Of 960 normal errors 2.6 are outside 3 sigma on
 * the average. The 8 errors of a run are correlated, so the spread of that number is taken as twice a binomial's 1.6:
 * 3 of it above the mean is 12. The rms of 960 values of which 120 runs are independent is known to 1/sqrt(240) = 6 %
 * at worst; two of that, and 5 % for the autocorrelation time, which is itself estimated.
 */
static void test_errors_are_as_large_as_stated(void) {
    const double rhos[] = {0.0, 0.6};
    for (size_t c = 0; c < 2; c++) {
        random_t random = random_start("refine_coverage", 100 + c);
        double square_sum = 0.0;
        size_t outside = 0;
        recording_t clean;
        model_t truth;
        make_chain(&truth);
        make_recording(&clean, &truth, SAMPLES, 50);
        for (size_t run = 0; run < RUNS; run++) {
            run_once(&truth, &clean, rhos[c], &random, &square_sum, &outside);
        }
        const double ratio = sqrt(square_sum / (RUNS * UNKNOWNS));
        printf("correlation %.1f: %.2f %% of %d errors within 3 sigma, rms %.3f sigma\n", rhos[c],
               100.0 - 100.0 * (double)outside / (RUNS * UNKNOWNS), RUNS * UNKNOWNS, ratio);
        TEST_ASSERT_TRUE(outside <= 12);
        TEST_ASSERT_TRUE(ratio > 0.83 && ratio < 1.17);
        recording_free(&clean);
        model_free(&truth);
    }
}

/* Without noise what was put in comes out, to what differences of simulations resolve. */
static void test_finds_the_truth_exactly_without_noise(void) {
    refine_unknown_t unknown[UNKNOWNS];
    recording_t recording;
    refine_report_t report;
    model_t truth, model;
    failure_t failure;
    make_chain(&truth);
    make_recording(&recording, &truth, SAMPLES, 50);
    model_copy(&model, &truth);
    list_unknowns(&model, unknown);
    for (size_t u = 0; u < UNKNOWNS; u++) {
        *number(&model, &unknown[u]) *= u % 2 == 0 ? 1.3 : 0.75;
    }
    const refine_job_t job = {
        .recordings = &recording, .count = 1, .unknown = unknown, .unknowns = UNKNOWNS, .most_iterations = 100};
    TEST_ASSERT_TRUE_MESSAGE(refine(&model, &job, &report, &failure), failure.text);
    for (size_t u = 0; u < UNKNOWNS; u++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-7 * fabs(*number(&truth, &unknown[u])), *number(&truth, &unknown[u]),
                                  *number(&model, &unknown[u]));
    }
    refine_report_free(&report);
    recording_free(&recording);
    model_free(&model);
    model_free(&truth);
}

/* Stage by stage is what chain_step does, to the bit, and settles in the same state. */
static void test_stages_are_the_chain(void) {
    size_t order[MODEL_MAX_BLOCKS];
    recording_t recording;
    model_t model;
    make_chain(&model);
    model_set(model_append(&model, &block_sensor_noise), "rms_um", 0.1);
    model_block_t *rate = model_append(&model, &block_rate_dependent_hysteresis); /* runs before the bank */
    model_set(rate, "beta_s", 1e-3);
    const model_block_t moved = model.block[4]; /* a modifier stands among the hystereses in a file */
    memmove(&model.block[2], &model.block[1], 3 * sizeof moved);
    model.block[1] = moved;
    recording_create(&recording, "stages", rate_hz, SAMPLES);
    fill_lines(recording.column[COLUMN_DRIVE], SAMPLES, corners + 1, 10, 50);
    const stage_setup_t setup = {.sample_rate_hz = rate_hz, .seed = 1};
    chain_stage_t stage[MODEL_MAX_BLOCKS];
    signal_t signal = {.value = recording.column[COLUMN_DRIVE][0]};
    failure_t failure = {{0}};
    chain_t *chain = chain_open(&model, rate_hz, 1, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(chain, failure.text);
    chain_settle(chain, recording.column[COLUMN_DRIVE][0]);
    const size_t stages = chain_order(&model, order);
    TEST_ASSERT_EQUAL_UINT64(5, stages);
    for (size_t i = 0; i < stages; i++) {
        stage[i] = chain_stage_open(&model, order[i], &setup);
        chain_stage_settle(&stage[i], &signal);
    }
    for (size_t k = 0; k < SAMPLES; k++) {
        signal = (signal_t){.value = recording.column[COLUMN_DRIVE][k]};
        for (size_t i = 0; i < stages; i++) {
            chain_stage_step(&stage[i], &signal);
        }
        TEST_ASSERT_TRUE(signal.value == chain_step(chain, recording.column[COLUMN_DRIVE][k]));
    }
    chain_close(chain);
    for (size_t i = 0; i < stages; i++) {
        chain_stage_close(&stage[i]);
    }
    recording_free(&recording);
    model_free(&model);
}

/* A lag before and the same lag behind a linear gain cannot be told apart; the gain and the offset can. */
static void test_what_others_can_replace_is_not_determined(void) {
    random_t random = random_start("refine_singular", 7);
    recording_t recording;
    refine_report_t report;
    model_t model;
    model_create(&model, rate_hz);
    model_set(model_append(&model, &block_amplifier_bandwidth), "cutoff_hz", 100.0);
    model_set_array(model_append(&model, &block_prandtl_ishlinskii), "weights", 1, weights, NULL);
    model_set(model_append(&model, &block_sensor_bandwidth), "cutoff_hz", 100.0);
    make_recording(&recording, &model, SAMPLES, 50);
    add_noise(&recording, 0.05, 0.0, &random);
    const refine_unknown_t unknown[] = {refine_unknown(&model, "amplifier_bandwidth", "cutoff_hz", 0),
                                        refine_unknown(&model, "prandtl_ishlinskii", "weights", 0),
                                        refine_unknown(&model, "sensor_bandwidth", "cutoff_hz", 0),
                                        refine_unknown(&model, "prandtl_ishlinskii", "offset_um", 0)};
    refine_job_t job = {.recordings = &recording, .count = 1, .unknown = unknown, .unknowns = 4};
    refine_well(&model, &job, &report);
    TEST_ASSERT_EQUAL_INT(REFINE_NOT_DETERMINED, report.state[0]);
    TEST_ASSERT_EQUAL_INT(REFINE_DETERMINED, report.state[1]);
    TEST_ASSERT_EQUAL_INT(REFINE_NOT_DETERMINED, report.state[2]);
    TEST_ASSERT_EQUAL_INT(REFINE_DETERMINED, report.state[3]);
    TEST_ASSERT_TRUE(report.sigma[0] == HUGE_VAL && report.sigma[2] == HUGE_VAL);
    TEST_ASSERT_TRUE(report.sigma[1] < 1e-3 * weights[0]);
    refine_report_free(&report);
    /* An offset of the recording's own takes the place of the model's. */
    job.offsets = true;
    refine_well(&model, &job, &report);
    TEST_ASSERT_EQUAL_INT(REFINE_NOT_DETERMINED, report.state[3]);
    refine_report_free(&report);
    /* One of the two alone is determined. */
    job.unknowns = 2;
    refine_well(&model, &job, &report);
    TEST_ASSERT_EQUAL_INT(REFINE_DETERMINED, report.state[0]);
    TEST_ASSERT_TRUE(report.sigma[0] < 1.0);
    refine_report_free(&report);
    recording_free(&recording);
    model_free(&model);
}

/* An operator that the drive never carries along, and a lag far above what a slow drive shows in its noise. */
static void test_what_has_no_effect_is_not_determined(void) {
    const double beyond[] = {15.0, 300.0};
    random_t random = random_start("refine_no_effect", 8);
    recording_t recording;
    refine_report_t report;
    model_t model;
    make_bank_model(&model, rate_hz, 0.0, 2, weights, beyond);
    make_recording(&recording, &model, 20000, 2000);
    add_noise(&recording, 3.0, 0.0, &random); /* the lag costs 5 nm, 20000 samples of this noise know it to 20 */
    model_set(model_append(&model, &block_sensor_bandwidth), "cutoff_hz", 900.0);
    const refine_unknown_t unknown[] = {refine_unknown(&model, "prandtl_ishlinskii", "weights", 1),
                                        refine_unknown(&model, "prandtl_ishlinskii", "weights", 2),
                                        refine_unknown(&model, "prandtl_ishlinskii", "thresholds_v", 1),
                                        refine_unknown(&model, "sensor_bandwidth", "cutoff_hz", 0)};
    const size_t from = 0;
    const refine_job_t job = {.recordings = &recording, .count = 1, .from = &from, .unknown = unknown, .unknowns = 4};
    refine_well(&model, &job, &report);
    TEST_ASSERT_EQUAL_INT(REFINE_DETERMINED, report.state[0]);
    for (int u = 1; u < 4; u++) {
        TEST_ASSERT_EQUAL_INT(REFINE_NOT_DETERMINED, report.state[u]);
    }
    refine_report_free(&report);
    recording_free(&recording);
    model_free(&model);
}

/* The truth lies outside the range: the search ends on the bound, says so, and the others are as good as they can be.
 */
static void test_stops_at_bounds(void) {
    refine_unknown_t unknown[2];
    recording_t recording;
    refine_report_t report;
    model_t model;
    make_chain(&model);
    make_recording(&recording, &model, SAMPLES, 50);
    unknown[0] = refine_unknown(&model, "prandtl_ishlinskii", "weights", 1);
    unknown[0].low = 0.0;
    unknown[0].high = 0.025; /* true: 0.03 */
    unknown[1] = refine_unknown(&model, "resonance", "frequency_hz", 0);
    unknown[1].low = 160.0; /* true: 150 */
    *number(&model, &unknown[0]) = 0.01;
    *number(&model, &unknown[1]) = 200.0;
    const refine_job_t job = {
        .recordings = &recording, .count = 1, .unknown = unknown, .unknowns = 2, .most_iterations = 50};
    refine_well(&model, &job, &report);
    TEST_ASSERT_EQUAL_DOUBLE(0.025, *number(&model, &unknown[0]));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 160.0, *number(&model, &unknown[1]));
    for (int u = 0; u < 2; u++) {
        TEST_ASSERT_EQUAL_INT(REFINE_AT_BOUND, report.state[u]);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, report.sigma[u]);
    }
    refine_report_free(&report);
    recording_free(&recording);
    model_free(&model);
}

/* Recordings whose sensors were zeroed differently, fitted together. */
static void test_every_recording_may_have_its_own_offset(void) {
    random_t random = random_start("refine_offsets", 9);
    const double offsets[3] = {-4.0, 0.5, 7.0};
    refine_unknown_t unknown[UNKNOWNS];
    recording_t recordings[3];
    refine_report_t report;
    model_t truth, model;
    make_chain(&truth);
    model_copy(&model, &truth);
    for (size_t i = 0; i < 3; i++) {
        make_recording(&recordings[i], &truth, SAMPLES + 100 * i, 40 + 20 * i);
        add_noise(&recordings[i], 0.05, 0.0, &random);
        for (size_t k = 0; k < recordings[i].samples; k++) {
            recordings[i].column[COLUMN_DISPLACEMENT][k] += offsets[i];
        }
    }
    list_unknowns(&model, unknown);
    unknown[1] = unknown[7]; /* all but offset_um */
    *number(&model, &unknown[0]) = 100.0;
    *number(&model, &unknown[2]) = 0.1;
    const refine_job_t job = {.recordings = recordings,
                              .count = 3,
                              .offsets = true,
                              .unknown = unknown,
                              .unknowns = 7,
                              .most_iterations = 50};
    refine_well(&model, &job, &report);
    for (size_t u = 0; u < 7; u++) {
        TEST_ASSERT_TRUE(fabs(*number(&model, &unknown[u]) - *number(&truth, &unknown[u])) < 4.0 * report.sigma[u]);
    }
    for (size_t i = 0; i < 3; i++) { /* 0.05 um over 2000 samples */
        TEST_ASSERT_DOUBLE_WITHIN(6.0 * 0.05 / sqrt(2000.0), offsets[i], report.offset_um[i]);
    }
    refine_report_free(&report);
    for (size_t i = 0; i < 3; i++) {
        recording_free(&recordings[i]);
    }
    model_free(&model);
    model_free(&truth);
}

static void test_refuses_and_leaves_the_model_alone(void) {
    refine_unknown_t unknown;
    recording_t recording;
    refine_report_t report;
    failure_t failure;
    model_t model;
    make_chain(&model);
    make_recording(&recording, &model, SAMPLES, 50);
    unknown = refine_unknown(&model, "resonance", "frequency_hz", 0);
    const size_t end = 2, start = 0;
    refine_job_t job = {.recordings = &recording,
                        .count = 1,
                        .from = &start,
                        .to = &end,
                        .unknown = &unknown,
                        .unknowns = 1,
                        .most_iterations = 5};
    TEST_ASSERT_FALSE(refine(&model, &job, &report, &failure));
    expect_line(&failure, "2 samples count: too few for 1 unknowns");
    job.to = NULL;
    *number(&model, &unknown) = -1.0;
    TEST_ASSERT_FALSE(refine(&model, &job, &report, &failure));
    expect_line(&failure, "frequency_hz = -1 Hz is outside");
    TEST_ASSERT_EQUAL_DOUBLE(-1.0, *number(&model, &unknown));
    recording_free(&recording);
    model_free(&model);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_stages_are_the_chain);
    RUN_TEST(test_finds_the_truth_exactly_without_noise);
    RUN_TEST(test_errors_are_as_large_as_stated);
    RUN_TEST(test_what_others_can_replace_is_not_determined);
    RUN_TEST(test_what_has_no_effect_is_not_determined);
    RUN_TEST(test_stops_at_bounds);
    RUN_TEST(test_every_recording_may_have_its_own_offset);
    RUN_TEST(test_refuses_and_leaves_the_model_alone);
    return UNITY_END();
}
