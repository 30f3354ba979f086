/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Where an effect acts: constructed differences whose place is known. */
#include "diagnosis/noise/lines.h"
#include "diagnosis/where/cells.h"
#include "diagnosis/where/drive_period.h"
#include "diagnosis/where/drive_rate.h"
#include "diagnosis/where/locate.h"
#include "diagnosis/where/loop_parts.h"
#include "numerics/reversals.h"
#include "numerics/spectrum.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

enum { SAMPLES = 12000 };
static const double rate_hz = 1000.0;
static recording_t recording;
static double difference[SAMPLES];

/* 0.5 Hz sine of 40 V about 50 V. */
static void sine_drive(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_DRIVE][k] = 50.0 + 40.0 * sin(2.0 * M_PI * 0.5 * (double)k / rate_hz);
    }
}

/* Up and down in five steps that are held for 0.4 s after a move of 0.1 s. */
static void staircase_drive(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const size_t step = k / 500, in_step = k % 500;
        const double level[] = {0, 20, 40, 60, 80, 100, 80, 60, 40, 20};
        const double from = level[step % 10], to = level[(step + 1) % 10];
        recording.column[COLUMN_DRIVE][k] = from + (to - from) * fmin(1.0, (double)in_step / 100.0);
    }
}

static location_t located(double floor_um) {
    double *const differences[] = {difference};
    const size_t from[] = {0};
    location_t location;
    locate(&recording, 1, differences, from, floor_um, &location);
    return location;
}

static void expect_range(const ranges_t *ranges, double from, double to, double within) {
    TEST_ASSERT_EQUAL_UINT64(1, ranges->count);
    TEST_ASSERT_DOUBLE_WITHIN(within, from, ranges->range[0].from);
    TEST_ASSERT_DOUBLE_WITHIN(within, to, ranges->range[0].to);
}

static void expect_everywhere(const location_t *location) {
    expect_range(&location->time_s, 5.0, 17.0, 1e-9);
    TEST_ASSERT_EQUAL_INT(LOOP_EVERYWHERE, location->loop);
}

/* A cell of time is 0.2 s. */
static void test_burst_is_found_in_time_and_frequency(void) {
    sine_drive();
    for (size_t k = 0; k < SAMPLES; k++) {
        difference[k] = k >= 4000 && k < 4600 ? 0.1 * sin(2.0 * M_PI * 80.0 * (double)k / rate_hz) : 0.0;
    }
    const location_t location = located(0.0);
    TEST_ASSERT_TRUE(location.somewhere);
    TEST_ASSERT_EQUAL_UINT64(1, location.time_s.count);
    TEST_ASSERT_TRUE(location.time_s.range[0].from >= 8.99 && location.time_s.range[0].to <= 9.61);
    TEST_ASSERT_EQUAL_UINT64(1, location.frequency_hz.count);
    TEST_ASSERT_TRUE(location.frequency_hz.range[0].from < 80.0 && location.frequency_hz.range[0].to > 80.0);
    /* 0.6 s are 1.7 Hz wide */
    TEST_ASSERT_TRUE(location.frequency_hz.range[0].from > 75.0 && location.frequency_hz.range[0].to < 85.0);
}

static void test_two_bands_are_two_ranges(void) {
    sine_drive();
    for (size_t k = 0; k < SAMPLES; k++) {
        difference[k] =
            sin(2.0 * M_PI * 7.0 * (double)k / rate_hz) + sin(2.0 * M_PI * 200.0 * (double)k / rate_hz + 1.0);
    }
    const location_t location = located(0.0);
    expect_everywhere(&location);
    TEST_ASSERT_EQUAL_UINT64(2, location.frequency_hz.count);
    TEST_ASSERT_DOUBLE_WITHIN(0.3, 7.0, location.frequency_hz.range[0].from);
    TEST_ASSERT_DOUBLE_WITHIN(0.3, 7.0, location.frequency_hz.range[0].to);
    TEST_ASSERT_DOUBLE_WITHIN(6.0, 200.0, location.frequency_hz.range[1].from);
    TEST_ASSERT_DOUBLE_WITHIN(6.0, 200.0, location.frequency_hz.range[1].to);
}

