/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Physics that no block has: it has no name, and the model gets better all the same. */
#include "compile/compile.h"
#include "diagnosis/account/account.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/diagnose.h"
#include "report/diagnosis_json.h"
#include "report/diagnosis_text.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 8000, OPERATORS = 16 };
static const double rate_hz = 2000.0, noise_um = 0.005;
static random_t rng;
static recording_t recording;
static model_t truth;
static answer_t diagnosis;
static failure_t failure;

/* Triangles between many levels, slow and fast, with rests between them. */
static void fill_drive(void) {
    static const double level[] = {100.0, 0.0, 85.0, 20.0, 70.0, 35.0, 60.0, 45.0, 90.0, 10.0, 0.0};
    static const size_t per_line[] = {200, 60, 30, 120};
    double *drive = recording.column[COLUMN_DRIVE], last = 0.0;
    size_t at = 0;
    for (size_t round = 0; at < SAMPLES; round++) {
        for (size_t i = 0; i < 11 && at < SAMPLES; i++) {
            const size_t line = per_line[round % 4];
            for (size_t k = 1; k <= line && at < SAMPLES; k++) {
                drive[at++] = last + (level[i] - last) * (double)k / (double)line;
            }
            last = level[i];
        }
        for (size_t k = 0; k < 200 && at < SAMPLES; k++) {
            drive[at++] = last;
        }
    }
}

void setUp(void) {
    double weights[OPERATORS + 1] = {0.09}, thresholds[OPERATORS];
    for (size_t i = 0; i < OPERATORS; i++) {
        thresholds[i] = 3.0 * (double)(i + 1);
        weights[i + 1] = 0.006 * exp(-0.1 * (double)i);
    }
    recording_create(&recording, "unknown.csv", rate_hz, SAMPLES);
    fill_drive();
    make_bank_model(&truth, rate_hz, 1.0, OPERATORS, weights, thresholds);
    simulate_into(&recording, &truth, 1);
}

void tearDown(void) {
    answer_free(&diagnosis);
    model_free(&truth);
    recording_free(&recording);
}

/* A drift that comes and goes. */
static void add_bump(double *x, double height_um) {
    for (size_t k = 0; k < SAMPLES; k++) {
        x[k] += height_um * exp(-0.5 * gsl_pow_2(((double)k / SAMPLES - 0.55) / 0.13));
    }
}

static const double lead_hz = 20.0, lead_part = 0.1;

/* A gain that rises by a tenth above 20 Hz. */
static void add_lead(double *x) {
    const double decay = exp(-2.0 * M_PI * lead_hz / rate_hz);
    double slow = x[0];
    for (size_t k = 0; k < SAMPLES; k++) {
        slow = decay * slow + (1.0 - decay) * x[k];
        x[k] += lead_part * (x[k] - slow);
    }
}

/* A gain that depends on the level, up and down several times. */
static void add_waves(double *x, double height_um) {
    for (size_t k = 0; k < SAMPLES; k++) {
        x[k] += height_um * sin(2.0 * M_PI * x[k] / 6.0);
    }
}

/* Something that repeats itself with a period that the drive does not know: three harmonics. */
static void add_tone(double *x, double tone_hz, double height_um) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const double angle = 2.0 * M_PI * tone_hz * (double)k / rate_hz;
        x[k] += height_um * (sin(angle + 0.4) + 0.6 * sin(2.0 * angle + 1.9) + 0.4 * cos(3.0 * angle));
    }
}

/* Single readings that are far off, at random. */
static void add_spikes(double *x) {
    for (size_t k = 0; k < SAMPLES; k++) {
        x[k] += random_unit(&rng) < 0.005 ? 0.3 * random_normal(&rng) : 0.0;
    }
}

static void ask(void) {
    double *x = recording.column[COLUMN_DISPLACEMENT];
    char text[DIAGNOSIS_LINE];
    for (size_t k = 0; k < SAMPLES; k++) {
        x[k] += noise_um * random_normal(&rng);
    }
    TEST_ASSERT_TRUE_MESSAGE(diagnose(NULL, &recording, 1, &diagnosis, &failure), failure.text);
    verdict_sentence(&diagnosis, text);
    printf("%s\n", text);
}

