/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the look says beside faults: drive, frequency response, rings, creep, noise. */
#include "look/look_text.h"
#include "looked_at.h"
#include "support.h"
#include "unity.h"
#include <complex.h>
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 16384 };
static const double rate_hz = 2000.0, errors = 4.0;
static random_t rng;
static recording_t recording;
static look_t look;
static failure_t failure;

void setUp(void) {
    recording_create(&recording, "look.csv", rate_hz, SAMPLES);
}

void tearDown(void) {
    recording_free(&recording);
}

static double *drive(void) {
    return recording.column[COLUMN_DRIVE];
}

static double *position(void) {
    return recording.column[COLUMN_DISPLACEMENT];
}

static void see(void) {
    TEST_ASSERT_TRUE(look_at(&recording, &look, &failure));
}

/* y[k] = a y[k-1] + b y[k-2] + c u[k-1]: a mode at 90 Hz with damping 0.1, static gain 0.3. */
static const double mode_hz = 90.0, mode_damping = 0.1;

static void filter_numbers(double *a, double *b, double *c) {
    const double w = 2.0 * M_PI * mode_hz / rate_hz, decay = exp(-mode_damping * w);
    *a = 2.0 * decay * cos(w * sqrt(1.0 - mode_damping * mode_damping));
    *b = -decay * decay;
    *c = 0.3 * (1.0 - *a - *b);
}

static double complex filter_at(double f) {
    double a, b, c;
    filter_numbers(&a, &b, &c);
    const double complex z = cexp(-2.0 * M_PI * (double complex)I * f / rate_hz);
    return c * z / (1.0 - a * z - b * z * z);
}

static void fill_filtered(double noise_um) {
    double a, b, c, y1 = 0.0, y2 = 0.0;
    filter_numbers(&a, &b, &c);
    for (size_t k = 0; k < SAMPLES; k++) {
        const double y = a * y1 + b * y2 + (k > 0 ? c * drive()[k - 1] : 0.0);
        position()[k] = y + noise_um * random_normal(&rng);
        y2 = y1;
        y1 = y;
    }
}

/* Of 48 points with two numbers each, 4.5 errors are exceeded once in 1500 runs. To the error the bias of parabolas
 * over 17 lines of 0.12 Hz is added: below 1e-4 of a mode 18 Hz wide. */
static void expect_response(double coherence) {
    TEST_ASSERT_TRUE(look.response.count >= 20);
    for (size_t i = 0; i < look.response.count; i++) {
        const response_point_t *p = &look.response.point[i];
        const double complex truth = filter_at(p->frequency_hz);
        const double phase = carg(truth) - p->phase_rad;
        char text[200];
        snprintf(text, sizeof text, "%g Hz: %g +- %g (%g), phase %g +- %g, coherence %g", p->frequency_hz,
                 p->gain_um_per_v, p->gain_sigma, cabs(truth), phase, p->phase_sigma, p->coherence);
        TEST_ASSERT_TRUE_MESSAGE(fabs(p->gain_um_per_v - cabs(truth)) < 4.5 * p->gain_sigma + 1e-3 * cabs(truth), text);
        TEST_ASSERT_TRUE_MESSAGE(fabs(remainder(phase, 2.0 * M_PI)) < 4.5 * p->phase_sigma + 2e-3, text);
        TEST_ASSERT_TRUE_MESSAGE(p->frequency_hz > 200.0 || p->coherence > coherence, text);
    }
}

static void test_response_to_a_random_drive(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = 10.0 * random_normal(&rng);
    }
    fill_filtered(0.05);
    see();
    TEST_ASSERT_FALSE(look.response.periodic);
    expect_response(0.95);
    const response_point_t *peak = response_peak(&look.response);
    TEST_ASSERT_NOT_NULL(peak);
    TEST_ASSERT_DOUBLE_WITHIN(0.15 * mode_hz, mode_hz, peak->frequency_hz); /* points are 15 % apart there */
    look_free(&look);
}

