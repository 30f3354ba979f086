/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What programs get of a diagnosis: JSON against its format, where things are, errors, and the model. */
#include "diagnosis/evidence/searched.h"
#include "diagnosis/judgement/unseen.h"
#include "thresholds/thresholds.h"
#include "told_diagnosis.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static void expect_ranges(const json_t *ranges, size_t least) {
    TEST_ASSERT_TRUE(json_is_array(ranges) && json_array_size(ranges) >= least);
    double last = -HUGE_VAL;
    for (size_t i = 0; i < json_array_size(ranges); i++) {
        const json_t *pair = json_array_get(ranges, i);
        TEST_ASSERT_EQUAL_UINT64(2, json_array_size(pair));
        const double from = json_number_value(json_array_get(pair, 0)), to = json_number_value(json_array_get(pair, 1));
        TEST_ASSERT_TRUE(from >= last && to > from);
        last = to;
    }
}

static void test_json_has_the_format_of_the_contract(void) {
    work_out();
    json_t *json = as_json(), *names, *chain, *findings, *where, *parameters, *confusable, *remaining, *unseen, *band,
           *levels, *taken_out, *ring, *between, *each;
    double given, before, held_out, nrmse, floor_percent, confidence, value, sigma, rms, by_level, delivered;
    const char *text, *place, *certainty, *unit, *explanation, *excitation, *loop, *name;
    int past_unknown, structured, outliers;
    expect_format(json,
                  "{s:s, s:o, s:{s:f, s:f}, s:{s:o, s:f, s:f, s:f, s:f, s:f}, s:o, s:o, s:{s:f, s:f, s:f, s:f, s:b, "
                  "s:b, s:f, s:o, "
                  "s:i, s:f, s:o, s:o, s:o, s:o}, "
                  "s:s, s:n, s:o, s:o}",
                  "format", &text, "recordings", &names, "given", "nrmse_percent", &given, "held_out_nrmse_percent",
                  &held_out, "baseline", "chain", &chain, "nrmse_percent", &before, "held_out_nrmse_percent", &held_out,
                  "simulated_nrmse_percent", &delivered, "straight_line_nrmse_percent", &delivered,
                  "plays_nrmse_percent", &delivered, "findings", &findings, "not_found", &unseen, "remaining",
                  "nrmse_percent", &nrmse, "held_out_nrmse_percent", &held_out, "simulated_nrmse_percent", &delivered,
                  "noise_floor_percent", &floor_percent, "past_unknown", &past_unknown, "structured", &structured,
                  "rms_um", &rms, "band_hz", &band, "outliers", &outliers, "by_level", &by_level, "levels_um", &levels,
                  "where", &remaining, "taken_out", &taken_out, "ring", &ring, "verdict", &place, "caveat",
                  "between_samples", &between, "each", &each);
    TEST_ASSERT_EQUAL_DOUBLE(1.9, given);
    TEST_ASSERT_EQUAL_DOUBLE(0.9, before);
    TEST_ASSERT_TRUE(json_is_null(band) && json_is_null(levels) && json_is_null(ring));
    TEST_ASSERT_TRUE(json_is_array(taken_out));
    TEST_ASSERT_EQUAL_STRING("hyst-diagnosis-1", text);
    TEST_ASSERT_EQUAL_STRING("explained", place);
    TEST_ASSERT_EQUAL_UINT64(2, json_array_size(names));
    TEST_ASSERT_EQUAL_UINT64(1, json_array_size(chain)); /* the baseline's, without what was found */
    TEST_ASSERT_FALSE(structured);
    TEST_ASSERT_EQUAL_UINT64(0, json_array_size(json_object_get(remaining, "time_s")));
    expect_format(json_array_get(findings, 0), "{s:s, s:s, s:s, s:f, s:o, s:f, s:f, s:o, s:s, s:o, s:s}", "block",
                  &text, "place", &place, "certainty", &certainty, "confidence", &confidence, "parameters", &parameters,
                  "held_out_nrmse_percent_before", &before, "held_out_nrmse_percent_after", &nrmse, "where", &where,
                  "explanation", &explanation, "confusable_with", &confusable, "separating_excitation", &excitation);
    TEST_ASSERT_EQUAL_STRING("resonance", text);
    TEST_ASSERT_EQUAL_STRING("mechanics", place);
    TEST_ASSERT_EQUAL_STRING("named", certainty);
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, threshold.named_are_right, confidence); /* exp(-60 / 5) is 6e-6 */
    TEST_ASSERT_EQUAL_UINT64(0, json_array_size(confusable));
    expect_format(parameters, "{s:{s:f, s:f, s:s}, s:{s:f, s:f, s:s}}", "frequency_hz", "value", &value, "sigma",
                  &sigma, "unit", &unit, "damping_ratio", "value", &value, "sigma", &sigma, "unit", &unit);
    expect_ranges(json_object_get(where, "time_s"), 1);
    expect_ranges(json_object_get(where, "frequency_hz"), 1);
    expect_ranges(json_object_get(where, "drive"), 1);
    TEST_ASSERT_TRUE(json_array_size(json_object_get(where, "drive_rate_v_per_s")) > 0);
    expect_format(json_object_get(where, "loop"), "s", &loop);
    expect_format(json_object_get(where, "recording"), "s", &name);
    TEST_ASSERT_EQUAL_STRING(recordings[1].name, name); /* steps ring more than triangles */
    json_decref(json);
    account_free(&account);
}