static void test_harmonics_of_a_periodic_drive(void) {
    sine_drive();
    for (size_t k = 0; k < SAMPLES; k++) {
        const double angle = 2.0 * M_PI * 0.5 * (double)k / rate_hz;
        difference[k] = 0.3 + sin(2.0 * angle) + 0.5 * sin(5.0 * angle + 0.4);
    }
    const location_t location = located(0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.5, location.fundamental_hz);
    TEST_ASSERT_EQUAL_UINT64(2, location.harmonics);
    TEST_ASSERT_EQUAL_UINT(2, location.harmonic[0]);
    TEST_ASSERT_EQUAL_UINT(5, location.harmonic[1]);
}

/* Clipping at 82 V of 90: only at the top, a cell of drive is 3.3 V. */
static void test_clipping_is_at_the_top(void) {
    sine_drive();
    for (size_t k = 0; k < SAMPLES; k++) {
        difference[k] = 0.1 * fmin(0.0, 82.0 - recording.column[COLUMN_DRIVE][k]);
    }
    const location_t location = located(0.0);
    expect_range(&location.drive_v, 85.0, 90.0, 3.4);
    TEST_ASSERT_EQUAL_INT(LOOP_TURNING_POINTS, location.loop);
}

/* What goes with the rate: a delay, a lag. */
static void test_delay_is_in_mid_branch(void) {
    sine_drive();
    for (size_t k = 0; k < SAMPLES; k++) {
        difference[k] = cos(2.0 * M_PI * 0.5 * (double)k / rate_hz);
    }
    TEST_ASSERT_EQUAL_INT(LOOP_MID_BRANCH, located(0.0).loop);
}

static void test_slow_motion_is_in_the_holds(void) {
    staircase_drive();
    for (size_t k = 0; k < SAMPLES; k++) {
        difference[k] = k % 500 < 100 ? 0.0 : 0.01 * log((double)(k % 500) / 100.0);
    }
    TEST_ASSERT_EQUAL_INT(LOOP_HOLDS, located(0.0).loop);
}

/* The slow turn of a sine is no hold, and neither is a small sine beside a large one. */
static void test_the_turn_of_a_sine_is_no_hold(void) {
    sine_drive();
    for (size_t k = SAMPLES / 2; k < SAMPLES; k++) {
        recording.column[COLUMN_DRIVE][k] = 50.0 + 2.0 * sin(2.0 * M_PI * 0.5 * (double)k / rate_hz);
    }
    for (size_t k = 0; k < SAMPLES; k++) {
        difference[k] = gsl_pow_2(sin(2.0 * M_PI * 0.5 * (double)k / rate_hz));
    }
    TEST_ASSERT_EQUAL_INT(LOOP_TURNING_POINTS, located(0.0).loop);
}

/* Triangles from 0 to 100 V, each twice as fast as the one before: 50 to 800 V/s, a cell of rate is 12 %. */
static void triangles_drive(void) {
    double volts = 0.0, direction = 1.0, speed = 50.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_DRIVE][k] = volts;
        volts += direction * speed / rate_hz;
        if (volts >= 100.0 || volts <= 0.0) {
            volts = fmax(0.0, fmin(100.0, volts));
            direction = -direction;
            speed = direction > 0.0 ? fmin(800.0, 2.0 * speed) : speed;
        }
    }
}

/* What the position lacks behind a limit of 300 V/s: nothing at 50 to 200 V/s. */
static void test_a_slew_limit_is_at_high_rates(void) {
    triangles_drive();
    for (size_t k = 1; k < SAMPLES; k++) {
        const double *drive = recording.column[COLUMN_DRIVE];
        difference[k] = fmax(0.0, fabs(drive[k] - drive[k - 1]) * rate_hz - 300.0) * 1e-3;
    }
    const location_t location = located(0.0);
    TEST_ASSERT_EQUAL_UINT64(1, location.drive_rate_v_per_s.count);
    TEST_ASSERT_TRUE(location.drive_rate_v_per_s.range[0].from > 300.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 800.0, location.drive_rate_v_per_s.range[0].to);
}

