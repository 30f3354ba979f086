/* SPDX-License-Identifier: MIT */
/*
 * What an image may do to the output: nothing that comes with it, however it was made, moves the drive by more than the
 * board allows in a sample, and what the board cannot allow is refused.
 */
#include "fake_board.h"
#include "loop/loop.h"
#include "master.h"
#include "random.h"
#include "unity.h"
#include <stdlib.h>

#define CODE_STEP (1 << 16) /* of 16 bits, in Q31 */

static random_t rng;

void setUp(void) {
    fake_board_power_on(0);
}
void tearDown(void) {
}

static hyst_parameters_error_t commit(const hyst_parameters_t *p) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    const size_t length = hyst_parameters_encode(p, words, HYST_IMAGE_MAX_WORDS);
    master_write_words(ADDRESS_staging, words, length);
    master_command(COMMAND_COMMIT);
    return (hyst_parameters_error_t)master_get(INDEX_fault_code);
}

static void expect_refused(const hyst_parameters_t *p, hyst_field_t field) {
    TEST_ASSERT_EQUAL(HYST_PARAMETERS_OUT_OF_RANGE, commit(p));
    TEST_ASSERT_EQUAL_UINT32(field, master_get(INDEX_fault_field));
    TEST_ASSERT_EQUAL_UINT32(FAKE_COMMITS, master_get(INDEX_commits));
}

static void test_a_transition_that_never_arrives_or_is_a_step_is_refused(void) {
    static const hyst_q31_t refused[] = {1, FAKE_TRANSITION_SLEW_MIN - 1, FAKE_TRANSITION_SLEW_MAX + 1, HYST_Q31_MAX};
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++) {
        p.transition_slew = refused[i];
        expect_refused(&p, HYST_FIELD_TRANSITION_SLEW);
    }
    p.transition_slew = FAKE_TRANSITION_SLEW_MIN;
    TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, commit(&p));
    (void)fake_board_run(1);
    p.transition_slew = FAKE_TRANSITION_SLEW_MAX;
    TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, commit(&p));
}

static void test_a_filter_of_too_much_gain_is_refused(void) {
    /* Gain at rest; gain at half the sample rate; a slow pole; two sections of 10 each; a ringing pole. */
    static const hyst_iir_section_t bad[][2] = {
        {{.b0 = HYST_Q28_ONE, .a1 = -(HYST_Q28_ONE - HYST_Q28_ONE / 128)}, {.b0 = HYST_Q28_ONE}},
        {{.b0 = HYST_Q28_ONE, .a1 = HYST_Q28_ONE - HYST_Q28_ONE / 128}, {.b0 = HYST_Q28_ONE}},
        {{.b0 = 1, .a1 = -(HYST_Q28_ONE - 1), .b1 = 70}, {.b0 = HYST_Q28_ONE}},
        {{.b0 = 5 * HYST_Q28_ONE, .b1 = -5 * HYST_Q28_ONE}, {.b0 = 5 * HYST_Q28_ONE, .b1 = -5 * HYST_Q28_ONE}},
        {{.b0 = HYST_Q28_ONE / 1000, .a2 = HYST_Q28_ONE - 1}, {.b0 = HYST_Q28_ONE}},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        hyst_parameters_t p;
        hyst_parameters_default(&p);
        p.shape_sections = 2;
        p.shape[0] = bad[i][0];
        p.shape[1] = bad[i][1];
        expect_refused(&p, HYST_FIELD_SHAPE);
        hyst_parameters_default(&p);
        p.equalise_sections = 2;
        p.equalise[0] = bad[i][0];
        p.equalise[1] = bad[i][1];
        expect_refused(&p, HYST_FIELD_EQUALISE);
    }
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    p.inertia_sections = 1;
    p.inertia[0] = bad[0][0];
    expect_refused(&p, HYST_FIELD_INERTIA);
}

