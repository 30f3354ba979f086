/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The sensor's noise, found where the drive rests: of first order, with white noise on top. */
#include "diagnosis/noise/noise.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Ten rests of 350 samples; a third of each is left to settling: 2340 speak. */
enum { SAMPLES = 5000, PERIOD = 500, REST = 350 };
static const double rate_hz = 2000.0;
static random_t rng;
static recording_t recording;
static model_t model;
static samples_t samples;
static failure_t failure;

/* memory: of the first-order part, of deviation 1 in itself; white_um: on top of it. */
typedef struct {
    double memory, own_um, white_um;
} truth_t;

static void add_noise(double *x, size_t length, const truth_t *truth) {
    double n = random_normal(&rng);
    for (size_t k = 0; k < length; k++) {
        x[k] += truth->own_um * n + truth->white_um * random_normal(&rng);
        n = truth->memory * n + sqrt(1.0 - truth->memory * truth->memory) * random_normal(&rng);
    }
}

/* The deviation of what cannot be predicted: x = own + white is an ARMA(1, 1), whose covariances at lags 0 and 1,
 * s^2 (1 + m^2) = q + w (1 + a^2) and s^2 m = a w, give s. */
static double unpredictable_um(const truth_t *t) {
    const double q = gsl_pow_2(t->own_um) * (1.0 - gsl_pow_2(t->memory)), w = gsl_pow_2(t->white_um);
    const double sum = q + w * (1.0 + gsl_pow_2(t->memory)), product = t->memory * w;
    return sqrt(0.5 * (sum + sqrt(sum * sum - 4.0 * product * product)));
}

static double rms_um(const truth_t *t) {
    return hypot(t->own_um, t->white_um);
}

/* Ramps between levels that are held, and a position that is far from anything that the noise could be. */
static void fill_steps(void) {
    double *drive = recording.column[COLUMN_DRIVE], *x = recording.column[COLUMN_DISPLACEMENT];
    double level = 0.0, next = 0.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        if (k % PERIOD == 0) {
            level = next;
            next = k / PERIOD % 2 == 0 ? 100.0 : 10.0 * (double)(k / PERIOD % 7);
        }
        const double part = (double)(k % PERIOD) / (PERIOD - REST);
        drive[k] = part < 1.0 ? level + (next - level) * part : next;
        x[k] = 1.0 + 0.1 * drive[k] + 3e-4 * drive[k] * drive[k];
    }
}

void setUp(void) {
    const double weight = 0.1;
    recording_create(&recording, "rests.csv", rate_hz, SAMPLES);
    fill_steps();
    make_bank_model(&model, rate_hz, 0.0, 0, &weight, NULL);
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&samples, &model, &recording, 1, &failure), failure.text);
}

void tearDown(void) {
    samples_close(&samples);
    model_free(&model);
    recording_free(&recording);
}

/* The standard error of a deviation from n independent values is 1 / sqrt(2 n): 1.5 % of n = 2340. Five of them. */
static const double tolerance = 5.0 * 0.0146;
/* The rms of a noise with memory a has n (1 - a^2) / (1 + a^2) values for n. And a parabola takes out of a run what is
 * slower than the run: with c = (1 + a) / (1 - a) samples that move together, three numbers out of `run` / c, of memory
 * 0.99 more than half of 234 samples. So of the square between 1 - 4.5 c / run, if not even that, a tenth, and all of
 * it are found. */
static void expect(const noise_t *noise, const truth_t *truth, double run) {
    const double sigma = unpredictable_um(truth), a2 = gsl_pow_2(truth->memory), rms = rms_um(truth);
    const double together = (1.0 + truth->memory) / (1.0 - truth->memory), own = gsl_pow_2(truth->own_um / rms);
    const double part = fmax(0.1, 1.0 - 4.5 * own * together / run);
    const double scatter = 5.0 * sqrt(0.5 / 2300.0 * (1.0 + a2) / (1.0 - a2));
    TEST_ASSERT_DOUBLE_WITHIN(tolerance * sigma, sigma, noise->sigma_um);
    TEST_ASSERT_TRUE(noise->rms_um < (1.0 + scatter) * rms);
    TEST_ASSERT_TRUE(noise->rms_um > fmax(0.3, 1.0 - scatter) * sqrt(part) * rms);
    TEST_ASSERT_TRUE(noise->rms_um > (1.0 - tolerance) * sigma);
}

