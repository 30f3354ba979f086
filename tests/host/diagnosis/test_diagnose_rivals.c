/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a finding can be confused with beside a hysteresis of any shape is in the answer, though a review looks for it
 * before it is known that the finding stays. */
#include "belief/rivals.h"
#include "diagnosis/diagnose.h"
#include "support.h"
#include "unity.h"
#include <stdio.h>

enum { SAMPLES = 8000, PLAYS = 100 };
static const double rate_hz = 2000.0, noise_um = 0.004;
static recording_t recording;
static model_t truth;
static answer_t diagnosis;
static failure_t failure;
static random_t rng;

void setUp(void) {
    recording_create(&recording, "rivals.csv", rate_hz, SAMPLES);
    fill_tones(recording.column[COLUMN_DRIVE], SAMPLES, rate_hz, 100.0, &rng);
    make_fine_bank_model(&truth, rate_hz, PLAYS);
}

void tearDown(void) {
    answer_free(&diagnosis);
    model_free(&truth);
    recording_free(&recording);
}

/* The same question, asked again when the answer is there. */
static void ask_again(const finding_t *finding, rivals_t *rivals) {
    const question_t *question = diagnosis.question;
    model_t chain;
    fitted_chain_t beside;
    chain_for_operator(&diagnosis.given, &chain);
    TEST_ASSERT_TRUE(fitted_chain_open(&beside, &question->samples, &chain, NULL));
    rivals_of(&beside, &question->setting, finding->block, NULL, rivals);
    fitted_chain_close(&beside);
    model_free(&chain);
}

static void test_rivals_beside_any_shape_are_in_the_answer(void) {
    static const double delay_s[] = {1e-4};
    rivals_t rivals;
    measure_with(&recording, &truth, &block_transport_delay, delay_s, noise_um, &rng);
    TEST_ASSERT_TRUE_MESSAGE(diagnose(NULL, &recording, 1, &diagnosis, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT(1, diagnosis.findings);
    const finding_t *finding = &diagnosis.finding[0];
    printf("%s:", finding->block->name);
    for (size_t i = 0; i < finding->rivals; i++) {
        printf(" %s", finding->rival[i]->name);
    }
    ask_again(finding, &rivals);
    printf("; beside any shape:");
    for (size_t i = 0; i < rivals.count; i++) {
        printf(" %s", rivals.rival[i]->name);
    }
    printf("\n");
    TEST_ASSERT_TRUE(rivals.count > 0);
    for (size_t i = 0; i < rivals.count; i++) {
        TEST_ASSERT_TRUE(finding_has_rival(finding, rivals.rival[i]));
    }
}

/* What other blocks with these numbers are worth beside the operator. */
static void ask_elsewhere(const block_t *there, const block_t *found, rivals_t *rivals) {
    static const double value[] = {200.0, 0.7};
    probe_setting_t setting;
    model_t chain, with;
    samples_t samples;
    fitted_chain_t beside;
    measure_with(&recording, &truth, there, value, noise_um, &rng);
    question_setting(&recording, 1, &setting);
    imitation_chain(rate_hz, &chain);
    insert_block(&with, &truth, found, value);
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&samples, &chain, &recording, 1, &failure), failure.text);
    TEST_ASSERT_TRUE(fitted_chain_open(&beside, &samples, &chain, NULL));
    rivals_elsewhere(&beside, &setting, model_find(&with, found->name), rivals);
    printf("%s in the place of %s: worth %g, the other one %g\n", found->name, there->name, rivals->gain,
           rivals->best_gain);
    fitted_chain_close(&beside);
    samples_close(&samples);
    model_free(&chain);
    model_free(&with);
}

/* Behind the hysteresis in the place of before it, and the other way round. Where it was, the other one is worth less:
 * by 100 to 2200 natural units of some 10,000 with four seeds. */
static void test_a_low_pass_at_the_wrong_side_has_the_other_one_for_a_rival(void) {
    static const block_t *const side[] = {&block_amplifier_filter, &block_sensor_filter};
    for (size_t i = 0; i < 2; i++) {
        rivals_t rivals;
        ask_elsewhere(side[i], side[1 - i], &rivals);
        TEST_ASSERT_EQUAL_UINT64(1, rivals.count);
        TEST_ASSERT_TRUE(rivals.rival[0] == side[i]);
        ask_elsewhere(side[i], side[i], &rivals);
        TEST_ASSERT_TRUE(rivals.best_gain < rivals.gain);
    }
}

int main(void) {
    rng = random_start("diagnose_rivals", 20261128);
    UNITY_BEGIN();
    RUN_TEST(test_rivals_beside_any_shape_are_in_the_answer);
    RUN_TEST(test_a_low_pass_at_the_wrong_side_has_the_other_one_for_a_rival);
    return UNITY_END();
}