static void test_response_to_a_repeated_drive(void) {
    enum { PASS = SAMPLES / 8 };
    double pass[PASS] = {0.0};
    for (size_t line = 1; line < 200; line += 2) { /* 1 .. 195 Hz */
        const double phase = 2.0 * M_PI * random_unit(&rng);
        for (size_t k = 0; k < PASS; k++) {
            pass[k] += sin(2.0 * M_PI * (double)(line * k) / PASS + phase);
        }
    }
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = pass[k % PASS];
    }
    fill_filtered(0.01);
    see();
    TEST_ASSERT_TRUE(look.response.periodic);
    TEST_ASSERT_EQUAL(DRIVE_PERIODIC, look.drive.kind);
    TEST_ASSERT_EQUAL_DOUBLE(PASS, look.drive.period);
    for (size_t i = 0; i < look.response.count; i++) {
        const response_point_t *p = &look.response.point[i];
        /* Lines that share a point: the mean over a fifth of an octave of a mode with damping 0.1. */
        TEST_ASSERT_DOUBLE_WITHIN(0.06 * cabs(filter_at(p->frequency_hz)) + errors * p->gain_sigma,
                                  cabs(filter_at(p->frequency_hz)), p->gain_um_per_v);
    }
    look_free(&look);
}

/* Twelve tones below 20 Hz that repeat nothing, digits as a file has them, and a play: its corners make the position's
 * leakage another than the drive's, so that there is something to take for a response above the drive's band. */
