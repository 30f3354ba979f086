/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Families in stop form and with inertia: the truth found again, from positions whose derivatives are known. */
#include "chain/catalogue.h"
#include "identify/fit.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STOPS = 4, SAMPLES = 6000 };

static const double rate_hz = 20000.0, half_um = 10.0;
static const double offset_v = 2.0, weights[STOPS + 1] = {2.5, 0.9, 0.6, 0.4, 0.3};
static const double damping = 8e-4, mass = 6e-8;

void setUp(void) {
}
void tearDown(void) {
}

/*
 * The position is a sum of two sines between 0 and 20 um, so rate and acceleration are known without differences; the
 * drive follows from the operator definition. Noise is added to the position afterwards.
 */
static void make_recording(recording_t *recording, double frequency_hz, double preload_factor, double noise_um,
                           random_t *random) {
    double stop[STOPS] = {0}, previous = 0.0;
    recording_create(recording, "synthetic", rate_hz, SAMPLES);
    for (size_t k = 0; k < SAMPLES; k++) {
        /* The slow sine swings the middle by a fifth, so that inner loops are there too. */
        const double w = 2.0 * M_PI * frequency_hz, v = w / 5.0, t = (double)k / rate_hz;
        const double x = half_um - 0.8 * half_um * cos(w * t) - 0.2 * half_um * cos(v * t);
        const double rate = 0.8 * half_um * w * sin(w * t) + 0.2 * half_um * v * sin(v * t);
        const double acceleration = 0.8 * half_um * w * w * cos(w * t) + 0.2 * half_um * v * v * cos(v * t);
        double drive = offset_v + weights[0] * x + damping * rate + mass * acceleration;
        for (size_t i = 0; i < STOPS; i++) {
            const double r = half_um * (double)(i + 1) / (STOPS + 1);
            stop[i] = fmax(-r, fmin(r, stop[i] + x - previous));
            drive += weights[i + 1] * stop[i];
        }
        previous = x;
        recording->column[COLUMN_DRIVE][k] = drive;
        recording->column[COLUMN_DISPLACEMENT][k] = x / preload_factor + noise_um * random_normal(random);
    }
}

static void fit(const family_t *family, const recording_t *recordings, size_t count, size_t operators, model_t *model,
                family_notes_t *notes) {
    progress_t progress;
    size_t train_to[8];
    const family_job_t job = {
        .recordings = recordings, .count = count, .train_to = train_to, .operators = operators, .progress = &progress};
    failure_t failure = {{0}};
    for (size_t i = 0; i < count; i++) {
        train_to[i] = recordings[i].samples;
    }
    memset(notes, 0, sizeof *notes);
    progress_begin(&progress, "fitting");
    TEST_ASSERT_TRUE_MESSAGE(family->fit(&job, model, notes, &failure), failure.text);
    progress_end(&progress);
    TEST_ASSERT_TRUE_MESSAGE(model_check(model, "fitted", &failure), failure.text);
}

static double scalar(const model_t *model, const char *block, const char *parameter) {
    return model_parameter(model_find(model, block), parameter)->value[0];
}

static void test_finds_mass_damping_and_spring(void) {
    static const double frequencies[] = {40.0, 100.0, 200.0};
    random_t random = random_start("inertial_exact", 41);
    recording_t recordings[3];
    family_notes_t notes;
    model_t model;
    for (size_t i = 0; i < 3; i++) {
        make_recording(&recordings[i], frequencies[i], 1.0, 0.0, &random);
    }
    fit(&family_inertial_hysteresis, recordings, 3, 0, &model, &notes);
    const parameter_t *found = model_parameter(&model.block[0], "weights");
    TEST_ASSERT_EQUAL_UINT64(STOPS + 1, found->count); /* four stops unless asked otherwise */
    /* Differences of a 200 Hz sine at 20 kHz: (w dt)^2 / 6 = 7e-4 of the rate, half of that of the acceleration. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * damping, damping, scalar(&model, "inertial_hysteresis", "damping_v_s_per_um"));
    TEST_ASSERT_DOUBLE_WITHIN(5e-3 * mass, mass, scalar(&model, "inertial_hysteresis", "mass_v_s2_per_um"));
    for (size_t i = 0; i <= STOPS; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(2e-3, weights[i], found->value[i]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.01, offset_v, scalar(&model, "inertial_hysteresis", "offset_v"));
    TEST_ASSERT_NULL(model_find(&model, "preload")); /* one preload only */
    model_free(&model);
    for (size_t i = 0; i < 3; i++) {
        recording_free(&recordings[i]);
    }
}

