/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The sentence of the verdict, what comes before it, and what it advises. */
#include "report/advice.h"
#include "told_diagnosis.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Drives that go up once, and once back, are no loop; JSON, text and page say so before the verdict. */
static void test_too_few_reversals_are_told_first(void) {
    static const char sentence[] = "Too little to go by: the drive turns round 1 time by more than half of its range";
    char text[DIAGNOSIS_LINE];
    work_out();
    TEST_ASSERT_FALSE(verdict_caveat(&diagnosis, text));
    for (size_t k = 0; k < SAMPLES; k++) {
        recordings[0].column[COLUMN_DRIVE][k] = fmin((double)k, SAMPLES - (double)k);
        recordings[1].column[COLUMN_DRIVE][k] = (double)k;
    }
    TEST_ASSERT_TRUE(verdict_caveat(&diagnosis, text));
    TEST_ASSERT_EQUAL_INT(0, strncmp(text, sentence, strlen(sentence)));
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_EQUAL_INT(0, strncmp(text, sentence, strlen(sentence)));
    TEST_ASSERT_NOT_NULL(strstr(text, "any. As far as it goes: Explained by"));
    json_t *json = as_json();
    TEST_ASSERT_EQUAL_INT(0, strncmp(json_string_value(json_object_get(json, "caveat")), sentence, strlen(sentence)));
    json_decref(json);
    account_free(&account);
}

/* An operator that leaves as much as the model proves no shape: that the rest is noise, its spectrum alone says. */
static void test_an_operator_that_leaves_as_much_proves_nothing(void) {
    char text[DIAGNOSIS_LINE];
    diagnosis.another_shape = true;
    diagnosis.findings = 0;
    diagnosis.verdict = NOTHING_MISSING;
    diagnosis.shape_after = (shape_t){.operator_percent = 1.2 * diagnosis.held_out_percent, .rho_hz = 210.0};
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "What the model leaves, 0.1 %, is 1/f below 210 Hz: noise, or something "
                                              "slow, as creep or a drift."),
                                 text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "leaves no less, 0.12 %. A rest, or a path that repeats itself, would "),
                                 text);
    /* What the recordings have is not advised. */
    question->seen.repeats = true;
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "leaves no less, 0.12 %. A rest would tell which."), text);
    question->seen.rests = true;
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "leaves no less, 0.12 %."), text);
    TEST_ASSERT_NULL_MESSAGE(strstr(text, "would tell which"), text);
    question->seen.repeats = false;
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "0.12 %. A path that repeats itself would tell which."), text);
    TEST_ASSERT_NULL_MESSAGE(strstr(text, "of another shape"), text);
    diagnosis.shape_after.operator_percent = 0.5 * diagnosis.held_out_percent;
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_NULL(strstr(text, "something slow"));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text,
                                        "What the model leaves beside noise is a hysteresis of another shape, the "
                                        "shape of its loops"),
                                 text);
    TEST_ASSERT_NULL_MESSAGE(strstr(text, "Beside it"), text);
    /* What speaks beside the operator has its sentence, with what it may be. */
    diagnosis.shape_after.loudest = &block_static_nonlinearity;
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "Beside it speaks static_nonlinearity: a bend, of the loops or of the "
                                              "readings."),
                                 text);
    diagnosis.shape_after.loudest = &block_gain_drift;
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "speaks gain_drift, but for no more than the operator itself may be"),
                                 text);
    diagnosis.shape_after.silent = true;
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_NULL_MESSAGE(strstr(text, "Beside it"), text);
}