static void test_response_ends_where_the_drive_does(void) {
    double hz[12], phase[12], held = 0.0;
    for (size_t i = 0; i < 12; i++) {
        hz[i] = 0.5 + 19.5 * random_unit(&rng);
        phase[i] = 2.0 * M_PI * random_unit(&rng);
    }
    for (size_t k = 0; k < SAMPLES; k++) {
        double v = 50.0;
        for (size_t i = 0; i < 12; i++) {
            v += 5.0 * sin(2.0 * M_PI * hz[i] * (double)k / rate_hz + phase[i]);
        }
        held = fmax(v - 8.0, fmin(v + 8.0, held));
        drive()[k] = 1e-5 * round(1e5 * v);
        position()[k] = 0.2 * v + 0.1 * held + 0.005 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_FALSE(look.response.periodic);
    TEST_ASSERT_TRUE(look.response.count > 0);
    for (size_t i = 0; i < look.response.count; i++) {
        const response_point_t *p = &look.response.point[i];
        char text[120];
        snprintf(text, sizeof text, "%g Hz: %g +- %g um/V", p->frequency_hz, p->gain_um_per_v, p->gain_sigma);
        /* One line is 0.12 Hz, and the points there are 15 % apart. */
        TEST_ASSERT_TRUE_MESSAGE(p->frequency_hz < 20.0 * 1.15 + 17 * 0.13, text);
        TEST_ASSERT_TRUE_MESSAGE(p->gain_um_per_v < 0.3 + errors * p->gain_sigma, text);
    }
    look_free(&look);
}

/* The response without the rest of the look, which takes a second. */
static drive_look_t driven;
static response_t response;

static void respond(void) {
    TEST_ASSERT_TRUE(drive_look(&recording, &driven, &failure));
    response_look(&recording, &driven, &response);
}

static void respond_free(void) {
    drive_look_free(&driven);
    response_free(&response);
}

/* Four plays with weights and radii at random, behind the drive's column. Returns the sum of the weights. */
static double fill_with_plays(double noise_um, double *stiff) {
    enum { PLAYS = 4 };
    double radius[PLAYS], weight[PLAYS], held[PLAYS], sum = 0.0;
    for (size_t i = 0; i < PLAYS; i++) {
        radius[i] = i == 0 ? 0.0 : 25.0 * random_unit(&rng);
        weight[i] = (i == 0 ? 0.05 : 0.01) + 0.05 * random_unit(&rng);
        held[i] = drive()[0];
        sum += weight[i];
    }
    *stiff = weight[0];
    for (size_t k = 0; k < SAMPLES; k++) {
        position()[k] = noise_um * random_normal(&rng);
        for (size_t i = 0; i < PLAYS; i++) {
            held[i] = fmax(drive()[k] - radius[i], fmin(drive()[k] + radius[i], held[i]));
            position()[k] += weight[i] * held[i];
        }
    }
    return sum;
}

/* What plays can do to a tone: never ahead of it; at least the gain of what has no play; and where only the amplitude
 * changes, by so much more as a play's amplitude grows: d(a N(a)) / da of its describing function N is 1.19 at most, at
 * a = 2 r. */
static void expect_plays(const response_point_t *p, double stiff, double sum, double tone_hz) {
    char text[200];
    snprintf(text, sizeof text, "tone of %g Hz, at %g Hz: %g +- %g um/V, phase %g +- %g; plays %g of %g", tone_hz,
             p->frequency_hz, p->gain_um_per_v, p->gain_sigma, p->phase_rad, p->phase_sigma, sum - stiff, sum);
    TEST_ASSERT_TRUE_MESSAGE(p->gain_um_per_v < 1.19 * sum + errors * p->gain_sigma, text);
    TEST_ASSERT_TRUE_MESSAGE(p->gain_um_per_v > stiff - errors * p->gain_sigma, text);
    TEST_ASSERT_TRUE_MESSAGE(p->phase_rad < errors * p->phase_sigma, text);
}

/* The tone and its transient were one smooth spectrum, and parabolas of the response fitted what they do not share. */
static void test_response_to_a_sine_that_fades(void) {
    for (size_t run = 0; run < 24; run++) {
        const double cycles = 4.0 + 16.0 * random_unit(&rng), end = run % 3 == 0 ? 0.0 : 0.8 * random_unit(&rng);
        const double tone_hz = cycles * rate_hz / SAMPLES;
        for (size_t k = 0; k < SAMPLES; k++) {
            const double part = (double)k / SAMPLES;
            drive()[k] = 60.0 - 50.0 * (1.0 - (1.0 - end) * part) * cos(2.0 * M_PI * cycles * part);
        }
        double stiff;
        const double sum = fill_with_plays(run % 2 == 0 ? 0.005 : 0.0, &stiff);
        respond();
        TEST_ASSERT_FALSE(response.periodic);
        TEST_ASSERT_TRUE_MESSAGE(response.count <= 1, drive_kind_text(driven.kind));
        if (response.count == 1) {
            /* The point is the tone's own: within a line. */
            TEST_ASSERT_DOUBLE_WITHIN(rate_hz / SAMPLES, tone_hz, response.point[0].frequency_hz);
            expect_plays(&response.point[0], stiff, sum, tone_hz);
        }
        respond_free();
    }
}

/* As `hyst record` drives: from its lower end and back, less far each time, with a rest before and behind. Harmonics in
 * the position are distortion and response at once, so only what is below the third one is a test. */
static void test_response_to_triangles_that_fade(void) {
    size_t seen = 0;
    for (size_t run = 0; run < 12; run++) {
        const double cycles = (double)(3 + run % 6), rest = 0.02 + 0.05 * random_unit(&rng);
        const double tone_hz = cycles / (1.0 - 2.0 * rest) * rate_hz / SAMPLES;
        for (size_t k = 0; k < SAMPLES; k++) {
            const double part = ((double)k / SAMPLES - rest) / (1.0 - 2.0 * rest) * cycles, cycle = floor(part);
            const bool moves = part > 0.0 && part < cycles;
            drive()[k] =
                10.0 + (moves ? 80.0 * (1.0 - cycle / cycles) * (1.0 - fabs(1.0 - 2.0 * (part - cycle))) : 0.0);
        }
        double stiff;
        const double sum = fill_with_plays(run % 2 == 0 ? 0.005 : 0.0, &stiff);
        respond();
        for (size_t i = 0; i < response.count; i++) {
            const response_point_t *p = &response.point[i];
            if (p->frequency_hz < 2.0 * tone_hz) {
                expect_plays(p, stiff, sum, tone_hz);
                seen += fabs(p->frequency_hz - tone_hz) < rate_hz / SAMPLES ? 1 : 0;
            }
        }
        respond_free();
    }
    TEST_ASSERT_TRUE(seen >= 6); /* of 12; mostly there is one */
}

/* A raster: triangles at one speed on a slow ramp, with a mode behind. Each window has one line of the triangle, and
 * the error hangs on it alone; yet the line agrees with the noise, so the mode stands. */
static void test_response_at_few_lines_far_apart(void) {
    const double line_hz = 41.0 * rate_hz / SAMPLES;
    for (size_t k = 0; k < SAMPLES; k++) {
        const double part = fmod(line_hz * (double)k / rate_hz, 1.0);
        drive()[k] = 40.0 * (1.0 - fabs(1.0 - 2.0 * part)) + 50.0 * (double)k / SAMPLES;
    }
    fill_filtered(0.005);
    respond();
    TEST_ASSERT_FALSE(response.periodic);
    const response_point_t *peak = response_peak(&response);
    TEST_ASSERT_NOT_NULL(peak);
    TEST_ASSERT_DOUBLE_WITHIN(2.0 * line_hz, mode_hz, peak->frequency_hz); /* odd harmonics alone */
    /* Beside the error, what a line that is strong brings of the mode's width (18 Hz) within half a line of 0.12 Hz. */
    TEST_ASSERT_DOUBLE_WITHIN(errors * peak->gain_sigma + 0.01 * cabs(filter_at(peak->frequency_hz)),
                              cabs(filter_at(peak->frequency_hz)), peak->gain_um_per_v);
    respond_free();
}

static void test_a_period_between_samples(void) {
    const double period = rate_hz / 7.31;
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = round(1e4 * (50.0 + 40.0 * sin(2.0 * M_PI * (double)k / period))) / 1e4;
        position()[k] = 0.1 * drive()[k] + 0.001 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_SINE, look.drive.kind);
    TEST_ASSERT_EQUAL(BETWEEN_SMOOTH, look.drive.between);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, period, look.drive.period); /* rounding: 3e-7 of the range; a cubic: 1e-4 */
    look_free(&look);
}

