/* SPDX-License-Identifier: GPL-3.0-or-later */
/* An effect of hundreds of times the noise is found, though every hysteresis that is fitted first takes a part of it:
 * rails that cut both ends off, and modes among the frequencies of the drive. */
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

static double number_of(const char *block, size_t parameter) {
    const model_block_t *found = model_find(&diagnosis.model, block);
    TEST_ASSERT_NOT_NULL_MESSAGE(found, block);
    printf("%s %s %g\n", block, found->block->parameter[parameter].name, found->parameter[parameter].value[0]);
    return found->parameter[parameter].value[0];
}

/* At the mode the delay is a third of a turn: either alone, beside a hysteresis, explains a part with numbers that hold
 * nowhere else. Both together are found as they are. */
static void test_a_sweep_through_a_mode_that_comes_late(void) {
    const double mode[] = {290.0, 0.02}, delay_s = 1.2e-3;
    const double pi = acos(-1.0), from_hz = 2.0, octaves = log(180.0), duration_s = SAMPLES / rate_hz;
    for (size_t k = 0; k < SAMPLES; k++) {
        const double part = (double)k / SAMPLES;
        recording.column[COLUMN_DRIVE][k] =
            50.0 - 20.0 * cos(2.0 * pi * from_hz * duration_s * (exp(octaves * part) - 1.0) / octaves);
    }
    model_t late;
    insert_block(&late, &truth, &block_transport_delay, &delay_s);
    measure_with(&recording, &late, &block_resonance, mode, noise_um, &rng);
    model_free(&late);
    TEST_ASSERT_TRUE_MESSAGE(diagnose(NULL, &recording, 1, &diagnosis, &failure), failure.text);
    TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
    TEST_ASSERT_EQUAL_UINT(2, diagnosis.findings);
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * mode[0], mode[0], number_of("resonance", 0));
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * delay_s, delay_s, number_of("transport_delay", 0));
}

/* Readings of the limit, the bank, a bend of the whole hysteresis, and the mode behind that. */
static void ring_behind_bend(const double *limit, const double *mode) {
    static const double weight[1] = {1.0};
    double *position = recording.column[COLUMN_DISPLACEMENT], range[2];
    model_t limited, whole, ringing;
    recording_t bent;
    insert_block(&limited, &truth, &block_amplifier_slew_limit, limit);
    simulate_into(&recording, &limited, 1);
    values_range(position, SAMPLES, range);
    recording_copy(&bent, &recording, 0, SAMPLES);
    bent.held = false;
    for (size_t k = 0; k < SAMPLES; k++) {
        const double part = 2.0 * (position[k] - range[0]) / (range[1] - range[0]) - 1.0;
        bent.column[COLUMN_DRIVE][k] = 7.0 * tanh(0.9 * part + 0.1);
    }
    make_bank_model(&whole, rate_hz, 0.0, 0, weight, NULL);
    insert_block(&ringing, &whole, &block_resonance, mode);
    simulate_into(&bent, &ringing, 1);
    for (size_t k = 0; k < SAMPLES; k++) {
        position[k] = bent.column[COLUMN_DISPLACEMENT][k] + noise_um * random_normal(&rng);
    }
    recording_free(&bent);
    model_free(&limited);
    model_free(&whole);
    model_free(&ringing);
}

/* Triangles, then steps with rests, held. Towards what is held the voltage goes at the limit: taken for a ramp the
 * drive was ahead of it, and no mode was right. The bend is the hysteresis' own, and no finding. */
static void test_steps_through_a_limit_and_a_mode_of_bent_loops(void) {
    enum { LINE = 800, LINES = 8, HOLD = 600 };
    static const double corner[] = {50.0, 95.0, 5.0, 80.0, 20.0};
    const double limit[] = {28000.0}, mode[] = {310.0, 0.02};
    double *drive = recording.column[COLUMN_DRIVE];
    fill_lines(drive, SAMPLES, corner, sizeof corner / sizeof corner[0], LINE);
    for (size_t k = LINE * LINES; k < SAMPLES; k++) {
        drive[k] = k % HOLD == 0 ? 10.0 + 80.0 * random_unit(&rng) : drive[k - 1];
    }
    recording.held = true;
    ring_behind_bend(limit, mode);
    TEST_ASSERT_TRUE_MESSAGE(diagnose(NULL, &recording, 1, &diagnosis, &failure), failure.text);
    for (size_t f = 0; f < diagnosis.findings; f++) {
        printf("%s, certainty %d\n", diagnosis.finding[f].block->name, (int)diagnosis.finding[f].certainty);
    }
    printf("held out %g -> %g, noise %g\n", diagnosis.baseline_held_out_percent, diagnosis.held_out_percent,
           diagnosis.noise_percent);
    TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
    TEST_ASSERT_EQUAL_UINT(2, diagnosis.findings);
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * mode[0], mode[0], number_of("resonance", 0));
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * limit[0], limit[0], number_of("amplifier_slew_limit", 0));
}

/* Tones that come again every two seconds never rest, and no block that is looked for first comes near two modes: what
 * a rich model leaves is a thousand times the noise, and then counted as noise. Passes differ by the noise alone. */
static void test_two_modes_in_tones_that_repeat(void) {
    enum { PERIOD = SAMPLES / 4, TONES = 60 };
    const double modes[] = {60.0, 0.02, 85.0, 0.02, 0.3};
    const probe_passes_t passes = {.from = 0, .to = SAMPLES, .period = PERIOD};
    const probe_seen_t seen = {.passes = &passes};
    double *drive = recording.column[COLUMN_DRIVE], phase[TONES], range[2];
    for (size_t i = 0; i < TONES; i++) {
        phase[i] = 2.0 * acos(-1.0) * random_unit(&rng);
    }
    for (size_t k = 0; k < SAMPLES; k++) {
        drive[k] = 0.0;
        for (size_t i = 0; i < TONES; i++) {
            const double turns = (double)((1 + 2 * i) * (k % PERIOD)) / PERIOD;
            drive[k] += cos(2.0 * acos(-1.0) * turns + phase[i]) / (1.0 + 0.1 * (double)i);
        }
    }
    values_range(drive, SAMPLES, range);
    for (size_t k = 0; k < SAMPLES; k++) {
        drive[k] = 5.0 + 90.0 * (drive[k] - range[0]) / (range[1] - range[0]);
    }
    measure_with(&recording, &truth, &block_two_modes, modes, noise_um, &rng);
    TEST_ASSERT_TRUE_MESSAGE(diagnose_seen(NULL, &seen, &recording, 1, &diagnosis, &failure), failure.text);
    TEST_ASSERT_EQUAL_INT(EXPLAINED, diagnosis.verdict);
    TEST_ASSERT_EQUAL_UINT(1, diagnosis.findings);
    for (size_t p = 0; p < block_two_modes.parameters; p++) {
        TEST_ASSERT_DOUBLE_WITHIN(0.05 * modes[p], modes[p], number_of("two_modes", p));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_rails_on_both_sides);
    RUN_TEST(test_a_mode_inside_the_band);
    RUN_TEST(test_a_sweep_through_a_mode_that_comes_late);
    RUN_TEST(test_steps_through_a_limit_and_a_mode_of_bent_loops);
    RUN_TEST(test_two_modes_in_tones_that_repeat);
    return UNITY_END();
}