/* The same square at every rate: all of them, holds included. */
static void test_a_curve_has_no_rate(void) {
    const size_t hold = SAMPLES - 1000;
    triangles_drive();
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_DRIVE][k] = recording.column[COLUMN_DRIVE][k < hold ? k : hold];
        difference[k] = 0.1 * sin(M_PI * recording.column[COLUMN_DRIVE][k] / 100.0);
    }
    const location_t location = located(0.0);
    expect_range(&location.drive_rate_v_per_s, 0.0, 800.0, 1e-6);
}

/* Where the drive rests, and nowhere else: no rate of a motion, however slow. */
static void test_what_rests_has_no_rate(void) {
    staircase_drive();
    for (size_t k = 0; k < SAMPLES; k++) {
        difference[k] = k % 500 < 100 ? 0.0 : 0.01 * log((double)(k % 500) / 100.0);
    }
    const location_t location = located(0.0);
    expect_range(&location.drive_rate_v_per_s, 0.0, 0.0, 0.0);
}

/* 20 V in 100 samples, in steps of 1 V: the rate of a ramp, not 1 V in one sample and nothing in the next four. */
static void test_steps_of_a_converter_are_a_ramp(void) {
    double drive[200], rate[200];
    for (size_t k = 0; k < 200; k++) {
        drive[k] = floor(fmin((double)k, 100.0) / 5.0);
    }
    drive_rates(drive, 200, rate_hz, rate);
    for (size_t k = 5; k < 100; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 200.0, rate[k]);
    }
}

/* 50 V in one sample, then a hold: the motion's for a tenth of a second, then none. */
static void test_a_step_has_a_rate_for_a_while(void) {
    double drive[400], rate[400];
    for (size_t k = 0; k < 400; k++) {
        drive[k] = k < 200 ? 0.0 : 50.0 + 1e-4 * (double)(k % 2);
    }
    drive_rates(drive, 400, rate_hz, rate);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, rate[199]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 50.0 * rate_hz, rate[200]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 50.0 * rate_hz, rate[299]);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, rate[300]);
}

/* 0.5 Hz over 12 s, from the middle to the middle: 12 turns; before the first and behind the last one it does not go
 * further than half of the range. */
static void test_reversals_of_a_sine(void) {
    sine_drive();
    TEST_ASSERT_EQUAL_UINT64(12, reversals_count_by_part(recording.column[COLUMN_DRIVE], SAMPLES, 0.01));
    TEST_ASSERT_EQUAL_UINT64(10, reversals_count_by_part(recording.column[COLUMN_DRIVE], SAMPLES, 0.5));
    TEST_ASSERT_EQUAL_UINT64(0, reversals_count_by_part(recording.column[COLUMN_DRIVE], 400, 0.01));
}

static void test_small_gaps_are_bridged_first(void) {
    const ranges_t ranges = {4, {{1.0, 2.0}, {3.0, 4.0}, {10.0, 11.0}, {11.5, 12.0}}, false};
    const ranges_t three = ranges_bridged(&ranges, cells_linear_gap, 3),
                   all = ranges_bridged(&ranges, cells_linear_gap, 4);
    TEST_ASSERT_EQUAL_UINT64(4, all.count);
    TEST_ASSERT_EQUAL_UINT64(3, three.count);
    TEST_ASSERT_EQUAL_DOUBLE(10.0, three.range[2].from);
    TEST_ASSERT_EQUAL_DOUBLE(12.0, three.range[2].to);
}

static void test_an_even_difference_is_everywhere(void) {
    staircase_drive();
    for (size_t k = 0; k < SAMPLES; k++) {
        difference[k] = random_normal(&rng);
    }
    const location_t location = located(0.0);
    expect_everywhere(&location);
    expect_range(&location.drive_v, 0.0, 100.0, 1e-9);
    TEST_ASSERT_TRUE(location.frequency_hz.range[location.frequency_hz.count - 1].to > 450.0);
}

/* Noise of deviation 1 all over, and a burst of 2 in a fortieth of the time: without the floor the noise has 91 % of
 * the energy. */
