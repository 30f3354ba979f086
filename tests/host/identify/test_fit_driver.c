/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What fit.h does without endy family: with families made for the purpose, each with a fault or a gap of its own. */
#include "chain/catalogue.h"
#include "identify/fit.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { SAMPLES = 3000, CUT = 2000 };

static const double rate_hz = 1000.0, weight = 0.05, noise_um = 0.05;
static const double corners[] = {0, 100, -100, 60, -30, 100, -80};

static recording_t recording;
static bool looked_ahead;

/* A linear actuator behind a lag, in noise; the last third lies 1 um higher, which only the held-out error may see. */
void setUp(void) {
    random_t random = random_start("fit_driver", 3);
    model_t truth;
    make_bank_model(&truth, rate_hz, 1.0, 0, &weight, NULL);
    model_set(model_append(&truth, &block_sensor_bandwidth), "cutoff_hz", 20.0);
    recording_create(&recording, "synthetic", rate_hz, SAMPLES);
    fill_lines(recording.column[COLUMN_DRIVE], SAMPLES, corners, sizeof corners / sizeof corners[0], 50);
    simulate_into(&recording, &truth, 1);
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_DISPLACEMENT][k] += noise_um * random_normal(&random) + (k >= CUT ? 1.0 : 0.0);
    }
    model_free(&truth);
}

void tearDown(void) {
    recording_free(&recording);
}

static bool straight_line(const family_job_t *job, double lag_hz, model_t *model) {
    looked_ahead = job->train_to[0] != CUT;
    make_bank_model(model, rate_hz, 1.0, 0, &weight, NULL);
    model_set(model_append(model, &block_sensor_bandwidth), "cutoff_hz", lag_hz);
    return true;
}

/* The truth itself: every number determined. */
static bool fit_lag(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    (void)failure;
    family_note(notes, "a line");
    return straight_line(job, 20.0, model);
}

/* Half of the lag before, half behind a linear stage. */
static bool fit_two_lags(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    (void)notes;
    (void)failure;
    (void)job;
    model_create(model, rate_hz);
    model_set(model_append(model, &block_amplifier_bandwidth), "cutoff_hz", 40.0);
    model_set_array(model_append(model, &block_prandtl_ishlinskii), "weights", 1, &weight, NULL);
    model_set(model_append(model, &block_sensor_bandwidth), "cutoff_hz", 40.0);
    return true;
}

static bool fit_without_lag(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    (void)notes;
    (void)failure;
    return straight_line(job, 400.0, model);
}

static bool fit_nonsense(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    (void)notes;
    (void)failure;
    return straight_line(job, -1.0, model);
}

static bool fit_nothing(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    (void)job;
    (void)model;
    (void)notes;
    return fail(failure, "needs a full moon");
}

static const family_t no_lag = {.name = "no lag", .fit = fit_without_lag};
static const family_t lag = {.name = "lag", .fit = fit_lag, .without = &no_lag};
static const family_t two_lags = {.name = "two_lags", .fit = fit_two_lags};
static const family_t nonsense = {.name = "nonsense", .fit = fit_nonsense};
static const family_t nothing = {.name = "nothing", .fit = fit_nothing};

static bool says(const fit_report_t *report, const char *text) {
    for (size_t i = 0; i < report->notes.count; i++) {
        if (strstr(report->notes.line[i], text) != NULL) {
            return true;
        }
    }
    return false;
}

static void fit(const family_t *family, const fit_options_t *options, model_t *model, fit_report_t *report) {
    failure_t failure = {{0}};
    TEST_ASSERT_TRUE_MESSAGE(fit_recordings(family, &recording, 1, options, model, report, &failure), failure.text);
}

static double peak_to_peak(size_t from, size_t to) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (size_t k = from; k < to; k++) {
        low = fmin(low, recording.column[COLUMN_DISPLACEMENT][k]);
        high = fmax(high, recording.column[COLUMN_DISPLACEMENT][k]);
    }
    return high - low;
}

static void test_judges_by_simulation_on_data_that_the_family_did_not_see(void) {
    const fit_options_t options = {0};
    model_t model;
    fit_report_t report;
    fit(&lag, &options, &model, &report);
    TEST_ASSERT_FALSE(looked_ahead);
    /* RMS of 1 um and of the noise; the mean noise of 1000 samples is 0.05 um / sqrt(1000), a part in 600 of 1 um. */
    const double held_out_um = 0.01 * report.held_out_nrmse_percent * peak_to_peak(CUT, SAMPLES);
    TEST_ASSERT_DOUBLE_WITHIN(3.0 / 600.0, sqrt(1.0 + noise_um * noise_um), held_out_um);
    /* The noise, which 2000 samples know to 1.6 %. */
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * noise_um, noise_um, 0.01 * report.nrmse_percent * peak_to_peak(0, CUT));
    TEST_ASSERT_EQUAL_DOUBLE(2.0, report.recording[0].held_out_s);
    TEST_ASSERT_TRUE(report.recording[0].held_out_max_s >= 2.0 && report.held_out_max_um > 1.0);
    TEST_ASSERT_TRUE(report.without_held_out_nrmse_percent > report.held_out_nrmse_percent);
    TEST_ASSERT_TRUE(says(&report, "a line"));
    TEST_ASSERT_EQUAL_STRING("lag", json_string_value(json_object_get(model.fit, "family")));
    TEST_ASSERT_EQUAL_STRING("a line", json_string_value(json_array_get(json_object_get(model.fit, "notes"), 0)));
    TEST_ASSERT_EQUAL_STRING("no lag",
                             json_string_value(json_object_get(json_object_get(model.fit, "without"), "name")));
    model_free(&model);
    fit_report_free(&report);
}