static const truth_t truths[] = {
    {0.0, 0.01, 0.0}, {0.9, 0.01, 0.0}, {0.99, 0.01, 0.0}, {0.9, 0.01, 0.005}, {0.99, 0.01, 0.01}};
enum { TRUTHS = sizeof truths / sizeof truths[0] };

static void test_noise_is_found_at_rest(void) {
    for (size_t i = 0; i < TRUTHS; i++) {
        noise_t noise;
        fill_steps();
        add_noise(recording.column[COLUMN_DISPLACEMENT], SAMPLES, &truths[i]);
        TEST_ASSERT_TRUE(noise_at_rest(&samples, NULL, NULL, 0, &noise));
        printf("memory %.2f: found %.3f, mix %.3f, sigma %.5f (%.5f), rms %.5f (%.5f), %zu samples\n", truths[i].memory,
               noise.filter.memory, noise.filter.mix, noise.sigma_um, unpredictable_um(&truths[i]), noise.rms_um,
               rms_um(&truths[i]), noise.samples);
        TEST_ASSERT_TRUE(noise.at_rest);
        TEST_ASSERT_TRUE(noise.samples > 2000 && noise.samples <= 3000);
        expect(&noise, &truths[i], REST - REST / 3.0);
    }
}

/* What drifts slowly and what hums at a frequency that is known is not noise. */
static void test_drift_and_hum_are_no_noise(void) {
    const double hum_hz = 50.0;
    double *x = recording.column[COLUMN_DISPLACEMENT];
    noise_t noise;
    add_noise(x, SAMPLES, &truths[1]);
    for (size_t k = 0; k < SAMPLES; k++) {
        const double t = (double)k / rate_hz;
        x[k] += 0.5 * t * t - t + 0.05 * sin(2.0 * M_PI * hum_hz * t + 1.0);
    }
    TEST_ASSERT_TRUE(noise_at_rest(&samples, NULL, &hum_hz, 1, &noise));
    expect(&noise, &truths[1], REST - REST / 3.0);
    TEST_ASSERT_TRUE(noise_at_rest(&samples, NULL, NULL, 0, &noise)); /* it is the line that makes the difference */
    TEST_ASSERT_TRUE(noise.rms_um > 2.0 * rms_um(&truths[1]));
}

static void test_one_disturbed_rest_is_left_out(void) {
    double *x = recording.column[COLUMN_DISPLACEMENT];
    noise_t noise;
    add_noise(x, SAMPLES, &truths[1]);
    for (size_t k = 4 * PERIOD; k < 5 * PERIOD; k++) {
        x[k] += k % 7 == 0 ? 0.2 : 0.0;
    }
    TEST_ASSERT_TRUE(noise_at_rest(&samples, NULL, NULL, 0, &noise));
    expect(&noise, &truths[1], REST - REST / 3.0);
}

/* However the position moves while the drive does. */
static void test_motion_is_no_noise(void) {
    double *x = recording.column[COLUMN_DISPLACEMENT];
    noise_t noise, other;
    add_noise(x, SAMPLES, &truths[1]);
    TEST_ASSERT_TRUE(noise_at_rest(&samples, NULL, NULL, 0, &noise));
    for (size_t k = 0; k < SAMPLES; k++) {
        const size_t moved = k % PERIOD; /* 0: the drive is still where it rested */
        x[k] += moved > 0 && moved < PERIOD - REST ? 3.0 * random_normal(&rng) : 0.0;
    }
    TEST_ASSERT_TRUE(noise_at_rest(&samples, NULL, NULL, 0, &other));
    TEST_ASSERT_EQUAL_DOUBLE(noise.sigma_um, other.sigma_um);
    TEST_ASSERT_EQUAL_DOUBLE(noise.rms_um, other.rms_um);
}