/* Few periods, and long ones: what does not end with a period shifts the maximum of the autocovariance by many samples.
 */
static void test_few_long_periods_without_rounding(void) {
    const double period = (double)SAMPLES / 4.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = 60.0 - 60.0 * cos(2.0 * M_PI * (double)k / period);
        position()[k] = 0.1 * drive()[k] + 0.001 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_SINE, look.drive.kind);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, period, look.drive.period); /* a cubic between samples is exact to far less */
    look_free(&look);
}

/* A converter at 1/24 of the recording's rate: its staircase is neither noise, nor rests, nor steps. */
static void test_a_converter_slower_than_the_recording(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)(k - k % 24) / rate_hz;
        drive()[k] = 50.0 + 45.0 * sin(2.0 * M_PI * 3.1 * t) * (1.0 + 0.3 * sin(2.0 * M_PI * 0.17 * t));
        position()[k] = 0.1 * drive()[k] + 0.005 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_EQUAL_UINT64(24, look.drive.held_samples);
    TEST_ASSERT_EQUAL_INT(BETWEEN_HELD, look.drive.between);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, look.drive.noise_v);
    TEST_ASSERT_EQUAL_UINT64(0, look.drive.steps);
    look_free(&look);
}

/* A sine that swells for the first quarter: its period is that of the rest, not twice that. What is printed is in the
 * file's own times. */
static void test_a_sine_that_swells_at_first(void) {
    char text[4000] = "";
    const fault_list_t no_faults = {0};
    recording.start_s = -2.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz;
        drive()[k] = 60.0 + 50.0 * fmin(1.0, t / 2.0) * sin(2.0 * M_PI * 2.0 * t) + 0.04 * random_normal(&rng);
        position()[k] = 0.1 * drive()[k];
    }
    see();
    /* The drive's noise is 0.3 samples of its mean slope, over thousands of samples. */
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 1000.0, look.drive.period);
    FILE *file = tmpfile();
    looks_print(file, &look, 1, &no_faults);
    rewind(file);
    TEST_ASSERT_TRUE(fread(text, 1, sizeof text - 1, file) > 0);
    fclose(file);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "8.192 s, from t = -2 s\n"), text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, " .. 6.19"), text); /* where the last pass ends */
    look_free(&look);
}

static void test_kinds_of_drive(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = 20.0 * (double)(k / 2048 % 3);
        position()[k] = 0.1 * drive()[k] + 0.001 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_STEPS, look.drive.kind);
    TEST_ASSERT_EQUAL(7, look.drive.steps);
    TEST_ASSERT_EQUAL(3, look.drive.levels);
    TEST_ASSERT_EQUAL(BETWEEN_HELD, look.drive.between);
    look_free(&look);
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz;
        drive()[k] = 10.0 * sin(2.0 * M_PI * (1.0 + 3.0 * t) * t);
        position()[k] = 0.1 * drive()[k] + 0.001 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_SWEEP, look.drive.kind);
    look_free(&look);
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = 50.0 + 30.0 * (fabs((double)(k % 400) - 200.0) / 100.0 - 1.0);
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_TRIANGLE, look.drive.kind);
    look_free(&look);
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = 5.0 + 90.0 * (double)k / SAMPLES;
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_LINES, look.drive.kind);
    look_free(&look);
}

