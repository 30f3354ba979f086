/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Each block's own probe is worth playing: a twin with that effect at an ordinary size, a model without it, and
 * diagnose names the block from the one recording. The loop is left out, so that it takes a second a block: codes of 16
 * bits at 10 kHz, every n-th pair is a frame.
 */
#include "amplifier/probe_plan.h"
#include "bench/twin.h"
#include "chain/catalogue.h"
#include "diagnosis/diagnose.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>

static const double rate_hz = 10000.0;
static const double weights[] = {0.6, 0.1, 0.08, 0.07, 0.06, 0.05}, thresholds_v[] = {2.0, 5.0, 10.0, 18.0, 30.0};
static failure_t failure;

void setUp(void) {
}
void tearDown(void) {
}

typedef struct {
    const char *name;
    double value;
} number_t;

typedef struct {
    const char *block;
    number_t number[3];
    size_t judged; /* which number is looked at, and to which part of itself it has to be right */
    double tolerance;
    unsigned long decimation; /* what a line of 115200 baud allows (test_probe.c prints some) */
} effect_t;

static void make_truth(const effect_t *effect, model_t *truth) {
    const block_t *block = catalogue_find(effect->block);
    make_bank_model(truth, rate_hz, 1.0, 5, weights, thresholds_v);
    model_block_t *added = model_append(truth, block);
    for (size_t i = 0; i < 3 && effect->number[i].name != NULL; i++) {
        model_set(added, effect->number[i].name, effect->number[i].value);
    }
    if (block->place < PLACE_HYSTERESIS || block->modifies_hysteresis) {
        const model_block_t hysteresis = truth->block[0];
        truth->block[0] = truth->block[1];
        truth->block[1] = hysteresis;
    }
    TEST_ASSERT_TRUE_MESSAGE(model_check(truth, effect->block, &failure), failure.text);
}

static double unit_of_code(uint16_t code) {
    return ((double)code - 32768.0) / 65536.0 * 100.0;
}

/* The plan, played to the twin of a range of +-50 V and +-50 um. */
static void play(twin_t *twin, const probe_plan_t *plan, recording_t *recording) {
    const unsigned long decimation = plan->limits.decimation;
    double from = plan->start_v;
    size_t sample = 0;
    recording_create(recording, "probe", rate_hz / (double)decimation, (size_t)(plan->samples - 1.0) / decimation + 1);
    for (size_t c = 0; c < plan->corners; c++) {
        const breakpoint_t *corner = &plan->corner[c];
        for (uint32_t i = 1; i <= corner->samples; i++, sample++) {
            const double level = from + (corner->level - from) * i / corner->samples;
            const uint16_t code = (uint16_t)lround(level / 100.0 * 65536.0 + 32768.0);
            twin_step(twin, code);
            if (sample % decimation == 0) {
                recording->column[COLUMN_DRIVE][sample / decimation] = unit_of_code(code);
                recording->column[COLUMN_DISPLACEMENT][sample / decimation] = unit_of_code(twin_position_code(twin));
            }
        }
        from = corner->level;
    }
}

