/* SPDX-License-Identifier: GPL-3.0-or-later */
/* An effect of hundreds of times the noise is found, though every hysteresis that is fitted first takes a part of it:
 * rails that cut both ends off, and a mode among the frequencies of the drive. */
#include "diagnosis/diagnose.h"
#include "diagnosis/evidence/searched.h"
#include "support.h"
#include "unity.h"
#include <math.h>

enum { SAMPLES = 16000, PLAYS = 200 };
static const double rate_hz = 4000.0, noise_um = 0.004;
static recording_t recording;
static model_t truth;
static answer_t diagnosis;
static failure_t failure;
static random_t rng;

void setUp(void) {
    rng = random_start("diagnose_strong", 20261123);
    recording_create(&recording, "strong.csv", rate_hz, SAMPLES);
    fill_tones(recording.column[COLUMN_DRIVE], SAMPLES, rate_hz, 50.0, &rng);
    make_fine_bank_model(&truth, rate_hz, PLAYS);
}

void tearDown(void) {
    answer_free(&diagnosis);
    model_free(&truth);
    recording_free(&recording);
}

/* It alone is found, without reservation, with its numbers to 2 %: the bank that it is fitted beside is not the one of
 * the recording, and a rail of 6 V comes out as 6.04, which is five of its standard errors. */
static void expect_found(const block_t *block, const double *value) {
    measure_with(&recording, &truth, block, value, noise_um, &rng);
    TEST_ASSERT_TRUE_MESSAGE(diagnose(NULL, &recording, 1, &diagnosis, &failure), failure.text);
    TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
    TEST_ASSERT_EQUAL_UINT(1, diagnosis.findings);
    const finding_t *finding = &diagnosis.finding[0];
    TEST_ASSERT_EQUAL_STRING(block->name, finding->block->name);
    TEST_ASSERT_EQUAL_INT(NAMED, finding->certainty);
    const model_block_t *found = &diagnosis.model.block[finding_index(&diagnosis, finding)];
    for (size_t p = 0; p < block->parameters; p++) {
        if (number_is_searched(found, p)) {
            const parameter_t *parameter = &found->parameter[p];
            printf("%s %g +- %g (%g)\n", block->parameter[p].name, parameter->value[0], parameter->sigma[0], value[p]);
            TEST_ASSERT_DOUBLE_WITHIN(0.02 * fabs(value[p]), value[p], parameter->value[0]);
        }
    }
}

static void test_rails_on_both_sides(void) {
    expect_found(&block_amplifier_saturation, (double[]){6.0, 93.0});
}

static void test_a_mode_inside_the_band(void) {
    expect_found(&block_resonance, (double[]){28.0, 0.02});
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_rails_on_both_sides);
    RUN_TEST(test_a_mode_inside_the_band);
    return UNITY_END();
}
