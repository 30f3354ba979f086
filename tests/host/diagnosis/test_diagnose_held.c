/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a look shows becomes evidence: a mode behind a drive that a converter holds, and a mode that rings once, after a
 * jump that no fit would see. The actuator here is no block: plays, and a mode integrated in small steps. */
#include "chain/align.h"
#include "interface/diagnosis_run.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>

enum { SAMPLES = 16000, PLAYS = 30, SUBSTEPS = 50 };

static const double rate_hz = 2000.0, mode_hz = 300.0, damping = 0.03, noise_um = 0.005;
static recording_t recording;
static failure_t failure;
static random_t rng;
static double play[PLAYS];

void setUp(void) {
    rng = random_start("diagnose_held", 20261125U);
    recording_create(&recording, "held.csv", rate_hz, SAMPLES);
    for (size_t i = 0; i < PLAYS; i++) {
        play[i] = 0.0;
    }
}

void tearDown(void) {
    recording_free(&recording);
}

static double hysteresis_um(double u) {
    double y = 10.0 * u;
    for (size_t i = 0; i < PLAYS; i++) {
        const double half = 0.02 + 0.88 * (double)i / (PLAYS - 1);
        play[i] = fmax(u - half, fmin(u + half, play[i]));
        y += 0.2 * exp(-2.0 * half) * play[i];
    }
    return y;
}

/* Semi-implicit Euler, 50 steps a sample: it moves a mode of 0.15 of the sample rate by (omega / 50)^2 / 24, 1.5e-5,
 * and its damping by nothing that 1 % noise shows. */
static void move_mode(double hz, double zeta, double y[2], double u_um, double samples) {
    const int steps = (int)ceil(SUBSTEPS * samples);
    const double h = samples / (double)steps, omega = 2.0 * M_PI * hz / rate_hz;
    for (int i = 0; i < steps; i++) {
        y[1] = (y[1] + h * omega * omega * (u_um - y[0])) / (1.0 + 2.0 * h * zeta * omega);
        y[0] += h * y[1];
    }
}

/* The drive, and the position behind it, read `since` parts of a sample after each value of the drive went out. */
static void record(const double *u, double since) {
    double y[2] = {hysteresis_um(u[0]), 0.0}, last = y[0];
    for (size_t k = 0; k < SAMPLES; k++) {
        const double now = hysteresis_um(u[k]);
        if (since < 1.0) {
            move_mode(mode_hz, damping, y, last, 1.0 - since);
        }
        if (since > 0.0) {
            move_mode(mode_hz, damping, y, now, since);
        }
        recording.column[COLUMN_DRIVE][k] = 50.0 + 50.0 * u[k];
        recording.column[COLUMN_DISPLACEMENT][k] = y[0] + noise_um * random_normal(&rng);
        last = now;
    }
}

/* Two tones and a square, from and to rest. */
static void fill_drive(double *u) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz, part = t < 1.0 || t > 7.3 ? 0.0 : fmin(1.0, t / 2.0);
        u[k] = part * (0.6 * sin(2.0 * M_PI * 1.3 * t) + 0.3 * sin(2.0 * M_PI * 7.7 * t) +
                       (sin(2.0 * M_PI * 3.1 * t) > 0.0 ? 0.1 : -0.1));
    }
}