/* From each pass to the next it loses 0.35 % of its amplitude, 0.17 % of its range: what differs is no noise. */
static void test_a_sine_that_dies_away_slowly_is_not_repeated(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz;
        drive()[k] = 50.0 + 40.0 * pow(0.9965, 5.0 * t) * sin(2.0 * M_PI * 5.0 * t);
        position()[k] = 0.1 * drive()[k] + 0.001 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_SWELLING, look.drive.kind);
    TEST_ASSERT_EQUAL_UINT64(0, drive_periods(&look.drive));
    look_free(&look);
}

/* The last percent of its amplitude comes slowly; the passes after that are one path. */
static void test_a_sine_that_settles_is_repeated_from_there_on(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz;
        drive()[k] = 50.0 + 40.0 * (1.0 - 0.02 * exp(-t / 1.0)) * sin(2.0 * M_PI * 5.0 * t);
        position()[k] = 0.1 * drive()[k] + 0.001 * random_normal(&rng);
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_SINE, look.drive.kind);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 400.0, look.drive.period);
    TEST_ASSERT_TRUE(look.drive.repeat.from > 0);
    look_free(&look);
}

static void test_header_key_says_what_is_between_samples(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = random_normal(&rng);
        position()[k] = drive()[k];
    }
    recording_set_key(&recording, "drive_between_samples", "line");
    see();
    TEST_ASSERT_EQUAL(BETWEEN_LINE, look.drive.between);
    TEST_ASSERT_TRUE(look.drive.between_given);
    look_free(&look);
    recording_set_key(&recording, "drive_between_samples", "wavy");
    TEST_ASSERT_FALSE(look_at(&recording, &look, &failure));
    TEST_ASSERT_NOT_NULL(strstr(failure.text, "wavy"));
}

/* What rings: 212.7 Hz seen, damping 0.013, on a slow creep and noise. */
static void test_frequency_and_damping_of_a_ring(void) {
    const double f = 212.7, damping = 0.013, alpha = 2.0 * M_PI * f * damping / sqrt(1.0 - damping * damping);
    for (size_t trial = 0; trial < (INSTRUMENTED ? 1 : 5); trial++) {
        for (size_t k = 0; k < SAMPLES; k++) {
            const double t = ((double)k - 3000.0) / rate_hz;
            drive()[k] = k >= 3000 ? 60.0 : 10.0;
            position()[k] = 0.1 * drive()[k] + 0.004 * random_normal(&rng);
            if (k >= 3000) {
                position()[k] += -4.0 * exp(-alpha * t) * cos(2.0 * M_PI * f * t) + 0.05 * log10(0.01 + t);
            }
        }
        see();
        TEST_ASSERT_EQUAL(1, look.ring.rings);
        TEST_ASSERT_DOUBLE_WITHIN(errors * look.ring.frequency_sigma_hz, f, look.ring.frequency_hz);
        TEST_ASSERT_DOUBLE_WITHIN(errors * look.ring.damping_sigma, damping, look.ring.damping);
        /* Of such a decay an error of 1e-4 is possible; a hundred times as much would be no answer. */
        TEST_ASSERT_TRUE(look.ring.frequency_sigma_hz < 0.01 * f && look.ring.damping_sigma < 0.1 * damping);
        look_free(&look);
    }
}

static void test_a_step_without_a_ring(void) {
    for (size_t k = 0; k < SAMPLES; k++) {
        drive()[k] = k >= 3000 ? 60.0 : 10.0;
        position()[k] = 0.1 * drive()[k] + 0.004 * random_normal(&rng);
        position()[k] += k >= 3000 ? -2.0 * exp(-((double)k - 3000.0) / 40.0) : 0.0;
    }
    see();
    TEST_ASSERT_EQUAL(0, look.ring.rings);
    look_free(&look);
}

/* 1.3 % of the way per decade, in both directions. */
static void test_creep_in_holds(void) {
    const double creep = 0.013;
    for (size_t trial = 0; trial < 5; trial++) {
        double level = 10.0, offset = 0.0;
        size_t since = 0;
        for (size_t k = 0; k < SAMPLES; k++) {
            const double next = k / 4096 % 2 == 1 ? 70.0 : 10.0;
            if (next != level) { /* what crept stays, so that each hold has its own slope */
                offset += 0.1 * (next - level);
                level = next;
                since = k;
            }
            drive()[k] = level;
            position()[k] = offset + 0.002 * random_normal(&rng);
            if (since > 0 && k > since) {
                position()[k] +=
                    creep * 0.1 * (level == 70.0 ? 60.0 : -60.0) * log10((double)(k - since) / rate_hz / 0.1);
            }
        }
        see();
        TEST_ASSERT_EQUAL(3, look.holds.count);
        TEST_ASSERT_TRUE(look.holds.creep_sigma > 0.0 && look.holds.creep_sigma < 0.1 * creep);
        /* The change before a hold has the creep of the first two samples in it: three decades below 0.1 s, 4 %. */
        TEST_ASSERT_DOUBLE_WITHIN(errors * look.holds.creep_sigma + 0.06 * creep, creep, look.holds.creep);
        look_free(&look);
    }
}