static void test_noise_below_the_floor_is_no_place(void) {
    sine_drive();
    for (size_t k = 0; k < SAMPLES; k++) {
        difference[k] = random_normal(&rng);
    }
    TEST_ASSERT_FALSE(located(1.1).somewhere); /* 1.1: 15 standard errors of the deviation above 1 */
    for (size_t k = 7000; k < 7300; k++) {
        difference[k] += 4.0 * sin(2.0 * M_PI * 33.0 * (double)k / rate_hz);
    }
    expect_range(&(ranges_t){1, {located(0.0).time_s.range[0]}, false}, 5.0, 17.0, 1e-9);
    /* Cells of 0.2 s of noise scatter by 10 % about the floor; the burst has 9 times it in 1.5 cells. */
    const location_t location = located(1.0);
    TEST_ASSERT_TRUE(location.somewhere);
    for (size_t i = 0; i < location.time_s.count; i++) {
        printf("%g..%g s ", location.time_s.range[i].from, location.time_s.range[i].to);
    }
    printf("\n");
    bool met = false;
    for (size_t i = 0; i < location.time_s.count; i++) {
        met = met || (location.time_s.range[i].from <= 12.05 && location.time_s.range[i].to >= 12.25);
    }
    TEST_ASSERT_TRUE(met);
}

static void test_nothing_is_nowhere(void) {
    sine_drive();
    memset(difference, 0, sizeof difference);
    TEST_ASSERT_FALSE(located(0.0).somewhere);
}

static void test_the_recording_that_has_most_of_it(void) {
    recording_t both[2];
    double *differences[2];
    const size_t from[2] = {0, 1000};
    location_t location;
    for (size_t i = 0; i < 2; i++) {
        recording_create(&both[i], "r", 500.0 * (double)(i + 1), 4000);
        differences[i] = allocate(4000, sizeof(double));
        for (size_t k = 0; k < 4000; k++) {
            both[i].column[COLUMN_DRIVE][k] = sin((double)k / 100.0);
            differences[i][k] = (i == 0 ? 0.1 : k < 1000 ? 100.0 : 1.0) * sin((double)k / 7.0);
        }
    }
    locate(both, 2, differences, from, 0.0, &location);
    TEST_ASSERT_EQUAL_UINT64(1, location.recording);
    expect_range(&location.time_s, 1.0, 4.0, 1e-9); /* what counts of the second one */
    for (size_t i = 0; i < 2; i++) {
        recording_free(&both[i]);
        free(differences[i]);
    }
}

/* Random periods, 1e-4 of noise: within a sample over half of the recording. */
static void test_period_of_any_length(void) {
    static double drive[SAMPLES];
    for (int trial = 0; trial < 100; trial++) {
        const double period = exp(log(20.0) + random_unit(&rng) * log(SAMPLES / 3.1 / 20.0)),
                     third = 0.3 * random_unit(&rng);
        for (size_t k = 0; k < SAMPLES; k++) {
            const double angle = 2.0 * M_PI * (double)k / period;
            drive[k] = sin(angle) + third * sin(3.0 * angle + 0.3) + 1e-4 * random_normal(&rng);
        }
        const double found = drive_period(drive, SAMPLES);
        char message[80];
        snprintf(message, sizeof message, "period %.4f, found %.4f, third %.3f", period, found, third);
        /* Short ones need not fall on samples: then a multiple of the period is what repeats. */
        const double multiple = fmax(1.0, round(found / period));
        TEST_ASSERT_TRUE_MESSAGE(found > 0.0, message);
        TEST_ASSERT_TRUE_MESSAGE(period < 60.0 || multiple == 1.0, message);
        TEST_ASSERT_TRUE_MESSAGE(fabs(found / multiple - period) < 4.0 * period / SAMPLES, message);
    }
}

static void test_no_period(void) {
    static double drive[SAMPLES];
    double walk = 0.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        drive[k] = sin(1e-6 * (double)k * (double)k); /* a chirp to 4 Hz */
    }
    TEST_ASSERT_EQUAL_DOUBLE(0.0, drive_period(drive, SAMPLES));
    for (size_t k = 0; k < SAMPLES; k++) {
        drive[k] = walk += random_normal(&rng);
    }
    TEST_ASSERT_EQUAL_DOUBLE(0.0, drive_period(drive, SAMPLES));
    for (size_t k = 0; k < SAMPLES; k++) {
        drive[k] = sin((double)k / 50.0) * (k < SAMPLES - 1000 ? 1.0 : 0.5); /* periodic, but for its end */
    }
    TEST_ASSERT_EQUAL_DOUBLE(0.0, drive_period(drive, SAMPLES));
    for (size_t k = 0; k < SAMPLES; k++) {
        drive[k] = 3.0;
    }
    TEST_ASSERT_EQUAL_DOUBLE(0.0, drive_period(drive, SAMPLES));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, drive_period(drive, 2));
}

