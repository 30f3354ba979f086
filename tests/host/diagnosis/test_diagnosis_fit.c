/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a diagnosis simulates, projects and fits with. */
#include "diagnosis/evidence/evidence.h"
#include "diagnosis/evidence/joint_fit.h"
#include "diagnosis/nuisance/smooth_plane.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { OPERATORS = 5, RECORDINGS = 2 };
static const size_t lengths[RECORDINGS] = {4000, 2600};
static const double rate_hz = 2000.0, noise_um = 0.003;
static const double weights[OPERATORS + 1] = {0.1, 0.03, 0.02, 0.015, 0.01, 0.01};
static const double thresholds[OPERATORS] = {3.0, 9.0, 18.0, 30.0, 42.0};
static random_t rng;
static recording_t recordings[RECORDINGS];
static model_t bank;
static samples_t samples;
static noise_t noise;
static failure_t failure;

/* Lines between corners; in the second recording the corners are held instead. */
void setUp(void) {
    const double corner[] = {0.0, 100.0, 20.0, 80.0, 0.0, 60.0, 10.0};
    for (size_t i = 0; i < RECORDINGS; i++) {
        recording_create(&recordings[i], i == 0 ? "lines.csv" : "steps.csv", rate_hz, lengths[i]);
        double *drive = recordings[i].column[COLUMN_DRIVE];
        fill_lines(drive, lengths[i], corner, 7, 150);
        for (size_t k = 0; i == 1 && k < lengths[i]; k++) {
            drive[k] = corner[k / 150 % 7];
        }
    }
    make_bank_model(&bank, rate_hz, 1.0, OPERATORS, weights, thresholds);
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&samples, &bank, recordings, RECORDINGS, &failure), failure.text);
    noise = (noise_t){.sigma_um = noise_um, .rms_um = noise_um};
}

void tearDown(void) {
    samples_close(&samples);
    model_free(&bank);
    for (size_t i = 0; i < RECORDINGS; i++) {
        recording_free(&recordings[i]);
    }
}

static void add_noise(double deviation_um) {
    for (size_t i = 0; i < RECORDINGS; i++) {
        for (size_t k = 0; k < lengths[i]; k++) {
            recordings[i].column[COLUMN_DISPLACEMENT][k] += deviation_um * random_normal(&rng);
        }
    }
}

static void measure(const model_t *truth, double deviation_um) {
    for (size_t i = 0; i < RECORDINGS; i++) {
        simulate_into(&recordings[i], truth, 1);
    }
    add_noise(deviation_um);
}

/* One number a parameter, in the order of its table. */
static void with_block(model_t *model, const block_t *block, const double *value) {
    insert_block(model, &bank, block, value);
}

static double *number_of(model_t *model, const char *block, const char *parameter) {
    return model_parameter(model_find(model, block), parameter)->value;
}

/* A chain of a block in each place, each changed in turn: simulated from there on, it is what it is from the beginning.
 */