/* White 0.01 um; 1/f with the same power in each octave, 0.02 um over four decades: of it the look sees what is above
 * its lowest frequency. Densities of few lines scatter: a fifth of the white, a third of the slow share. */
static void test_noise_in_its_shares(void) {
    scene_t scene;
    recording_t scenes;
    scene_open(&scene, 0, &rng);
    scene.noise_um = 0.01;
    scene.slow_um = 0.02;
    for (size_t k = 0; k < (SCENE_SAMPLES + 64) * SCENE_FINER; k++) { /* all of it is a rest */
        scene.drive[k] = scene.position[k] = 5.0;
    }
    scene_record(&scene, NULL, &rng, &scenes);
    TEST_ASSERT_TRUE(look_at(&scenes, &look, &failure));
    const noise_share_t *rest = &look.noise.rest;
    const double seen = 0.02 * sqrt(log(500.0 / rest->lowest_hz) / log(500.0 / 0.05));
    TEST_ASSERT_DOUBLE_WITHIN(0.2 * 0.01, 0.01, rest->white_um);
    TEST_ASSERT_DOUBLE_WITHIN(seen / 3.0, seen, rest->slow_um);
    look_free(&look);
    recording_free(&scenes);
    scene_close(&scene);
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

static void expect_wave(size_t samples, bool triangle, double shift) {
    char text[100];
    for (size_t k = 0; k < SAMPLES; k++) {
        const double part = fmod(((double)k + shift) / (double)samples, 1.0);
        drive()[k] = 50.0 + 50.0 * (triangle ? 4.0 * fabs(part - 0.5) - 1.0 : sin(2.0 * M_PI * part));
        drive()[k] = 1e-5 * round(1e5 * drive()[k]); /* as a file has it */
    }
    TEST_ASSERT_TRUE(drive_look(&recording, &driven, &failure));
    snprintf(text, sizeof text, "%zu samples a period, shifted by %g: %s, noise %g V", samples, shift,
             drive_kind_text(driven.kind), driven.noise_v);
    TEST_ASSERT_EQUAL_MESSAGE(triangle ? DRIVE_TRIANGLE : DRIVE_SINE, driven.kind, text);
    TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(0.0, driven.noise_v, text);
    drive_look_free(&driven);
}

/* Sines and triangles of 8 to 100 samples a period are what they are, with extremes on samples or between them. None is
 * measured: a triangle's corner has the ratio of differences that noise has. */
static void test_waves_of_few_samples(void) {
    static const size_t samples[] = {8, 10, 12, 16, 20, 40, 100};
    for (size_t i = 0; i < sizeof samples / sizeof *samples; i++) {
        for (size_t triangle = 0; triangle < 2; triangle++) {
            expect_wave(samples[i], triangle != 0, 0.0);
            expect_wave(samples[i], triangle != 0, random_unit(&rng));
        }
    }
}

/* A level at random every so many samples. */
static void fill_levels(size_t hold) {
    double level = 50.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        level = k % hold == 0 ? 10.0 + 80.0 * random_unit(&rng) : level;
        drive()[k] = level;
    }
}

/* The mode rings through all of each hold of 0.1 s. What is left is white: of 10000 samples their deviation is known to
 * 0.7 %, and the fit of shares adds as much. It was 28000 times too small. */
