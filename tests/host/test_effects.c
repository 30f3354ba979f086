/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The limits, drifts and curved characteristics: each against the answer that its own equation has in closed form. */
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

void setUp(void) {
}
void tearDown(void) {
}

/* A 100 V/s limit and a triangle between 0 and 10 V. Twice as steep as the limit: the voltage is a triangle too, and
 * turns where it meets the drive, inside a sample. */
static void test_slew_limit_makes_a_smaller_triangle_of_a_steep_one(void) {
    const double rate = 1000.0, limit = 100.0, corner[] = {0.0, 10.0};
    double drive[1500], largest = 0.0, least = 10.0;
    chain_t *chain = open_block(&block_amplifier_slew_limit, &limit, rate, 1);
    fill_lines(drive, 1500, corner, 2, 50); /* 200 V/s */
    chain_settle(chain, 0.0);
    double previous = 0.0;
    for (int k = 0; k < 1500; k++) {
        const double v = chain_step(chain, drive[k]);
        TEST_ASSERT_TRUE(fabs(v - previous) <= limit / rate + 1e-12);
        if (k < 66) { /* first meets the falling drive: 100 t = 20 - 200 t at 66.67 ms */
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, limit * k / rate, v);
        }
        largest = k >= 1000 ? fmax(largest, v) : largest;
        least = k >= 1000 ? fmin(least, v) : least;
        previous = v;
    }
    /* Once it repeats it swings by 100 V/s times half a period of 50 ms, about the middle. Between samples it is
     * higher: by up to half a sample at the limit. */
    TEST_ASSERT_DOUBLE_WITHIN(0.5 * limit / rate + 1e-9, 7.5, largest);
    TEST_ASSERT_DOUBLE_WITHIN(0.5 * limit / rate + 1e-9, 2.5, least);
    chain_close(chain);
}

/* The corner inside the sample counts: the same drive at ten times the rate gives the same voltages. The drive is
 * linear between the coarse samples, so there is nothing that only the fine one sees. */
static void test_slew_limit_does_not_depend_on_the_sample_rate(void) {
    enum { FINE = 10 };
    const double limit = 37.0, rate = 100.0;
    random_t random = random_start("slew limit, two rates", 20);
    chain_t *coarse = open_block(&block_amplifier_slew_limit, &limit, rate, 1);
    chain_t *fine = open_block(&block_amplifier_slew_limit, &limit, rate * FINE, 1);
    double from = 0.0;
    chain_settle(coarse, 0.0);
    chain_settle(fine, 0.0);
    for (int k = 0; k < 20000; k++) {
        const double to = from + 0.6 * random_normal(&random);
        double v = 0.0;
        for (int i = 1; i <= FINE; i++) {
            v = chain_step(fine, from + (to - from) * i / FINE);
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, v, chain_step(coarse, to));
        from = to;
    }
    chain_close(coarse);
    chain_close(fine);
}

static void test_a_drive_within_the_slew_limit_passes_unchanged(void) {
    const double limit = 100.0, rate = 1000.0;
    chain_t *chain = open_block(&block_amplifier_slew_limit, &limit, rate, 1);
    double drive = 0.0;
    random_t random = random_start("slow drive", 21);
    chain_settle(chain, 0.0);
    for (int k = 0; k < 1000; k++) {
        drive += fmax(-0.0999, fmin(0.0999, 0.1 * random_normal(&random)));
        TEST_ASSERT_EQUAL_DOUBLE(drive, chain_step(chain, drive));
    }
    chain_close(chain);
}

static void test_saturation_cuts_at_its_rails(void) {
    chain_t *chain = open_block(&block_amplifier_saturation, (const double[]){-10.0, 120.0}, 1000.0, 1);
    const double drive[] = {-11.0, -10.0, 0.0, 119.5, 120.5, 1e6}, voltage[] = {-10.0, -10.0, 0.0, 119.5, 120.0, 120.0};
    for (int k = 0; k < 6; k++) {
        TEST_ASSERT_EQUAL_DOUBLE(voltage[k], chain_step(chain, drive[k]));
    }
    chain_close(chain);
}