static void test_a_changed_block_is_simulated_from_there_on(void) {
    const struct {
        const block_t *block;
        double value[4], other;
    } cases[] = {{&block_transport_delay, {0.7e-3}, 1.4e-3},
                 {&block_amplifier_bandwidth, {300.0}, 200.0},
                 {&block_asymmetric_hysteresis, {0.1, 50.0, 50.0}, 0.2},
                 {&block_rate_dependent_hysteresis, {1e-4}, 3e-4},
                 {&block_creep, {0.01, 0.05, 100.0}, 0.02},
                 {&block_resonance, {180.0, 0.05}, 150.0},
                 {&block_sensor_bandwidth, {400.0}, 600.0},
                 {&block_static_nonlinearity, {0.05, 0.02, 6.0, 6.0}, 0.1},
                 {&block_mains_interference, {50.0, 0.01, 0.3}, 60.0}};
    enum { CASES = sizeof cases / sizeof cases[0] };
    model_t full, altered;
    signals_t signals;
    model_copy(&full, &bank);
    for (size_t i = 0; i < CASES; i++) {
        double value[BLOCK_MAX_PARAMETERS];
        model_t more;
        for (size_t p = 0; p < cases[i].block->parameters; p++) {
            const parameter_info_t *info = &cases[i].block->parameter[p];
            value[p] = info->optional ? info->default_value : p < 4 ? cases[i].value[p] : 0.0;
        }
        insert_block(&more, &full, cases[i].block, value);
        model_free(&full);
        full = more;
    }
    TEST_ASSERT_EQUAL_UINT64(CASES + 1, full.blocks);
    TEST_ASSERT_TRUE_MESSAGE(signals_open(&signals, &samples, &full, &failure), failure.text);
    double *expected = samples_column(&samples), *position = samples_column(&samples);
    TEST_ASSERT_TRUE(samples_simulate(&samples, &full, expected, &failure));
    TEST_ASSERT_EQUAL_MEMORY(expected, signals.simulated, samples.all * sizeof(double));
    for (size_t i = 0; i <= CASES; i++) {
        model_copy(&altered, &full);
        const char *name = i < CASES ? cases[i].block->name : "prandtl_ishlinskii";
        const size_t at = (size_t)(model_find(&altered, name) - altered.block);
        double *number = i < CASES ? altered.block[at].parameter[0].value : number_of(&altered, name, "weights");
        *number = i < CASES ? cases[i].other : 0.12;
        TEST_ASSERT_TRUE(signals_altered(&signals, &altered, stage_of(&altered, at), position));
        TEST_ASSERT_TRUE(samples_simulate(&samples, &altered, expected, &failure));
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expected, position, samples.all * sizeof(double), name);
        TEST_ASSERT_TRUE_MESSAGE(memcmp(position, signals.simulated, samples.all * sizeof(double)) != 0, name);
        model_remove(&altered, at); /* another length: what stood before it stands */
        if (i < CASES) {
            const size_t stage = stage_of(&full, at);
            TEST_ASSERT_TRUE(signals_altered(&signals, &altered, stage, position));
            TEST_ASSERT_TRUE(samples_simulate(&samples, &altered, expected, &failure));
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expected, position, samples.all * sizeof(double), name);
        }
        model_free(&altered);
    }
    free(expected);
    free(position);
    signals_close(&signals);
    model_free(&full);
}

/* A plane whose past has many reversals. */
static void make_plane(model_t *plane) {
    const double level[] = {-5.0, 30.0, 60.0, 105.0}, table[] = {2.0, 5.0, 2.5, 9.0, 6.0, 3.0};
    const double past[] = {104.0, 8.0, 96.0, 14.0, 71.0, 33.0}, range_v[2] = {-5.0, 105.0};
    model_create(plane, rate_hz);
    model_block_t *block = model_append(plane, &block_preisach);
    model_set_array(block, "levels_v", 4, level, NULL);
    model_set_array(block, "everett_um", 6, table, NULL);
    model_set(block, "offset_um", 0.3);
    model_set_array(block, "past_v", 6, past, NULL);
    TEST_ASSERT_TRUE_MESSAGE(smooth_plane_from(block, range_v, false, &failure), failure.text);
}

/* Derivatives by the numbers in which the hysteresis is linear, all in one walk, are the differences that a simulation
 * for each of them gives. These are quotients of differences of positions of some 10 um by steps that are no smaller
 * than 1e-4 of a number: rounding leaves 1e-9 of the largest. */
