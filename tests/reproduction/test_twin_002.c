/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The twin of paper 002 against plays, one by one, and its steady state against time. */
#include "random.h"
#include "twins/twin_002.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <math.h>

enum { PLAYS = 5000 };
static const double rate_hz = 1000.0, most_v = 100.0;

void setUp(void) {
}
void tearDown(void) {
}

/* Without lag, relaxation, noise and steps. */
static twin_002_numbers_t ceramic(void) {
    twin_002_numbers_t numbers = twin_002_actuator;
    numbers.cutoff_hz = 1e15;
    for (size_t j = 0; j < TWIN_002_RELAXATIONS; j++) {
        numbers.part[j] = 0.0;
    }
    return numbers;
}

/* A sum of plays with the density of the header, midpoint rule, after 100 V and back. Turning points of every size. */
static void test_is_the_continuum_of_plays_that_it_says(void) {
    random_t random = random_start("twin 002 against plays", 1);
    const twin_002_numbers_t n = ceramic();
    static double play[PLAYS];
    double largest = 0.0, rest = 0.0;
    twin_002_t twin;
    twin_002_open(&twin, &n, rate_hz, 1);
    for (size_t i = 0; i < PLAYS; i++) {
        const double r = most_v * ((double)i + 0.5) / PLAYS;
        play[i] = fmin(r, most_v - r);
        rest += most_v / PLAYS * play[i] * n.density_um_per_v2 / (1.0 + r * r / (n.scale_v * n.scale_v));
    }
    for (int k = 0; k < 2000; k++) {
        const double near = k % 7 == 0 ? most_v : 5.0;
        const double v = fmax(0.0, fmin(most_v, twin.drive_v + near * random_normal(&random)));
        double expected = (n.linear_um_per_v + n.quadratic_um_per_v2 * v) * v - rest;
        for (size_t i = 0; i < PLAYS; i++) {
            const double r = most_v * ((double)i + 0.5) / PLAYS;
            play[i] = fmax(v - r, fmin(v + r, play[i]));
            expected += most_v / PLAYS * play[i] * n.density_um_per_v2 / (1.0 + r * r / (n.scale_v * n.scale_v));
        }
        largest = fmax(largest, fabs(expected - twin_002_step(&twin, v)));
    }
    /* A midpoint rule of step s misses at most s^2 / 4 times the jump of slope (2 times the density) at each corner of
     * the memory, and there are never more than the turning points left. 20 is more than random drives leave. */
    TEST_ASSERT_DOUBLE_WITHIN(20.0 * 0.5 * pow(most_v / PLAYS, 2.0) * n.density_um_per_v2, 0.0, largest);
}

static void test_a_period_ends_where_it_began(void) {
    enum { PERIOD = 200 };
    double drive[PERIOD];
    twin_002_t twin;
    twin_002_open(&twin, &twin_002_actuator, rate_hz, 1);
    for (size_t k = 0; k < PERIOD; k++) {
        drive[k] = 30.0 + 20.0 * sin(2.0 * M_PI * (double)k / PERIOD) + 8.0 * cos(6.0 * M_PI * (double)k / PERIOD);
    }
    twin_002_repeat(&twin, drive, PERIOD);
    const double first = twin_002_step(&twin, drive[0]);
    double last = 0.0;
    for (size_t k = 1; k <= 50 * PERIOD; k++) {
        last = twin_002_step(&twin, drive[k % PERIOD]);
        if (k % PERIOD == 0) { /* a relaxation of 1.6 s that began a percent off would show as 1e-3 um */
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, first, last);
        }
    }
}

/* As many turning points as an ever smaller swing leaves, and none of them once it has been passed. */
static void test_forgets_what_a_large_swing_passes(void) {
    const twin_002_numbers_t n = ceramic();
    twin_002_t twin, fresh;
    twin_002_open(&twin, &n, rate_hz, 1);
    twin_002_open(&fresh, &n, rate_hz, 1);
    for (int k = 0; k < 200; k++) {
        twin_002_step(&twin, 50.0 + 40.0 * (k % 2 == 0 ? 1.0 : -1.0) * (200 - k) / 200.0);
    }
    TEST_ASSERT_TRUE(twin.turns > 190);
    twin_002_step(&twin, 95.0);
    TEST_ASSERT_EQUAL_UINT64(1, twin.turns);
    twin_002_step(&twin, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, twin_002_step(&fresh, 60.0), twin_002_step(&twin, 60.0));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_is_the_continuum_of_plays_that_it_says);
    RUN_TEST(test_a_period_ends_where_it_began);
    RUN_TEST(test_forgets_what_a_large_swing_passes);
    return UNITY_END();
}
