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
    rivals_of(&beside, &question->setting, finding->block, false, rivals);
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

int main(void) {
    rng = random_start("diagnose_rivals", 20261128);
    UNITY_BEGIN();
    RUN_TEST(test_rivals_beside_any_shape_are_in_the_answer);
    return UNITY_END();
}