static void expect_the_same_derivatives(model_t *model, size_t least_together, size_t most_together) {
    signals_t signals;
    hysteresis_numbers_t numbers;
    size_t together = 0;
    TEST_ASSERT_TRUE_MESSAGE(signals_open(&signals, &samples, model, &failure), failure.text);
    hysteresis_numbers_open(model, &numbers);
    double *expected = samples_column(&samples), *column = samples_column(&samples);
    for (size_t n = 0; n < numbers.count; n++) {
        TEST_ASSERT_TRUE(signals_derivative(&signals, &numbers, n, expected));
        signals_differentiate(&signals, &numbers);
        together += signals.output != NULL && signals.output[n] != NULL ? 1 : 0;
        TEST_ASSERT_TRUE(signals_derivative(&signals, &numbers, n, column));
        signals_forget(&signals);
        const double most = fabs(expected[cblas_idamax((int)samples.all, expected, 1)]);
        cblas_daxpy((int)samples.all, -1.0, expected, 1, column, 1);
        TEST_ASSERT_TRUE(most > 0.0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-7 * most, 0.0, column[cblas_idamax((int)samples.all, column, 1)]);
    }
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(least_together, together);
    TEST_ASSERT_LESS_OR_EQUAL_UINT64(most_together, together);
    free(expected);
    free(column);
    hysteresis_numbers_close(&numbers);
    signals_close(&signals);
}

static void test_linear_numbers_are_derived_together(void) {
    const double delay[] = {0.7e-3}, mode[] = {180.0, 0.05, 1.0}, wider[] = {3e-4, 0.0, HUGE_VAL, 0.0};
    model_t plane, behind_delay, whole;
    make_plane(&plane);
    expect_the_same_derivatives(&bank, OPERATORS + 1, OPERATORS + 1);
    expect_the_same_derivatives(&plane, 20, smooth_plane_functions());
    insert_block(&behind_delay, &plane, &block_transport_delay, delay);
    insert_block(&whole, &behind_delay, &block_resonance, mode);
    expect_the_same_derivatives(&whole, 20, smooth_plane_functions());
    model_free(&whole);
    model_free(&behind_delay);
    insert_block(&whole, &plane, &block_rate_dependent_hysteresis, wider); /* what widens loops is not walked */
    expect_the_same_derivatives(&whole, 0, 0);
    model_free(&whole);
    insert_block(&whole, &bank, &block_rate_dependent_hysteresis, wider);
    expect_the_same_derivatives(&whole, OPERATORS + 1, OPERATORS + 1);
    model_free(&whole);
    model_free(&plane);
}

static double rms_between(const model_t *one, const model_t *other) {
    double *a = samples_column(&samples), *b = samples_column(&samples), squares = 0.0;
    TEST_ASSERT_TRUE(samples_simulate(&samples, one, a, &failure) && samples_simulate(&samples, other, b, &failure));
    for (size_t k = 0; k < samples.all; k++) {
        squares += samples.part[k] == SAMPLE_FITTED ? (a[k] - b[k]) * (a[k] - b[k]) : 0.0;
    }
    free(a);
    free(b);
    return sqrt(squares / (double)samples.fitted);
}

/* From weights that are too large and a mode that is elsewhere. p numbers from n samples leave a simulation that is
 * wrong by noise sqrt(p / n) on average over its noise; twice that. The sums of squares have a deviation of sqrt(2 /
 * n). */
/* Both in percent of a stroke, and the worst recording counts: an error that is the same in all of them is reported as
 * the noise of that size is. */
static void test_noise_and_error_have_one_measure(void) {
    const double error_um = 0.02;
    double *simulated = samples_column(&samples), least_um = HUGE_VAL;
    measure(&bank, 0.0);
    for (size_t i = 0; i < RECORDINGS; i++) {
        const double *measured = recordings[i].column[COLUMN_DISPLACEMENT];
        double range_um[2];
        for (size_t k = 0; k < lengths[i]; k++) {
            simulated[samples.begin[i] + k] = measured[k] + (k % 2 == 0 ? error_um : -error_um);
        }
        values_range(measured, lengths[i], range_um);
        least_um = fmin(least_um, range_um[1] - range_um[0]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 100.0 * error_um / least_um, samples_percent(&samples, error_um));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, samples_percent(&samples, error_um),
                              samples_nrmse_percent(&samples, SAMPLE_HELD_OUT, simulated));
    free(simulated);
}

