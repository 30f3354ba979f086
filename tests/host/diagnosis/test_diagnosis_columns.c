/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the model leaves, against temperature, voltage and current, from an actuator that shares no formula with it. */
#include "diagnosis/question/baseline.h"
#include "measured_actuator.h"
#include "report/measured_columns_text.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 8000, SEEDS = 24 };
static const double noise_um = 0.005;
static random_t rng;
static recording_t recording;
static model_t bank; /* fitted to the actuator alone */
static question_t *question;
static answer_t diagnosis;
static measured_columns_t measured;
static failure_t failure;

void setUp(void) {
}

void tearDown(void) {
    answer_free(&diagnosis);
    recording_free(&recording);
}

static void fit_bank(void) {
    const actuator_t actuator = {.samples = SAMPLES, .noise_um = noise_um};
    baseline_t baseline, rough;
    measure_actuator(&actuator, "alone.csv", &rng, &recording);
    TEST_ASSERT_TRUE_MESSAGE(baseline_bank(&recording, 1, &baseline, &rough, &failure), failure.text);
    model_copy(&bank, &baseline.model);
    baseline_free(&baseline, 1);
    baseline_free(&rough, 1);
}

/* A diagnosis that has found nothing. */
static void measure(actuator_t actuator) {
    tearDown();
    actuator.samples = SAMPLES;
    actuator.noise_um = noise_um;
    measure_actuator(&actuator, "actuator.csv", &rng, &recording);
    question = question_open(false, NULL);
    diagnosis = (answer_t){.question = question};
    model_copy(&diagnosis.given, &bank);
    model_copy(&diagnosis.baseline, &bank);
    model_copy(&diagnosis.model, &bank);
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&question->samples, &bank, &recording, 1, &failure), failure.text);
    question->noise = (noise_t){.sigma_um = noise_um, .rms_um = noise_um, .at_rest = true};
}

/* Now it has found this block with these numbers. */
static void found(const block_t *block, const double *value) {
    model_free(&diagnosis.model);
    insert_block(&diagnosis.model, &bank, block, value);
    diagnosis.findings = 1;
    diagnosis.finding[0] = (finding_t){.block = block, .certainty = NAMED, .margin = 40.0, .support = 60.0};
}

static void look(void) {
    TEST_ASSERT_TRUE_MESSAGE(measured_columns(&diagnosis, &measured, &failure), failure.text);
    for (size_t c = 0; c < measured.count; c++) {
        char text[DIAGNOSIS_LINE];
        measured_column_text(&diagnosis, &measured.column[c], text);
        printf("%s\n", text);
    }
}

static void expect_text(const char *part) {
    char text[DIAGNOSIS_LINE];
    measured_column_text(&diagnosis, &measured.column[0], text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, part), text);
}

static void test_no_column_no_word(void) {
    measure((actuator_t){.amplifier_hz = 150.0});
    found(&block_amplifier_bandwidth, (const double[BLOCK_MAX_PARAMETERS]){150.0});
    look();
    TEST_ASSERT_EQUAL_UINT64(0, measured.count);
    TEST_ASSERT_NULL(finding_columns_to_json(&measured.finding[0]));
    char text[DIAGNOSIS_LINE];
    TEST_ASSERT_FALSE(finding_columns_text(&diagnosis.finding[0], &measured.finding[0], text));
}

/* Of 24 diagnoses with three columns that say nothing, 0.24 may say something; 3 come once in 500 tests. A drift that
 * no model has, beside a temperature that moves by itself, may at most be taken for something slow. */
static void expect_silence(double drift_um, relation_t most) {
    int alarms = 0;
    for (int seed = 0; seed < SEEDS; seed++) {
        measure((actuator_t){.climate = seed % 2 == 0 ? WANDERING_TEMPERATURE : CYCLING_TEMPERATURE,
                             .drift_um = drift_um,
                             .voltage = true,
                             .current = true,
                             .temperature = true});
        TEST_ASSERT_TRUE_MESSAGE(measured_columns(&diagnosis, &measured, &failure), failure.text);
        TEST_ASSERT_EQUAL_UINT64(3, measured.count);
        for (size_t c = 0; c < measured.count; c++) {
            alarms += measured.column[c].before.relation > most ? 1 : 0;
        }
    }
    printf("%d of %d\n", alarms, SEEDS);
    TEST_ASSERT_LESS_THAN_INT(3, alarms);
}