/* Against an independent sum in floating point: refused above the bound, accepted below it. */
static void test_the_gain_is_the_sum_of_the_impulse_response(void) {
    unsigned accepted = 0, refused = 0;
    for (unsigned run = 0; run < 400; run++) {
        hyst_parameters_t p;
        hyst_parameters_default(&p);
        p.shape_sections = (uint32_t)random_between(&rng, 1, 3);
        double y[4] = {0.0}, state[4][4] = {{0.0}}, sum = 0.0;
        for (uint32_t i = 0; i < p.shape_sections; i++) {
            const double radius = 0.5 + 0.45 * random_between(&rng, 0, 1000) / 1000.0;
            p.shape[i] = (hyst_iir_section_t){.b0 = random_between(&rng, 0, 4 * HYST_Q28_ONE),
                                              .b1 = random_between(&rng, -4 * HYST_Q28_ONE, 0),
                                              .b2 = random_between(&rng, 0, HYST_Q28_ONE),
                                              .a1 = (hyst_q28_t)(-1.5 * radius * HYST_Q28_ONE),
                                              .a2 = (hyst_q28_t)(radius * radius * HYST_Q28_ONE)};
        }
        for (unsigned k = 0; k < 4000; k++) {
            double x = k == 0 ? 1.0 : 0.0;
            for (uint32_t i = 0; i < p.shape_sections; i++) {
                const hyst_iir_section_t *s = &p.shape[i];
                double *h = state[i]; /* x1 x2 y1 y2 */
                y[i] = (s->b0 * x + s->b1 * h[0] + s->b2 * h[1] - s->a1 * h[2] - s->a2 * h[3]) / HYST_Q28_ONE;
                h[1] = h[0];
                h[0] = x;
                h[3] = h[2];
                h[2] = y[i];
                x = y[i];
            }
            sum += x < 0.0 ? -x : x;
        }
        if (sum > 0.99 * FAKE_FILTER_GAIN_MAX && sum < 1.01 * FAKE_FILTER_GAIN_MAX) {
            continue; /* too near for either */
        }
        const hyst_parameters_error_t error = commit(&p);
        (void)fake_board_run(1);
        if (sum > FAKE_FILTER_GAIN_MAX) {
            TEST_ASSERT_EQUAL(HYST_PARAMETERS_OUT_OF_RANGE, error);
            refused++;
        } else if (error == HYST_PARAMETERS_OK) {
            accepted++;
        } else { /* an inner section may exceed what the whole does not: then one of its ends does */
            TEST_ASSERT_EQUAL_UINT32(HYST_FIELD_SHAPE, master_get(INDEX_fault_field));
        }
    }
    TEST_ASSERT_TRUE(accepted > 50 && refused > 20);
}

static hyst_q31_t distance(hyst_q31_t a, hyst_q31_t b) {
    const int64_t d = (int64_t)a - b;
    return d < 0 ? (hyst_q31_t)(d < -HYST_Q31_MAX ? HYST_Q31_MAX : -d)
                 : (hyst_q31_t)(d > HYST_Q31_MAX ? HYST_Q31_MAX : d);
}

/* Runs on; no step is above `bound`. Returns the last drive. */
static hyst_q31_t run_within(hyst_q31_t last, unsigned samples, hyst_q31_t bound) {
    for (unsigned i = 0; i < samples; i++) {
        const hyst_q31_t drive = fake_board_run(1);
        TEST_ASSERT_LESS_OR_EQUAL_INT32(bound + CODE_STEP, distance(drive, last)); /* each code is rounded by half */
        last = drive;
    }
    return last;
}

/* The drive is at one end of the range when limits come that exclude it. */
static void test_new_limits_are_reached_by_a_ramp(void) {
    for (int mode = HYST_MODE_DIRECT; mode <= HYST_MODE_COMPENSATE; mode++) {
        for (unsigned upper = 0; upper < 2; upper++) {
            hyst_parameters_t p;
            fake_board_power_on(0);
            hyst_parameters_default(&p);
            TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, commit(&p));
            master_put(INDEX_mode, (uint32_t)mode);
            (void)fake_board_run(10);
            master_put(INDEX_setpoint, (uint32_t)(upper != 0 ? HYST_Q31_MAX / 10 * 9 : HYST_Q31_MIN / 10 * 9));
            const hyst_q31_t last = fake_board_run(10000);
            p.drive_low = upper != 0 ? HYST_Q31_MIN : HYST_Q31_MAX / 10 * 7;
            p.drive_high = upper != 0 ? HYST_Q31_MIN / 10 * 7 : HYST_Q31_MAX;
            p.drive_park = upper != 0 ? p.drive_high : p.drive_low;
            p.transition_slew = FAKE_TRANSITION_SLEW_MAX / 4;
            TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, commit(&p));
            const hyst_q31_t end = run_within(last, 1000, p.transition_slew);
            TEST_ASSERT_INT32_WITHIN(CODE_STEP, p.drive_park, end);
        }
    }
}