static void test_weights_and_a_mode_are_fitted_together(void) {
    model_t truth, model;
    joint_power_t power, again;
    with_block(&truth, &block_resonance, (const double[]){180.0, 0.05});
    measure(&truth, noise_um);
    model_copy(&model, &truth);
    for (size_t i = 0; i <= OPERATORS; i++) {
        number_of(&model, "prandtl_ishlinskii", "weights")[i] *= 1.2;
    }
    *number_of(&model, "resonance", "frequency_hz") = 165.0;
    *number_of(&model, "resonance", "damping_ratio") = 0.1;
    const unsigned mode = 1U << (size_t)(model_find(&model, "resonance") - model.block);
    TEST_ASSERT_TRUE(joint_fit(&samples, &noise, &model, mode, 10, &power, &failure));
    const double numbers = OPERATORS + 2 + 2, fitted = (double)samples.fitted, held = (double)samples.held;
    TEST_ASSERT_TRUE(rms_between(&model, &truth) < 2.0 * noise_um * sqrt(numbers / fitted));
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * sqrt(2.0 / fitted), 1.0, power.fitted / (fitted * noise_um * noise_um));
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * sqrt(2.0 / held), 1.0, power.held / (held * noise_um * noise_um));
    /* A mode of 12 um steps in noise of 3 nm: a part in 10000 or so. */
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 180.0, *number_of(&model, "resonance", "frequency_hz"));
    TEST_ASSERT_DOUBLE_WITHIN(2e-4, 0.05, *number_of(&model, "resonance", "damping_ratio"));
    TEST_ASSERT_TRUE(joint_power(&samples, &noise, &model, &again, &failure));
    TEST_ASSERT_EQUAL_DOUBLE(power.fitted, again.fitted);
    TEST_ASSERT_EQUAL_DOUBLE(power.held, again.held);
    model_free(&model);
    model_free(&truth);
}

/* A block that is not among the bits keeps its numbers. */
static void test_other_blocks_stay(void) {
    model_t truth, model;
    joint_power_t power;
    with_block(&truth, &block_resonance, (const double[]){180.0, 0.05});
    measure(&truth, noise_um);
    model_copy(&model, &truth);
    *number_of(&model, "resonance", "frequency_hz") = 170.0;
    TEST_ASSERT_TRUE(joint_fit(&samples, &noise, &model, 0, 4, &power, &failure));
    TEST_ASSERT_EQUAL_DOUBLE(170.0, *number_of(&model, "resonance", "frequency_hz"));
    model_free(&model);
    model_free(&truth);
}

/* Behind a converter's steps a small change of a number is none, or a whole step: a chain with them is fitted as the
 * chain without, and the step stays what the readings say. */
static void test_steps_are_in_no_fit(void) {
    static const double step_um = 0.06;
    joint_power_t power, plain_power;
    model_t plain, stepped, coarse;
    with_block(&coarse, &block_quantisation, &step_um);
    measure(&coarse, 0.0);
    model_copy(&plain, &bank);
    double *weight = number_of(&plain, "prandtl_ishlinskii", "weights");
    for (size_t i = 0; i <= OPERATORS; i++) {
        weight[i] *= i % 2 == 0 ? 1.2 : 0.7;
    }
    insert_block(&stepped, &plain, &block_quantisation, &step_um);
    const unsigned steps = 1U << (size_t)(model_find(&stepped, "quantisation") - stepped.block);
    TEST_ASSERT_TRUE(joint_fit(&samples, &noise, &plain, 0, 8, &plain_power, &failure));
    TEST_ASSERT_TRUE(joint_fit(&samples, &noise, &stepped, steps, 8, &power, &failure));
    TEST_ASSERT_TRUE(joint_errors(&samples, &noise, &stepped, steps, &failure));
    TEST_ASSERT_EQUAL_UINT64(2, stepped.blocks);
    TEST_ASSERT_EQUAL_DOUBLE(step_um, *number_of(&stepped, "quantisation", "step_um"));
    TEST_ASSERT_EQUAL_DOUBLE(plain_power.fitted, power.fitted);
    for (size_t i = 0; i <= OPERATORS; i++) {
        TEST_ASSERT_EQUAL_DOUBLE(number_of(&plain, "prandtl_ishlinskii", "weights")[i],
                                 number_of(&stepped, "prandtl_ishlinskii", "weights")[i]);
        /* The steps are no noise, but nearly: a thousandth of the stroke's 8 um over the drive's 100 V. */
        TEST_ASSERT_DOUBLE_WITHIN(2e-3, weights[i], number_of(&stepped, "prandtl_ishlinskii", "weights")[i]);
    }
    model_free(&plain);
    model_free(&stepped);
    model_free(&coarse);
}

