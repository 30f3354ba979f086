/* SPDX-License-Identifier: GPL-3.0-or-later */
/* From recordings to an answer: physics that is planted is named with its numbers, and none where there is none. */
#include "base/parallel.h"
#include "chain/catalogue.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/diagnose.h"
#include "diagnosis/evidence/searched.h"
#include "report/diagnosis_json.h"
#include "report/diagnosis_text.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 8000, OPERATORS = 16, REST = 400 };
static const double rate_hz = 2000.0, noise_um = 0.005;
static random_t rng;
static recording_t recording;
static model_t truth, given;
static answer_t diagnosis;
static failure_t failure;

/* A line to a level, then a rest there, or none. Returns where it ends. */
static size_t go_to(size_t at, double level_v, size_t samples, size_t rest) {
    double *drive = recording.column[COLUMN_DRIVE];
    const double from = at > 0 ? drive[at - 1] : 0.0;
    for (size_t k = 0; k < samples + rest && at < SAMPLES; k++, at++) {
        drive[at] = k < samples ? from + (level_v - from) * (double)(k + 1) / (double)samples : level_v;
    }
    return at;
}

/* The whole range once; loops inside it, slow and fast; steps with rests; a chirp of 5 V from 5 to 400 Hz. */
static void fill_drive(void) {
    static const double level[] = {20.0, 85.0, 35.0, 70.0, 45.0, 0.0}, step[] = {60.0, 20.0, 90.0, 50.0};
    size_t at = go_to(0, 0.0, 1, 200);
    at = go_to(at, 100.0, 500, 0);
    at = go_to(at, 0.0, 500, REST);
    for (size_t i = 0; i < 6; i++) {
        at = go_to(at, level[i], 250, 0);
    }
    for (size_t i = 0; i < 4; i++) {
        at = go_to(at, step[i], 1, REST);
    }
    at = go_to(at, 100.0, 40, 0);
    for (size_t i = 0; i < 6; i++) {
        at = go_to(at, level[i], 40, 0);
    }
    at = go_to(at, 50.0, 100, REST);
    const size_t chirp = SAMPLES - at - REST;
    for (size_t k = 0; k < chirp; k++, at++) {
        const double t = (double)k / rate_hz, seconds = (double)chirp / rate_hz, growth = log(400.0 / 5.0) / seconds;
        recording.column[COLUMN_DRIVE][at] = 50.0 + 5.0 * sin(2.0 * M_PI * 5.0 / growth * expm1(growth * t));
    }
    go_to(at, 50.0, 1, REST);
}

void setUp(void) {
    double weights[OPERATORS + 1] = {0.09}, thresholds[OPERATORS];
    for (size_t i = 0; i < OPERATORS; i++) {
        thresholds[i] = 3.0 * (double)(i + 1);
        weights[i + 1] = 0.006 * exp(-0.1 * (double)i);
    }
    recording_create(&recording, "planted.csv", rate_hz, SAMPLES);
    fill_drive();
    make_bank_model(&truth, rate_hz, 1.0, OPERATORS, weights, thresholds);
    for (size_t i = 0; i <= OPERATORS; i++) { /* what somebody has identified before, 3 % away */
        weights[i] *= 1.03;
    }
    make_bank_model(&given, rate_hz, 0.8, OPERATORS, weights, thresholds);
}

void tearDown(void) {
    answer_free(&diagnosis);
    model_free(&truth);
    model_free(&given);
    recording_free(&recording);
}

static void plant(const block_t *block, const double *value) {
    model_t more;
    insert_block(&more, &truth, block, value);
    model_free(&truth);
    truth = more;
}

/* Noise stands before the sensor's steps. */
static void measure(double step_um) {
    simulate_into(&recording, &truth, 1);
    for (size_t k = 0; k < SAMPLES; k++) {
        double *x = &recording.column[COLUMN_DISPLACEMENT][k];
        *x += noise_um * random_normal(&rng);
        *x = step_um > 0.0 ? step_um * round(*x / step_um) : *x;
    }
}