static double noise_percent(void) {
    double range[2];
    values_range(recording.column[COLUMN_DISPLACEMENT], SAMPLES, range);
    return 100.0 * noise_um / (range[1] - range[0]);
}

/* The terms, in this order, are the only findings; the error falls with each, in the end nearly to the noise. */
static void expect_terms(const block_t *const *block, size_t count, double over_noise) {
    TEST_ASSERT_EQUAL_INT(UNKNOWN_PHYSICS, diagnosis.verdict);
    TEST_ASSERT_EQUAL_UINT64(count, diagnosis.findings);
    TEST_ASSERT_EQUAL_UINT64(0, findings_named(&diagnosis));
    TEST_ASSERT_TRUE(something_remains(&diagnosis));
    for (size_t f = 0; f < count; f++) {
        const finding_t *finding = &diagnosis.finding[f];
        TEST_ASSERT_EQUAL_PTR(block[f], finding->block);
        TEST_ASSERT_EQUAL_INT(DETECTED, finding->certainty);
        TEST_ASSERT_TRUE(finding->held_out_after_percent < 0.6 * finding->held_out_before_percent);
        TEST_ASSERT_TRUE(finding_determined(&diagnosis, finding));
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, diagnosis.held_out_percent, diagnosis.finding[count - 1].held_out_after_percent);
    TEST_ASSERT_TRUE(diagnosis.held_out_percent < over_noise * noise_percent());
}

/* The model as it is written has the error that the reply tells, and an image can be made of it. report: of that. */
static void expect_written(compile_report_t *report) {
    account_t account;
    model_t model;
    hyst_parameters_t parameters;
    const compile_options_t options = {.sample_rate_hz = 10000.0};
    double *position = allocate(SAMPLES, sizeof *position);
    TEST_ASSERT_TRUE_MESSAGE(account_for(&diagnosis, &recording, 1, &account, &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(model_write(&diagnosis.model, "empirical.json", &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(model_read(&model, "empirical.json", &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(chain_simulate(&model, &recording, 1, position, &failure), failure.text);
    const error_measure_t error = measure_error(recording.column[COLUMN_DISPLACEMENT], position, SAMPLES);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, diagnosis.delivered_percent, error.nrmse_percent);
    TEST_ASSERT_TRUE(diagnosis.delivered_percent < diagnosis.plays_percent);
    TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &options, &parameters, report, &failure), failure.text);
    model_free(&model);
    account_free(&account);
    free(position);
}

/* In every form of the reply, without a name. */
static void expect_told(const char *block) {
    char text[DIAGNOSIS_LINE];
    account_t account;
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "Unknown physics: "), text);
    TEST_ASSERT_NULL_MESSAGE(strstr(text, "What comes nearest"), text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, " describes it, without a cause: the held-out error falls from "), text);
    finding_explanation(&diagnosis.finding[0], text);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, strncmp(text, "No known effect fits. ", 22), text);
    TEST_ASSERT_EQUAL_STRING("all", next_probe(&diagnosis));
    TEST_ASSERT_TRUE_MESSAGE(account_for(&diagnosis, &recording, 1, &account, &failure), failure.text);
    json_t *json = diagnosis_to_json(&diagnosis, &account, &recording, 1);
    const json_t *finding = json_array_get(json_object_get(json, "findings"), 0);
    TEST_ASSERT_EQUAL_STRING("unknown physics", json_string_value(json_object_get(json, "verdict")));
    TEST_ASSERT_EQUAL_STRING(block, json_string_value(json_object_get(finding, "block")));
    TEST_ASSERT_EQUAL_STRING("detected", json_string_value(json_object_get(finding, "certainty")));
    TEST_ASSERT_TRUE(json_is_true(json_object_get(finding, "empirical")));
    TEST_ASSERT_TRUE(json_real_value(json_object_get(finding, "confidence")) <= 0.5);
    json_decref(json);
    account_free(&account);
}

