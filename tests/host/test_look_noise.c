/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Noise at rest, between passes and between neighbouring readings, and its shares. */
#include "one_look.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <string.h>

/* Adds noise with a density of `power` / f: relaxations, two to an octave, from beyond its lowest frequency on. */
static void add_slow_noise(double power) {
    enum { RELAXATIONS = 31 }; /* from 0.02 Hz to 0.65 kHz */
    const double ratio = sqrt(2.0), part_um = sqrt(power * log(ratio));
    for (int i = 0; i < RELAXATIONS; i++) {
        const double corner_hz = 0.02 * pow(ratio, i);
        const double keep = exp(-2.0 * M_PI * corner_hz / rate_hz), more = part_um * sqrt(1.0 - keep * keep);
        double value = part_um * random_normal(&rng);
        for (size_t k = 0; k < SAMPLES; k++) {
            position()[k] += value;
            value = keep * value + more * random_normal(&rng);
        }
    }
}

/* White 0.01 um, and as much power of 1/f in each factor e as 0.007 um have. Densities of few lines scatter: a fifth of
 * the white, a third of the slow share. */
static void test_noise_in_its_shares(void) {
    const double slow_um = 0.007;
    for (size_t k = 0; k < SAMPLES; k++) { /* all of it is a rest */
        drive()[k] = 5.0;
        position()[k] = 5.0 + 0.01 * random_normal(&rng);
    }
    add_slow_noise(slow_um * slow_um);
    see();
    const noise_share_t *rest = &look.noise.rest;
    const double seen = slow_um * sqrt(log(0.5 * rate_hz / rest->lowest_hz));
    TEST_ASSERT_DOUBLE_WITHIN(0.2 * 0.01, 0.01, rest->white_um);
    TEST_ASSERT_DOUBLE_WITHIN(seen / 3.0, seen, rest->slow_um);
    look_free(&look);
}

static void test_white_noise_has_no_slow_share(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = 3.0;
        position()[k] = 0.01 * random_normal(&rng);
    }
    position()[5000] += 0.2;
    see();
    TEST_ASSERT_DOUBLE_WITHIN(0.0005, 0.01, look.noise.rest.white_um);
    TEST_ASSERT_TRUE(look.noise.rest.slow_um < 0.002);
    TEST_ASSERT_EQUAL(1, look.noise.rest.outliers);
    look_free(&look);
}

static void test_a_path_that_repeats_exactly_has_no_noise(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = (double)(k % 200);
        position()[k] = 0.1 * drive()[k];
    }
    see();
    TEST_ASSERT_GREATER_THAN_UINT(0, look.noise.repeat.samples);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, look.noise.repeat.rms_um);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, look.noise.repeat.white_um);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, look.noise.repeat.slow_um);
    look_free(&look);
}

/* The mode rings through all of each hold of 0.1 s. What is left is white: of 10000 samples their deviation is known to
 * 0.7 %, and the fit of shares adds as much. It was 28000 times too small. */
static void test_noise_beside_a_ring(void) {
    fill_levels(200);
    fill_with_mode(0.005);
    see();
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * 0.005, 0.005, look.noise.rest.white_um);
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * 0.005, 0.005, look.noise.rest.rms_um);
    TEST_ASSERT_TRUE(look.noise.rest.slow_um < 0.002);
    TEST_ASSERT_EQUAL(0, look.noise.rest.outliers);
    /* Nor does it creep: of the way, 0.1 % would be 50 nm. */
    TEST_ASSERT_TRUE(look.holds.count > 60);
    TEST_ASSERT_DOUBLE_WITHIN(fmax(0.001, errors * look.holds.creep_sigma), 0.0, look.holds.creep);
    TEST_ASSERT_TRUE(look.holds.creep_sigma < 0.001);
    look_free(&look);
}

/* Hum is no ring of the steps: it stays, as neither share. Its square is 50 times that of the white noise, whose share
 * came out a fifth low while its lines counted as the largest of noise. */