/* Weights of which the true ones are 0, in much noise: half of them would come out below it. */
static void test_weights_do_not_become_negative(void) {
    double *found = number_of(&bank, "prandtl_ishlinskii", "weights");
    size_t at_bound = 0;
    for (int round = 0; round < 8; round++) {
        joint_power_t power;
        memcpy(found, weights, sizeof weights);
        found[2] = found[4] = 0.0;
        measure(&bank, 0.3);
        for (size_t i = 0; i <= OPERATORS; i++) {
            found[i] += 0.01;
        }
        TEST_ASSERT_TRUE(joint_fit(&samples, &noise, &bank, 0, 4, &power, &failure));
        for (size_t i = 0; i <= OPERATORS; i++) {
            TEST_ASSERT_TRUE(found[i] >= 0.0);
            at_bound += found[i] < 1e-9 ? 1 : 0;
        }
    }
    TEST_ASSERT_TRUE(at_bound >= 3 && at_bound <= 16); /* 8 of 16 on average */
}

/* A play wider than any way of the drive. */
static void test_what_the_samples_do_not_determine_stays(void) {
    double *found = number_of(&bank, "prandtl_ishlinskii", "weights"),
           *wide = number_of(&bank, "prandtl_ishlinskii", "thresholds_v");
    joint_power_t power;
    wide[OPERATORS - 1] = 150.0;
    measure(&bank, noise_um);
    for (size_t i = 0; i <= OPERATORS; i++) {
        found[i] *= 1.3;
    }
    const double kept = found[OPERATORS];
    TEST_ASSERT_TRUE(joint_fit(&samples, &noise, &bank, 0, 10, &power, &failure));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, kept, found[OPERATORS]);
    TEST_ASSERT_DOUBLE_WITHIN(0.001, weights[0], found[0]);
}

/* White noise: with memory, the filter takes the last sample of a held-out block to the first one behind it. */
static void test_held_out_samples_are_not_used(void) {
    model_t one, other;
    joint_power_t power, power_other;
    with_block(&one, &block_resonance, (const double[]){170.0, 0.06});
    model_copy(&other, &one);
    *number_of(&one, "resonance", "frequency_hz") = 180.0;
    measure(&one, noise_um);
    model_free(&one);
    model_copy(&one, &other);
    TEST_ASSERT_TRUE(joint_fit(&samples, &noise, &one, 2, 4, &power, &failure));
    for (size_t k = 0; k < samples.all; k++) {
        if (samples.part[k] == SAMPLE_HELD_OUT) {
            const size_t i = k >= samples.begin[1] ? 1 : 0;
            recordings[i].column[COLUMN_DISPLACEMENT][k - samples.begin[i]] += 50.0 * random_normal(&rng);
        }
    }
    TEST_ASSERT_TRUE(joint_fit(&samples, &noise, &other, 2, 4, &power_other, &failure));
    TEST_ASSERT_EQUAL_DOUBLE(power.fitted, power_other.fitted);
    TEST_ASSERT_TRUE(power_other.held > 1e6 * power.held);
    TEST_ASSERT_EQUAL_MEMORY(number_of(&one, "prandtl_ishlinskii", "weights"),
                             number_of(&other, "prandtl_ishlinskii", "weights"), sizeof weights);
    TEST_ASSERT_EQUAL_DOUBLE(*number_of(&one, "resonance", "frequency_hz"),
                             *number_of(&other, "resonance", "frequency_hz"));
    model_free(&one);
    model_free(&other);
}

