/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A lead that only the likelihood of the readings speaks for is none, where physics makes them as likely. */
#include "interface/diagnosis_run.h"
#include "interface/faults_undone.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>

enum { SAMPLES = 20000, FINER = 6 };
static const double rate_hz = 20000.0, drive_hz = 21.0, noise_um = 0.026; /* 0.1 % of the stroke */
static random_t rng;
static recording_t recording;
static diagnosis_run_t run;
static failure_t failure;

void setUp(void) {
    rng = random_start("faults_suspected", 20261130U);
    recording_create(&recording, "suspected.csv", rate_hz, SAMPLES);
}

void tearDown(void) {
    diagnosis_run_free(&run);
    recording_free(&recording);
}

/* A sine that dies away drives what is magnetised. Hum is on the position. */
static void record(double hum_um) {
    double m = 0.0, before = 0.0;
    for (size_t step = 0; step < SAMPLES * FINER; step++) {
        const double t = (double)step / (rate_hz * FINER);
        const double now = exp(-2.5 * t) * sin(2.0 * M_PI * drive_hz * t + 0.3);
        m = magnetised(m, now, now - before);
        before = now;
        if (step % FINER == 0) {
            recording.column[COLUMN_DRIVE][step / FINER] = 75.0 + 73.0 * now;
            recording.column[COLUMN_DISPLACEMENT][step / FINER] =
                10.0 * now + 5.0 * m + hum_um * sin(2.0 * M_PI * 50.0 * t + 1.0) + noise_um * random_normal(&rng);
        }
    }
}

/* Whether the look and the operator alone suspect one. */
static bool is_suspected(void) {
    fault_list_t faults;
    progress_t progress;
    recording_t copy;
    recording_copy(&copy, &recording, 0, SAMPLES);
    look_t *looks = looks_at(&copy, 1, &failure);
    faults_find(looks, 1, &faults);
    TEST_ASSERT_EQUAL(0, faults.count);
    progress_begin(&progress, "");
    faults_undo(&copy, looks, 1, &faults, &progress);
    progress_end(&progress);
    const bool suspected = faults_some_suspected(&faults);
    faults_free(&faults);
    looks_free(looks, 1);
    recording_free(&copy);
    return suspected;
}

/* Hum beside a hysteresis that the look's ruler does not follow: a lead of some samples makes the readings likelier,
 * while the operator is alone. Not with every noise, so several are tried. */
static void test_hum_is_no_lead(void) {
    bool suspected = false;
    for (int noise = 0; !suspected && noise < 5; noise++) {
        record(1.6);
        suspected = is_suspected();
    }
    TEST_ASSERT_TRUE_MESSAGE(suspected, "nothing is suspected, and the test says nothing");
    TEST_ASSERT_TRUE_MESSAGE(diagnosis_run(NULL, &recording, 1, 0, &run, &failure), failure.text);
    TEST_ASSERT_EQUAL(0, run.faults.count);
    TEST_ASSERT_EQUAL(0, run.faults.withdrawn); /* no look has told it */
    TEST_ASSERT_EQUAL_INT(EXPLAINED, run.answer.verdict);
    TEST_ASSERT_EQUAL_UINT(1, run.answer.findings);
    TEST_ASSERT_EQUAL_STRING("mains_interference", run.answer.finding[0].block->name);
    for (size_t k = 0; k < SAMPLES; k++) { /* the recording is as it was */
        TEST_ASSERT_TRUE(recording.masked == NULL || recording.masked[k] == 0);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_hum_is_no_lead);
    return UNITY_END();
}