static void test_columns_that_say_nothing_are_silent(void) {
    expect_silence(0.0, GOES_WITH_NOTHING);
}

static void test_another_drift_is_not_the_temperature(void) {
    expect_silence(0.1, LOOKS_LIKE_IT);
}

/* Noise of first order, whitened by its filter. */
static void test_coloured_noise_is_no_relation(void) {
    const double memory = 0.95, own = sqrt(1.0 - memory * memory);
    int alarms = 0;
    for (int seed = 0; seed < SEEDS; seed++) {
        measure((actuator_t){.climate = WANDERING_TEMPERATURE, .temperature = true});
        double n = random_normal(&rng);
        for (size_t k = 0; k < SAMPLES; k++) {
            recording.column[COLUMN_DISPLACEMENT][k] += 4.0 * noise_um * n;
            n = memory * n + own * random_normal(&rng);
        }
        TEST_ASSERT_TRUE(noise_at_rest(&question->samples, NULL, NULL, 0, &question->noise));
        TEST_ASSERT_TRUE(measured_columns(&diagnosis, &measured, &failure));
        alarms += measured.column[0].before.relation == GOES_WITH_IT ? 1 : 0;
    }
    printf("%d of %d\n", alarms, SEEDS);
    TEST_ASSERT_LESS_THAN_INT(3, alarms);
}

static void test_what_follows_the_thermometer_goes_with_it(void) {
    measure((actuator_t){.climate = CYCLING_TEMPERATURE, .um_per_kelvin = 0.05, .temperature = true});
    look();
    const column_relation_t *relation = &measured.column[0].before;
    TEST_ASSERT_EQUAL_INT(GOES_WITH_IT, relation->relation);
    TEST_ASSERT_DOUBLE_WITHIN(4.0 * relation->sigma, 0.05, relation->coefficient);
    TEST_ASSERT_TRUE(relation->sigma < 0.1 * 0.05 && relation->lag_s == 0.0);
    TEST_ASSERT_TRUE(relation->share > 0.5); /* 0.93 by the sizes, less what 190 nuisance columns take of a slow tone */
    TEST_ASSERT_TRUE(relation->least < 0.05);
    expect_text("What the model leaves goes with the temperature: 0.0");
}

/* The time constant is found by golden section, to 5 %. */
static void test_the_actuator_may_be_late(void) {
    measure((actuator_t){
        .climate = CYCLING_TEMPERATURE, .um_per_kelvin = 0.3, .actuator_warms_s = 0.2, .temperature = true});
    look();
    const column_relation_t *relation = &measured.column[0].before;
    TEST_ASSERT_EQUAL_INT(GOES_WITH_IT, relation->relation);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.2, relation->lag_s);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.3, relation->coefficient);
    expect_text("behind it by a lag of about 0.");
}

static void test_a_thermometer_that_only_drifts_is_not_oversold(void) {
    measure((actuator_t){.climate = WARMING_UP, .um_per_kelvin = 0.05, .temperature = true});
    look();
    TEST_ASSERT_EQUAL_INT(LOOKS_LIKE_IT, measured.column[0].before.relation);
    expect_text("cannot be distinguished from any other slow drift");
}

/* Wherever the disturbance comes from, it is in the measured voltage. */
static void test_the_position_follows_the_measured_voltage(void) {
    measure((actuator_t){.ripple_v = 0.4, .voltage = true});
    look();
    const column_relation_t *relation = &measured.column[0].before;
    TEST_ASSERT_EQUAL_INT(GOES_WITH_IT, relation->relation);
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 1.0, relation->coefficient);
    expect_text("Something is missing in the amplifier");
    measure((actuator_t){.sensor_hz = 150.0, .monitor_hz = 1000.0, .voltage = true}); /* both lag, not for one reason */
    look();
    TEST_ASSERT_EQUAL_INT(GOES_WITH_NOTHING, measured.column[0].before.relation);
}

static void expect_side(const block_t *block, bool contradicted, const char *part) {
    char text[DIAGNOSIS_LINE];
    found(block, (const double[BLOCK_MAX_PARAMETERS]){150.0});
    look();
    TEST_ASSERT_TRUE(finding_columns_text(&diagnosis.finding[0], &measured.finding[0], text));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, part), text);
    TEST_ASSERT_EQUAL_INT(contradicted, finding_contradicted(&diagnosis.finding[0], &measured.finding[0]));
}