/* The mode is where the simulations with and without it differ, though the hysteresis is fitted again. */
/* A curve's numbers say nothing without the range that they refer to. */
static void test_what_numbers_refer_to_is_told(void) {
    model_t model;
    const char *told = "";
    model_create(&model, 1000.0);
    const model_block_t *curve = model_append(&model, &block_static_nonlinearity),
                        *mode = model_append(&model, &block_resonance);
    for (size_t p = 0; p < curve->block->parameters; p++) {
        TEST_ASSERT_TRUE_MESSAGE(number_is_told(curve, p), curve->block->parameter[p].name);
        told = number_is_searched(curve, p) ? told : curve->block->parameter[p].name;
    }
    TEST_ASSERT_EQUAL_STRING("half_range_um", told);
    for (size_t p = 0; p < mode->block->parameters; p++) {
        TEST_ASSERT_EQUAL(number_is_searched(mode, p), number_is_told(mode, p));
    }
    model_free(&model);
}

/* Harmonics that a line does not have are no numbers of it. */
static void test_harmonics_are_told_once_there_are_any(void) {
    model_t model;
    model_create(&model, 1000.0);
    model_block_t *hum = model_append(&model, &block_mains_interference);
    for (size_t p = 0; p < hum->block->parameters; p++) {
        TEST_ASSERT_EQUAL_MESSAGE(p < 3, number_is_told(hum, p), hum->block->parameter[p].name);
    }
    model_set(hum, "sin_3_um", 0.01);
    for (size_t p = 3; p < hum->block->parameters; p++) {
        TEST_ASSERT_EQUAL(strcmp(hum->block->parameter[p].name, "sin_3_um") == 0, number_is_told(hum, p));
    }
    model_free(&model);
}

static void test_a_mode_is_located_at_its_frequency(void) {
    work_out();
    const ranges_t *hz = &account.where[0].frequency_hz;
    bool met = false;
    for (size_t i = 0; i < hz->count; i++) {
        met = met || (hz->range[i].from < 180.0 && hz->range[i].to > 180.0);
    }
    TEST_ASSERT_TRUE(met);
    TEST_ASSERT_TRUE(account.where[0].somewhere);
    TEST_ASSERT_TRUE(account.where[0].fundamental_hz > 0.0); /* both drives repeat themselves */
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, RATE_HZ / 1200.0, account.where[0].fundamental_hz);
    account_free(&account);
}

/* Steps lower no error: what is drawn behind them is the chain without them, and where a mode acts they are no part. */
static void test_steps_are_not_drawn(void) {
    const double step_um = 0.5;
    work_out();
    const double from = account.where[0].frequency_hz.range[0].from, smooth = account.after[1][2000];
    account_free(&account);
    model_set(model_append(&diagnosis.model, &block_quantisation), "step_um", step_um);
    diagnosis.finding[1] = (finding_t){.block = &block_quantisation, .certainty = NAMED, .in_readings = true};
    diagnosis.findings = 2;
    work_out();
    TEST_ASSERT_EQUAL_DOUBLE(smooth, account.after[1][2000]);
    TEST_ASSERT_EQUAL_DOUBLE(from, account.where[0].frequency_hz.range[0].from);
    TEST_ASSERT_TRUE(account.where[1].somewhere);
    account_free(&account);
}