/* Behind by the same angle from 1 Hz to 50 Hz, and larger by the growth of a decade at a tenth of the frequency. */
static void test_dielectric_loss_is_the_same_angle_at_all_frequencies(void) {
    const double rate = 5000.0, hz[] = {1.0, 10.0, 50.0}, loss = 0.02, growth = loss * 2.0 * M_LN10 / M_PI;
    double in_phase[3] = {0.0}, quadrature[3] = {0.0};
    for (size_t i = 0; i < 3; i++) {
        const int period = (int)(rate / hz[i]), periods = (int)(20.0 * hz[i]);
        chain_t *chain = open_block(&block_dielectric_loss, &loss, rate, 1);
        chain_settle(chain, 0.0);
        for (int k = 0; k < 2 * periods * period; k++) {
            const double phase = 2.0 * M_PI * (double)k / period, y = chain_step(chain, sin(phase));
            if (k >= periods * period) {
                in_phase[i] += 2.0 * y * sin(phase) / periods / period;
                quadrature[i] += 2.0 * y * cos(phase) / periods / period;
            }
        }
        chain_close(chain);
        /* The quickest cells, 0.1 ms, are missing at 50 Hz: atan(2 pi 50 1e-4) is 2 % of pi / 2. */
        TEST_ASSERT_DOUBLE_WITHIN(0.03 * loss, -loss, quadrature[i]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.03 * growth, growth, in_phase[0] - in_phase[1]);
}

/* What had been present leaves exponentials. Each of the 13 cells has its share. */
static void test_dielectric_loss_begins_where_it_is_told(void) {
    const double rate = 100.0, before_um = 3.0, loss = 0.02, share = loss * 2.0 * M_LN10 / M_PI / 2.0, one = 1.0;
    model_t model;
    failure_t failure;
    make_bank_model(&model, rate, 0.0, 0, &one, NULL);
    model_block_t *block = model_append(&model, &block_dielectric_loss);
    model_set(block, "loss_tangent", loss);
    model_set(block, "initial_um", before_um);
    chain_t *chain = chain_open(&model, rate, 1, &failure);
    TEST_ASSERT_NOT_NULL(chain);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 13.0 * share * before_um, chain_settle(chain, 0.0));
    for (int k = 1; k < 500; k++) {
        double left = 0.0;
        for (int j = 0; j < 13; j++) {
            left += share * before_um * exp(-(double)k / rate / (1e-4 * pow(10.0, 0.5 * j)));
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, left, chain_step(chain, 0.0));
    }
    chain_close(chain);
    model_free(&model);
}

/* x' = x_in' - x / T: a ramp of slope s from 0 gives s T (1 - exp(-t / T)), and what is then held decays. */
static void test_leakage_answers_a_ramp_and_a_hold_exactly(void) {
    const double rate = 50.0, tau = 1.7, s = 3.0, end = 4.0;
    chain_t *chain = open_block(&block_charge_leakage, (const double[]){tau, 0.25}, rate, 1);
    TEST_ASSERT_EQUAL_DOUBLE(0.25, chain_settle(chain, 0.0));
    for (int k = 1; k < 1000; k++) {
        const double t = k / rate, at_end = s * tau * -expm1(-end / tau);
        const double expected = t <= end ? s * tau * -expm1(-t / tau) : at_end * exp(-(t - end) / tau);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.25 + expected, chain_step(chain, s * fmin(t, end)));
    }
    chain_close(chain);
}

/* A model in which the recording begins fresh: nothing has leaked away yet. */
static void test_leakage_begins_where_it_is_told(void) {
    const double one = 1.0, nothing = 0.0, tau = 2.0, rate = 10.0;
    model_t model;
    failure_t failure;
    make_bank_model(&model, rate, 0.0, 0, &one, NULL);
    model_block_t *block = model_append(&model, &block_charge_leakage);
    model_set(block, "time_constant_s", tau);
    model_set_array(block, "initial_um", 1, &nothing, NULL);
    chain_t *chain = chain_open(&model, rate, 1, &failure);
    TEST_ASSERT_NOT_NULL(chain);
    TEST_ASSERT_EQUAL_DOUBLE(5.0, chain_settle(chain, 5.0));
    for (int k = 1; k < 100; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 5.0 * exp(-k / rate / tau), chain_step(chain, 5.0));
    }
    chain_close(chain);
    const double two[] = {1.0, 2.0};
    model_set_array(block, "initial_um", 2, two, NULL);
    TEST_ASSERT_NULL(chain_open(&model, rate, 1, &failure));
    expect_line(&failure, "initial_um has 2 elements, at most 1 are allowed");
    model_free(&model);
}