static void test_a_drift_without_a_name_is_a_trend(void) {
    static const block_t *const expected[] = {&block_empirical_trend};
    compile_report_t report;
    add_bump(recording.column[COLUMN_DISPLACEMENT], 0.5);
    ask();
    expect_terms(expected, 1, 1.15);
    expect_told("empirical_trend");
    expect_written(&report);
    TEST_ASSERT_EQUAL_UINT64(1, report.uncorrected);
    TEST_ASSERT_EQUAL_STRING("empirical_trend", report.uncorrected_block[0].block);
    TEST_ASSERT_NOT_NULL(strstr(report.uncorrected_block[0].why, "curve of the time"));
}

/* The filter's response is that of the physics, at frequencies that the drive has. */
static void expect_response(const model_block_t *found) {
    static const double hz[] = {5.0, 10.0, 20.0, 40.0};
    const parameter_t *p = found->parameter;
    for (size_t i = 0; i < sizeof hz / sizeof hz[0]; i++) {
        const double w = hz[i] / p[0].value[0], v = hz[i] / lead_hz;
        const double re = 1.0 - w * w, im = 2.0 * p[1].value[0] * w, square = re * re + im * im;
        const double n_re = -p[3].value[0] * w * w, n_im = p[2].value[0] * w;
        const double found_re = 1.0 + (n_re * re + n_im * im) / square, found_im = (n_im * re - n_re * im) / square;
        TEST_ASSERT_DOUBLE_WITHIN(0.005, 1.0 + lead_part * v * v / (1.0 + v * v), found_re);
        TEST_ASSERT_DOUBLE_WITHIN(0.005, lead_part * v / (1.0 + v * v), found_im);
    }
}

static void test_a_response_without_a_name_is_a_filter(void) {
    static const block_t *const expected[] = {&block_empirical_filter};
    compile_report_t report;
    add_lead(recording.column[COLUMN_DISPLACEMENT]);
    ask();
    expect_terms(expected, 1, 1.15);
    expect_told("empirical_filter");
    expect_response(model_find(&diagnosis.model, "empirical_filter"));
    expect_written(&report);
    TEST_ASSERT_EQUAL_UINT64(0, report.uncorrected);
}

/* A curve of the position alone is a hysteresis of another shape, and no unknown physics (DIAGNOSIS). */
static void test_a_second_term_stands_beside_the_first(void) {
    static const block_t *const expected[] = {&block_empirical_trend, &block_empirical_curve};
    compile_report_t report;
    add_waves(recording.column[COLUMN_DISPLACEMENT], 0.05);
    add_bump(recording.column[COLUMN_DISPLACEMENT], 0.5);
    ask();
    expect_terms(expected, 2, 3.0);
    expect_written(&report);
    TEST_ASSERT_EQUAL_UINT64(1, report.uncorrected);
}

