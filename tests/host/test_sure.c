/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Recordings like a given one, simulated and diagnosed again: what is counted, and by what it is decided.
 */
#include "interface/sure.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 2400, OPERATORS = 4, EACH = 1 };
static const double rate_hz = 1000.0, noise_um = 0.01;
static recording_t recording;
static model_t bank;
static diagnosis_run_t run;
static failure_t failure;
static random_t rng;

void setUp(void) {
    static const double corner[] = {0, 100, -100, 60, -20, 100, -100, 100, 20, 100, -100, 50, 0, 100, -100, 80};
    static const double weights[] = {0.09, 0.01, 0.008, 0.006, 0.004}, thresholds[] = {5, 10, 20, 40};
    recording_create(&recording, "sure.csv", rate_hz, SAMPLES);
    double *drive = recording.column[COLUMN_DRIVE]; /* at two speeds, so that a lag is no shape of the loops */
    fill_lines(drive, SAMPLES / 2, corner, sizeof corner / sizeof corner[0], 75);
    fill_lines(drive + SAMPLES / 2, SAMPLES / 2, corner, sizeof corner / sizeof corner[0], 20);
    make_bank_model(&bank, rate_hz, 1.0, OPERATORS, weights, thresholds);
    rng = random_start("sure", 20261123);
}

void tearDown(void) {
    diagnosis_run_free(&run);
    model_free(&bank);
    recording_free(&recording);
}

static void record(const model_t *model) {
    simulate_into(&recording, model, 1);
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_DISPLACEMENT][k] += noise_um * random_normal(&rng);
    }
    TEST_ASSERT_TRUE_MESSAGE(diagnosis_run(&bank, &recording, 1, 0, &run, &failure), failure.text);
}

static void ask(unsigned long seed) {
    sure_work_t work;
    sure_prepare(&run, EACH, seed, 0.5, &work);
    TEST_ASSERT_EQUAL_DOUBLE(0.5 * EACH * (double)work.worlds, work.seconds);
    TEST_ASSERT_TRUE_MESSAGE(sure_ask(&work, &bank, &recording, 1, &run, &failure), failure.text);
    sure_print(stdout, &run.sure);
}

/* Each simulated recording has one answer to each question about it. */
static void expect_all_counted(void) {
    for (size_t q = 0; q < run.sure.count; q++) {
        const sure_question_t *question = &run.sure.question[q];
        size_t all = question->right + question->open + question->nothing;
        for (size_t i = 0; i < question->others; i++) {
            all += question->other[i].count;
        }
        TEST_ASSERT_EQUAL_UINT64(EACH, all);
    }
}

/* Effects of three times their limit are seen, those of a third are not: the limit is where half of them are. */
static void test_where_nothing_is_missing_the_limits_are_asked(void) {
    record(&bank);
    TEST_ASSERT_EQUAL_INT(NOTHING_MISSING, run.answer.verdict);
    ask(7);
    expect_all_counted();
    TEST_ASSERT_GREATER_THAN(2, run.sure.count);
    TEST_ASSERT_NULL(run.sure.question[0].hidden);
    TEST_ASSERT_EQUAL_UINT64(EACH, run.sure.question[0].right);
    size_t seen[2] = {0};
    for (size_t q = 1; q < run.sure.count; q++) {
        const sure_question_t *question = &run.sure.question[q];
        seen[question->limits > 1.0 ? 1 : 0] += question->right + question->open;
    }
    TEST_ASSERT_TRUE(seen[1] > seen[0]);
}

static void test_what_was_found_and_what_it_could_be_are_asked(void) {
    model_t with;
    const sure_t *sure = &run.sure;
    insert_block(&with, &bank, &block_sensor_bandwidth, (double[]){150.0});
    record(&with);
    model_free(&with);
    TEST_ASSERT_EQUAL_UINT64(1, run.answer.findings);
    ask(7);
    expect_all_counted();
    TEST_ASSERT_GREATER_THAN(1, sure->count);
    TEST_ASSERT_EQUAL_PTR(run.answer.finding[0].block, sure->question[0].hidden);
    TEST_ASSERT_EQUAL_UINT64(EACH, sure->question[0].right + sure->question[0].open);
    TEST_ASSERT_TRUE(sure->question[1].hidden != sure->question[0].hidden);
    TEST_ASSERT_EQUAL_PTR(sure->question[0].hidden, sure->question[1].in_place_of);
    const sure_t first = *sure;
    ask(7); /* the same seed, the same counts */
    TEST_ASSERT_EQUAL_MEMORY(&first.question, &sure->question, sizeof first.question);
    json_t *json = diagnosis_run_to_json(&run, &recording, 1);
    const json_t *told = json_object_get(json, "sure");
    TEST_ASSERT_EQUAL_INT(7, json_integer_value(json_object_get(told, "seed")));
    TEST_ASSERT_EQUAL_UINT64(sure->count, json_array_size(json_object_get(told, "questions")));
    json_decref(json);
}

/* So many that it ends in the time that the user reads, of which a slow diagnosis leaves the least number. */
static void test_the_number_follows_the_time(void) {
    sure_work_t work;
    record(&bank);
    const double took_s[] = {0.01, 0.1, 1.0, 10.0, 100.0};
    for (size_t i = 0; i < sizeof took_s / sizeof took_s[0]; i++) {
        sure_prepare(&run, 0, 1, took_s[i], &work);
        TEST_ASSERT_TRUE(work.sure.each >= SURE_LEAST && work.sure.each <= SURE_MOST);
        TEST_ASSERT_TRUE(work.sure.each == SURE_LEAST || work.seconds <= SURE_DEFAULT_S);
        sure_forget(&work);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_where_nothing_is_missing_the_limits_are_asked);
    RUN_TEST(test_what_was_found_and_what_it_could_be_are_asked);
    RUN_TEST(test_the_number_follows_the_time);
    return UNITY_END();
}