static evidence_t *evidence_of(void) {
    evidence_t *evidence = evidence_open(&bank, &samples, &noise, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(evidence, failure.text);
    return evidence;
}

/* A signature of known size in white noise: its amplitude is found within its standard error, and T is that. Over 24
 * rounds, (amplitude - truth) t / amplitude is a normal number: none beyond 4.2, and its mean square within 5 of its
 * deviations sqrt(2 / 24) of 1. T by the scatter over 36 blocks, 24 of them fitted, is as large, within 5 / sqrt(2 x
 * 24). */
static void test_amplitude_of_a_known_signature(void) {
    enum { ROUNDS = 24 };
    const double amplitude = 0.04;
    double squares = 0.0, t = 0.0, t_blocks = 0.0, expected = 0.0;
    model_t altered;
    measure(&bank, 0.0);
    with_block(&altered, &block_sensor_bandwidth, (const double[]){8000.0});
    evidence_t *clean = evidence_of();
    double *signature = evidence_signature(clean, &altered, 1);
    TEST_ASSERT_NOT_NULL(signature);
    evidence_close(clean);
    for (int round = 0; round < ROUNDS; round++) {
        measure(&bank, noise_um);
        for (size_t k = 0; k < samples.all; k++) {
            const size_t i = k >= samples.begin[1] ? 1 : 0;
            recordings[i].column[COLUMN_DISPLACEMENT][k - samples.begin[i]] += amplitude * signature[k];
        }
        evidence_t *evidence = evidence_of();
        const evidence_test_t test = evidence_test(evidence, signature);
        const double away = (test.amplitude - amplitude) * test.t / test.amplitude;
        TEST_ASSERT_DOUBLE_WITHIN(4.2, 0.0, away);
        TEST_ASSERT_DOUBLE_WITHIN(0.05 * noise_um, noise_um, evidence_sigma_um(evidence) * sqrt(1.0 - test.explained));
        squares += away * away / ROUNDS;
        t += test.t / ROUNDS;
        t_blocks += test.t_blocks / ROUNDS;
        expected = amplitude * test.own_um * sqrt((double)samples.fitted) / noise_um;
        TEST_ASSERT_TRUE(test.own_part > 0.0 && test.own_part <= 1.0);
        evidence_close(evidence);
    }
    printf("t %.2f, by blocks %.2f, expected %.2f; mean square %.2f\n", t, t_blocks, expected, squares);
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * sqrt(2.0 / ROUNDS), 1.0, squares);
    TEST_ASSERT_TRUE(expected > 6.0);
    TEST_ASSERT_DOUBLE_WITHIN(5.0 / sqrt(ROUNDS), expected, t);
    TEST_ASSERT_DOUBLE_WITHIN(0.7 * expected, expected, t_blocks);
    free(signature);
    model_free(&altered);
}

/* An offset, another weight, nothing at all: no evidence, and no number that is none. */
static void test_what_the_model_imitates_is_no_evidence(void) {
    model_t altered;
    measure(&bank, noise_um);
    evidence_t *evidence = evidence_of();
    model_copy(&altered, &bank);
    number_of(&altered, "prandtl_ishlinskii", "weights")[2] += 0.01;
    double *signature = evidence_signature(evidence, &altered, 0);
    for (int kind = 0; kind < 3; kind++) {
        for (size_t k = 0; k < samples.all && kind > 0; k++) {
            signature[k] = kind == 1 ? 1.0 : 0.0;
        }
        const evidence_test_t test = evidence_test(evidence, signature);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, test.amplitude);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, test.t);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, test.t_blocks);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, test.explained);
        TEST_ASSERT_FALSE(isnan(test.held_share));
        TEST_ASSERT_TRUE(isfinite(evidence_cosine(evidence, signature, signature)));
    }
    free(signature);
    evidence_close(evidence);
    model_free(&altered);
}