static hyst_iir_section_t random_section(void) {
    return (hyst_iir_section_t){.b0 = random_between(&rng, -2 * HYST_Q28_ONE, 2 * HYST_Q28_ONE),
                                .b1 = random_between(&rng, -2 * HYST_Q28_ONE, 2 * HYST_Q28_ONE),
                                .a1 = random_between(&rng, -HYST_Q28_ONE + 1, HYST_Q28_ONE - 1)};
}

/* Random images, modes and references at random moments: no two codes are farther apart than the board allows. */
static void test_nothing_that_is_committed_steps_the_drive(void) {
    enum { RUNS = 3000 };
    unsigned accepted = 0, limited = 0;
    hyst_q31_t last = fake_board_run(1);
    for (unsigned run = 0; run < RUNS; run++) {
        hyst_parameters_t p;
        hyst_parameters_default(&p);
        const hyst_q31_t a = random_q31(&rng), b = random_q31(&rng);
        p.drive_low = a < b ? a : b;
        p.drive_high = a < b ? b : a;
        p.drive_park = run % 2 == 0 ? p.drive_low : p.drive_high;
        p.hysteresis_offset = random_q31(&rng) / 4;
        p.linear_offset = random_q31(&rng);
        p.linear_gain = random_between(&rng, 1, INT32_MAX);
        p.transition_slew = random_between(&rng, FAKE_TRANSITION_SLEW_MIN, FAKE_TRANSITION_SLEW_MAX);
        p.shape_sections = (uint32_t)random_between(&rng, 0, 2);
        p.shape[0] = random_section();
        p.shape[1] = random_section();
        accepted += commit(&p) == HYST_PARAMETERS_OK ? 1U : 0U;
        master_put(INDEX_setpoint_slew, (uint32_t)HYST_Q31_MAX);
        master_put(INDEX_mode, (uint32_t)random_between(&rng, 0, 3));
        last = run_within(last, (unsigned)random_between(&rng, 1, 5), FAKE_DRIVE_SLEW_MAX);
        master_put(INDEX_setpoint, (uint32_t)random_q31(&rng));
        last = run_within(last, (unsigned)random_between(&rng, 1, 30), FAKE_DRIVE_SLEW_MAX);
    }
    limited = master_get(INDEX_slew_limited);
    TEST_ASSERT_TRUE_MESSAGE(accepted > RUNS / 4 && limited > 100, "or nothing was tried");
}

/* The model follows what the actuator got: after a limited step the drive is the one that a slow way there makes. */
static void test_the_memory_follows_the_limited_drive(void) {
    hyst_q31_t drive[2];
    for (unsigned fast = 0; fast < 2; fast++) {
        hyst_parameters_t p;
        fake_board_power_on(0);
        hyst_parameters_default(&p);
        p.pi_operators = 1;
        p.pi_weight[0] = p.pi_weight[1] = HYST_Q28_ONE / 2;
        p.pi_threshold[0] = 1 << 28;
        TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, commit(&p));
        master_put(INDEX_mode, HYST_MODE_COMPENSATE);
        (void)fake_board_run(2000);
        master_put(INDEX_setpoint_slew, fast != 0 ? (uint32_t)HYST_Q31_MAX : 1U << 22);
        master_put(INDEX_setpoint, 3U << 29);
        (void)fake_board_run(2000);
        master_put(INDEX_setpoint, 1U << 29);
        drive[fast] = fake_board_run(2000);
    }
    TEST_ASSERT_EQUAL_INT32(drive[0], drive[1]);
}

int main(void) {
    rng = random_start("firmware_commit_steps", 20261123);
    UNITY_BEGIN();
    RUN_TEST(test_a_transition_that_never_arrives_or_is_a_step_is_refused);
    RUN_TEST(test_a_filter_of_too_much_gain_is_refused);
    RUN_TEST(test_the_gain_is_the_sum_of_the_impulse_response);
    RUN_TEST(test_new_limits_are_reached_by_a_ramp);
    RUN_TEST(test_nothing_that_is_committed_steps_the_drive);
    RUN_TEST(test_the_memory_follows_the_limited_drive);
    return UNITY_END();
}