static void look(bool with_model) {
    answer_free(&diagnosis);
    const bool good = diagnose(with_model ? &given : NULL, &recording, 1, &diagnosis, &failure);
    TEST_ASSERT_TRUE_MESSAGE(good, failure.text);
    for (size_t f = 0; f < diagnosis.findings; f++) {
        printf("%s%s: t %.0f, support %.0f", with_model ? "with a model: " : "", diagnosis.finding[f].block->name,
               diagnosis.finding[f].t, diagnosis.finding[f].support);
        printf(f + 1 < diagnosis.findings ? "; " : "\n");
    }
}

/* Every number that was searched and that the recording determines, within three of its standard errors. */
static void expect_numbers(const block_t *block, const double *value) {
    const finding_t *finding = finding_of(&diagnosis, block);
    TEST_ASSERT_NOT_NULL_MESSAGE(finding, block->name);
    /* Loops that an operator of any shape imitates by itself are no name for one of these shapes. */
    TEST_ASSERT_TRUE_MESSAGE(finding->certainty == NAMED || (finding->shape && finding->certainty == ISOLATED),
                             block->name);
    const model_block_t *found = &diagnosis.model.block[finding_index(&diagnosis, finding)];
    size_t determined = 0;
    for (size_t p = 0; p < block->parameters; p++) {
        const double *sigma = found->parameter[p].sigma;
        if (number_is_searched(found, p) && sigma != NULL && isfinite(sigma[0])) {
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(3.0 * sigma[0], value[p], found->parameter[p].value[0], block->name);
            determined++;
        }
    }
    TEST_ASSERT_TRUE(determined > 0);
}

static bool was_taken(const block_t *block) {
    for (size_t c = 0; c < diagnosis.considered; c++) {
        if (diagnosis.consideration[c].block == block && diagnosis.consideration[c].outcome == TAKEN) {
            return true;
        }
    }
    return false;
}

/* Each finding is needed: without it, whatever the others and the hysteresis do, more is left of the samples that were
 * fitted and of those that were not. What was taken and is no finding was found superfluous, and nothing else. */
static void expect_needed(void) {
    joint_power_t power, without_it;
    model_t smooth, without;
    model_copy(&smooth, &diagnosis.model);
    if (model_find(&smooth, "quantisation") != NULL) {
        model_remove(&smooth, smooth.blocks - 1);
    }
    TEST_ASSERT_TRUE(joint_power(&diagnosis.question->samples, &diagnosis.question->noise, &smooth, &power, &failure));
    for (size_t f = 0; f < diagnosis.findings; f++) {
        unsigned others = 0;
        if (diagnosis.finding[f].in_readings) {
            continue;
        }
        TEST_ASSERT_TRUE(was_taken(diagnosis.finding[f].block));
        model_copy(&without, &smooth);
        model_remove(&without, finding_index(&diagnosis, &diagnosis.finding[f]));
        for (size_t b = 0; b < without.blocks; b++) {
            others |= finding_of(&diagnosis, without.block[b].block) != NULL ? 1U << b : 0U;
        }
        TEST_ASSERT_TRUE(joint_fit(&diagnosis.question->samples, &diagnosis.question->noise, &without, others, 6,
                                   &without_it, &failure));
        TEST_ASSERT_TRUE((double)diagnosis.question->samples.held * log(without_it.held / power.held) > 12.0);
        TEST_ASSERT_TRUE(without_it.fitted > power.fitted);
        model_free(&without);
    }
    model_free(&smooth);
    for (size_t c = 0; c < diagnosis.considered; c++) {
        const considered_t *considered = &diagnosis.consideration[c];
        const bool stands = finding_of(&diagnosis, considered->block) != NULL;
        TEST_ASSERT_TRUE(considered->outcome != TAKEN || stands);
        TEST_ASSERT_TRUE(considered->outcome != SUPERFLUOUS || !stands);
    }
}

/* Noise alone is left. Its root mean square over the 1700 or more samples that are held out is known to 2 %; what the
 * fitted numbers add is less. */