/* Parseval, on average over the place under the window: the energy of white noise there scatters by sqrt(3.9 / 12000)
 * (Hann's window squared has a relative spread of 35/18), of which 0.1 are five. The level of 4096 bins of it, three of
 * which are independent of each other in four, by 1/55. */
static void test_spectrum_has_all_the_energy(void) {
    double energy = 0.0, spectral = 0.0, level = 0.0;
    spectrum_t spectrum;
    for (size_t k = 0; k < SAMPLES; k++) {
        difference[k] = random_normal(&rng) + 3.0 * sin((double)k / 10.0);
        energy += difference[k] * difference[k];
    }
    spectrum_of(difference, SAMPLES, rate_hz, &spectrum);
    for (size_t f = 0; f < spectrum.count; f++) {
        spectral += spectrum.energy[f];
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * energy, energy, spectral);
    const size_t upper = spectrum.count / 2;
    for (size_t f = upper; f < spectrum.count - 1; f++) {
        level += spectrum.energy[f] / (double)(spectrum.count - 1 - upper);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * spectrum.white, spectrum.white, level);
    spectrum_free(&spectrum);
}

/* Lines whose amplitude is the noise's deviation and half of that. In 200 trials they were off by 0.02 and 0.03 of a
 * bin rms, 0.09 at most: a quarter is eight times the larger. */
static void test_lines_between_the_bins(void) {
    const double bin_hz = rate_hz / 8192.0; /* of as many samples as are a power of two */
    for (int trial = 0; trial < 20; trial++) {
        const double strong = 50.0 + 150.0 * random_unit(&rng), weak = 250.0 + 200.0 * random_unit(&rng);
        double hz[LINES_MOST];
        for (size_t k = 0; k < SAMPLES; k++) {
            const double turn = 2.0 * M_PI * (double)k / rate_hz;
            difference[k] = random_normal(&rng) + 0.5 * sin(weak * turn) + sin(strong * turn);
        }
        TEST_ASSERT_TRUE(find_lines(difference, SAMPLES, rate_hz, hz) >= 2);
        TEST_ASSERT_DOUBLE_WITHIN(0.25 * bin_hz, strong, hz[0]);
        TEST_ASSERT_DOUBLE_WITHIN(0.25 * bin_hz, weak, hz[1]);
    }
}

int main(void) {
    rng = random_start("locate", 20261121);
    recording_create(&recording, "constructed.csv", rate_hz, SAMPLES);
    recording.start_s = 5.0;
    UNITY_BEGIN();
    RUN_TEST(test_burst_is_found_in_time_and_frequency);
    RUN_TEST(test_two_bands_are_two_ranges);
    RUN_TEST(test_harmonics_of_a_periodic_drive);
    RUN_TEST(test_clipping_is_at_the_top);
    RUN_TEST(test_delay_is_in_mid_branch);
    RUN_TEST(test_slow_motion_is_in_the_holds);
    RUN_TEST(test_the_turn_of_a_sine_is_no_hold);
    RUN_TEST(test_a_slew_limit_is_at_high_rates);
    RUN_TEST(test_a_curve_has_no_rate);
    RUN_TEST(test_what_rests_has_no_rate);
    RUN_TEST(test_steps_of_a_converter_are_a_ramp);
    RUN_TEST(test_a_step_has_a_rate_for_a_while);
    RUN_TEST(test_reversals_of_a_sine);
    RUN_TEST(test_small_gaps_are_bridged_first);
    RUN_TEST(test_an_even_difference_is_everywhere);
    RUN_TEST(test_noise_below_the_floor_is_no_place);
    RUN_TEST(test_nothing_is_nowhere);
    RUN_TEST(test_the_recording_that_has_most_of_it);
    RUN_TEST(test_period_of_any_length);
    RUN_TEST(test_no_period);
    RUN_TEST(test_spectrum_has_all_the_energy);
    RUN_TEST(test_lines_between_the_bins);
    recording_free(&recording);
    return UNITY_END();
}