/* The harmonics of a hum are found with it, and no others. */
static void test_hum_has_its_harmonics(void) {
    static const double height_um = 0.1, hz = 50.0;
    static const struct {
        const char *name;
        double part; /* of the height */
    } harmonics[] = {{"cos_3_um", 0.4}, {"sin_4_um", 0.0}, {"cos_5_um", 0.0}};
    add_tone(recording.column[COLUMN_DISPLACEMENT], hz, height_um);
    ask();
    TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
    TEST_ASSERT_EQUAL_UINT64(1, diagnosis.findings);
    TEST_ASSERT_TRUE(diagnosis.held_out_percent < 1.15 * noise_percent());
    const model_block_t *hum = model_find(&diagnosis.model, "mains_interference");
    TEST_ASSERT_NOT_NULL(hum);
    for (size_t i = 0; i < sizeof harmonics / sizeof harmonics[0]; i++) {
        const parameter_t *number = model_parameter(hum, harmonics[i].name);
        const double sigma = number->sigma != NULL ? number->sigma[0] : 0.0;
        printf("%s %g +- %g\n", harmonics[i].name, number->value[0], sigma);
        TEST_ASSERT_DOUBLE_WITHIN(3.0 * sigma, harmonics[i].part * height_um, number->value[0]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(
        0.02 * height_um, 0.6 * height_um,
        hypot(*model_parameter(hum, "cos_2_um")->value, *model_parameter(hum, "sin_2_um")->value));
    compile_report_t report;
    expect_written(&report);
    TEST_ASSERT_EQUAL_UINT64(1, report.uncorrected);
}

/* No hum is as slow: it is a tone. */
static void test_what_repeats_itself_without_the_drive_is_a_tone(void) {
    static const double tone_hz = 3.1;
    add_tone(recording.column[COLUMN_DISPLACEMENT], tone_hz, 0.1);
    ask();
    const model_block_t *tone = model_find(&diagnosis.model, "empirical_tone");
    TEST_ASSERT_NOT_NULL(tone);
    TEST_ASSERT_TRUE(diagnosis.held_out_percent < 1.15 * noise_percent());
    const double harmonic = tone->parameter[0].value[0] / tone_hz;
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, floor(harmonic + 0.5), harmonic);
    for (size_t f = 0; f < diagnosis.findings; f++) {
        const block_t *block = diagnosis.finding[f].block;
        TEST_ASSERT_TRUE(block == &block_empirical_tone || block == &block_mains_interference);
    }
    compile_report_t report;
    expect_written(&report);
    TEST_ASSERT_TRUE(report.uncorrected > 0);
}

static void expect_no_terms(void) {
    TEST_ASSERT_EQUAL_UINT64(diagnosis.findings, findings_named(&diagnosis));
    for (size_t b = 0; b < diagnosis.model.blocks; b++) {
        TEST_ASSERT_NULL(diagnosis.model.block[b].block->empirical);
    }
}

/* A drift of a third of the noise, of which a trend would take all: too little to ask for a reason. */
static void test_where_nothing_is_missing_there_is_no_term(void) {
    add_bump(recording.column[COLUMN_DISPLACEMENT], 0.0035);
    ask();
    TEST_ASSERT_EQUAL_INT(NOTHING_MISSING, diagnosis.verdict);
    expect_no_terms();
}

/* Its hysteresis has another shape, and leaves ten times the noise: that is no unknown physics. */
static void test_another_shape_has_no_term(void) {
    add_waves(recording.column[COLUMN_DISPLACEMENT], 0.2);
    ask();
    TEST_ASSERT_EQUAL_INT(NOTHING_MISSING, diagnosis.verdict);
    TEST_ASSERT_TRUE(diagnosis.another_shape && diagnosis.held_out_percent > 5.0 * noise_percent());
    expect_no_terms();
}

static void test_what_no_term_describes_gets_none(void) {
    add_spikes(recording.column[COLUMN_DISPLACEMENT]);
    ask();
    TEST_ASSERT_EQUAL_INT(UNKNOWN_PHYSICS, diagnosis.verdict);
    expect_no_terms();
}

static void test_what_is_explained_has_no_term(void) {
    const double mode[] = {180.0, 0.05};
    model_t with_mode;
    insert_block(&with_mode, &truth, &block_resonance, mode);
    simulate_into(&recording, &with_mode, 1);
    model_free(&with_mode);
    ask();
    TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
    TEST_ASSERT_NOT_NULL(finding_of(&diagnosis, &block_resonance));
    expect_no_terms();
}

int main(void) {
    rng = random_start("diagnose_empirical", 20261123);
    UNITY_BEGIN();
    RUN_TEST(test_a_drift_without_a_name_is_a_trend);
    RUN_TEST(test_a_response_without_a_name_is_a_filter);
    RUN_TEST(test_hum_has_its_harmonics);
    RUN_TEST(test_what_repeats_itself_without_the_drive_is_a_tone);
    RUN_TEST(test_a_second_term_stands_beside_the_first);
    RUN_TEST(test_where_nothing_is_missing_there_is_no_term);
    RUN_TEST(test_another_shape_has_no_term);
    RUN_TEST(test_what_no_term_describes_gets_none);
    RUN_TEST(test_what_is_explained_has_no_term);
    return UNITY_END();
}