/* White noise of known size: the standard error of the frequency follows from the derivative of the simulation. It is
 * larger by sqrt(3/2) = 1.22 for the held-out third, by what the other numbers share with it (about 1 %), and by the
 * scatter of the autocorrelation time, which is 1 or more for white residuals. What the block's approximations add is
 * in its table, and is more. */
static void test_standard_errors_are_those_of_the_noise(void) {
    work_out();
    const model_block_t *block = model_find(&diagnosis.model, "resonance");
    const double told = model_parameter(block, "frequency_hz")->sigma[0], step = 0.01;
    const double sigma = sqrt(told * told - pow(block_resonance.probe->accuracy[0] * 180.0, 2.0));
    double squares = 0.0;
    for (size_t i = 0; i < RECORDINGS; i++) {
        static double low[SAMPLES], high[SAMPLES];
        model_t shifted;
        model_copy(&shifted, &diagnosis.model);
        model_set(&shifted.block[1], "frequency_hz", 180.0 - step);
        TEST_ASSERT_TRUE(chain_simulate(&shifted, &recordings[i], 0, low, &failure));
        model_set(&shifted.block[1], "frequency_hz", 180.0 + step);
        TEST_ASSERT_TRUE(chain_simulate(&shifted, &recordings[i], 0, high, &failure));
        for (size_t k = account.from[i]; k < SAMPLES; k++) {
            squares += pow((high[k] - low[k]) / (2.0 * step), 2.0);
        }
        model_free(&shifted);
    }
    const double alone = NOISE_UM / sqrt(squares);
    printf("sigma of the frequency %.5f Hz, alone %.5f Hz\n", sigma, alone);
    TEST_ASSERT_TRUE(sigma > 1.2 * alone && sigma < 1.5 * alone);
    TEST_ASSERT_NOT_NULL(model_parameter(&diagnosis.model.block[0], "weights")->sigma);
    account_free(&account);
}

