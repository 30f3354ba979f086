/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Ellipses and sines through points: against loops from an independent generator, and against their own errors. */
#include "ellipses_003.h"
#include "numerics/ellipse_fit.h"
#include "numerics/sine_fit.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdio.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

enum { POINTS = 20000 };
static double x[POINTS], y[POINTS];

/* The rebuilt loop as measured: noise, then 16 bits over 150 V and 90 um; in the plane of the table. */
static void rebuild(const ellipse_003_t *row, size_t count, double noise_um) {
    for (size_t k = 0; k < count; k++) {
        double drive_v, displacement_um;
        /* 10 kHz; where that gives few phases (300 Hz: 100), noise spreads them over the codes */
        ellipse_003_point(row, 2.0 * M_PI * row->frequency_hz * (double)k / 10000.0, &drive_v, &displacement_um);
        x[k] = floor(drive_v / 150.0 * 65536.0 + 0.5) / 65536.0;
        y[k] = floor((displacement_um + noise_um * random_normal(&rng)) / 90.0 * 65536.0 + 0.5) / 65536.0;
    }
}

/* The printed digits, all nine rows, from two seconds with 5 nm of noise. (The noise bends thin ellipses: 10 nm already
 * cost 4e-5 of the 5e-5 that half a digit is.) */
static void test_recovers_the_published_table(void) {
    double worst = 0.0;
    for (size_t i = 0; i < ELLIPSES_003; i++) {
        const ellipse_003_t *row = &ellipses_003[i];
        ellipse_t found, sigma;
        failure_t failure;
        rebuild(row, POINTS, 0.005);
        TEST_ASSERT_TRUE_MESSAGE(ellipse_fit(x, y, POINTS, &found, &sigma, &failure), failure.text);
        const double deviation[] = {found.x_center - row->x_center, found.y_center - row->y_center,
                                    found.major - row->major, found.minor - row->minor, found.angle - row->angle};
        for (size_t j = 0; j < 5; j++) {
            worst = fmax(worst, fabs(deviation[j]));
            TEST_ASSERT_TRUE_MESSAGE(fabs(deviation[j]) < 5e-5, "a printed digit differs");
        }
    }
    printf("table 1 of 003: worst deviation %.2g, half a printed digit is 5e-5\n", worst);
}

/* A Monte Carlo of 300 fits: the scatter is what the standard errors say. */
static void test_standard_errors_are_the_scatter(void) {
    enum { RUNS = 300, COUNT = 400 };
    const ellipse_003_t *row = &ellipses_003[7];
    double sum[5] = {0}, squares[5] = {0}, sigmas[5] = {0};
    for (int run = 0; run < RUNS; run++) {
        ellipse_t found, sigma;
        failure_t failure;
        rebuild(row, COUNT, 0.05);
        TEST_ASSERT_TRUE(ellipse_fit(x, y, COUNT, &found, &sigma, &failure));
        const double value[] = {found.x_center - row->x_center, found.y_center - row->y_center,
                                found.major - row->major, found.minor - row->minor, found.angle - row->angle};
        const double error[] = {sigma.x_center, sigma.y_center, sigma.major, sigma.minor, sigma.angle};
        for (size_t j = 0; j < 5; j++) {
            sum[j] += value[j] / RUNS;
            squares[j] += value[j] * value[j] / RUNS;
            sigmas[j] += error[j] / RUNS;
        }
    }
    for (size_t j = 0; j < 5; j++) {
        const double scatter = sqrt(squares[j] - sum[j] * sum[j]);
        /* The scatter of 300 runs is known to 1 / sqrt(600) = 4 %; five of these. */
        TEST_ASSERT_DOUBLE_WITHIN(0.2 * scatter, scatter, sigmas[j]);
        /* Noise makes an algebraic fit a little small: second order in the noise, below a scatter here. */
        TEST_ASSERT_TRUE(fabs(sum[j]) < scatter);
    }
}

static void test_the_fit_moves_with_the_plane(void) {
    for (int run = 0; run < 200; run++) {
        enum { COUNT = 60 };
        const double p = exp(6.0 * random_unit(&rng)), q = exp(-6.0 * random_unit(&rng)),
                     shift = 100.0 * random_unit(&rng);
        ellipse_t here, there;
        failure_t failure;
        const ellipse_sines_t sines = {1.0, 1.0, 0.05 + 3.0 * random_unit(&rng)};
        for (int k = 0; k < COUNT; k++) { /* no ellipse exactly, and uneven */
            const double theta = 6.0 * random_unit(&rng);
            x[k] = sin(theta) + 0.01 * random_normal(&rng);
            y[k] = sin(theta - sines.lag) + 0.01 * random_normal(&rng);
            x[COUNT + k] = p * x[k] + shift;
            y[COUNT + k] = q * y[k] - shift;
        }
        if (!ellipse_fit(x, y, COUNT, &here, NULL, &failure)) {
            continue;
        }
        TEST_ASSERT_TRUE(ellipse_fit(x + COUNT, y + COUNT, COUNT, &there, NULL, &failure));
        const ellipse_sines_t a = ellipse_sines(&here), b = ellipse_sines(&there);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, a.x_radius, b.x_radius / p);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, a.y_radius, b.y_radius / q);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, a.lag, b.lag);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, here.x_center, (there.x_center - shift) / p);
    }
}