static void test_noise_beside_a_ring(void) {
    fill_levels(200);
    fill_filtered(0.005);
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

/* Hum is no ring of the steps: it stays, as neither share. Its square is 50 times that of the white noise. */
static void test_hum_beside_noise(void) {
    fill_levels(1000);
    for (size_t k = 0; k < SAMPLES; k++) {
        const double hum = 0.05 * sin(2.0 * M_PI * 49.7 * (double)k / rate_hz);
        position()[k] = 0.1 * drive()[k] + hum + 0.005 * random_normal(&rng);
    }
    see();
    /* Its five lines count 8 times the noise each, 40 of 256: some of that is taken for 1/f, off the white. */
    TEST_ASSERT_DOUBLE_WITHIN(0.3 * 0.005, 0.005, look.noise.rest.white_um);
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * 0.035, 0.035, look.noise.rest.other_um); /* 0.05 / sqrt 2 */
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
    look_free(&look);
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

/* Holds of 0.1 s behind a low pass of 60 Hz: no creep is in them. It was 115 % of the way per decade. */
static void test_a_low_pass_is_no_creep(void) {
    const double keep = exp(-2.0 * M_PI * 60.0 / rate_hz);
    double y = 5.0;
    fill_levels(200);
    for (size_t k = 0; k < SAMPLES; k++) {
        position()[k] = y + 0.005 * random_normal(&rng);
        y = keep * y + (1.0 - keep) * 0.1 * drive()[k];
    }
    see();
    /* Nothing, or nothing but what the last of an exponential is behind 12 time constants: 0.02 %. */
    TEST_ASSERT_TRUE(look.holds.creep_sigma <= 0.0 || fabs(look.holds.creep) < 2e-4 + errors * look.holds.creep_sigma);
    look_free(&look);
}

/* A step of 180 Hz with damping 0.02, and a creep of 1.2 % a decade below it, in holds of 0.5 s. The line that is laid
 * through it begins one sample after the step: 2.7 decades of creep are 3 % of the way. */
static void test_creep_beside_a_ring(void) {
    const double creep = 0.012, f = 180.0, alpha = 0.02 * 2.0 * M_PI * f;
    double level = 10.0, offset = 1.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        const size_t since = k % 1000;
        if (since == 0 && k > 0) {
            const double next = 10.0 + 80.0 * random_unit(&rng);
            offset += 0.1 * (next - level) * (1.0 + creep * log10(1000.0));
            level = next;
        }
        drive()[k] = level;
        position()[k] = offset + 0.003 * random_normal(&rng);
        if (k >= 1000) {
            const double t = (double)since / rate_hz, way = 0.1 * (level - drive()[k - since - 1]);
            position()[k] +=
                way * (creep * log10(((double)since + 0.01) / 1000.0) - exp(-alpha * t) * cos(2.0 * M_PI * f * t));
        }
    }
    see();
    TEST_ASSERT_TRUE(look.holds.creep_sigma > 0.0 && look.holds.creep_sigma < 0.1 * creep);
    TEST_ASSERT_DOUBLE_WITHIN(errors * look.holds.creep_sigma + 0.05 * creep, creep, look.holds.creep);
    look_free(&look);
}

/* One reading is 1 um off, or 40 deviations, where the position moves by 0.06 um a sample. The error of the prediction
 * is the noise, and a little of the neighbours'. It was 0.3 um too small, or not seen. */
static void test_size_of_a_wrong_reading_in_motion(void) {
    static const double size_um[] = {1.0, 0.2};
    for (size_t i = 0; i < 2; i++) {
        for (size_t k = 0; k < SAMPLES; k++) {
            drive()[k] = 50.0 - 50.0 * cos(2.0 * M_PI * (double)k / 500.0);
            position()[k] = 0.1 * drive()[k] + 0.005 * random_normal(&rng);
        }
        position()[2222] += size_um[i];
        see();
        TEST_ASSERT_EQUAL_UINT64(1, look.wrong.count);
        TEST_ASSERT_EQUAL_UINT64(2222, look.wrong.at[0]);
        TEST_ASSERT_DOUBLE_WITHIN(6.0 * 0.005, size_um[i], look.wrong.largest_um);
        look_free(&look);
    }
}