static void expect_noise_is_left(void) {
    double range[2];
    recordings_range(&recording, 1, COLUMN_DISPLACEMENT, range);
    const double percent = 100.0 * noise_um / (range[1] - range[0]);
    TEST_ASSERT_TRUE(diagnosis.question->samples.held > 1700);
    TEST_ASSERT_TRUE(diagnosis.held_out_percent > 0.9 * percent && diagnosis.held_out_percent < 1.15 * percent);
    TEST_ASSERT_FALSE(diagnosis.remainder.structured);
}

/* Every block that is looked for is in the chain, may be what was found, or has its size or its reason. */
static void expect_all_are_told_of(void) {
    for (size_t c = 0; c < catalogue_count; c++) {
        const block_t *block = catalogue[c];
        const unseen_t *told = NULL;
        size_t times = 0;
        for (size_t i = 0; i < diagnosis.unseen_count; i++) {
            told = diagnosis.unseen[i].block == block ? &diagnosis.unseen[i] : told;
            times += diagnosis.unseen[i].block == block ? 1 : 0;
        }
        TEST_ASSERT_TRUE_MESSAGE(times <= 1, block->name);
        if (probe_is_first(block->probe) && model_find(&diagnosis.model, block->name) == NULL &&
            !finding_may_be(&diagnosis, block)) {
            TEST_ASSERT_NOT_NULL_MESSAGE(told, block->name);
        }
        if (told != NULL) {
            TEST_ASSERT_TRUE_MESSAGE(told->testable == (told->why == NULL), block->name);
            TEST_ASSERT_TRUE_MESSAGE(!told->testable || told->smallest_um > 0.0, block->name);
        }
    }
}

static const unseen_t *unseen_of(const block_t *block) {
    for (size_t i = 0; i < diagnosis.unseen_count; i++) {
        if (diagnosis.unseen[i].block == block) {
            return &diagnosis.unseen[i];
        }
    }
    TEST_FAIL_MESSAGE(block->name);
    return NULL;
}

static void test_nothing_is_found_where_nothing_is(void) {
    measure(0.0);
    for (int with_model = 0; with_model < 2; with_model++) {
        look(with_model == 1);
        TEST_ASSERT_EQUAL_UINT64(0, diagnosis.findings);
        TEST_ASSERT_EQUAL_INT(NOTHING_MISSING, diagnosis.verdict);
        TEST_ASSERT_TRUE(diagnosis.tested > 0 && diagnosis.unseen_count > 0);
        expect_all_are_told_of();
        TEST_ASSERT_NOT_NULL(strstr(unseen_of(&block_preload)->why, "at one preload"));
        TEST_ASSERT_TRUE(unseen_of(&block_quantisation)->testable);
        expect_noise_is_left();
    }
}

/* Without a model, and then with one: a model given changes where the search begins, whatever is planted. */
enum { ALONE = 1, AND_WITH_A_MODEL = 2 };

static void find_planted(const block_t *block, const double *value, int looks) {
    plant(block, value);
    measure(0.0);
    for (int with_model = 0; with_model < looks; with_model++) {
        look(with_model == 1);
        TEST_ASSERT_EQUAL_UINT64(1, diagnosis.findings);
        TEST_ASSERT_EQUAL_STRING(block->name, diagnosis.finding[0].block->name);
        TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
        expect_numbers(block, value);
        expect_needed();
        expect_all_are_told_of();
        expect_noise_is_left();
    }
}

/* One number a parameter; those that a block does not have are 0. */
typedef double numbers_t[BLOCK_MAX_PARAMETERS];
static const numbers_t creep_truth = {0.02, 0.05, 100.0, 0.0}, delay_truth = {0.7e-3}, hum_truth = {50.0, 0.02, 0.5},
                       saturation_truth = {-10.0, 92.0}, mode_truth = {180.0, 0.05}, gain_truth = {0.02, 0.0, 1.5};

static void test_creep_is_named(void) {
    find_planted(&block_creep, creep_truth, AND_WITH_A_MODEL);
}

static void test_a_delay_is_named(void) {
    find_planted(&block_transport_delay, delay_truth, AND_WITH_A_MODEL);
}