/* Time counts from the first sample; settling again begins anew. */
static void test_drifts_and_hum_are_functions_of_time(void) {
    const double rate = 1000.0, x = 7.0;
    chain_t *gain = open_block(&block_gain_drift, (const double[BLOCK_MAX_PARAMETERS]){-1e-3, 2.0}, rate, 1);
    chain_t *settles = open_block(&block_gain_drift, (const double[BLOCK_MAX_PARAMETERS]){-1e-3, 2.0, 0.7}, rate, 1);
    chain_t *drift = open_block(&block_thermal_drift, (const double[]){0.8, 0.3}, rate, 1);
    chain_t *hum =
        open_block(&block_mains_interference, (const double[BLOCK_MAX_PARAMETERS]){50.0, 0.02, 0.5}, rate, 1);
    for (int again = 0; again < 2; again++) {
        TEST_ASSERT_EQUAL_DOUBLE(x, chain_settle(gain, x));
        TEST_ASSERT_EQUAL_DOUBLE(x, chain_settle(settles, x));
        TEST_ASSERT_EQUAL_DOUBLE(x, chain_settle(drift, x));
        TEST_ASSERT_EQUAL_DOUBLE(x, chain_settle(hum, x));
        for (int k = 0; k < 3000; k++) {
            const double t = k / rate;
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, x - 1e-3 * t * (x - 2.0), chain_step(gain, x));
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, x - 1e-3 * 0.7 * (1.0 - exp(-t / 0.7)) * (x - 2.0),
                                      chain_step(settles, x));
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, x + 0.8 * (1.0 - exp(-t / 0.3)), chain_step(drift, x));
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, x + 0.02 * sin(2.0 * M_PI * 50.0 * t + 0.5), chain_step(hum, x));
        }
    }
    chain_close(gain);
    chain_close(settles);
    chain_close(drift);
    chain_close(hum);
}

/* From half of the sample rate on a harmonic is left out; the first line never is. */
static void test_hum_has_harmonics(void) {
    static const double values[BLOCK_MAX_PARAMETERS] = {110.0, 0.02,  0.5,   0.003, -0.004, 0.005,
                                                        0.006, 0.007, 0.008, 0.009, 0.01};
    const double rate = 1000.0, x = 7.0; /* 440 Hz is seen, 550 Hz is not */
    chain_t *hum = open_block(&block_mains_interference, values, rate, 1);
    TEST_ASSERT_EQUAL_DOUBLE(x, chain_settle(hum, x));
    for (int k = 0; k < 5000; k++) {
        const double p = 2.0 * M_PI * 110.0 * k / rate;
        double expected = x + 0.02 * sin(p + 0.5);
        for (int h = 2; h <= 4; h++) {
            expected += values[2 * h - 1] * cos(h * p) + values[2 * h] * sin(h * p);
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, expected, chain_step(hum, x));
    }
    chain_close(hum);
}

/* Loops of amplitude a, f times a second, have the power (a / R)^2 f, and the heat is a low pass of it: with a time
 * constant of many loops it rises with little ripple, and falls at rest. At multiples of the plays' spacing, as here,
 * their sum has that power exactly. The heat comes where a branch ends more than where it begins: a ripple of an eighth
 * of a loop's heat. Twice that is allowed. */