/* From 1 to 300 Hz through a mode at 240 Hz: what the response does not cover, it says. */
static void test_response_to_a_sweep_that_ends_fast(void) {
    char text[4000] = "";
    const fault_list_t no_faults = {0};
    for (size_t k = 0; k < SAMPLES; k++) {
        const double ratio = log(300.0), part = (double)k / SAMPLES, duration = SAMPLES / rate_hz;
        drive()[k] = 50.0 - 20.0 * cos(2.0 * M_PI * duration / ratio * (exp(ratio * part) - 1.0));
    }
    const double decay = exp(-0.015 * 2.0 * M_PI * 240.0 / rate_hz), turn = 2.0 * M_PI * 240.0 / rate_hz;
    double y1 = 6.0, y2 = 6.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        const double a = 2.0 * decay * cos(turn), b = -decay * decay;
        const double y = a * y1 + b * y2 + 0.2 * (1.0 - a - b) * drive()[k];
        position()[k] = y + 0.005 * random_normal(&rng);
        y2 = y1;
        y1 = y;
    }
    see();
    TEST_ASSERT_EQUAL(DRIVE_SWEEP, look.drive.kind);
    TEST_ASSERT_FALSE(look.rails.low || look.rails.high); /* there are none, however much the mode swings */
    if (look.response.point[look.response.count - 1].frequency_hz < 250.0) {
        TEST_ASSERT_DOUBLE_WITHIN(15.0, 300.0, look.response.goes_on_to_hz); /* a way is 3.3 samples, of eight */
        FILE *file = tmpfile();
        looks_print(file, &look, 1, &no_faults);
        rewind(file);
        TEST_ASSERT_TRUE(fread(text, 1, sizeof text - 1, file) > 0);
        fclose(file);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "it ends there"), text);
        TEST_ASSERT_NULL_MESSAGE(strstr(text, "rail "), text);
    }
    look_free(&look);
}

static void test_too_short(void) {
    recording.samples = 63;
    TEST_ASSERT_FALSE(look_at(&recording, &look, &failure));
    TEST_ASSERT_NOT_NULL(strstr(failure.text, "63 samples"));
}

/* A lossy actuator has another gain at another speed, as no sensor has that is switched: 4 Hz, then 40 Hz. */
static void test_another_speed_is_no_switch(void) {
    model_t bank;
    make_fine_bank_model(&bank, rate_hz, 50);
    for (size_t k = 0; k < SAMPLES; k++) {
        const double hz = k < SAMPLES / 2 ? 4.0 : 40.0, t = (double)k / rate_hz;
        drive()[k] = 50.0 + 48.0 * sin(2.0 * M_PI * hz * t) * (1.0 - 0.2 * sin(7.0 * t));
    }
    measure_with(&recording, &bank, &block_dielectric_loss, (const double[]){0.05}, 0.01, &rng);
    see();
    TEST_ASSERT_EQUAL_UINT64(0, look.changes.switches);
    look_free(&look);
    model_free(&bank);
}

int main(void) {
    rng = random_start("look", 20260717U);
    UNITY_BEGIN();
    RUN_TEST(test_response_to_a_random_drive);
    RUN_TEST(test_response_to_a_repeated_drive);
    RUN_TEST(test_response_ends_where_the_drive_does);
    RUN_TEST(test_response_to_a_sine_that_fades);
    RUN_TEST(test_response_to_triangles_that_fade);
    RUN_TEST(test_response_at_few_lines_far_apart);
    RUN_TEST(test_a_period_between_samples);
    RUN_TEST(test_few_long_periods_without_rounding);
    RUN_TEST(test_a_converter_slower_than_the_recording);
    RUN_TEST(test_a_sine_that_swells_at_first);
    RUN_TEST(test_kinds_of_drive);
    RUN_TEST(test_a_sine_that_dies_away_slowly_is_not_repeated);
    RUN_TEST(test_a_sine_that_settles_is_repeated_from_there_on);
    RUN_TEST(test_header_key_says_what_is_between_samples);
    RUN_TEST(test_frequency_and_damping_of_a_ring);
    RUN_TEST(test_a_step_without_a_ring);
    RUN_TEST(test_creep_in_holds);
    RUN_TEST(test_noise_in_its_shares);
    RUN_TEST(test_white_noise_has_no_slow_share);
    RUN_TEST(test_a_path_that_repeats_exactly_has_no_noise);
    RUN_TEST(test_another_speed_is_no_switch);
    RUN_TEST(test_waves_of_few_samples);
    RUN_TEST(test_noise_beside_a_ring);
    RUN_TEST(test_hum_beside_noise);
    RUN_TEST(test_a_burst_is_neither_share);
    RUN_TEST(test_noise_in_a_closed_loop);
    RUN_TEST(test_a_position_ahead_is_no_closed_loop);
    RUN_TEST(test_a_low_pass_is_no_creep);
    RUN_TEST(test_creep_beside_a_ring);
    RUN_TEST(test_size_of_a_wrong_reading_in_motion);
    RUN_TEST(test_response_to_a_sweep_that_ends_fast);
    RUN_TEST(test_too_short);
    return UNITY_END();
}