/* A model that follows the recording only with what was put down to its past is not simply to be used. */
static void test_what_rests_on_the_past_is_told_first(void) {
    static const char sentence[] = "2.2 % of the stroke were put down to what drives before the recording left";
    char text[DIAGNOSIS_LINE];
    diagnosis.past_percent = 0.9 * diagnosis.nrmse_percent;
    TEST_ASSERT_FALSE(verdict_caveat(&diagnosis, text));
    diagnosis.past_percent = 2.2;
    TEST_ASSERT_TRUE(verdict_caveat(&diagnosis, text));
    TEST_ASSERT_EQUAL_INT(0, strncmp(text, sentence, strlen(sentence)));
    diagnosis.verdict = NOTHING_MISSING;
    advice_on_verdict(&diagnosis, text);
    TEST_ASSERT_NOT_NULL(strstr(text, "drive_before_v"));
    TEST_ASSERT_NULL(strstr(text, "Use the model"));
}

/* The numbers of what is found beside the operator hold, of a model that is no better they alone. */
static void test_partly_beside_the_operator(void) {
    char text[DIAGNOSIS_LINE];
    diagnosis.verdict = PARTLY_EXPLAINED;
    diagnosis.finding[0].heard = diagnosis.another_shape = true;
    diagnosis.held_out_percent = 0.9;
    diagnosis.shape_after.operator_percent = 0.4;
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text,
                                        "What remains is more than noise, and in no block of the catalogue. A part "
                                        "of it is the shape of the loops: an operator that imitates a hysteresis "
                                        "of any shape leaves 0.4 % of samples that no fit saw, the model 0.9 %."),
                                 text);
    TEST_ASSERT_NULL_MESSAGE(strstr(text, "nothing but noise"), text);
    diagnosis.baseline_held_out_percent = 0.8;
    advice_on_verdict(&diagnosis, text);
    TEST_ASSERT_EQUAL_STRING("Trust the numbers of what was found, and not the model's error: its hysteresis has "
                             "another shape, and is no better beside it. Something else is there, too.",
                             text);
}

/* They are found without an error that falls, and none is claimed; but for that of what else was found. */
static void test_steps_lower_no_error(void) {
    char text[DIAGNOSIS_LINE];
    model_block_t *block = model_append(&diagnosis.model, &block_quantisation);
    model_set(block, "step_um", 0.0123);
    diagnosis.finding[1] = (finding_t){
        .block = &block_quantisation, .certainty = NAMED, .in_readings = true, .held_out_before_percent = 0.1};
    diagnosis.findings = 2;
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_EQUAL_STRING("Explained by resonance and quantisation: the held-out error falls from 1 % to 0.1 %, the "
                             "noise is 0.1 %. The readings are multiples of 0.0123 um, which no model follows.",
                             text);
    diagnosis.finding[0] = diagnosis.finding[1];
    diagnosis.findings = 1;
    model_remove(&diagnosis.model, 1);
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_EQUAL_STRING("Explained by quantisation: the readings are multiples of 0.0123 um, which no model "
                             "follows. These steps are in the held-out error of 0.1 %; with them the noise is 0.1 %.",
                             text);
}

/* A term of a model that was given is no explanation, whatever the verdict is beside it. */
static void test_a_given_term_is_no_explanation(void) {
    char text[DIAGNOSIS_LINE];
    TEST_ASSERT_FALSE(verdict_caveat(&diagnosis, text));
    model_append(&diagnosis.given, &block_empirical_trend);
    TEST_ASSERT_TRUE(verdict_caveat(&diagnosis, text));
    TEST_ASSERT_EQUAL_STRING("The given chain has a term without a cause, empirical_trend: what that describes is not "
                             "explained.",
                             text);
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "is not explained. As far as it goes: Explained by resonance"), text);
    question->model_given = false;
    TEST_ASSERT_FALSE(verdict_caveat(&diagnosis, text));
}

int main(void) {
    rng = random_start("diagnose_verdict", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_too_few_reversals_are_told_first);
    RUN_TEST(test_an_operator_that_leaves_as_much_proves_nothing);
    RUN_TEST(test_what_rests_on_the_past_is_told_first);
    RUN_TEST(test_partly_beside_the_operator);
    RUN_TEST(test_steps_lower_no_error);
    RUN_TEST(test_a_given_term_is_no_explanation);
    return UNITY_END();
}