/* What the fit takes for the equation is what the block integrates: no error of differences at all. */
static void test_finds_its_own_block_to_rounding(void) {
    enum { ROUNDS = 30 };
    const double thresholds[STOPS] = {2.0, 4.0, 6.0, 8.0};
    recording_t recording;
    family_notes_t notes;
    model_t truth, model;
    double low = HUGE_VAL, high = -HUGE_VAL, scaled[STOPS];
    for (int round = 0; round < ROUNDS; round++) { /* ends with the thresholds that the fit is going to choose */
        model_create(&truth, rate_hz);
        model_block_t *block = model_append(&truth, &block_inertial_hysteresis);
        for (size_t i = 0; i < STOPS; i++) {
            scaled[i] = round == 0 ? thresholds[i] : 0.5 * (high - low) * (double)(i + 1) / (STOPS + 1);
        }
        model_set(block, "offset_v", offset_v);
        model_set_array(block, "weights", STOPS + 1, weights, NULL);
        model_set_array(block, "thresholds_um", STOPS, scaled, NULL);
        model_set(block, "damping_v_s_per_um", damping);
        model_set(block, "mass_v_s2_per_um", mass);
        recording_create(&recording, "own", rate_hz, SAMPLES);
        for (size_t k = 0; k < SAMPLES; k++) {
            const double t = (double)k / rate_hz;
            recording.column[COLUMN_DRIVE][k] = offset_v + 40.0 * (1.0 - cos(2.0 * M_PI * (20.0 + 300.0 * t) * t));
        }
        simulate_into(&recording, &truth, 1);
        low = HUGE_VAL;
        high = -HUGE_VAL;
        for (size_t k = 0; k < SAMPLES; k++) {
            low = fmin(low, recording.column[COLUMN_DISPLACEMENT][k]);
            high = fmax(high, recording.column[COLUMN_DISPLACEMENT][k]);
        }
        if (round < ROUNDS - 1) {
            recording_free(&recording);
            model_free(&truth);
        }
    }
    fit(&family_inertial_hysteresis, &recording, 1, STOPS, &model, &notes);
    printf("thresholds off by %.2g um, damping by %.2g, mass by %.2g of their values\n",
           fabs(scaled[0] - model_parameter(&model.block[0], "thresholds_um")->value[0]),
           fabs(scalar(&model, "inertial_hysteresis", "damping_v_s_per_um") / damping - 1.0),
           fabs(scalar(&model, "inertial_hysteresis", "mass_v_s2_per_um") / mass - 1.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-7 * damping, damping, scalar(&model, "inertial_hysteresis", "damping_v_s_per_um"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-7 * mass, mass, scalar(&model, "inertial_hysteresis", "mass_v_s2_per_um"));
    model_free(&model);
    model_free(&truth);
    recording_free(&recording);
}

/* A sensor of 0.75 nm, as the source's: unsmoothed second differences would have 300 times the power of the motion. */
static void test_noise_does_not_pull_the_mass_down(void) {
    static const double frequencies[] = {10.0, 50.0, 200.0};
    random_t random = random_start("inertial_noise", 42);
    double worst[2] = {0};
    for (int round = 0; round < 10; round++) {
        recording_t recordings[3];
        family_notes_t notes;
        model_t model;
        for (size_t i = 0; i < 3; i++) {
            make_recording(&recordings[i], frequencies[i], 1.0, 7.5e-4, &random);
        }
        fit(&family_inertial_hysteresis, recordings, 3, 0, &model, &notes);
        worst[0] = fmax(worst[0], fabs(scalar(&model, "inertial_hysteresis", "damping_v_s_per_um") / damping - 1.0));
        worst[1] = fmax(worst[1], fabs(scalar(&model, "inertial_hysteresis", "mass_v_s2_per_um") / mass - 1.0));
        TEST_ASSERT_NOT_NULL(strstr(notes.line[1], "smoothed"));
        model_free(&model);
        for (size_t i = 0; i < 3; i++) {
            recording_free(&recordings[i]);
        }
    }
    printf("with noise: damping off by %.2g, mass by %.2g of their values at most\n", worst[0], worst[1]);
    TEST_ASSERT_TRUE(worst[0] < 2e-3); /* 7e-4 for the differences, as above, and what the noise adds */
    TEST_ASSERT_TRUE(worst[1] < 3e-3);
}

/* Through the driver, which knows the standard errors. The noise is 20 nm: with less, what decides is that thresholds
 * follow the ends of the range and rates the differences, which are systematic errors and not in sigma. */
static void test_numbers_are_within_their_standard_errors(void) {
    static const double frequencies[] = {40.0, 100.0, 200.0};
    random_t random = random_start("inertial_sigma", 46);
    recording_t recordings[3];
    fit_report_t report;
    failure_t failure = {{0}};
    model_t model;
    double worst = 0.0;
    for (size_t i = 0; i < 3; i++) {
        make_recording(&recordings[i], frequencies[i], 1.0, 2e-2, &random);
    }
    TEST_ASSERT_TRUE_MESSAGE(
        fit_recordings(&family_inertial_hysteresis, recordings, 3, &(fit_options_t){0}, &model, &report, &failure),
        failure.text);
    const struct {
        const char *name;
        const double *truth;
        size_t count;
    } numbers[] = {{"offset_v", &offset_v, 1},
                   {"weights", weights, STOPS + 1},
                   {"damping_v_s_per_um", &damping, 1},
                   {"mass_v_s2_per_um", &mass, 1}};
    for (size_t n = 0; n < sizeof numbers / sizeof numbers[0]; n++) {
        const parameter_t *found = model_parameter(&model.block[0], numbers[n].name);
        TEST_ASSERT_NOT_NULL_MESSAGE(found->sigma, numbers[n].name);
        for (size_t i = 0; i < numbers[n].count; i++) {
            worst = fmax(worst, fabs(found->value[i] - numbers[n].truth[i]) / found->sigma[i]);
        }
    }
    printf("worst number %.1f standard errors off; held out %.4f %%, without mass and damper %.4f %%\n", worst,
           report.held_out_nrmse_percent, report.without_held_out_nrmse_percent);
    TEST_ASSERT_TRUE(worst < 6.0);
    model_free(&model);
    fit_report_free(&report);
    for (size_t i = 0; i < 3; i++) {
        recording_free(&recordings[i]);
    }
}

/* Where the motion is so slow that its acceleration drowns in the noise (the estimate of the noise is then above the
 * power of both as often as below), the numbers stay finite and explain the drive. */
static void test_noise_alone_in_the_acceleration(void) {
    random_t random = random_start("inertial_slow", 45);
    for (int round = 0; round < 10; round++) {
        recording_t recording;
        family_notes_t notes;
        model_t model;
        make_recording(&recording, 10.0, 1.0, 7.5e-4, &random);
        fit(&family_inertial_hysteresis, &recording, 1, 0, &model, &notes);
        const char *rms = strstr(notes.line[0], "drive ");
        TEST_ASSERT_NOT_NULL(rms);
        TEST_ASSERT_TRUE(strtod(rms + strlen("drive "), NULL) <
                         0.01); /* of 80 V: 0.75 nm times 4.7 V/um are 0.0035 V */
        model_free(&model);
        recording_free(&recording);
    }
}

static void test_finds_the_compliance_under_three_preloads(void) {
    static const char *const preloads[] = {"0", "4", "12"};
    const double compliance = 0.003;
    random_t random = random_start("preload_fit", 43);
    recording_t recordings[3];
    family_notes_t notes;
    model_t model;
    for (size_t i = 0; i < 3; i++) {
        make_recording(&recordings[i], 50.0, 1.0 + compliance * strtod(preloads[i], NULL), 7.5e-4, &random);
        recording_set_key(&recordings[i], "preload_n", preloads[i]);
    }
    fit(&family_stop_prandtl_ishlinskii, recordings, 3, 0, &model, &notes);
    printf("compliance %.6f (true %.6f)\n", scalar(&model, "preload", "compliance_per_n"), compliance);
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * compliance, compliance, scalar(&model, "preload", "compliance_per_n"));
    recording_set_key(&recordings[1], "preload_n", "much");
    {
        const size_t train_to[3] = {SAMPLES, SAMPLES, SAMPLES};
        progress_t progress = {0};
        const family_job_t job = {.recordings = recordings, .count = 3, .train_to = train_to, .progress = &progress};
        model_t none;
        failure_t failure;
        TEST_ASSERT_FALSE(family_stop_prandtl_ishlinskii.fit(&job, &none, &notes, &failure));
        expect_line(&failure, "preload_n is 'much'");
    }
    model_free(&model);
    for (size_t i = 0; i < 3; i++) {
        recording_free(&recordings[i]);
    }
}

/* A recording that begins in the middle of things: 0 to 60 V and back to 25 V happened before it. */
static void test_finds_what_happened_before_the_recording(void) {
    enum { BEFORE = 200, SMALL = 1000 };
    const double thresholds[STOPS] = {2.0, 4.0, 6.0, 8.0};
    double position[SAMPLES], with = 0.0, without = 0.0;
    recording_t recording;
    family_notes_t notes;
    model_t truth, model;
    failure_t failure = {{0}};
    model_create(&truth, rate_hz);
    model_block_t *block = model_append(&truth, &block_stop_prandtl_ishlinskii);
    model_set(block, "offset_v", offset_v);
    model_set_array(block, "weights", STOPS + 1, weights, NULL);
    model_set_array(block, "thresholds_um", STOPS, thresholds, NULL);
    chain_t *chain = chain_open(&truth, rate_hz, 1, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(chain, failure.text);
    recording_create(&recording, "late", rate_hz, SAMPLES);
    chain_settle(chain, 0.0);
    for (int k = 0; k < BEFORE + SAMPLES; k++) {
        const double t = (k - BEFORE) / rate_hz, w = 2.0 * M_PI * 40.0;
        const double way = 2.0 * k / BEFORE; /* 1 at 60 V, 2 at 25 V */
        const double past = way < 1.0 ? 60.0 * way : 60.0 - 35.0 * (way - 1.0);
        const double now = k < BEFORE + SMALL ? 25.0 + 4.0 * sin(w * t) : 30.0 - 5.0 * cos(w * t) - 30.0 * sin(w * t);
        const double drive = k < BEFORE ? past : now, x = chain_step(chain, drive);
        if (k >= BEFORE) {
            recording.column[COLUMN_DRIVE][k - BEFORE] = drive;
            recording.column[COLUMN_DISPLACEMENT][k - BEFORE] = x;
        }
    }
    chain_close(chain);
    fit(&family_stop_prandtl_ishlinskii, &recording, 1, 0, &model, &notes);
    TEST_ASSERT_EQUAL_UINT64(STOPS, model_parameter(&model.block[0], "initial_memory_um")->count);
    for (int memory = 1; memory >= 0; memory--) {
        TEST_ASSERT_TRUE(chain_simulate(&model, &recording, 1, position, &failure));
        for (size_t k = 0; k < SMALL; k++) {
            *(memory == 1 ? &with : &without) += fabs(position[k] - recording.column[COLUMN_DISPLACEMENT][k]) / SMALL;
        }
        model_set_array(&model.block[0], "initial_memory_um", 0, NULL, NULL);
    }
    printf("mean error before the memory is determined: %.4f um, %.4f um from demagnetised\n", with, without);
    TEST_ASSERT_TRUE(with < 0.05); /* of 20 um: the thresholds are not the true ones */
    TEST_ASSERT_TRUE(without > 10.0 * with);
    model_free(&model);
    model_free(&truth);
    recording_free(&recording);
}

/* Mass and damping of the play form, and its weights, from a simulation of its own blocks at two sample rates. */
static void test_finds_the_play_form(void) {
    enum { PLAYS = 4 };
    const double true_weights[PLAYS + 1] = {0.2, 0.03, 0.02, 0.02, 0.01}, thresholds[PLAYS] = {8.0, 16.0, 24.0, 32.0};
    const double c = 1.5e-4, m = 2e-8;
    random_t random = random_start("play_form", 44);
    recording_t recordings[2];
    family_notes_t notes;
    model_t truth, model;
    make_bank_model(&truth, rate_hz, 1.0, PLAYS, true_weights, thresholds);
    model_block_t *block = model_append(&truth, &block_inertial_terms);
    model_set(block, "damping_s", c);
    model_set(block, "mass_s2", m);
    for (size_t i = 0; i < 2; i++) {
        const double own_hz = i == 0 ? 0.5 * rate_hz : rate_hz;
        recording_create(&recordings[i], "play form", own_hz, SAMPLES);
        for (size_t k = 0; k < SAMPLES; k++) {
            recordings[i].column[COLUMN_DRIVE][k] =
                40.0 * (1.0 - cos(2.0 * M_PI * (i == 0 ? 20.0 : 200.0) * (double)k / own_hz));
        }
        simulate_into(&recordings[i], &truth, 1);
        for (size_t k = 0; k < SAMPLES; k++) {
            recordings[i].column[COLUMN_DISPLACEMENT][k] += 7.5e-4 * random_normal(&random);
        }
    }
    fit(&family_inertial_prandtl_ishlinskii, recordings, 2, PLAYS, &model, &notes);
    const parameter_t *found = model_parameter(&model.block[0], "weights");
    printf("play form: damping %.6g s (true %.6g), mass %.6g s2 (true %.6g)\n",
           scalar(&model, "inertial_terms", "damping_s"), c, scalar(&model, "inertial_terms", "mass_s2"), m);
    /* 12000 samples of 0.75 nm over 20 um know the lag to 0.75e-3 / (20 * 1257) / sqrt(12000) = 3e-10 s,
     * were it not for the first weight, which opens the loop too. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, c, scalar(&model, "inertial_terms", "damping_s"));
    TEST_ASSERT_DOUBLE_WITHIN(5e-3 * m, m, scalar(&model, "inertial_terms", "mass_s2"));
    for (size_t i = 0; i <= PLAYS; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(2e-5, true_weights[i], found->value[i]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 1.0, scalar(&model, "prandtl_ishlinskii", "offset_um"));
    model_free(&model);
    model_free(&truth);
    for (size_t i = 0; i < 2; i++) {
        recording_free(&recordings[i]);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_finds_mass_damping_and_spring);
    RUN_TEST(test_finds_its_own_block_to_rounding);
    RUN_TEST(test_noise_does_not_pull_the_mass_down);
    RUN_TEST(test_numbers_are_within_their_standard_errors);
    RUN_TEST(test_noise_alone_in_the_acceleration);
    RUN_TEST(test_finds_the_compliance_under_three_preloads);
    RUN_TEST(test_finds_what_happened_before_the_recording);
    RUN_TEST(test_finds_the_play_form);
    return UNITY_END();
}