static void test_hum_beside_noise(void) {
    fill_levels(1000);
    for (size_t k = 0; k < SAMPLES; k++) {
        const double hum = 0.05 * sin(2.0 * M_PI * 49.7 * (double)k / rate_hz);
        position()[k] = 0.1 * drive()[k] + hum + 0.005 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * 0.005, 0.005, look.noise.rest.white_um); /* of 16000 samples: 0.6 % */
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * 0.035, 0.035, look.noise.rest.other_um);  /* 0.05 / sqrt 2 */
    look_free(&look);
}

/* The same with two harmonics, and holds of 0.1 s: of 64 lines a third has hum. All of it was 1/f, and nothing white.
 */
static void test_hum_in_short_holds(void) {
    fill_levels(200);
    for (size_t k = 0; k < SAMPLES; k++) {
        const double turn = 2.0 * M_PI * 50.0 * (double)k / rate_hz;
        const double hum = 0.05 * sin(turn) + 0.02 * sin(2.0 * turn + 1.0) + 0.02 * sin(3.0 * turn + 2.0);
        position()[k] = 0.1 * drive()[k] + hum + 0.005 * random_normal(&rng);
    }
    see();
    /* The parabola that is taken out of each hold has a part in what the lines around it have. */
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * 0.005, 0.005, look.noise.rest.white_um);
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * 0.0406, 0.0406, look.noise.rest.other_um); /* sqrt((0.05^2 + 2 0.02^2) / 2) */
    look_free(&look);
}

/* Noise behind a sensor's low pass, in holds whose spectra are averaged 80 times: no line of it is hum. */
static void test_filtered_noise_is_no_hum(void) {
    const double keep = exp(-2.0 * M_PI * 300.0 / rate_hz), more = 0.005 * sqrt(1.0 - keep * keep);
    double noise = 0.0;
    fill_levels(200);
    for (size_t k = 0; k < SAMPLES; k++) {
        noise = keep * noise + more * random_normal(&rng);
        position()[k] = 0.1 * drive()[k] + noise;
    }
    see();
    const noise_share_t *rest = &look.noise.rest;
    /* Its colour is neither share's; both together are within a fifth, and of 13 runs 0.3 of it was left at most. */
    TEST_ASSERT_DOUBLE_WITHIN(0.2 * 0.005, 0.005, hypot(rest->white_um, rest->slow_um));
    TEST_ASSERT_TRUE(rest->other_um < 0.6 * 0.005);
    look_free(&look);
}

/* A converter with steps of five deviations: where most readings are one code, the next one is not far outside. */
static void test_coarse_readings_at_rest(void) {
    fill_levels(1000);
    for (size_t k = 0; k < SAMPLES; k++) {
        position()[k] = 0.01 * round(100.0 * (0.1 * drive()[k] + 0.002 * random_normal(&rng)));
    }
    position()[5500] += 0.1;
    see();
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.01, look.noise.step_um);
    TEST_ASSERT_EQUAL_UINT64(1, look.noise.rest.outliers);
    look_free(&look);
}

/* Ten readings are 3 um off, in passes that agree to 5 nm: 20 of the differences. */
static void test_a_burst_is_neither_share(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = 50.0 - 50.0 * cos(2.0 * M_PI * (double)k / 1000.0);
        position()[k] = 0.1 * drive()[k] + 0.005 * random_normal(&rng) + (k >= 5500 && k < 5510 ? 3.0 : 0.0);
    }
    see();
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * 0.005, 0.005, look.noise.repeat.white_um); /* of 14000 samples: 0.6 % */
    TEST_ASSERT_UINT64_WITHIN(2, 20, look.noise.repeat.outliers);               /* those beside it may look single */
    TEST_ASSERT_TRUE(look.noise.repeat.other_um < 0.005);
    look_free(&look);
}