static void test_self_heating_is_the_heat_of_loops(void) {
    const double rate = 1000.0, hz = 25.0, range = 50.0, tau = 2.0, gain = 3e-4, expansion = 0.01;
    for (int part = 1; part <= 2; part++) {
        chain_t *chain = open_block(&block_self_heating, (const double[]){gain, expansion, tau, range}, rate, 1);
        const double power = hz / (part * part), of_a_loop = power / (hz * tau);
        double drive = 0.0, output = chain_settle(chain, 0.0), worst = 0.0;
        for (int k = 1; k <= 8000; k++) {
            const double t = k / rate, rose = -expm1(-fmin(t, 4.0) / tau), fell = exp(-fmax(0.0, t - 4.0) / tau);
            drive = k <= 4000 ? range / part * M_2_PI * asin(sin(2.0 * M_PI * hz * t)) : drive;
            output = chain_step(chain, drive);
            worst = fmax(worst, fabs((output - drive) / (gain * drive + expansion) - power * rose * fell));
        }
        printf("amplitude 1/%d of the range: heat %.4f Hz, within %.4f\n", part, power, worst);
        TEST_ASSERT_TRUE(worst < 0.25 * of_a_loop);
        chain_close(chain);
    }
}

/* The same power in a small loop far from the middle of the range: there is no centre. */
static void test_self_heating_has_no_centre(void) {
    const double rate = 1000.0;
    double heat[2];
    for (int high = 0; high < 2; high++) {
        const double level = high ? 30.0 : 0.0;
        chain_t *chain = open_block(&block_self_heating, (const double[]){0.0, 1.0, 0.5, 50.0}, rate, 1);
        double output = chain_settle(chain, level), drive = level;
        for (int k = 1; k <= 3000; k++) {
            drive = level + 12.5 * sin(2.0 * M_PI * 10.0 * k / rate);
            output = chain_step(chain, drive);
        }
        heat[high] = output - drive;
        chain_close(chain);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 10.0 / 16.0, heat[0]); /* a quarter of a loop's heat, as above */
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, heat[0], heat[1]);     /* rounding */
}

/* A vector that is turned sample by sample against the sine, made with 11 bits more. The angle of a turn (half a turn
 * at most) rounds by 2.2e-16, its cosine and sine by 1.6e-16, the products by as much; there are 255 turns: 1.4e-13 of
 * the amplitude. An hour at 10 kHz is as good as the first second, and so are frequencies beyond the sample rate. */
static void test_hum_is_the_sine(void) {
    random_t random = random_start("hum", 20261122);
    double worst = 0.0;
    for (int run = 0; run < 20; run++) {
        const double rate = 10000.0, hz = run == 0 ? 1.5e4 : 5.0 + 2000.0 * random_unit(&random);
        const double phase = M_PI * (2.0 * random_unit(&random) - 1.0), turns_per_sample = hz / rate;
        chain_t *hum =
            open_block(&block_mains_interference, (const double[BLOCK_MAX_PARAMETERS]){hz, 1.0, phase}, rate, 1);
        for (long k = 0; k < (run == 0 ? 36000000 : 50000); k++) {
            const double y = chain_step(hum, 0.0);
            if (k < 1000 || k % 97 == 0) {
                const long double turns = fmodl((long double)turns_per_sample * (long double)k, 1.0L);
                const long double sine = sinl(2.0L * 3.141592653589793238462643383L * turns + (long double)phase);
                worst = fmax(worst, fabs((double)((long double)y - sine)));
            }
        }
        chain_close(hum);
    }
    printf("hum: within %.1e of the sine\n", worst);
    TEST_ASSERT_TRUE(worst < 1.4e-13);
}