static void expect_named(const effect_t *effect) {
    static probe_plan_t plan;
    const twin_options_t options = {.sample_rate_hz = rate_hz,
                                    .substeps = 4,
                                    .drive_range_v = {-50.0, 50.0},
                                    .position_range_um = {-50.0, 50.0},
                                    .noise_um = 0.02,
                                    .seed = 3};
    const probe_limits_t limits = {
        .range_v = {-50.0, 49.99}, .slew_v_per_s = 5000.0, .sample_rate_hz = rate_hz, .decimation = effect->decimation};
    model_t truth, baseline;
    recording_t recording;
    answer_t diagnosis;
    make_truth(effect, &truth);
    twin_t *twin = twin_open(&truth, &options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(twin, failure.text);
    probe_plan_make(&plan, probe_parts(effect->block, &failure), &limits);
    play(twin, &plan, &recording);
    make_bank_model(&baseline, recording.sample_rate_hz, 1.0, 5, weights, thresholds_v);
    TEST_ASSERT_TRUE_MESSAGE(diagnose(&baseline, &recording, 1, &diagnosis, &failure), failure.text);
    TEST_ASSERT_GREATER_THAN_UINT_MESSAGE(0, diagnosis.findings, effect->block);
    TEST_ASSERT_EQUAL_STRING(effect->block, diagnosis.finding[0].block->name);
    /* By its name, or as one of its group: a delay and a loss have rivals beside a hysteresis of any shape. */
    TEST_ASSERT_TRUE_MESSAGE(diagnosis.finding[0].certainty >= ISOLATED, effect->block);
    const number_t *number = &effect->number[effect->judged];
    const double found = model_parameter(model_find(&diagnosis.model, effect->block), number->name)->value[0];
    printf("%s: %s = %.4g, in truth %.4g, %zu findings\n", effect->block, number->name, found, number->value,
           diagnosis.findings);
    TEST_ASSERT_DOUBLE_WITHIN(effect->tolerance * fabs(number->value), number->value, found);
    answer_free(&diagnosis);
    recording_free(&recording);
    model_free(&baseline);
    model_free(&truth);
    twin_close(twin);
}

/* A twin holds the drive for a sample, diagnose draws lines between frames: half a sample, 50 us, is 9 % of the time
 * constant of 300 Hz. */
static const effect_t electronics[] = {{"transport_delay", {{"delay_s", 300e-6}}, 0, 0.05, 6},
                                       {"amplifier_bandwidth", {{"cutoff_hz", 300.0}}, 0, 0.1, 6},
                                       {"amplifier_slew_limit", {{"limit_v_per_s", 2000.0}}, 0, 0.02, 7},
                                       {"amplifier_saturation", {{"low_v", -60.0}, {"high_v", 47.0}}, 1, 0.01, 4}};

static const effect_t hysteresis[] = {
    {"asymmetric_hysteresis", {{"asymmetry", 0.03}, {"center_v", 0.0}, {"half_range_v", 50.0}}, 0, 0.1, 5},
    {"rate_dependent_hysteresis", {{"beta_s", 0.0005}, {"rate_filter_s", 0.002}}, 0, 0.05, 7}};

static const effect_t slow[] = {
    {"creep", {{"gamma_per_decade", 0.012}}, 0, 0.05, 9},
    {"dielectric_loss", {{"loss_tangent", 0.005}}, 0, 0.05, 9},
    {"charge_leakage", {{"time_constant_s", 300.0}}, 0, 0.05, 9},
    {"gain_drift", {{"gain_per_s", 0.0003}}, 0, 0.05, 9},
    {"self_heating", {{"gain_per_hz", 0.001}, {"time_constant_s", 5.0}, {"half_range_v", 50.0}}, 0, 0.1, 9},
    {"thermal_drift", {{"drift_um", 0.5}, {"time_constant_s", 10.0}}, 0, 0.1, 9}};

static const effect_t mechanics_and_sensor[] = {
    {"resonance", {{"frequency_hz", 260.0}, {"damping_ratio", 0.03}}, 0, 0.01, 6},
    {"sensor_bandwidth", {{"cutoff_hz", 300.0}}, 0, 0.1, 6},
    {"static_nonlinearity", {{"quadratic", 0.01}, {"center_um", 0.0}, {"half_range_um", 45.0}}, 0, 0.1, 5},
    {"mains_interference", {{"frequency_hz", 50.0}, {"amplitude_um", 0.03}}, 1, 0.1, 5}};

static void expect_all_named(const effect_t *effects, size_t count) {
    for (size_t i = 0; i < count; i++) {
        expect_named(&effects[i]);
    }
}

static void test_effects_of_the_electronics(void) {
    expect_all_named(electronics, sizeof electronics / sizeof electronics[0]);
}

static void test_effects_in_the_hysteresis(void) {
    expect_all_named(hysteresis, sizeof hysteresis / sizeof hysteresis[0]);
}

static void test_slow_effects(void) {
    expect_all_named(slow, sizeof slow / sizeof slow[0]);
}

static void test_effects_of_mechanics_and_sensor(void) {
    expect_all_named(mechanics_and_sensor, sizeof mechanics_and_sensor / sizeof mechanics_and_sensor[0]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_effects_of_the_electronics);
    RUN_TEST(test_effects_in_the_hysteresis);
    RUN_TEST(test_slow_effects);
    RUN_TEST(test_effects_of_mechanics_and_sensor);
    return UNITY_END();
}