/* A controller without any delay but its sample knows the noise of each reading, and so does its drive. 0.005 um are
 * known to 1 % or so; the neighbours' motion adds less than a tenth. It was 1/600 of that. */
static void test_noise_in_a_closed_loop(void) {
    double integral = 40.0, next = 40.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        const double wanted = 8.0 + 4.0 * sin(2.0 * M_PI * 1.5 * (double)k / rate_hz) * (1.0 - 3e-5 * (double)k);
        drive()[k] = next;
        position()[k] = 0.2 * drive()[k] + 0.005 * random_normal(&rng);
        integral += 0.1 * (wanted - position()[k]);
        next = integral + 0.3 * (wanted - position()[k]);
    }
    see();
    TEST_ASSERT_TRUE(look.prediction.fed_back);
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * 0.005, 0.005, look.prediction.noise_um);
    TEST_ASSERT_TRUE(look.drive.noise_v > 0.0); /* that of the readings, and no measurement's */
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(said(), "answers the readings, with noise of 0.00"), said());
    look_free(&look);
}

/* The same with steps that it is to follow, and with up to two samples more before it answers: it was the noise of a
 * measurement, and 1/60 of the readings' noise. */
static void test_noise_in_slower_loops_and_steps(void) {
    for (size_t run = 0; run < 6; run++) {
        const size_t late = run % 3;
        double integral = 40.0, wanted = 8.0, next[3] = {40.0, 40.0, 40.0};
        for (size_t k = 0; k < SAMPLES; k++) {
            if (run < 3) {
                wanted = 8.0 + 4.0 * sin(2.0 * M_PI * 1.5 * (double)k / rate_hz) * (1.0 - 3e-5 * (double)k);
            } else if (k % 1000 == 0) {
                wanted = 4.0 + 8.0 * random_unit(&rng);
            }
            drive()[k] = next[k % 3];
            position()[k] = 0.2 * drive()[k] + 0.005 * random_normal(&rng);
            integral += 0.1 * (wanted - position()[k]);
            next[(k + 1 + late) % 3] = integral + 0.3 * (wanted - position()[k]);
        }
        see();
        TEST_ASSERT_TRUE(look.prediction.fed_back);
        TEST_ASSERT_DOUBLE_WITHIN(0.1 * 0.005, 0.005, look.prediction.noise_um);
        TEST_ASSERT_NULL_MESSAGE(strstr(said(), "measured"), said());
        look_free(&look);
    }
}

/* An open loop whose position is ahead of the drive by half a sample knows what is new in it, too, but goes along. */
static void test_a_position_ahead_is_no_closed_loop(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = 10.0 * random_normal(&rng);
    }
    for (size_t k = 0; k < SAMPLES; k++) {
        const double ahead = k + 1 < SAMPLES ? 0.5 * (drive()[k] + drive()[k + 1]) : drive()[k];
        position()[k] = 0.2 * ahead + 0.005 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_FALSE(look.prediction.fed_back);
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * 0.005, 0.005, look.prediction.noise_um);
    look_free(&look);
}

int main(void) {
    rng = random_start("look_noise", 20260717U);
    UNITY_BEGIN();
    RUN_TEST(test_noise_in_its_shares);
    RUN_TEST(test_white_noise_has_no_slow_share);
    RUN_TEST(test_a_path_that_repeats_exactly_has_no_noise);
    RUN_TEST(test_noise_beside_a_ring);
    RUN_TEST(test_hum_beside_noise);
    RUN_TEST(test_hum_in_short_holds);
    RUN_TEST(test_filtered_noise_is_no_hum);
    RUN_TEST(test_coarse_readings_at_rest);
    RUN_TEST(test_a_burst_is_neither_share);
    RUN_TEST(test_noise_in_a_closed_loop);
    RUN_TEST(test_noise_in_slower_loops_and_steps);
    RUN_TEST(test_a_position_ahead_is_no_closed_loop);
    return UNITY_END();
}