static void test_hum_is_named(void) {
    find_planted(&block_mains_interference, hum_truth, ALONE);
}

/* A gain that settles is one drift, with its time constant. */
static void test_a_gain_that_settles_is_named(void) {
    find_planted(&block_gain_drift, gain_truth, ALONE);
    const model_block_t *found = model_find(&diagnosis.model, "gain_drift");
    TEST_ASSERT_NOT_NULL(found);
    TEST_ASSERT_TRUE(model_parameter(found, "time_constant_s")->value[0] > 0.0);
}

static void test_saturation_is_named(void) {
    find_planted(&block_amplifier_saturation, saturation_truth, ALONE);
}

/* Steps ten times the noise: the readings lie on them, to rounding. */
static void test_steps_are_named(void) {
    const double step_um = 0.05;
    measure(step_um);
    for (int with_model = 0; with_model < 2; with_model++) {
        look(with_model == 1);
        TEST_ASSERT_EQUAL_UINT64(1, diagnosis.findings);
        TEST_ASSERT_EQUAL_STRING("quantisation", diagnosis.finding[0].block->name);
        const model_block_t *found = model_find(&diagnosis.model, "quantisation");
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, step_um, model_parameter(found, "step_um")->value[0]);
        TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
    }
}

static void find_two(const block_t *one, const double *one_value, const block_t *other, const double *other_value) {
    plant(one, one_value);
    plant(other, other_value);
    measure(0.0);
    look(true);
    TEST_ASSERT_EQUAL_UINT64(2, diagnosis.findings);
    expect_numbers(one, one_value);
    expect_numbers(other, other_value);
    expect_needed();
}

static void test_two_effects_are_named(void) {
    find_two(&block_creep, creep_truth, &block_mains_interference, hum_truth);
    TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
    expect_noise_is_left();
}

/* A mode behind a delay: before the mode is known, a low pass is a good guess for both; it must not stay. The mode
 * rings on into the rests, which makes the noise uncertain, and so the verdict. */
static void test_a_superfluous_finding_does_not_stay(void) {
    plant(&block_transport_delay, delay_truth);
    plant(&block_resonance, mode_truth);
    measure(0.0);
    look(true);
    TEST_ASSERT_EQUAL_UINT64(2, diagnosis.findings);
    expect_numbers(&block_resonance, mode_truth);
    expect_needed();
    /* Beside a hysteresis of any shape the two low passes say as much as the delay, so it is one of these three. */
    const finding_t *delay = finding_of(&diagnosis, &block_transport_delay);
    TEST_ASSERT_NOT_NULL(delay);
    TEST_ASSERT_TRUE(delay->certainty >= ISOLATED);
    for (size_t r = 0; r < delay->rivals; r++) {
        TEST_ASSERT_TRUE(delay->rival[r]->lag != LAG_NONE);
    }
}

/* 0.8 % of creep beside a mode whose response is many times the noise: not where the mode acts. */
static void test_a_small_effect_is_seen_where_a_large_one_rests(void) {
    static const numbers_t slight_creep = {0.008, 0.05, 100.0, 0.0};
    find_two(&block_resonance, mode_truth, &block_creep, slight_creep);
}

static void make_bouc_wen_the_truth(void) {
    model_free(&truth);
    model_create(&truth, rate_hz);
    model_block_t *hysteresis = model_append(&truth, &block_bouc_wen);
    model_set(hysteresis, "center_v", 50.0);
    model_set(hysteresis, "half_range_v", 50.0);
    model_set(hysteresis, "offset_um", 6.0);
    model_set(hysteresis, "direct_um", 7.0);
    model_set(hysteresis, "hysteretic_um", -2.0);
    model_set(hysteresis, "beta", 2.5);
    model_set(hysteresis, "gamma", 0.6);
    model_set(hysteresis, "exponent", 1.4);
}