static void test_a_lag_is_told_on_its_side(void) {
    measure((actuator_t){.amplifier_hz = 150.0, .voltage = true});
    expect_side(&block_amplifier_bandwidth, false, "it is in the amplifier");
    TEST_ASSERT_EQUAL_INT(GOES_WITH_IT, measured.column[0].before.relation);
    TEST_ASSERT_EQUAL_INT(GOES_WITH_NOTHING, measured.column[0].after.relation);
    expect_text("With what was found, nothing of that remains.");
    expect_side(&block_sensor_bandwidth, false, "the amplifier lags as well");
    measure((actuator_t){.sensor_hz = 150.0, .voltage = true});
    expect_side(&block_sensor_bandwidth, false, "it is behind the amplifier");
    expect_side(&block_amplifier_bandwidth, true, "it is behind the amplifier");
}

/* A wandering temperature has a steady share: a drift of the gain explains some of that. */
static void test_what_the_temperature_explains_is_no_drift_of_the_gain(void) {
    char text[DIAGNOSIS_LINE];
    measure((actuator_t){.climate = CYCLING_TEMPERATURE, .um_per_kelvin = 0.05, .temperature = true});
    found(&block_gain_drift, (const double[BLOCK_MAX_PARAMETERS]){0.0});
    for (size_t k = 0; k < SAMPLES; k++) { /* a steady part */
        recording.column[COLUMN_TEMPERATURE][k] += 0.3 * (double)k / SAMPLES;
        recording.column[COLUMN_DISPLACEMENT][k] += 0.05 * 0.3 * (double)k / SAMPLES;
    }
    model_set(&diagnosis.model.block[1], "gain_per_s", 0.0008);
    look();
    TEST_ASSERT_TRUE(finding_columns_text(&diagnosis.finding[0], &measured.finding[0], text));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "this block only looks like what the temperature does"), text);
    TEST_ASSERT_TRUE(finding_contradicted(&diagnosis.finding[0], &measured.finding[0]));
    /* and one that there is stands beside it */
    double *displacement = recording.column[COLUMN_DISPLACEMENT];
    for (size_t k = 0; k < SAMPLES; k++) {
        displacement[k] += 0.005 * (double)k / 2000.0 * displacement[k];
    }
    model_set(&diagnosis.model.block[1], "gain_per_s", 0.005);
    look();
    TEST_ASSERT_EQUAL_INT(CHANGE_PRESENT, electrical_verdict(&measured.finding[0].beside_temperature));
    TEST_ASSERT_FALSE(finding_contradicted(&diagnosis.finding[0], &measured.finding[0]));
}

static void test_a_thermometer_that_stands_still_says_so(void) {
    measure((actuator_t){.temperature = true});
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_TEMPERATURE][k] = 25.0;
    }
    look();
    expect_text("The temperature says nothing here");
    json_t *json = measured_columns_to_json(&measured);
    const json_t *before = json_object_get(json_array_get(json, 0), "before");
    TEST_ASSERT_EQUAL_STRING("none", json_string_value(json_object_get(before, "relation")));
    TEST_ASSERT_TRUE(json_is_null(json_object_get(before, "least")));
    json_decref(json);
}

int main(void) {
    rng = random_start("diagnosis_columns", 20261121);
    UNITY_BEGIN();
    fit_bank();
    RUN_TEST(test_no_column_no_word);
    RUN_TEST(test_columns_that_say_nothing_are_silent);
    RUN_TEST(test_another_drift_is_not_the_temperature);
    RUN_TEST(test_coloured_noise_is_no_relation);
    RUN_TEST(test_what_follows_the_thermometer_goes_with_it);
    RUN_TEST(test_the_actuator_may_be_late);
    RUN_TEST(test_a_thermometer_that_only_drifts_is_not_oversold);
    RUN_TEST(test_the_position_follows_the_measured_voltage);
    RUN_TEST(test_a_lag_is_told_on_its_side);
    RUN_TEST(test_what_the_temperature_explains_is_no_drift_of_the_gain);
    RUN_TEST(test_a_thermometer_that_stands_still_says_so);
    model_free(&bank);
    return UNITY_END();
}