static void test_without_rest_there_is_none(void) {
    noise_t noise;
    for (size_t k = 0; k < SAMPLES; k++) {
        recording.column[COLUMN_DRIVE][k] = 50.0 + 50.0 * sin(0.05 * (double)k);
    }
    TEST_ASSERT_FALSE(noise_at_rest(&samples, NULL, NULL, 0, &noise));
    fill_steps(); /* two rests: too few samples */
    for (size_t k = 1000; k < SAMPLES; k++) {
        recording.column[COLUMN_DRIVE][k] = (double)(k % 100);
    }
    TEST_ASSERT_FALSE(noise_at_rest(&samples, NULL, NULL, 0, &noise));
}

/* A path of PERIOD samples, again and again: noise, beside a gain and a lag that drift, which are none. */
static void test_noise_is_found_between_passes(void) {
    const probe_passes_t passes = {.from = 0, .to = SAMPLES, .period = PERIOD};
    double *drive = recording.column[COLUMN_DRIVE], *x = recording.column[COLUMN_DISPLACEMENT];
    for (size_t i = 0; i < TRUTHS; i++) {
        noise_t noise;
        for (size_t k = 0; k < SAMPLES; k++) {
            const double turns = (double)k / PERIOD, late = turns - 1e-5 * (double)k / SAMPLES;
            drive[k] = 50.0 + 50.0 * sin(2.0 * M_PI * turns);
            x[k] = 1.0 + (0.1 + 1e-7 * (double)k) * (50.0 + 50.0 * sin(2.0 * M_PI * late)) +
                   3e-4 * drive[k] * drive[k] + (turns < 1.0 ? exp(-0.01 * (double)k) : 0.0);
        }
        add_noise(x, SAMPLES, &truths[i]);
        TEST_ASSERT_TRUE(noise_between_passes(&samples, &passes, NULL, 0, &noise));
        printf("memory %.2f: found %.3f, mix %.3f, sigma %.5f (%.5f), rms %.5f (%.5f), %zu samples\n", truths[i].memory,
               noise.filter.memory, noise.filter.mix, noise.sigma_um, unpredictable_um(&truths[i]), noise.rms_um,
               rms_um(&truths[i]), noise.samples);
        TEST_ASSERT_TRUE(noise.between_passes && !noise.at_rest);
        /* The first pass is not compared; of the other nine the last four are, with those four passes before. */
        TEST_ASSERT_EQUAL_UINT64(SAMPLES / 2, noise.samples);
        expect(&noise, &truths[i], SAMPLES / 4.0);
    }
}

static void repeat(double period) {
    double *drive = recording.column[COLUMN_DRIVE], *x = recording.column[COLUMN_DISPLACEMENT];
    for (size_t k = 0; k < SAMPLES; k++) {
        x[k] = drive[k] = 50.0 + 50.0 * sin(2.0 * M_PI * (double)k / period);
    }
    add_noise(x, SAMPLES, &truths[0]);
}

/* A period of 2.5 samples more: two of them are whole samples. One of a third has none that are: between samples the
 * noise is smoother, which is made up for. The size, not the spectrum: half of it is a cubic's. */
static void test_passes_are_compared_by_whole_samples_or_between(void) {
    noise_t noise;
    repeat(502.5);
    TEST_ASSERT_TRUE(noise_between_passes(&samples, &(probe_passes_t){0, SAMPLES, 502.5}, NULL, 0, &noise));
    expect(&noise, &truths[0], 1000.0);
    static const double periods[] = {500.21, 501.37, 499.46};
    for (size_t i = 0; i < sizeof periods / sizeof periods[0]; i++) {
        repeat(periods[i]);
        TEST_ASSERT_TRUE(noise_between_passes(&samples, &(probe_passes_t){0, SAMPLES, periods[i]}, NULL, 0, &noise));
        printf("period %g: rms %.5f (%.5f), %zu samples\n", periods[i], noise.rms_um, rms_um(&truths[0]),
               noise.samples);
        /* 2500 samples: 1.4 %, and three times that. */
        TEST_ASSERT_DOUBLE_WITHIN(0.05 * rms_um(&truths[0]), rms_um(&truths[0]), noise.rms_um);
    }
}

