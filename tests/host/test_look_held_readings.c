/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A sensor slower than the rows is found with its rate, and nothing that only looks like it. */
#include "found_faults.h"
#include "look/held_readings.h"
#include "unity.h"
#include <math.h>
#include <string.h>

void setUp(void) {
    memset(late, 0, sizeof late);
}

void tearDown(void) {
}

/* A sensor that is read every so many rows; the first reading began `before` rows before the recording. */
static void hold_readings(double *y, size_t rows, size_t before) {
    for (size_t k = 0; k < SCENE_SAMPLES; k++) {
        const size_t since = (k + before) % rows;
        y[k] = since <= k ? y[k - since] : y[0];
    }
}

static void test_held_readings(void) {
    static const size_t rows[] = {2, 4, 10};
    static const double slow_um[] = {0.0, 0.01};
    for (size_t i = 0; i < 6; i++) {
        for (size_t which = 0; which < DRIVES; which++) {
            scene_open(&scene, which, &rng);
            scene.slow_um = slow_um[i / 3];
            scene_record(&scene, late, &rng, &recordings[0]);
            hold_readings(recordings[0].column[COLUMN_DISPLACEMENT], rows[i % 3], i % 2);
            look_at_them(1);
            const fault_t *fault = only(which, &fault_held_readings);
            expect_number(fault, "rows_per_reading", (double)rows[i % 3]);
            expect_number(fault, "sensor_rate_hz", scene_rate_hz / (double)rows[i % 3]);
            close_all(1);
        }
    }
}

/* A converter with some codes in the noise: readings in turn are equal now and then. */
static void test_held_readings_in_coarse_steps(void) {
    for (size_t which = 0; which < DRIVES; which++) {
        double *y = record(which);
        for (size_t k = 0; k < SCENE_SAMPLES; k++) {
            y[k] = round(100.0 * y[k] + 0.3 * random_normal(&rng)) / 100.0;
        }
        hold_readings(y, 5, 0);
        look_at_them(1);
        expect_number(only(which, &fault_held_readings), "rows_per_reading", 5.0);
        close_all(1);
    }
}

/* The other faults are not looked for, which would take far longer. */
static void expect_no_held_readings(void) {
    held_readings_t held;
    held_readings_find(&recordings[0], &held);
    TEST_ASSERT_EQUAL(0, held.rows);
    recording_free(&recordings[0]);
    scene_close(&scene);
}

/* A position without noise has the stairs of its drive, also when it is late. */
static void test_stairs_of_the_drive_are_no_held_readings(void) {
    static const size_t held_rows[] = {2, 5, 10};
    static const double late_rows[] = {0.0, 1.4, 7.0, 23.0};
    for (size_t i = 0; i < 12; i++) {
        for (size_t which = 0; which < DRIVES; which++) {
            memset(late, 0, sizeof late);
            shift_from(0, late_rows[i / 3]);
            scene_open(&scene, which, &rng);
            scene_hold(&scene, held_rows[i % 3]);
            scene.noise_um = 0.0;
            scene_record(&scene, late, &rng, &recordings[0]);
            expect_no_held_readings();
        }
    }
}

/* Rows that repeat, the drive too: the noise at rest tells it from such stairs. */
static void test_rows_that_repeat_are_held_readings(void) {
    double *y = record(2);
    hold_readings(y, 4, 0);
    hold_readings(recordings[0].column[COLUMN_DRIVE], 4, 0);
    look_at_them(1);
    expect_number(only(2, &fault_held_readings), "rows_per_reading", 4.0);
    close_all(1);
}

/* A triangle so slow that a converter without noise has a new code every five rows exactly; and one that is a little
 * slower. */
static void test_codes_at_equal_distances_are_no_held_readings(void) {
    enum { WAY = 1000 };
    static const double rows_per_code[] = {5.0, 5.1};
    for (size_t i = 0; i < 2; i++) {
        double *y = record(0), *u = recordings[0].column[COLUMN_DRIVE];
        for (size_t k = 0; k < SCENE_SAMPLES; k++) {
            const double way = fabs((double)(k % (2 * WAY)) - WAY);
            u[k] = 0.1 * way;
            y[k] = 0.01 * floor(way / rows_per_code[i] + 1e-9);
        }
        expect_no_held_readings();
    }
}

/* Readings that are equal to the one before at random, also most of them: no multiples of a number of rows. */
static void test_copies_here_and_there_are_no_held_readings(void) {
    static const double part[] = {0.05, 0.3, 0.7};
    for (size_t i = 0; i < 3; i++) {
        double *y = record(2);
        for (size_t k = 1; k < SCENE_SAMPLES; k++) {
            y[k] = random_unit(&rng) < part[i] ? y[k - 1] : y[k];
        }
        expect_no_held_readings();
    }
}

/* A sensor that a program reads at uneven times: half of its readings stand in five rows, the others in fewer or more.
 */
static void test_readings_at_uneven_times_are_no_held_readings(void) {
    double *y = record(2);
    for (size_t k = 0, rows = 0; k < SCENE_SAMPLES; k += rows) {
        rows = (size_t)fmin(fmax(round(5.0 + 0.8 * random_normal(&rng)), 1.0), (double)(SCENE_SAMPLES - k));
        for (size_t i = 1; i < rows; i++) {
            y[k + i] = y[k];
        }
    }
    expect_no_held_readings();
}

int main(void) {
    rng = random_start("look_held_readings", 20261127U);
    UNITY_BEGIN();
    RUN_TEST(test_held_readings);
    if (!INSTRUMENTED) { /* what is silent runs the code of the first test */
        RUN_TEST(test_held_readings_in_coarse_steps);
        RUN_TEST(test_stairs_of_the_drive_are_no_held_readings);
        RUN_TEST(test_rows_that_repeat_are_held_readings);
        RUN_TEST(test_codes_at_equal_distances_are_no_held_readings);
        RUN_TEST(test_copies_here_and_there_are_no_held_readings);
        RUN_TEST(test_readings_at_uneven_times_are_no_held_readings);
    }
    return UNITY_END();
}