static void test_sines_and_ellipses_are_two_views_of_one_thing(void) {
    for (int run = 0; run < 10000; run++) {
        const ellipse_sines_t sines = {exp(4.0 * random_unit(&rng) - 2.0), exp(4.0 * random_unit(&rng) - 2.0),
                                       0.01 + 3.12 * random_unit(&rng)};
        const ellipse_t ellipse = ellipse_of_sines(3.0, -4.0, &sines);
        const ellipse_sines_t back = ellipse_sines(&ellipse);
        TEST_ASSERT_TRUE(ellipse.major >= ellipse.minor && ellipse.minor > 0.0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9 * sines.x_radius, sines.x_radius, back.x_radius);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9 * sines.y_radius, sines.y_radius, back.y_radius);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, sines.lag, back.lag); /* cos of a small lag loses half the digits */
        /* and the two arcs meet the sines */
        const double theta = 1.3, at = 3.0 + sines.x_radius * sin(theta); /* on the way up */
        TEST_ASSERT_DOUBLE_WITHIN(1e-5 * sines.y_radius, -4.0 + sines.y_radius * sin(theta - sines.lag),
                                  ellipse_arc(&ellipse, at, -1.0));
    }
}

static void test_refuses_what_is_no_ellipse(void) {
    ellipse_t found;
    failure_t failure;
    for (int k = 0; k < 100; k++) {
        x[k] = k;
        y[k] = 3.0 * k - 7.0;
    }
    TEST_ASSERT_FALSE(ellipse_fit(x, y, 100, &found, NULL, &failure));
    expect_line(&failure, "straight line");
    TEST_ASSERT_FALSE(ellipse_fit(x, y, 5, &found, NULL, &failure));
    expect_line(&failure, "too few");
    for (int k = 0; k < 100; k++) { /* a point, many times */
        x[k] = y[k] = 1.0;
    }
    TEST_ASSERT_FALSE(ellipse_fit(x, y, 100, &found, NULL, &failure));
    x[3] = (double)NAN;
    TEST_ASSERT_FALSE(ellipse_fit(x, y, 100, &found, NULL, &failure));
}

static void test_a_sine_is_found_with_its_frequency(void) {
    const double frequency = 17.3, phase = -2.0;
    sine_t sine;
    failure_t failure;
    for (int k = 0; k < 2000; k++) {
        y[k] = 75.0 + 15.0 * sin(2.0 * M_PI * frequency * k / 10000.0 + phase) + 0.01 * random_normal(&rng);
    }
    TEST_ASSERT_TRUE_MESSAGE(sine_fit(y, 2000, 10000.0, &sine, &failure), failure.text);
    /* Five of the standard errors 0.01 sqrt(2 / 2000) (of the amplitude) and sqrt(6) / (pi 0.2 s) of its relative size.
     */
    TEST_ASSERT_DOUBLE_WITHIN(1.6e-3, 15.0, sine.amplitude);
    TEST_ASSERT_DOUBLE_WITHIN(1.6e-3, 75.0, sine.offset);
    TEST_ASSERT_DOUBLE_WITHIN(5e-4, frequency, sine.frequency_hz);
    TEST_ASSERT_DOUBLE_WITHIN(5e-4, phase, sine.phase);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.01, sine.rms);
    for (int k = 0; k < 2000; k++) {
        y[k] = k;
    }
    TEST_ASSERT_FALSE(sine_fit(y, 2000, 10000.0, &sine, &failure));
}

int main(void) {
    rng = random_start("test_ellipse", 20261003);
    UNITY_BEGIN();
    RUN_TEST(test_recovers_the_published_table);
    RUN_TEST(test_standard_errors_are_the_scatter);
    RUN_TEST(test_the_fit_moves_with_the_plane);
    RUN_TEST(test_sines_and_ellipses_are_two_views_of_one_thing);
    RUN_TEST(test_refuses_what_is_no_ellipse);
    RUN_TEST(test_a_sine_is_found_with_its_frequency);
    return UNITY_END();
}