/* Without a model: the shape of the hysteresis has to be found, too. */
static void find_beside_bouc_wen(const block_t *block, const double *value) {
    make_bouc_wen_the_truth();
    plant(block, value);
    measure(0.0);
    look(false);
    TEST_ASSERT_EQUAL_UINT64(1, diagnosis.findings);
    expect_numbers(block, value);
    TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
    expect_noise_is_left();
}

/* Far from linear in its numbers: beside their derivatives a lag hardly shows, and a rate-independent fit of them is
 * beside the truth. Only all numbers together say what it is. */
static void test_a_delay_before_bouc_wen_is_named(void) {
    find_beside_bouc_wen(&block_transport_delay, delay_truth);
}

/* The Bouc-Wen block has a bilinear gain of its own, which is absent here: it must not take in what is a block. */
static void test_interleaved_loops_of_bouc_wen_are_named(void) {
    static const numbers_t bilinear_truth = {0.01, 50.0, 50.0};
    find_beside_bouc_wen(&block_interleaved_hysteresis, bilinear_truth);
}

/* A block of its own beside creep, which is slow alone. */
static void test_dielectric_loss_is_no_creep(void) {
    static const numbers_t loss_truth = {0.004};
    find_planted(&block_dielectric_loss, loss_truth, ALONE);
}

/* What relaxed before the recording goes on in it: with the level that had been present it is a loss, and no drift. */
static void test_a_loss_that_began_before_is_no_drift(void) {
    static const numbers_t loss_truth = {0.02};
    const double before_um = 4.0;
    plant(&block_dielectric_loss, loss_truth);
    for (size_t b = 0; b < truth.blocks; b++) {
        if (truth.block[b].block == &block_dielectric_loss) {
            model_set(&truth.block[b], "initial_um", before_um);
        }
    }
    measure(0.0);
    look(false);
    TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
    TEST_ASSERT_EQUAL_UINT64(1, diagnosis.findings);
    TEST_ASSERT_EQUAL_STRING("dielectric_loss", diagnosis.finding[0].block->name);
    const parameter_t *initial = model_parameter(model_find(&diagnosis.model, "dielectric_loss"), "initial_um");
    TEST_ASSERT_EQUAL_UINT64(1, initial->count);
    printf("before: %g +- %g um (%g)\n", initial->value[0], initial->sigma[0], before_um);
    TEST_ASSERT_DOUBLE_WITHIN(3.0 * initial->sigma[0], before_um, initial->value[0]);
}

/* A gain that steps by 2 % at one instant: a drift comes near, and is not told as the reason. */
static void test_what_only_comes_near_is_no_name(void) {
    measure(0.0);
    for (size_t k = SAMPLES * 3 / 5; k < SAMPLES; k++) {
        recording.column[COLUMN_DISPLACEMENT][k] *= 1.02;
    }
    look(true);
    TEST_ASSERT_EQUAL_INT(UNKNOWN_PHYSICS, diagnosis.verdict);
    for (size_t f = 0; f < diagnosis.findings; f++) {
        TEST_ASSERT_EQUAL_INT(DETECTED, diagnosis.finding[f].certainty);
    }
}

/* The actuator leaves its seat in the lowest quarter of the stroke: a line with a bend. A sensor's curve takes most of
 * that, and what it leaves is another curve. That has no name; and since it is the same at any speed it is no more than
 * another shape of the hysteresis: DIAGNOSIS, 10. */
static void test_a_curve_that_leaves_a_curve_is_no_name(void) {
    double range[2];
    measure(0.0);
    recordings_range(&recording, 1, COLUMN_DISPLACEMENT, range);
    const double seat_um = 0.75 * range[0] + 0.25 * range[1];
    for (size_t k = 0; k < SAMPLES; k++) {
        double *x = &recording.column[COLUMN_DISPLACEMENT][k];
        *x += 0.05 * fmax(0.0, seat_um - *x);
    }
    look(false);
    TEST_ASSERT_EQUAL_INT(NOTHING_MISSING, diagnosis.verdict);
    TEST_ASSERT_EQUAL_UINT64(0, diagnosis.findings);
    TEST_ASSERT_TRUE(diagnosis.another_shape);
    TEST_ASSERT_TRUE(diagnosis.question->shape.whole);
}

