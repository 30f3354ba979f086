/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Readings that a simulation wrote, without noise: a few plays that no fitted shape has exactly are no unknown physics,
 * and a mode behind them is found. */
#include "chain/align.h"
#include "interface/diagnosis_run.h"
#include "interface/noiseless.h"
#include "report/diagnosis_text.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <string.h>

enum { SAMPLES = 12000, PLAYS = 8 };
static const double rate_hz = 2000.0;
static recording_t recording;
static model_t plays;
static failure_t failure;
static diagnosis_run_t run;

void setUp(void) {
    static const double weight[PLAYS + 1] = {0.12, 0.01, 0.012, 0.008, 0.01, 0.007, 0.006, 0.004, 0.003};
    static const double threshold_v[PLAYS] = {1.3, 3.1, 6.7, 11.0, 17.3, 25.9, 33.0, 41.0};
    recording_create(&recording, "simulated.csv", rate_hz, SAMPLES);
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz;
        recording.column[COLUMN_DRIVE][k] = 50.0 - 30.0 * cos(2.0 * M_PI * t) - 15.0 * sin(10.0 * M_PI * t);
    }
    make_bank_model(&plays, rate_hz, 0.0, PLAYS, weight, threshold_v);
    run = (diagnosis_run_t){0};
}

void tearDown(void) {
    diagnosis_run_free(&run);
    model_free(&plays);
    recording_free(&recording);
}

static void diagnose_it(void) {
    char text[DIAGNOSIS_LINE];
    TEST_ASSERT_TRUE_MESSAGE(recording_align(&recording, &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(diagnosis_run(NULL, &recording, 1, 0, &run, &failure), failure.text);
    (void)verdict_caveat(&run.answer, text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "The readings have no noise, as those of a simulation"), text);
}

static void test_a_few_plays_are_no_physics(void) {
    simulate_into(&recording, &plays, 1);
    diagnose_it();
    TEST_ASSERT_EQUAL_INT(NOTHING_MISSING, run.answer.verdict);
    TEST_ASSERT_EQUAL_UINT(0, run.answer.findings);
}

static void test_a_mode_is_found(void) {
    const double mode[] = {150.0, 0.03};
    random_t unused = random_start("diagnose_noiseless", 1);
    measure_with(&recording, &plays, &block_resonance, mode, 0.0, &unused);
    diagnose_it();
    TEST_ASSERT_EQUAL_INT(EXPLAINED, run.answer.verdict);
    const model_block_t *found = model_find(&run.answer.model, "resonance");
    TEST_ASSERT_NOT_NULL(found);
    const parameter_t *frequency = &found->parameter[0], *damping = &found->parameter[1];
    printf("frequency %g +- %g, damping %g +- %g\n", frequency->value[0], frequency->sigma[0], damping->value[0],
           damping->sigma[0]);
    /* The drive has nothing above 5 Hz. There the damping is a lag of 0.002 rad, of which the bank's
     * misfit makes more than its standard error: by which blocks are held out it came out as 0.023 to 0.045. */
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * mode[0], mode[0], frequency->value[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.6 * mode[1], mode[1], damping->value[0]);
}

/* Whose noise is little, whose steps are coarser than it, and that do not move at all. */
static void test_readings_of_a_sensor_stay(void) {
    static const double noise[] = {1e-5, 0.0, 0.0}, step[] = {0.0, 1e-3, 0.0}, gain[] = {1.0, 1.0, 0.0};
    random_t rng = random_start("diagnose_noiseless", 20261130);
    TEST_ASSERT_TRUE_MESSAGE(recording_align(&recording, &failure), failure.text);
    for (size_t i = 0; i < 3; i++) {
        double *y = recording.column[COLUMN_DISPLACEMENT], *before = allocate(SAMPLES, sizeof *before);
        simulate_into(&recording, &plays, 1);
        for (size_t k = 0; k < SAMPLES; k++) {
            y[k] = gain[i] * y[k] + noise[i] * 16.0 * random_normal(&rng);
            y[k] = step[i] > 0.0 ? step[i] * round(y[k] / step[i]) : y[k];
        }
        memcpy(before, y, SAMPLES * sizeof *y);
        look_t *looks = looks_at(&recording, 1, &failure);
        TEST_ASSERT_NOT_NULL_MESSAGE(looks, failure.text);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, noiseless_add(&recording, looks, 1));
        TEST_ASSERT_EQUAL_MEMORY(before, y, SAMPLES * sizeof *y);
        looks_free(looks, 1);
        free(before);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_few_plays_are_no_physics);
    RUN_TEST(test_a_mode_is_found);
    RUN_TEST(test_readings_of_a_sensor_stay);
    return UNITY_END();
}