/* At the ends of the range the error is what the numbers say, of half the range. */
static void test_static_nonlinearity_is_its_polynomial(void) {
    const double q = 0.03, c = -0.02, center = 30.0, half = 20.0;
    chain_t *chain = open_block(&block_static_nonlinearity, (const double[]){q, c, center, half}, 1000.0, 1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 50.0 + half * (q + c), chain_step(chain, 50.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 10.0 + half * (q - c), chain_step(chain, 10.0));
    TEST_ASSERT_EQUAL_DOUBLE(30.0, chain_step(chain, 30.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 40.0 + half * (q / 4.0 + c / 8.0), chain_step(chain, 40.0));
    chain_close(chain);
}

/* Beyond the ends of the range it goes on with the slope that it has there, however flat that is. */
static void test_static_nonlinearity_rises_beyond_its_range(void) {
    const double q = 0.4, c = -0.05, center = 30.0, half = 20.0;
    chain_t *chain = open_block(&block_static_nonlinearity, (const double[]){q, c, center, half}, 1000.0, 1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 50.0 + half * (q + c) + 5.0 * (1.0 + 2.0 * q + 3.0 * c), chain_step(chain, 55.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 10.0 + half * (q - c) - 5.0 * (1.0 - 2.0 * q + 3.0 * c), chain_step(chain, 5.0));
    double previous = -HUGE_VAL;
    for (int k = -2000; k <= 2000; k++) { /* it has an inverse */
        const double reading = chain_step(chain, 0.5 * k);
        TEST_ASSERT_TRUE(reading > previous);
        previous = reading;
    }
    chain_close(chain);
}

/* Refused exactly where the slope, looked at on a fine grid, is not positive somewhere in the range. */
static void test_static_nonlinearity_that_falls_is_refused(void) {
    const double one = 1.0;
    int refused = 0;
    random_t random = random_start("falling readings", 22);
    for (int i = 0; i < 3000; i++) {
        const double q = fmax(-1.0, fmin(1.0, 0.5 * random_normal(&random)));
        const double c = fmax(-1.0, fmin(1.0, 0.5 * random_normal(&random)));
        double least = HUGE_VAL;
        for (int k = -1000; k <= 1000; k++) {
            const double s = k / 1000.0;
            least = fmin(least, 1.0 + 2.0 * q * s + 3.0 * c * s * s);
        }
        if (fabs(least) < 1e-5) { /* the grid cannot tell */
            continue;
        }
        model_t model;
        failure_t failure;
        make_bank_model(&model, 1000.0, 0.0, 0, &one, NULL);
        model_block_t *block = model_append(&model, &block_static_nonlinearity);
        model_set(block, "quadratic", q);
        model_set(block, "cubic", c);
        model_set(block, "half_range_um", 1.0);
        TEST_ASSERT_EQUAL(least > 0.0, model_check(&model, "m", &failure));
        if (least <= 0.0) {
            expect_line(&failure, "falls within the range");
            refused++;
        }
        model_free(&model);
    }
    TEST_ASSERT_GREATER_THAN(300, refused); /* both answers were requested */
    TEST_ASSERT_LESS_THAN(2700, refused);
}

/* The ends stay, the middle moves by the number, and beyond the ends it goes on with the slope it has there. */
static void test_asymmetry_bends_the_drive_between_the_ends(void) {
    const double a = 0.2, center = 50.0, half = 40.0;
    chain_t *chain = open_block(&block_asymmetric_hysteresis, (const double[]){a, center, half}, 1000.0, 1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 10.0, chain_step(chain, 10.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 90.0, chain_step(chain, 90.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 50.0 - a * half, chain_step(chain, 50.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 90.0 + 1.4 * 5.0, chain_step(chain, 95.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 10.0 - 0.6 * 5.0, chain_step(chain, 5.0));
    double previous = -HUGE_VAL;
    for (int k = -2000; k <= 2000; k++) { /* it has an inverse */
        const double v = chain_step(chain, 0.5 * k);
        TEST_ASSERT_TRUE(v > previous);
        previous = v;
    }
    chain_close(chain);
}

/* Play operators behind a bent drive, range -1 V to 1 V, demagnetised. */
static chain_t *open_asymmetric(double asymmetry, size_t operators, const double *weights, const double *thresholds) {
    model_t model;
    failure_t failure = {{0}};
    model_create(&model, 1000.0);
    model_block_t *block = model_append(&model, &block_asymmetric_hysteresis);
    model_set(block, "asymmetry", asymmetry);
    model_set(block, "half_range_v", 1.0);
    block = model_append(&model, &block_prandtl_ishlinskii);
    model_set_array(block, "weights", operators + 1, weights, NULL);
    model_set_array(block, "thresholds_v", operators, thresholds, NULL);
    chain_t *chain = chain_open(&model, 1000.0, 1, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(chain, failure.text);
    chain_settle(chain, 0.0);
    model_free(&model);
    return chain;
}

/* Largest difference between a rising branch and the falling one mirrored at the loop's middle. */
static double mirror_error(double asymmetry) {
    enum { POINTS = 2000 };
    const double weights[] = {1.0, 0.5, 0.3}, thresholds[] = {0.2, 0.5};
    double branch[2][POINTS + 1], worst = 0.0;
    chain_t *chain = open_asymmetric(asymmetry, 2, weights, thresholds);
    for (int k = 0; k < 6 * POINTS; k++) { /* three loops; the last one counts */
        const int branch_point = k % (2 * POINTS) % POINTS, falling = k % (2 * POINTS) / POINTS;
        const double u = 2.0 * branch_point / POINTS - 1.0;
        branch[falling][branch_point] = chain_step(chain, falling ? -u : u);
    }
    branch[0][POINTS] = branch[1][0];
    branch[1][POINTS] = branch[0][0];
    const double middle = 0.5 * (branch[0][0] + branch[0][POINTS]);
    for (int k = 0; k <= POINTS; k++) { /* the falling branch runs the same way, mirrored */
        worst = fmax(worst, fabs(branch[0][k] + branch[1][k] - 2.0 * middle));
    }
    chain_close(chain);
    return worst;
}

static void test_asymmetric_branches_are_no_mirror_images(void) {
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, mirror_error(0.0));
    const double full = mirror_error(0.1), half = mirror_error(0.05);
    TEST_ASSERT_TRUE(full > 0.1);
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * full, full, 2.0 * half); /* proportional to the asymmetry */
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, full, mirror_error(-0.1));
}

/* One operator alone, of half the range's threshold: it sets off where g(u) = 0, on the way up and on the way down.
 * Without asymmetry that is the middle; with it the same voltage on both branches, which no mirror image has. */
static void test_an_operator_sets_off_where_the_bent_drive_says(void) {
    const double a = 0.1, corner = (sqrt(1.0 + 4.0 * a * a) - 1.0) / (2.0 * a), weights[] = {0.0, 1.0}, r = 0.5;
    chain_t *chain = open_asymmetric(a, 1, weights, &r);
    for (int turn = 0; turn < 3; turn++) {
        const double from = turn % 2 == 0 ? -1.0 : 1.0;
        chain_step(chain, from);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5 * from, chain_step(chain, corner + 1e-6 * from));
        TEST_ASSERT_TRUE(fabs(chain_step(chain, corner - 1e-6 * from) - 0.5 * from) > 1e-7);
    }
    chain_close(chain);
}

static json_t *model_json(const char *block, const char *parameters, const char *fit) {
    char text[1000];
    const bool first = strcmp(block, "asymmetric_hysteresis") == 0;
    const char *bank = "{\"block\": \"prandtl_ishlinskii\", \"parameters\": {\"offset_um\": 0, \"weights\": [1], "
                       "\"thresholds_v\": []}}";
    snprintf(text, sizeof text,
             "{\"format\": \"hyst-model-1\", \"sample_rate_hz\": 1000, \"chain\": [%s%s{\"block\": \"%s\", "
             "\"parameters\": %s}%s%s]%s}",
             first ? "" : bank, first ? "" : ",", block, parameters, first ? "," : "", first ? bank : "", fit);
    json_t *json = json_loads(text, 0, NULL);
    TEST_ASSERT_NOT_NULL_MESSAGE(json, text);
    return json;
}

/* Numbers that refer to a range take it from the model's fit, or demand it. */
static void test_a_range_that_is_absent_is_that_of_the_fit(void) {
    static const char fit[] = ",\"fit\": {\"drive_range_v\": [10, 110], \"displacement_range_um\": [-2, 18]}";
    static const struct {
        const char *block, *parameters, *center_name, *half_name;
        double center, half;
    } cases[] = {
        {"asymmetric_hysteresis", "{\"asymmetry\": 0.05}", "center_v", "half_range_v", 60.0, 50.0},
        {"static_nonlinearity", "{\"quadratic\": 0.01, \"cubic\": 0}", "center_um", "half_range_um", 8.0, 10.0},
        {"static_nonlinearity", "{\"quadratic\": 0.01, \"cubic\": 0, \"center_um\": 1}", "center_um", "half_range_um",
         1.0, 10.0}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        model_t model;
        failure_t failure = {{0}};
        json_t *json = model_json(cases[i].block, cases[i].parameters, fit);
        TEST_ASSERT_TRUE_MESSAGE(model_from_json(&model, json, "m", &failure), failure.text);
        const model_block_t *block = model_find(&model, cases[i].block);
        TEST_ASSERT_EQUAL_DOUBLE(cases[i].center, model_parameter(block, cases[i].center_name)->value[0]);
        TEST_ASSERT_EQUAL_DOUBLE(cases[i].half, model_parameter(block, cases[i].half_name)->value[0]);
        json_decref(json);
        json = model_to_json(&model); /* written out: the fit may change */
        model_t again;
        json_object_del(json, "fit");
        TEST_ASSERT_TRUE_MESSAGE(model_from_json(&again, json, "m", &failure), failure.text);
        model_free(&again);
        model_free(&model);
        json_decref(json);
    }
    model_t model;
    failure_t failure;
    json_t *json = model_json("asymmetric_hysteresis", "{\"asymmetry\": 0.05}", "");
    TEST_ASSERT_FALSE(model_from_json(&model, json, "m", &failure));
    expect_line(&failure, "missing parameter \"center_v\", and the model's \"fit\" has no \"drive_range_v\"");
    json_decref(json);
}

/* Rounded to 0.02 V, a drive of 160 V/s goes by up to 200 V/s from one sample to the next. A limit between the two
 * would smooth the rounding; where it is looked for the drive itself goes faster. */
static void test_a_limit_is_not_looked_for_within_the_rounding(void) {
    const double true_v_per_s = 160.0;
    probe_setting_t setting = {.sample_rate_hz = 2000.0, .largest_rate_v_per_s = 200.0, .seen.drive_step_v = 0.02};
    double limit_v_per_s;
    size_t count = 0;
    while (block_amplifier_slew_limit.probe->probe(&setting, count, &limit_v_per_s)) {
        TEST_ASSERT_TRUE(limit_v_per_s > 0.0 && limit_v_per_s < true_v_per_s);
        count++;
    }
    TEST_ASSERT_TRUE(count > 0);
    setting.seen.drive_step_v = 0.0; /* not rounded */
    TEST_ASSERT_TRUE(block_amplifier_slew_limit.probe->probe(&setting, 0, &limit_v_per_s));
    TEST_ASSERT_TRUE(limit_v_per_s > true_v_per_s);
    setting.seen.drive_step_v = 0.2; /* it may not move at all */
    TEST_ASSERT_FALSE(block_amplifier_slew_limit.probe->probe(&setting, 0, &limit_v_per_s));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_limit_is_not_looked_for_within_the_rounding);
    RUN_TEST(test_slew_limit_makes_a_smaller_triangle_of_a_steep_one);
    RUN_TEST(test_slew_limit_does_not_depend_on_the_sample_rate);
    RUN_TEST(test_a_drive_within_the_slew_limit_passes_unchanged);
    RUN_TEST(test_saturation_cuts_at_its_rails);
    RUN_TEST(test_dielectric_loss_is_the_same_angle_at_all_frequencies);
    RUN_TEST(test_dielectric_loss_begins_where_it_is_told);
    RUN_TEST(test_leakage_answers_a_ramp_and_a_hold_exactly);
    RUN_TEST(test_leakage_begins_where_it_is_told);
    RUN_TEST(test_drifts_and_hum_are_functions_of_time);
    RUN_TEST(test_hum_has_harmonics);
    RUN_TEST(test_self_heating_is_the_heat_of_loops);
    RUN_TEST(test_self_heating_has_no_centre);
    RUN_TEST(test_hum_is_the_sine);
    RUN_TEST(test_static_nonlinearity_is_its_polynomial);
    RUN_TEST(test_static_nonlinearity_rises_beyond_its_range);
    RUN_TEST(test_static_nonlinearity_that_falls_is_refused);
    RUN_TEST(test_asymmetry_bends_the_drive_between_the_ends);
    RUN_TEST(test_asymmetric_branches_are_no_mirror_images);
    RUN_TEST(test_an_operator_sets_off_where_the_bent_drive_says);
    RUN_TEST(test_a_range_that_is_absent_is_that_of_the_fit);
    return UNITY_END();
}