/* What compile and simulate need of it is there: it is read back, with the ranges of these recordings. */
static void test_the_augmented_model_is_complete(void) {
    double range[2];
    model_t read;
    work_out();
    TEST_ASSERT_TRUE_MESSAGE(model_write(&diagnosis.model, "augmented.json", &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(model_read(&read, "augmented.json", &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT64(2, read.blocks);
    TEST_ASSERT_TRUE(model_fit_range(&read, "drive_range_v", range));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, range[0]);
    TEST_ASSERT_EQUAL_DOUBLE(100.0, range[1]);
    TEST_ASSERT_TRUE(model_fit_range(&read, "displacement_range_um", range));
    TEST_ASSERT_EQUAL_DOUBLE(0.1, json_number_value(json_object_get(read.fit, "held_out_nrmse_percent")));
    model_free(&read);
    account_free(&account);
}

/* What the baseline covers stays covered; the converters are those of the recordings, if they agree, else its own. */
static void test_the_augmented_model_keeps_what_is_known(void) {
    double range[2];
    diagnosis.model.fit = json_pack("{s:[ff], s:[ff], s:[ff]}", "drive_range_v", -20.0, 60.0, "drive_converter_v", -9.0,
                                    9.0, "position_converter_um", -1.0, 20.0);
    recording_set_key(&recordings[1], "drive_converter_v", "-25.5:130");
    work_out();
    TEST_ASSERT_TRUE(model_fit_range(&diagnosis.model, "drive_range_v", range));
    TEST_ASSERT_EQUAL_DOUBLE(-20.0, range[0]);
    TEST_ASSERT_EQUAL_DOUBLE(100.0, range[1]);
    TEST_ASSERT_TRUE(model_fit_range(&diagnosis.model, "drive_converter_v", range));
    TEST_ASSERT_EQUAL_DOUBLE(-25.5, range[0]);
    TEST_ASSERT_EQUAL_DOUBLE(130.0, range[1]);
    TEST_ASSERT_TRUE(model_fit_range(&diagnosis.model, "position_converter_um", range));
    TEST_ASSERT_EQUAL_DOUBLE(20.0, range[1]);
    account_free(&account);
    recording_set_key(&recordings[0], "drive_converter_v", "-25.5:131");
    work_out();
    TEST_ASSERT_FALSE(model_fit_range(&diagnosis.model, "drive_converter_v", range));
    account_free(&account);
}

static void test_confidence_is_that_of_its_kind_and_rises_with_support(void) {
    const certainty_t kinds[] = {DETECTED, NAMED, ISOLATED}; /* in order of how often they were right */
    double before = 0.0;
    for (size_t i = 0; i < 3; i++) {
        finding_t finding = {.block = &block_creep, .certainty = kinds[i], .support = 1e6};
        const double most = finding_confidence(&finding);
        TEST_ASSERT_TRUE(most > before && most < 1.0);
        finding.support = 12.0;
        TEST_ASSERT_DOUBLE_WITHIN(0.001, 0.909 * most, finding_confidence(&finding)); /* as the header says */
        finding.support = -5.0;
        TEST_ASSERT_EQUAL_DOUBLE(0.0, finding_confidence(&finding));
        before = most;
    }
}

static void expect_reason(const block_t *block, double smallest_um, const char *why) {
    candidate_t candidate = {.block = block, .smallest_um = smallest_um, .smallest_value = {1e6}};
    diagnosis.unseen_count = 0;
    unseen_note(&diagnosis, &(candidates_t){.count = 1, .candidate = &candidate});
    TEST_ASSERT_EQUAL_UINT64(1, diagnosis.unseen_count);
    TEST_ASSERT_FALSE(diagnosis.unseen[0].testable);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(diagnosis.unseen[0].why, why), diagnosis.unseen[0].why);
}

/* Why the drive makes the nuisance subspace imitate a block. */
static void test_what_is_not_testable_has_its_reason(void) {
    expect_reason(&block_creep, 0.01, "larger than such a block");
    expect_reason(&block_creep, HUGE_VAL, "other numbers imitate it");
    question->noise.at_rest = false;
    expect_reason(&block_creep, HUGE_VAL, "never rests");
    expect_reason(&block_static_nonlinearity, HUGE_VAL, "other numbers imitate it");
    question->samples.count = 1; /* triangles of another height again and again: no one loop */
    double *drive = recordings[0].column[COLUMN_DRIVE];
    expect_reason(&block_creep, HUGE_VAL, "never rests");
    for (size_t k = 0; k < SAMPLES; k++) {
        drive[k] = 50.0 - 50.0 * cos(2.0 * M_PI * (double)k / 500.0);
    }
    expect_reason(&block_static_nonlinearity, HUGE_VAL, "repeats one loop");
    for (size_t k = 0; k < SAMPLES; k++) {
        drive[k] = 0.01 * (double)k;
    }
    expect_reason(&block_static_nonlinearity, HUGE_VAL, "never turns round");
}

static void test_what_cannot_be_written_is_one_line(void) {
    work_out();
    TEST_ASSERT_FALSE(
        diagnosis_write_report(&diagnosis, &account, recordings, RECORDINGS, NULL, "no/such/folder.html", &failure));
    expect_line(&failure, "no/such/folder.html");
    TEST_ASSERT_FALSE(
        diagnosis_write_json(&diagnosis, &account, recordings, RECORDINGS, "no/such/folder.json", &failure));
    expect_line(&failure, "no/such/folder.json");
    account_free(&account);
}

int main(void) {
    rng = random_start("diagnose_output", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_json_has_the_format_of_the_contract);
    RUN_TEST(test_what_numbers_refer_to_is_told);
    RUN_TEST(test_harmonics_are_told_once_there_are_any);
    RUN_TEST(test_a_mode_is_located_at_its_frequency);
    RUN_TEST(test_steps_are_not_drawn);
    RUN_TEST(test_standard_errors_are_those_of_the_noise);
    RUN_TEST(test_the_augmented_model_is_complete);
    RUN_TEST(test_the_augmented_model_keeps_what_is_known);
    RUN_TEST(test_confidence_is_that_of_its_kind_and_rises_with_support);
    RUN_TEST(test_what_is_not_testable_has_its_reason);
    RUN_TEST(test_what_cannot_be_written_is_one_line);
    return UNITY_END();
}