/* What each question asks for contains the one before: T cannot but rise in what it explains. */
static void test_questions_are_nested(void) {
    model_t altered;
    double last = 0.0;
    with_block(&altered, &block_static_nonlinearity, (const double[]){0.05, 0.0, 6.0, 6.0});
    measure(&altered, noise_um);
    evidence_t *evidence = evidence_of();
    double *signature = evidence_signature(evidence, &altered, 1);
    for (ask_t question = ASK_EFFECTS; question <= ASK_ANYTHING; question++) {
        evidence_ask(evidence, question);
        TEST_ASSERT_EQUAL_INT(question, evidence_question(evidence));
        const evidence_test_t test = evidence_test(evidence, signature);
        TEST_ASSERT_TRUE(test.own_part >= last);
        last = test.own_part;
    }
    TEST_ASSERT_TRUE(last > 0.0);
    free(signature);
    evidence_close(evidence);
    model_free(&altered);
}

/* Refined from another number, a delay and a mode are found within a part in 100 and 1000: their amplitudes are seen
 * hundreds of standard errors wide. And what is left is the noise. */
static void test_refining_finds_a_delay_and_a_mode(void) {
    const struct {
        const block_t *block;
        double start[2], truth[2], within[2];
    } cases[] = {{&block_transport_delay, {0.25 / 2000.0, 0.0}, {0.7e-3, 0.0}, {0.01, 0.0}},
                 {&block_resonance, {172.0, 0.03}, {180.0, 0.05}, {1e-3, 0.02}}};
    for (size_t i = 0; i < 2; i++) {
        model_t truth, altered;
        with_block(&truth, cases[i].block, cases[i].truth);
        with_block(&altered, cases[i].block, cases[i].start);
        measure(&truth, noise_um);
        const size_t at = (size_t)(model_find(&truth, cases[i].block->name) - truth.block);
        evidence_t *evidence = evidence_of();
        const double left = evidence_refine(evidence, &altered, at);
        for (size_t p = 0; p < cases[i].block->parameters; p++) {
            TEST_ASSERT_DOUBLE_WITHIN(cases[i].within[p] * cases[i].truth[p], cases[i].truth[p],
                                      altered.block[at].parameter[p].value[0]);
        }
        TEST_ASSERT_TRUE(left > 0.0 && left < 0.1);
        TEST_ASSERT_DOUBLE_WITHIN(0.05 * noise_um, noise_um, evidence_sigma_um(evidence) * sqrt(left));
        TEST_ASSERT_TRUE(evidence_likelihood(evidence, left) > 1000.0);
        evidence_close(evidence);
        model_free(&truth);
        model_free(&altered);
    }
}

/* A leakage's rest is a constant, which the offset imitates: a step of it would be rounding divided by rounding. It
 * stays where it is, and the time constant is found from one that is 30 times shorter, at 100 times the noise within a
 * twentieth. Under another noise rounding is another one. */
static void test_refining_leaves_what_is_imitated(void) {
    const double truth_s = 40.0;
    for (int i = 0; i < 12; i++) {
        model_t truth, altered;
        noise.filter.memory = 0.07 * i;
        with_block(&truth, &block_charge_leakage, (const double[]){truth_s, 0.0, 0.0});
        with_block(&altered, &block_charge_leakage, (const double[]){truth_s / 30.0, 0.0, 0.0});
        measure(&truth, noise_um);
        const size_t at = (size_t)(model_find(&truth, "charge_leakage") - truth.block);
        evidence_t *evidence = evidence_of();
        const double left = evidence_refine(evidence, &altered, at);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, *number_of(&altered, "charge_leakage", "rest_um"));
        TEST_ASSERT_DOUBLE_WITHIN(0.05 * truth_s, truth_s, *number_of(&altered, "charge_leakage", "time_constant_s"));
        TEST_ASSERT_TRUE(left > 0.0 && left < 0.1);
        evidence_close(evidence);
        model_free(&truth);
        model_free(&altered);
    }
}

