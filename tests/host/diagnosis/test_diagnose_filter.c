/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Richer forms are found where the plain one leaves more than noise, and only there: a low pass of second order in the
 * place of one of first order, two modes in the place of one, losses that warm in the place of a drift or of nothing.
 */
#include "diagnosis/diagnose.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>

enum { SAMPLES = 12000, PLAYS = 100 };
static const double rate_hz = 2000.0, noise_um = 0.004;
static recording_t recording;
static model_t truth;
static answer_t diagnosis;
static failure_t failure;
static random_t rng;

void setUp(void) {
    recording_create(&recording, "filter.csv", rate_hz, SAMPLES);
    fill_tones(recording.column[COLUMN_DRIVE], SAMPLES, rate_hz, 100.0, &rng);
    make_fine_bank_model(&truth, rate_hz, PLAYS);
}

void tearDown(void) {
    answer_free(&diagnosis);
    model_free(&truth);
    recording_free(&recording);
}

static const finding_t *ask(const block_t *block, const double *value) {
    measure_with(&recording, &truth, block, value, noise_um, &rng);
    TEST_ASSERT_TRUE_MESSAGE(diagnose(NULL, &recording, 1, &diagnosis, &failure), failure.text);
    printf("verdict %d, held out %.4f %%, noise %.4f %%\n", diagnosis.verdict, diagnosis.held_out_percent,
           diagnosis.noise_percent);
    for (size_t f = 0; f < diagnosis.findings; f++) {
        const finding_t *finding = &diagnosis.finding[f];
        const model_block_t *found = &diagnosis.model.block[finding_index(&diagnosis, finding)];
        printf("%s, certainty %d, %zu rivals", finding->block->name, finding->certainty, finding->rivals);
        for (size_t r = 0; r < finding->rivals; r++) {
            printf(" %s", finding->rival[r]->name);
        }
        for (size_t p = 0; p < finding->block->parameters; p++) {
            printf(", %g", found->parameter[p].count > 0 ? found->parameter[p].value[0] : 0.0);
        }
        printf("\n");
    }
    TEST_ASSERT_TRUE(diagnosis.findings > 0);
    return &diagnosis.finding[0];
}

/* Or its like on the other side, which the reply then names. */
static bool may_be(const finding_t *finding, const block_t *block) {
    bool may = finding->block == block;
    for (size_t r = 0; r < finding->rivals; r++) {
        may = may || finding->rival[r] == block;
    }
    return may;
}

/* It alone, with its numbers. Standard errors have the block's accuracy in them, 2 and 4 %. */
static void expect_found(const block_t *block, const double *value) {
    const finding_t *finding = ask(block, value);
    TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
    TEST_ASSERT_EQUAL_UINT(1, diagnosis.findings);
    TEST_ASSERT_TRUE(may_be(finding, block));
    TEST_ASSERT_TRUE(finding->held_out_after_percent < 0.5 * finding->held_out_before_percent);
    const model_block_t *found = &diagnosis.model.block[finding_index(&diagnosis, finding)];
    for (size_t p = 0; p < block->parameters; p++) {
        TEST_ASSERT_DOUBLE_WITHIN(3.0 * found->parameter[p].sigma[0], value[p], found->parameter[p].value[0]);
    }
}

static void test_a_butterworth_amplifier(void) {
    expect_found(&block_amplifier_filter, (double[]){150.0, sqrt(0.5)});
}

static void test_a_sensor_with_an_anti_alias_filter(void) {
    expect_found(&block_sensor_filter, (double[]){200.0, 0.87});
}

static void test_what_is_of_first_order_stays_so(void) {
    const finding_t *finding = ask(&block_sensor_bandwidth, (double[]){200.0});
    TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
    TEST_ASSERT_EQUAL_STRING("sensor_bandwidth", finding->block->name);
    TEST_ASSERT_FALSE(may_be(finding, &block_sensor_filter) || may_be(finding, &block_amplifier_filter));
}

/* Of 120 and 310 Hz with 0.3 of the stroke for the second; one that the other opposes; and one above most of what the
 * drive excites, at 0.35 of the sample rate. */
static void test_two_modes(void) {
    expect_found(&block_two_modes, (double[]){120.0, 0.02, 310.0, 0.03, 0.3});
    answer_free(&diagnosis);
    expect_found(&block_two_modes, (double[]){120.0, 0.02, 310.0, 0.03, -0.2});
    answer_free(&diagnosis);
    expect_found(&block_two_modes, (double[]){120.0, 0.02, 700.0, 0.03, 0.3});
}

static void test_a_single_mode_stays_one(void) {
    static const double mode[][2] = {{120.0, 0.02}, {310.0, 0.03}, {150.0, 0.15}};
    for (size_t i = 0; i < sizeof mode / sizeof mode[0]; i++) {
        const finding_t *finding = ask(&block_resonance, mode[i]);
        TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
        TEST_ASSERT_EQUAL_UINT(1, diagnosis.findings);
        TEST_ASSERT_EQUAL_STRING("resonance", finding->block->name);
        TEST_ASSERT_FALSE(may_be(finding, &block_two_modes));
        answer_free(&diagnosis);
    }
}

/* Two slow loops, then bursts of 25 Hz of different height with pauses. */
static void fill_bursts(void) {
    static const double height[] = {50.0, 35.0, 50.0, 20.0};
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz, burst = (t - 2.0) / 1.0;
        const double slow = t < 2.0 ? 50.0 * sin(2.0 * M_PI * t) : 0.0;
        const bool bursts = burst >= 0.0 && fmod(burst, 1.0) < 0.6;
        recording.column[COLUMN_DRIVE][k] =
            bursts ? height[(size_t)burst % 4] * sin(2.0 * M_PI * 25.0 * (t - 2.0)) : slow;
    }
}

/* Nothing of its group explains any of it. */
static void test_losses_that_warm(void) {
    static const double warms[4] = {1e-3, 0.01, 0.8, 50.0};
    fill_bursts();
    const finding_t *finding = ask(&block_self_heating, warms);
    TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
    TEST_ASSERT_EQUAL_UINT(1, diagnosis.findings);
    TEST_ASSERT_EQUAL_STRING("self_heating", finding->block->name);
    TEST_ASSERT_EQUAL_INT(NAMED, finding->certainty);
    const model_block_t *found = &diagnosis.model.block[finding_index(&diagnosis, finding)];
    for (size_t p = 0; p < 3; p++) {
        TEST_ASSERT_DOUBLE_WITHIN(3.0 * found->parameter[p].sigma[0], warms[p], found->parameter[p].value[0]);
    }
}

int main(void) {
    rng = random_start("diagnose_filter", 20261123);
    UNITY_BEGIN();
    RUN_TEST(test_a_butterworth_amplifier);
    RUN_TEST(test_a_sensor_with_an_anti_alias_filter);
    RUN_TEST(test_what_is_of_first_order_stays_so);
    RUN_TEST(test_two_modes);
    RUN_TEST(test_a_single_mode_stays_one);
    RUN_TEST(test_losses_that_warm);
    return UNITY_END();
}