static void give(const block_t *block, const double *value) {
    model_t more;
    insert_block(&more, &given, block, value);
    model_free(&given);
    given = more;
}

/* A model that says it all, its noise included. */
static void test_what_the_model_has_is_not_missing(void) {
    plant(&block_transport_delay, delay_truth);
    measure(0.0);
    give(&block_transport_delay, delay_truth);
    model_set(model_append(&given, &block_sensor_noise), "rms_um", 1.0);
    look(true);
    TEST_ASSERT_EQUAL_UINT64(0, diagnosis.findings);
    TEST_ASSERT_EQUAL_INT(NOTHING_MISSING, diagnosis.verdict);
    expect_noise_is_left();
}

/* Of twice the length: alone it is fitted again, and beside a mode that the chain lacks it is, too, and the mode alone
 * is missing. */
static void test_what_the_model_has_wrong_is_not_missing(void) {
    const double twice[BLOCK_MAX_PARAMETERS] = {2.0 * delay_truth[0]};
    give(&block_transport_delay, twice);
    plant(&block_transport_delay, delay_truth);
    for (size_t modes = 0; modes < 2; modes++) {
        measure(0.0);
        look(true);
        TEST_ASSERT_EQUAL_UINT64(modes, diagnosis.findings);
        TEST_ASSERT_EQUAL_INT(modes > 0 ? EXPLAINED : NOTHING_MISSING, diagnosis.verdict);
        TEST_ASSERT_NULL(diagnosis.family);
        const parameter_t *delay = model_find(&diagnosis.model, "transport_delay")->parameter;
        TEST_ASSERT_NOT_NULL(delay->sigma);
        TEST_ASSERT_DOUBLE_WITHIN(3.0 * delay->sigma[0], delay_truth[0], delay->value[0]);
        TEST_ASSERT_EQUAL_DOUBLE(twice[0], model_find(&diagnosis.given, "transport_delay")->parameter->value[0]);
        expect_noise_is_left();
        if (modes > 0) {
            expect_numbers(&block_resonance, mode_truth);
        }
        plant(&block_resonance, mode_truth);
    }
}

/* A drift that settles in an hour cannot be distinguished from a line in four seconds: its numbers stay where they
 * were. */
static void test_what_the_recording_does_not_determine_stays(void) {
    static const numbers_t drift = {1e-6, 3600.0};
    give(&block_thermal_drift, drift);
    measure(0.0);
    look(true);
    TEST_ASSERT_EQUAL_INT(NOTHING_MISSING, diagnosis.verdict);
    TEST_ASSERT_EQUAL_UINT64(0, diagnosis.refitted);
    for (size_t p = 0; p < 2; p++) {
        TEST_ASSERT_EQUAL_DOUBLE(drift[p], model_find(&diagnosis.model, "thermal_drift")->parameter[p].value[0]);
    }
}

/* A bank of plays for what is a Bouc-Wen hysteresis: that shape, and what is missing beside it. */
static void test_a_wrong_shape_is_not_missing_physics(void) {
    make_bouc_wen_the_truth();
    for (size_t effects = 0; effects < 2; effects++) {
        measure(0.0);
        look(true);
        TEST_ASSERT_EQUAL_UINT64(effects, diagnosis.findings);
        TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
        TEST_ASSERT_EQUAL_PTR(&block_bouc_wen, diagnosis_other_shape(&diagnosis));
        TEST_ASSERT_NOT_NULL(model_find(&diagnosis.given, "prandtl_ishlinskii"));
        TEST_ASSERT_TRUE(diagnosis.own_shape_held_out_percent > 2.0 * diagnosis.held_out_percent);
        expect_noise_is_left();
        if (effects > 0) {
            expect_numbers(&block_creep, creep_truth);
        }
        plant(&block_creep, creep_truth);
    }
}

/* Creep does 0.25 um in a decade here. A drift of 0.1 um may be what it still does from before the recording, one of 1
 * um is not. */