/* The mode alone is found, within three standard errors. */
static void expect_the_mode(bool alone) {
    diagnosis_run_t run;
    TEST_ASSERT_TRUE_MESSAGE(recording_align(&recording, &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(diagnosis_run(NULL, &recording, 1, 0, &run, &failure), failure.text);
    const answer_t *answer = &run.answer;
    printf("held out %g %%, noise %g %%\n", answer->held_out_percent, answer->noise_percent);
    for (size_t f = 0; f < answer->findings; f++) {
        printf("found %s\n", answer->finding[f].block->name);
    }
    if (alone) {
        TEST_ASSERT_EQUAL_INT(EXPLAINED, answer->verdict);
        TEST_ASSERT_EQUAL_UINT(1, answer->findings);
    }
    const finding_t *finding = finding_of(answer, &block_resonance);
    TEST_ASSERT_NOT_NULL(finding);
    const model_block_t *found = &answer->model.block[finding_index(answer, finding)];
    const double truth[2] = {mode_hz, damping};
    for (size_t p = 0; p < 2; p++) {
        const parameter_t *number = &found->parameter[p];
        printf("%s %g +- %g (%g), held %d, read %g\n", found->block->parameter[p].name, number->value[0],
               number->sigma[0], truth[p], (int)recording.held, recording.held_since);
        TEST_ASSERT_DOUBLE_WITHIN(3.0 * number->sigma[0], truth[p], number->value[0]);
        TEST_ASSERT_TRUE(number->sigma[0] < 0.1 * truth[p]);
    }
    diagnosis_run_free(&run);
}

/* With the header's two keys. */
static void expect_held(double since) {
    char after_s[32];
    (void)snprintf(after_s, sizeof after_s, "%.9g", since / rate_hz);
    recording_set_key(&recording, "drive_between_samples", "held");
    recording_set_key(&recording, "displacement_sampled_after_s", after_s);
    double *u = allocate(SAMPLES, sizeof *u);
    fill_drive(u);
    record(u, since);
    free(u);
    expect_the_mode(true);
    TEST_ASSERT_TRUE(recording.held);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, since, recording.held_since);
}

static void test_read_as_the_next_value_goes_out(void) {
    expect_held(1.0);
}

static void test_read_as_the_value_goes_out(void) {
    expect_held(0.0);
}

static void test_read_in_between(void) {
    expect_held(0.4);
}

/* A rest, one jump, and a slow sine: it rings once, for a hundredth of a second, in one of the blocks of time that are
 * held out of every fit. */
static void test_a_ring_after_one_jump(void) {
    double *u = allocate(SAMPLES, sizeof *u);
    const size_t jump = 5600; /* block 12 of 0 .. 35 begins at 5333, block 14 at 6222: it is in the one whose samples
                                 the usual choice holds out, or the test below says so */
    for (size_t k = 0; k < SAMPLES; k++) {
        u[k] = k < jump ? 0.0 : sin(2.0 * M_PI * 0.5 * (double)(k - jump) / rate_hz - 0.6);
    }
    record(u, 0.0);
    free(u);
    expect_the_mode(false);
}

/* Jumps to any level every 0.05 to 0.1 s, which the mode rings through: after 0.05 s a twentieth of it is left. No key
 * of the header says that the drive is held, and no rest has the noise alone. */
static void test_jumps_that_ring_into_the_rests(void) {
    double *u = allocate(SAMPLES, sizeof *u), level = 0.0;
    for (size_t k = 0, next = 400; k < SAMPLES; k++) {
        if (k == next) {
            level = 1.6 * random_unit(&rng) - 0.8;
            next += 100 + (size_t)(100.0 * random_unit(&rng));
        }
        u[k] = level;
    }
    record(u, 0.0);
    free(u);
    expect_the_mode(true);
    TEST_ASSERT_TRUE(recording.held);
}

/* Nothing moves but by whole samples, so the delay is known to one of them: by the middle of it, and a third of it as
 * standard error. */
static void test_a_delay_of_some_samples(void) {
    diagnosis_run_t run;
    const size_t late = 3 + (size_t)(20.0 * random_unit(&rng));
    double level = 0.0;
    recording_set_key(&recording, "drive_between_samples", "held");
    for (size_t k = 0, next = 400; k < SAMPLES; k++) {
        if (k == next) {
            level = 1.6 * random_unit(&rng) - 0.8;
            next += 100 + (size_t)(100.0 * random_unit(&rng));
        }
        recording.column[COLUMN_DRIVE][k] = 50.0 + 50.0 * level;
    }
    for (size_t k = 0; k < SAMPLES; k++) {
        const double u = k < late ? 0.0 : recording.column[COLUMN_DRIVE][k - late] / 50.0 - 1.0;
        recording.column[COLUMN_DISPLACEMENT][k] = hysteresis_um(u) + noise_um * random_normal(&rng);
    }
    TEST_ASSERT_TRUE_MESSAGE(recording_align(&recording, &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(diagnosis_run(NULL, &recording, 1, 0, &run, &failure), failure.text);
    TEST_ASSERT_EQUAL_INT(EXPLAINED, run.answer.verdict);
    TEST_ASSERT_EQUAL_UINT(1, run.answer.findings);
    const model_block_t *found = model_find(&run.answer.model, "transport_delay");
    TEST_ASSERT_NOT_NULL(found);
    const parameter_t *number = &found->parameter[0];
    printf("%zu samples: delay %g +- %g samples\n", late, number->value[0] * rate_hz, number->sigma[0] * rate_hz);
    /* Read as the value goes out: the delay is over late - 1 samples, and no more than late. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, (double)late - 0.5, number->value[0] * rate_hz);
    /* And 2 % of it, which is the block's own accuracy. */
    TEST_ASSERT_DOUBLE_WITHIN(0.02, hypot(sqrt(1.0 / 12.0), 0.02 * (double)late), number->sigma[0] * rate_hz);
    diagnosis_run_free(&run);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_read_as_the_next_value_goes_out);
    RUN_TEST(test_read_as_the_value_goes_out);
    RUN_TEST(test_read_in_between);
    RUN_TEST(test_a_ring_after_one_jump);
    RUN_TEST(test_jumps_that_ring_into_the_rests);
    RUN_TEST(test_a_delay_of_some_samples);
    return UNITY_END();
}
