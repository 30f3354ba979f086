/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The supply of the power stage, measured while it was recorded (header key stage_supply_v), against a drive that asks
 * for more: the search for a rail begins there, and the position decides. */
#include "diagnosis/diagnose.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <string.h>

/* What an amplifier records around a warning: 1.6 s of lines of 25 ms between levels on both sides of the middle. */
enum { SAMPLES = 5300, LINE = 83, PLAYS = 200 };
static const double rate_hz = 10000.0 / 3.0, noise_um = 0.01, middle_v = 75.0, most_v = 12.0;
static const double rail_v = 78.96; /* a third of the swing is above it */
static recording_t recording;
static model_t given;
static answer_t diagnosis;
static failure_t failure;
static random_t rng;

static void make_model(void) {
    double weights[PLAYS + 1] = {0.08}, thresholds[PLAYS];
    for (size_t i = 0; i < PLAYS; i++) {
        thresholds[i] = 14.0 * ((double)i + 0.5) / PLAYS;
        weights[i + 1] = 0.0012 * exp(-thresholds[i] / 5.0);
    }
    make_bank_model(&given, rate_hz, 40.0, PLAYS, weights, thresholds);
}

static void drive(void) {
    double *v = recording.column[COLUMN_DRIVE], from = middle_v;
    for (size_t i = 0, line = 0; i < SAMPLES; line++) {
        const double to = middle_v + (line % 2 == 0 ? 1.0 : -1.0) * most_v * (0.5 + 0.5 * random_unit(&rng));
        for (size_t k = 0; k < LINE && i < SAMPLES; k++, i++) {
            v[i] = from + (to - from) * (double)k / LINE;
        }
        from = to;
    }
}

void setUp(void) {
    rng = random_start("diagnose_supply", 2);
    make_model();
    recording_create(&recording, "warned.csv", rate_hz, SAMPLES);
    drive();
}

void tearDown(void) {
    answer_free(&diagnosis);
    model_free(&given);
    recording_free(&recording);
}

/* With a mode that the given model does not have. */
static void measure(bool rail) {
    model_t loaded, with;
    insert_block(&loaded, &given, &block_resonance, (double[]){250.0, 0.02});
    insert_block(&with, &loaded, &block_amplifier_saturation, (double[]){-1000.0, rail ? rail_v : 1000.0});
    simulate_into(&recording, &with, 1);
    model_free(&loaded);
    model_free(&with);
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_DISPLACEMENT][k] += noise_um * random_normal(&rng);
    }
}

static void look(const char *supply_v) {
    if (supply_v != NULL) {
        recording_set_key(&recording, STAGE_SUPPLY_KEY, supply_v);
    }
    answer_free(&diagnosis);
    TEST_ASSERT_TRUE_MESSAGE(diagnose(&given, &recording, 1, &diagnosis, &failure), failure.text);
}

static bool named(const char *block) {
    for (size_t f = 0; f < diagnosis.findings; f++) {
        const finding_t *finding = &diagnosis.finding[f];
        if (strcmp(finding->block->name, block) == 0) {
            return finding->certainty == NAMED;
        }
    }
    return false;
}

/* The mode and the rail, and nothing else. Without the key this recording is explained by hum. */
static void test_a_supply_that_sagged_is_named(void) {
    measure(true);
    look("78.963");
    TEST_ASSERT_EQUAL_UINT(2, diagnosis.findings);
    TEST_ASSERT_TRUE(named("resonance"));
    TEST_ASSERT_TRUE(named("amplifier_saturation"));
    const double found_v = model_parameter(model_find(&diagnosis.model, "amplifier_saturation"), "high_v")->value[0];
    printf("rail at %g V (%g)\n", found_v, rail_v);
    TEST_ASSERT_DOUBLE_WITHIN(0.001 * rail_v, rail_v, found_v); /* what a voltmeter in the rack says */
}

/* The drive is beyond what the sensor says of the supply, but the position goes on: the sensor is wrong. */
static void test_a_supply_alone_is_no_rail(void) {
    measure(false);
    look("78.963");
    TEST_ASSERT_EQUAL_UINT(1, diagnosis.findings);
    TEST_ASSERT_TRUE(named("resonance"));
}

/* A supply above the drive changes nothing, to the bit. */
static void test_a_supply_that_is_enough_says_nothing(void) {
    measure(true);
    look(NULL);
    const double left = diagnosis.held_out_percent;
    const size_t findings = diagnosis.findings;
    TEST_ASSERT_GREATER_THAN_UINT(0, findings);
    const block_t *first = diagnosis.finding[0].block;
    look("89.6");
    TEST_ASSERT_EQUAL_UINT(findings, diagnosis.findings);
    TEST_ASSERT_TRUE(first == diagnosis.finding[0].block);
    TEST_ASSERT_EQUAL_MEMORY(&left, &diagnosis.held_out_percent, sizeof left);
}

static void test_what_is_no_supply_is_refused(void) {
    static const char *const bad[] = {"", "full", "0", "-80", "nan", "inf", "80 V", "60:90"};
    measure(false);
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        recording_set_key(&recording, STAGE_SUPPLY_KEY, bad[i]);
        TEST_ASSERT_FALSE_MESSAGE(diagnose(&given, &recording, 1, &diagnosis, &failure), bad[i]);
        expect_line(&failure, "warned.csv: header key stage_supply_v");
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_supply_that_sagged_is_named);
    RUN_TEST(test_a_supply_alone_is_no_rail);
    RUN_TEST(test_a_supply_that_is_enough_says_nothing);
    RUN_TEST(test_what_is_no_supply_is_refused);
    return UNITY_END();
}