static void test_a_small_drift_beside_creep_may_be_creep(void) {
    static const numbers_t drifts[] = {{-0.2, 0.5}, {-0.3, 0.7}};
    model_t with_creep;
    plant(&block_creep, creep_truth);
    model_copy(&with_creep, &truth);
    for (size_t large = 0; large < 2; large++) {
        model_free(&truth);
        model_copy(&truth, &with_creep);
        plant(&block_thermal_drift, drifts[large]);
        measure(0.0);
        look(true);
        const finding_t *drift = finding_of(&diagnosis, &block_thermal_drift);
        TEST_ASSERT_NOT_NULL(finding_of(&diagnosis, &block_creep));
        TEST_ASSERT_NOT_NULL(drift);
        TEST_ASSERT_EQUAL_INT(large ? NAMED : ISOLATED, drift->certainty);
        TEST_ASSERT_EQUAL_UINT64(large ? 0 : 1, drift->rivals);
    }
    model_free(&with_creep);
}

static char *told(void) {
    account_t account;
    look(false);
    TEST_ASSERT_TRUE_MESSAGE(account_for(&diagnosis, &recording, 1, &account, &failure), failure.text);
    json_t *json = diagnosis_to_json(&diagnosis, &account, &recording, 1);
    char *text = json_dumps(json, JSON_INDENT(1));
    json_decref(json);
    account_free(&account);
    return text;
}

/* To the last digit, on one processor and on several. Without a model: all that runs side by side. */
static void test_the_same_recording_gives_the_same_answer(void) {
    plant(&block_transport_delay, delay_truth);
    measure(0.0);
    parallel_limit(1);
    char *one = told();
    parallel_limit(3);
    char *two = told();
    parallel_limit(0);
    TEST_ASSERT_NOT_NULL(strstr(one, "transport_delay"));
    TEST_ASSERT_EQUAL_STRING(one, two);
    free(one);
    free(two);
}

static void test_too_few_samples_are_refused(void) {
    const size_t some[] = {20, 500};
    for (size_t i = 0; i < 2; i++) {
        recording.samples = some[i];
        TEST_ASSERT_FALSE(diagnose(&given, &recording, 1, &diagnosis, &failure));
        expect_line(&failure, "planted.csv");
        TEST_ASSERT_FALSE(diagnose(NULL, &recording, 1, &diagnosis, &failure));
        expect_line(&failure, "planted.csv");
    }
}

int main(void) {
    rng = random_start("diagnose", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_nothing_is_found_where_nothing_is);
    RUN_TEST(test_hum_is_named);
    RUN_TEST(test_too_few_samples_are_refused);
    if (!INSTRUMENTED) { /* with sanitizers the others take many minutes, and show the same code */
        RUN_TEST(test_creep_is_named);
        RUN_TEST(test_a_delay_is_named);
        RUN_TEST(test_a_gain_that_settles_is_named);
        RUN_TEST(test_saturation_is_named);
        RUN_TEST(test_steps_are_named);
        RUN_TEST(test_two_effects_are_named);
        RUN_TEST(test_a_superfluous_finding_does_not_stay);
        RUN_TEST(test_a_small_effect_is_seen_where_a_large_one_rests);
        RUN_TEST(test_a_delay_before_bouc_wen_is_named);
        RUN_TEST(test_interleaved_loops_of_bouc_wen_are_named);
        RUN_TEST(test_dielectric_loss_is_no_creep);
        RUN_TEST(test_a_loss_that_began_before_is_no_drift);
        RUN_TEST(test_what_only_comes_near_is_no_name);
        RUN_TEST(test_a_curve_that_leaves_a_curve_is_no_name);
        RUN_TEST(test_what_the_model_has_is_not_missing);
        RUN_TEST(test_what_the_model_has_wrong_is_not_missing);
        RUN_TEST(test_what_the_recording_does_not_determine_stays);
        RUN_TEST(test_a_wrong_shape_is_not_missing_physics);
        RUN_TEST(test_a_small_drift_beside_creep_may_be_creep);
        RUN_TEST(test_the_same_recording_gives_the_same_answer);
    }
    return UNITY_END();
}