/* Of two passes all are compared that come after the hysteresis' memory is known. */
static void test_two_passes_are_enough(void) {
    const size_t known = samples.from[0];
    noise_t noise;
    repeat(2000.0);
    samples.from[0] = 700;
    TEST_ASSERT_TRUE(noise_between_passes(&samples, &(probe_passes_t){0, 4000, 2000.0}, NULL, 0, &noise));
    TEST_ASSERT_EQUAL_UINT64(1300, noise.samples);
    expect(&noise, &truths[0], 600.0);
    samples.from[0] = 1300; /* fewer than 1000 */
    TEST_ASSERT_FALSE(noise_between_passes(&samples, &(probe_passes_t){0, 4000, 2000.0}, NULL, 0, &noise));
    samples.from[0] = known;
}

/* Two recordings of one drive, whose gains differ by 2 %. A path that differs by more than a rest may is another one.
 */
static void test_two_recordings_of_one_path_tell_it(void) {
    const probe_passes_t never[2] = {{0}};
    recording_t both[2];
    samples_t of_both;
    noise_t noise;
    for (size_t i = 0; i < 2; i++) {
        recording_create(&both[i], "again.csv", rate_hz, SAMPLES);
        for (size_t k = 0; k < SAMPLES; k++) {
            const double t = (double)k / rate_hz, turn = sin(2.0 * M_PI * t) + 0.5 * sin(2.0 * M_PI * M_E * t);
            both[i].column[COLUMN_DRIVE][k] = 50.0 + 30.0 * turn;
            both[i].column[COLUMN_DISPLACEMENT][k] = (i == 0 ? 1.0 : 1.02) * turn + 0.1 * turn * turn + (double)i;
        }
        add_noise(both[i].column[COLUMN_DISPLACEMENT], SAMPLES, &truths[0]);
    }
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&of_both, &model, both, 2, &failure), failure.text);
    TEST_ASSERT_TRUE(noise_between_passes(&of_both, never, NULL, 0, &noise));
    printf("two recordings: rms %.5f (%.5f), %zu samples\n", noise.rms_um, rms_um(&truths[0]), noise.samples);
    TEST_ASSERT_TRUE(noise.between_passes);
    TEST_ASSERT_EQUAL_UINT64(SAMPLES - 1 - GSL_MAX(of_both.from[0], of_both.from[1]), noise.samples);
    expect(&noise, &truths[0], 1000.0);
    both[1].column[COLUMN_DRIVE][SAMPLES / 2] += 0.5;
    TEST_ASSERT_FALSE(noise_between_passes(&of_both, never, NULL, 0, &noise));
    both[1].column[COLUMN_DRIVE][SAMPLES / 2] -= 0.5;
    both[1].sample_rate_hz *= 10.0; /* the path is the same, and its speed is not */
    TEST_ASSERT_FALSE(noise_between_passes(&of_both, never, NULL, 0, &noise));
    samples_close(&of_both);
    recording_free(&both[0]);
    recording_free(&both[1]);
}

static void test_too_few_samples_come_again(void) {
    static const probe_passes_t passes[] = {
        {0, 1400, 500.0}, {0, SAMPLES + 1, 500.0}, {0, 1900, 1000.0}, {.period = 0.0}};
    noise_t noise;
    repeat(500.0);
    for (size_t i = 0; i < sizeof passes / sizeof passes[0]; i++) {
        TEST_ASSERT_FALSE(noise_between_passes(&samples, &passes[i], NULL, 0, &noise));
    }
}