static void test_finds_the_errors_that_a_family_leaves_open(void) {
    const fit_options_t options = {0};
    model_t model;
    fit_report_t report;
    fit(&lag, &options, &model, &report);
    const parameter_t *cutoff = model_parameter(model_find(&model, "sensor_bandwidth"), "cutoff_hz");
    const parameter_t *gain = model_parameter(model_find(&model, "prandtl_ishlinskii"), "weights");
    TEST_ASSERT_EQUAL_UINT64(3, report.parameters);
    TEST_ASSERT_NOT_NULL(cutoff->sigma);
    TEST_ASSERT_NOT_NULL(gain->sigma);
    TEST_ASSERT_NULL(model_parameter(model_find(&model, "prandtl_ishlinskii"), "thresholds_v")->sigma);
    /* Alone, the noise over the RMS of what the gain multiplies and sqrt(2000); together with cutoff and offset
     * somewhat more. */
    double mean = 0.0, power = 0.0;
    for (size_t k = 0; k < CUT; k++) {
        mean += recording.column[COLUMN_DISPLACEMENT][k] / CUT;
    }
    for (size_t k = 0; k < CUT; k++) {
        power += pow((recording.column[COLUMN_DISPLACEMENT][k] - mean) / weight, 2.0);
    }
    TEST_ASSERT_TRUE(gain->sigma[0] > 0.9 * noise_um / sqrt(power) && gain->sigma[0] < 1.4 * noise_um / sqrt(power));
    TEST_ASSERT_TRUE(cutoff->sigma[0] > 0.0 && cutoff->sigma[0] < 0.2);
    TEST_ASSERT_FALSE(says(&report, "not determined"));
    model_free(&model);
    fit_report_free(&report);
}

static void test_says_what_the_recordings_do_not_determine(void) {
    const fit_options_t options = {.creep = true};
    model_t model;
    fit_report_t report;
    fit(&two_lags, &options, &model, &report);
    TEST_ASSERT_TRUE(says(&report, "not determined by these recordings: cutoff_hz of amplifier_bandwidth"));
    TEST_ASSERT_TRUE(says(&report, "not determined by these recordings: cutoff_hz of sensor_bandwidth"));
    TEST_ASSERT_FALSE(says(&report, "weights of"));
    TEST_ASSERT_TRUE(says(&report, "creep: family two_lags does not look for it"));
    TEST_ASSERT_TRUE(isinf(model_parameter(model_find(&model, "sensor_bandwidth"), "cutoff_hz")->sigma[0]));
    model_free(&model);
    fit_report_free(&report);
}

static void test_use_all_shows_the_family_everything_and_judges_before(void) {
    const fit_options_t options = {.use_all = true};
    model_t model;
    fit_report_t report;
    fit(&lag, &options, &model, &report);
    TEST_ASSERT_TRUE(looked_ahead);
    TEST_ASSERT_TRUE(json_is_true(json_object_get(model.fit, "fitted_to_all")));
    TEST_ASSERT_TRUE(report.held_out_nrmse_percent > 5.0); /* still that of the third that lies higher */
    model_free(&model);
    fit_report_free(&report);
}

static void test_passes_refusals_on(void) {
    const fit_options_t options = {0};
    model_t model;
    fit_report_t report;
    failure_t failure;
    TEST_ASSERT_FALSE(fit_recordings(&nothing, &recording, 1, &options, &model, &report, &failure));
    expect_line(&failure, "needs a full moon");
    TEST_ASSERT_FALSE(fit_recordings(&nonsense, &recording, 1, &options, &model, &report, &failure));
    expect_line(&failure, "fitted model: block sensor_bandwidth: cutoff_hz = -1 Hz is outside");
}

static void test_every_family_is_found_by_its_name(void) {
    for (size_t i = 0; i < families_count; i++) {
        TEST_ASSERT_EQUAL_PTR(families[i], family_find(families[i]->name));
        TEST_ASSERT_TRUE(families[i]->text[0] != '\0' && families[i]->fit != NULL);
    }
    TEST_ASSERT_NULL(family_find("all"));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_judges_by_simulation_on_data_that_the_family_did_not_see);
    RUN_TEST(test_finds_the_errors_that_a_family_leaves_open);
    RUN_TEST(test_says_what_the_recordings_do_not_determine);
    RUN_TEST(test_use_all_shows_the_family_everything_and_judges_before);
    RUN_TEST(test_passes_refusals_on);
    RUN_TEST(test_every_family_is_found_by_its_name);
    return UNITY_END();
}