/* What moves back after a step is no creep, though a model may compute it: refined and fitted, it stays above 0. */
static void test_creep_goes_on(void) {
    const double values[] = {0.01, 0.05, 100.0, 0.0};
    joint_power_t power;
    model_t truth, altered;
    with_block(&truth, &block_creep, (const double[]){-0.02, 0.05, 100.0, 0.0});
    with_block(&altered, &block_creep, values);
    measure(&truth, noise_um);
    const size_t at = (size_t)(model_find(&altered, "creep") - altered.block);
    evidence_t *evidence = evidence_of();
    (void)evidence_refine(evidence, &altered, at);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, *number_of(&altered, "creep", "gamma_per_decade"));
    *number_of(&altered, "creep", "gamma_per_decade") = values[0];
    TEST_ASSERT_TRUE(joint_fit(&samples, &noise, &altered, 1U << at, 4, &power, &failure));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, *number_of(&altered, "creep", "gamma_per_decade"));
    evidence_close(evidence);
    model_free(&truth);
    model_free(&altered);
}

/* Beside the right slew limit there are little minima, since corners move from sample to sample. From wherever the
 * search begins it comes to the right one, but for one start in ten at most (measured: 2 of 66; without a look around
 * 14). */
static void test_refining_finds_a_slew_limit(void) {
    static const double parts[] = {0.4, 0.6}; /* of the largest rate */
    const double slowest_hz = 8.3, fastest_hz = slowest_hz + 7.1 * 3.0, amplitude_v = 50.0;
    size_t searches = 0, right = 0;
    for (size_t i = 0; i < RECORDINGS; i++) { /* sines of several sizes and frequencies */
        for (size_t k = 0; k < lengths[i]; k++) {
            const size_t frequency = k / 1300, size = k / 433 % 3;
            const double hz = slowest_hz + 7.1 * (double)frequency, v = amplitude_v - 15.0 * (double)size;
            recordings[i].column[COLUMN_DRIVE][k] = 50.0 - v * cos(2.0 * M_PI * hz * (double)k / rate_hz);
        }
    }
    noise.filter.memory = 0.99;
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        const double limit = parts[i] * amplitude_v * 2.0 * M_PI * fastest_hz;
        model_t truth;
        with_block(&truth, &block_amplifier_slew_limit, &limit);
        measure(&truth, 0.0);
        const size_t at = (size_t)(model_find(&truth, "amplifier_slew_limit") - truth.block);
        for (int start = 0; start < 33; start++) {
            const double value = limit * (0.7 + 0.02 * start);
            model_t altered;
            with_block(&altered, &block_amplifier_slew_limit, &value);
            evidence_t *evidence = evidence_of();
            (void)evidence_refine(evidence, &altered, at);
            searches++;
            right += fabs(*number_of(&altered, "amplifier_slew_limit", "limit_v_per_s") / limit - 1.0) < 1e-5;
            evidence_close(evidence);
            model_free(&altered);
        }
        model_free(&truth);
    }
    printf("slew limits: %zu of %zu\n", right, searches);
    TEST_ASSERT_TRUE(10 * (searches - right) <= searches);
}

int main(void) {
    rng = random_start("diagnosis_fit", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_a_changed_block_is_simulated_from_there_on);
    RUN_TEST(test_linear_numbers_are_derived_together);
    RUN_TEST(test_noise_and_error_have_one_measure);
    RUN_TEST(test_weights_and_a_mode_are_fitted_together);
    RUN_TEST(test_other_blocks_stay);
    RUN_TEST(test_steps_are_in_no_fit);
    RUN_TEST(test_weights_do_not_become_negative);
    RUN_TEST(test_what_the_samples_do_not_determine_stays);
    RUN_TEST(test_held_out_samples_are_not_used);
    RUN_TEST(test_amplitude_of_a_known_signature);
    RUN_TEST(test_what_the_model_imitates_is_no_evidence);
    RUN_TEST(test_questions_are_nested);
    RUN_TEST(test_refining_finds_a_delay_and_a_mode);
    RUN_TEST(test_refining_leaves_what_is_imitated);
    RUN_TEST(test_creep_goes_on);
    RUN_TEST(test_refining_finds_a_slew_limit);
    return UNITY_END();
}