/* Readings that do not move at all: the size of their noise is not known, but a filter and divisors are needed. */
static void test_constant_readings(void) {
    noise_t noise;
    double *column = samples_column(&samples), *white = samples_column(&samples);
    TEST_ASSERT_TRUE(noise_at_rest(&samples, NULL, NULL, 0, &noise));
    TEST_ASSERT_TRUE(isfinite(noise.sigma_um) && noise.sigma_um > 0.0 && noise.sigma_um < 1e-5);
    TEST_ASSERT_TRUE(isfinite(noise.rms_um) && noise.rms_um > 0.0 && fabs(noise.filter.memory) < 1.0);
    noise_of(&samples, NULL, column, &noise);
    TEST_ASSERT_TRUE(isfinite(noise.sigma_um) && noise.sigma_um > 0.0 && noise.sigma_um < 1e-5);
    TEST_ASSERT_TRUE(isfinite(noise.rms_um) && fabs(noise.filter.memory) < 1.0);
    noise_whiten(&noise, &samples, column, white);
    for (size_t k = 0; k < SAMPLES; k++) {
        TEST_ASSERT_EQUAL_DOUBLE(0.0, white[k]);
    }
    free(column);
    free(white);
}

/* Of a whole column: nothing is taken out of it. */
static void test_noise_of_a_column(void) {
    for (size_t i = 0; i < TRUTHS; i++) {
        double *left = samples_column(&samples);
        noise_t noise;
        add_noise(left, SAMPLES, &truths[i]);
        noise_of(&samples, NULL, left, &noise);
        TEST_ASSERT_FALSE(noise.at_rest);
        expect(&noise, &truths[i], SAMPLES);
        free(left);
    }
}

/* Mean over so many noises of the logarithm of a size that was found, in parts of the true one. */
enum { NOISES = 40 };
typedef struct {
    double sum, squares;
} ratios_t;

static void add_ratio(ratios_t *ratios, double ratio) {
    ratios->sum += log(ratio) / NOISES;
    ratios->squares += gsl_pow_2(log(ratio)) / NOISES;
}

/* Right but for four standard errors by the scatter of what was found, and for what an expectation of less memory
 * costs. */
static void expect_size(const char *what, const ratios_t *ratios, double cost) {
    const double scatter = sqrt(ratios->squares - ratios->sum * ratios->sum);
    const double error = 4.0 * scatter / sqrt((double)NOISES);
    printf("%s: %.3f of the size, scatter %.3f\n", what, exp(ratios->sum), scatter);
    TEST_ASSERT_TRUE(ratios->sum > -cost - error);
    TEST_ASSERT_TRUE(ratios->sum < error);
    TEST_ASSERT_TRUE(scatter < 0.5);
}

/* Rests of 234 samples, a memory of 100, and three numbers out of each: nine seeds found 0.74 to 0.82 of the size. The
 * parabolas left half of it. */
static void test_slow_noise_in_short_rests(void) {
    const truth_t truth = {0.99, 0.01, 0.0};
    ratios_t ratios = {0};
    for (size_t i = 0; i < NOISES; i++) {
        noise_t noise;
        fill_steps();
        add_noise(recording.column[COLUMN_DISPLACEMENT], SAMPLES, &truth);
        TEST_ASSERT_TRUE(noise_at_rest(&samples, NULL, NULL, 0, &noise));
        add_ratio(&ratios, noise.rms_um / truth.own_um);
    }
    expect_size("slow noise in rests", &ratios, 0.25);
}

/* 25 memories long, and 20 columns have taken theirs: unless they are accounted for, less than half of the square is
 * left. */
static void test_slow_noise_beside_columns(void) {
    const truth_t truth = {0.99, 0.01, 0.0};
    ratios_t ratios = {0}, unaware = {0};
    for (size_t i = 0; i < NOISES; i++) {
        double *left = samples_column(&samples), *column = samples_column(&samples);
        basis_t basis;
        noise_t noise;
        basis_open(&basis, SAMPLES, 20);
        for (size_t j = 0; j < basis.most; j++) {
            for (size_t k = samples.from[0]; k < SAMPLES; k++) {
                column[k] = cos(M_PI * (double)(j * k) / SAMPLES);
            }
            basis_add(&basis, column, 1);
        }
        add_noise(left + samples.from[0], SAMPLES - samples.from[0], &truth);
        basis_project(&basis, left, 1);
        noise_of(&samples, &basis, left, &noise);
        add_ratio(&ratios, noise.rms_um / truth.own_um);
        noise_of(&samples, NULL, left, &noise);
        add_ratio(&unaware, noise.rms_um / truth.own_um);
        basis_close(&basis);
        free(left);
        free(column);
    }
    expect_size("slow noise beside columns", &ratios, 0.05);
    TEST_ASSERT_TRUE(unaware.sum < log(0.7));
}

/* Whitened by the filter that was found in it: the correlations of the first ten neighbours of n values are 0 with a
 * standard error of 1 / sqrt(n); 4.5 of them, for 10 x TRUTHS of them. The deviation is sigma. */
static void test_whitened_noise_is_white(void) {
    for (size_t i = 0; i < TRUTHS; i++) {
        double *left = samples_column(&samples), *white = samples_column(&samples), square = 0.0;
        noise_t noise;
        add_noise(left, SAMPLES, &truths[i]);
        noise_of(&samples, NULL, left, &noise);
        noise_whiten(&noise, &samples, left, white);
        const size_t from = samples.from[0] + SAMPLES_SKIPPED, count = SAMPLES - from;
        for (size_t k = 0; k <= samples.from[0]; k++) {
            TEST_ASSERT_EQUAL_DOUBLE(0.0, white[k]);
        }
        for (size_t k = from; k < SAMPLES; k++) {
            square += white[k] * white[k];
        }
        TEST_ASSERT_DOUBLE_WITHIN(tolerance, 1.0, sqrt(square / (double)count) / noise.sigma_um);
        for (size_t lag = 1; lag <= 10; lag++) {
            double product = 0.0;
            for (size_t k = from + lag; k < SAMPLES; k++) {
                product += white[k] * white[k - lag];
            }
            TEST_ASSERT_DOUBLE_WITHIN(4.5 / sqrt((double)count), 0.0, product / square);
        }
        free(left);
        free(white);
    }
}

/* Behind an impulse a whitened column decays, and then is 0: the numbers below DBL_MIN, with which processors are slow,
 * are passed in a few samples or not at all. Before it vanishes it is the geometric series. */
static void test_tails_vanish(void) {
    static const double mixes[] = {0.01, 0.3, 0.5, 0.7, 0.9, 0.99};
    enum { LENGTH = 100000 };
    double *x = allocate(LENGTH, sizeof(double)), *white = allocate(LENGTH, sizeof(double));
    x[0] = 1.0;
    for (size_t i = 0; i < sizeof mixes / sizeof mixes[0]; i++) {
        const noise_filter_t filter = {.memory = 0.995, .mix = mixes[i]};
        size_t small = 0;
        noise_filter_whiten(&filter, x, LENGTH, white);
        for (size_t k = 0; k < LENGTH; k++) {
            small += fpclassify(white[k]) == FP_SUBNORMAL;
        }
        TEST_ASSERT_TRUE(small < 64);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, white[LENGTH - 1]);
        for (size_t k = 2; k < LENGTH && fabs(white[k - 1]) > 1e-190; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-12 * fabs(white[k - 1]), filter.mix * white[k - 1], white[k]);
        }
    }
    free(x);
    free(white);
}

int main(void) {
    rng = random_start("diagnosis_noise", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_noise_is_found_at_rest);
    RUN_TEST(test_drift_and_hum_are_no_noise);
    RUN_TEST(test_one_disturbed_rest_is_left_out);
    RUN_TEST(test_motion_is_no_noise);
    RUN_TEST(test_without_rest_there_is_none);
    RUN_TEST(test_noise_is_found_between_passes);
    RUN_TEST(test_passes_are_compared_by_whole_samples_or_between);
    RUN_TEST(test_two_passes_are_enough);
    RUN_TEST(test_two_recordings_of_one_path_tell_it);
    RUN_TEST(test_too_few_samples_come_again);
    RUN_TEST(test_constant_readings);
    RUN_TEST(test_noise_of_a_column);
    RUN_TEST(test_slow_noise_in_short_rests);
    RUN_TEST(test_slow_noise_beside_columns);
    RUN_TEST(test_whitened_noise_is_white);
    RUN_TEST(test_tails_vanish);
    return UNITY_END();
}
