/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Whether more than noise is left: of noise alone never, of what has some size always. */
#include "diagnosis/noise/remainder.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RECORDINGS = 2 };
static const size_t lengths[RECORDINGS] = {4000, 2500};
static const double rate_hz = 2000.0, rms_um = 0.01;
static random_t rng;
static recording_t recordings[RECORDINGS];
static model_t model;
static samples_t samples;
static double *simulated, *effect;
static failure_t failure;

static const double memories[] = {0.0, 0.9};

void setUp(void) {
    const double weight = 0.1, corner[] = {0.0, 100.0};
    for (size_t i = 0; i < RECORDINGS; i++) {
        recording_create(&recordings[i], "triangle.csv", rate_hz, lengths[i]);
        fill_lines(recordings[i].column[COLUMN_DRIVE], lengths[i], corner, 2, 250);
    }
    make_bank_model(&model, rate_hz, 0.0, 0, &weight, NULL);
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&samples, &model, recordings, RECORDINGS, &failure), failure.text);
    simulated = samples_column(&samples);
    effect = samples_column(&samples);
    TEST_ASSERT_TRUE_MESSAGE(samples_simulate(&samples, &model, simulated, &failure), failure.text);
}

void tearDown(void) {
    free(simulated);
    free(effect);
    samples_close(&samples);
    model_free(&model);
    for (size_t i = 0; i < RECORDINGS; i++) {
        recording_free(&recordings[i]);
    }
}

/* What the simulation leaves: noise of first order of rms_um in all. */
static noise_t measure(double memory) {
    const double own = sqrt(1.0 - memory * memory);
    for (size_t i = 0; i < RECORDINGS; i++) {
        double n = random_normal(&rng);
        for (size_t k = 0; k < lengths[i]; k++) {
            recordings[i].column[COLUMN_DISPLACEMENT][k] = simulated[samples.begin[i] + k] + rms_um * n;
            n = memory * n + own * random_normal(&rng);
        }
    }
    return (noise_t){.filter.memory = memory, .sigma_um = rms_um * own, .rms_um = rms_um};
}

typedef double shape_t(double t, double seconds);

static void add(shape_t *shape, double size_um) {
    for (size_t i = 0; i < RECORDINGS; i++) {
        for (size_t k = 0; k < lengths[i]; k++) {
            recordings[i].column[COLUMN_DISPLACEMENT][k] +=
                size_um * shape((double)k / rate_hz, (double)lengths[i] / rate_hz);
        }
    }
}

static remainder_t look(const noise_t *noise, double floor_um) {
    return remainder_of(&samples, noise, simulated, effect, floor_um);
}

/* Each shape has a root mean square of about 1. */
static double drift(double t, double seconds) {
    return sqrt(12.0) * (t / seconds - 0.5);
}

static double tone(double t, double seconds) {
    (void)seconds;
    return M_SQRT2 * sin(2.0 * M_PI * 217.0 * t + 0.7);
}

static double jumps(double t, double seconds) {
    (void)seconds;
    return fmod(t, 0.4) < 0.2 ? 1.0 : -1.0;
}

static double wandering_tone(double t, double seconds) {
    return M_SQRT2 * sin(2.0 * M_PI * (300.0 + 60.0 * t / seconds) * t);
}

static const struct {
    shape_t *shape;
    double low_hz, high_hz; /* where most of it is */
    double size;            /* of it, in parts of the noise, that is seen */
    double part;            /* of it that is: Hann's window hides the ends of a ramp, sqrt(12 <u^2>) of it is left */
} shapes[] = {{drift, 0.0, 3.0, 2.0, 0.49},
              {tone, 217.0, 217.0, 1.0, 1.0},
              {jumps, 2.5, 2.5, 1.0, 1.0},
              {wandering_tone, 300.0, 420.0, 1.0, 1.0}};
enum { SHAPES = sizeof shapes / sizeof shapes[0] };

/* 40 recordings' worth, none structured. */
static void test_noise_alone_is_nothing(void) {
    for (size_t m = 0; m < 2; m++) {
        for (int round = 0; round < 20; round++) {
            const noise_t noise = measure(memories[m]);
            const remainder_t found = look(&noise, 0.0);
            TEST_ASSERT_FALSE(found.structured);
            TEST_ASSERT_EQUAL_UINT64(0, found.outliers);
            TEST_ASSERT_TRUE(found.rms_um >= 0.0 && found.rms_um < 0.4 * rms_um);
            TEST_ASSERT_TRUE(found.by_level.part < 0.15);
        }
    }
}

/* Readings that are left out, as those at the end of a converter, say nothing, neither where they are nor behind them.
 */
static void test_what_is_left_out_leaves_nothing(void) {
    static const double end_um = 7.0;
    rng = random_start("left out", 20261128);
    for (size_t i = 0; i < RECORDINGS; i++) {
        recordings[i].masked = allocate(lengths[i], 1);
        for (size_t k = 0; k < lengths[i]; k++) {
            recordings[i].masked[k] = simulated[samples.begin[i] + k] > end_um ? 1 : 0;
        }
    }
    samples_close(&samples);
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&samples, &model, recordings, RECORDINGS, &failure), failure.text);
    for (size_t m = 0; m < sizeof memories / sizeof memories[0]; m++) {
        const noise_t noise = measure(memories[m]);
        for (size_t i = 0; i < RECORDINGS; i++) {
            for (size_t k = 0; k < lengths[i]; k++) {
                double *reading = &recordings[i].column[COLUMN_DISPLACEMENT][k];
                *reading = recordings[i].masked[k] != 0 ? end_um : *reading;
            }
        }
        const remainder_t remainder = remainder_of(&samples, &noise, simulated, effect, 0.0);
        TEST_ASSERT_FALSE(remainder.structured);
        TEST_ASSERT_EQUAL_UINT64(0, remainder.outliers);
    }
}

/* As large as the noise, a drift twice: seen, where it is. Of its size no more than that and a quarter for chance; less
 * where noise with memory is strong, in whose bands the harmonics of the jumps stay hidden. */
static void test_what_is_large_is_seen(void) {
    for (size_t m = 0; m < 2; m++) {
        for (size_t i = 0; i < SHAPES; i++) {
            const noise_t noise = measure(memories[m]);
            const double size_um = shapes[i].size * rms_um, seen_um = shapes[i].part * size_um;
            add(shapes[i].shape, size_um);
            const remainder_t found = look(&noise, 0.0);
            printf("memory %.1f, shape %zu: %.4f um in %.1f .. %.1f Hz, %zu outliers\n", memories[m], i, found.rms_um,
                   found.low_hz, found.high_hz, found.outliers);
            TEST_ASSERT_TRUE(found.structured);
            TEST_ASSERT_TRUE(found.low_hz <= shapes[i].high_hz && found.high_hz >= shapes[i].low_hz);
            TEST_ASSERT_TRUE(found.rms_um > 0.45 * seen_um && found.rms_um < 1.25 * seen_um);
        }
    }
}

/* A quarter of the noise is too little to be worth mentioning, whatever it is. */
static void test_what_is_small_is_not_mentioned(void) {
    for (size_t m = 0; m < 2; m++) {
        for (size_t i = 0; i < SHAPES; i++) {
            const noise_t noise = measure(memories[m]);
            add(shapes[i].shape, 0.25 * rms_um);
            TEST_ASSERT_FALSE(look(&noise, 0.0).structured);
        }
    }
}

/* Of the position that the model has, and of its direction. */
typedef double of_position_t(double part_of_stroke, double direction);

static double bend(double part_of_stroke, double direction) {
    (void)direction;
    return part_of_stroke > 0.75 ? 2.0 : 0.0;
}

static double play(double part_of_stroke, double direction) {
    (void)part_of_stroke;
    return direction;
}

static void add_of_position(of_position_t *shape, double size_um, const double range[2]) {
    for (size_t i = 0; i < RECORDINGS; i++) {
        const double *x = simulated + samples.begin[i];
        for (size_t k = 1; k < lengths[i]; k++) {
            recordings[i].column[COLUMN_DISPLACEMENT][k] +=
                size_um * shape((x[k] - range[0]) / (range[1] - range[0]), x[k] > x[k - 1] ? 1.0 : -1.0);
        }
    }
}

/* What is always at the same position is seen where it is a quarter of the noise: 6500 samples in 96 means know it to
 * sqrt(96 / 6500) = 0.12 of the noise in the square, 0.09 of 0.25 in the root. Bands of frequencies do not. */
static void test_what_goes_with_the_position(void) {
    double range[2];
    values_range(simulated, samples.all, range);
    for (int rising_and_falling = 0; rising_and_falling < 2; rising_and_falling++) {
        const noise_t noise = measure(0.0);
        add_of_position(rising_and_falling ? play : bend, 0.25 * rms_um, range);
        const remainder_t found = look(&noise, 0.0);
        TEST_ASSERT_TRUE(found.at_levels && found.structured);
        TEST_ASSERT_TRUE(found.rms_um < 0.4 * rms_um);
        TEST_ASSERT_DOUBLE_WITHIN(0.09, 0.25, found.by_level.part);
        if (!rising_and_falling) {
            TEST_ASSERT_DOUBLE_WITHIN(0.05 * (range[1] - range[0]), 0.25 * range[0] + 0.75 * range[1],
                                      found.by_level.low_um);
            TEST_ASSERT_DOUBLE_WITHIN(0.05 * (range[1] - range[0]), range[1], found.by_level.high_um);
        }
        for (size_t k = 0; k < samples.all; k++) {
            effect[k] = (k / 50 % 2 == 0 ? 1.0 : -1.0) * 15.0 * rms_um; /* simulated to two percent */
        }
        TEST_ASSERT_FALSE(look(&noise, 0.0).at_levels);
        TEST_ASSERT_TRUE(look(&noise, 0.0).by_level.part > 0.0);
        memset(effect, 0, samples.all * sizeof(double));
        TEST_ASSERT_FALSE(look(&noise, rms_um).at_levels); /* what steps of a converter may make */
    }
}

/* Single samples: of the whitened residual, so of a colour each one counts twice. Fewer than five may be chance. */
static void test_spikes_are_seen(void) {
    for (size_t m = 0; m < 2; m++) {
        noise_t noise = measure(memories[m]);
        double *x = recordings[0].column[COLUMN_DISPLACEMENT];
        for (size_t i = 0; i < 2; i++) {
            x[1000 + 400 * i] += 14.0 * noise.sigma_um;
        }
        remainder_t found = look(&noise, 0.0);
        TEST_ASSERT_TRUE(found.outliers >= 2 && found.outliers <= 4);
        TEST_ASSERT_FALSE(found.structured);
        for (size_t i = 0; i < 8; i++) {
            x[1100 + 300 * i] += 14.0 * noise.sigma_um;
        }
        found = look(&noise, 0.0);
        TEST_ASSERT_TRUE(found.outliers >= 8);
        TEST_ASSERT_TRUE(found.structured);
        found = look(&noise, 5.0 * noise.sigma_um); /* as many as steps of a converter could make */
        TEST_ASSERT_EQUAL_UINT64(0, found.outliers);
    }
}

/* What was found is right to a few percent: as much of it is no news. */
static void test_part_of_what_was_found_is_no_news(void) {
    const noise_t noise = measure(0.0);
    add(tone, rms_um);
    TEST_ASSERT_TRUE(look(&noise, 0.0).structured);
    TEST_ASSERT_FALSE(look(&noise, rms_um).structured);
    for (size_t k = 0; k < samples.all; k++) {
        effect[k] = (k / 50 % 2 == 0 ? 1.0 : -1.0) * 30.0 * rms_um;
    }
    TEST_ASSERT_FALSE(look(&noise, 0.0).structured);
    for (size_t k = 0; k < samples.all; k++) {
        effect[k] = 30.0 * rms_um; /* an offset is no effect */
    }
    TEST_ASSERT_TRUE(look(&noise, 0.0).structured);
}

/* No noise at all, and a perfect model: nothing, and no division by it. */
static void test_a_perfect_simulation(void) {
    memcpy(recordings[0].column[COLUMN_DISPLACEMENT], simulated, lengths[0] * sizeof(double));
    memcpy(recordings[1].column[COLUMN_DISPLACEMENT], simulated + lengths[0], lengths[1] * sizeof(double));
    const noise_t noise = {.sigma_um = 1e-6, .rms_um = 1e-6};
    const remainder_t found = look(&noise, 0.0);
    TEST_ASSERT_FALSE(found.structured);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, found.rms_um);
    TEST_ASSERT_EQUAL_UINT64(0, found.outliers);
}

int main(void) {
    rng = random_start("diagnosis_remainder", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_noise_alone_is_nothing);
    RUN_TEST(test_what_is_left_out_leaves_nothing);
    RUN_TEST(test_what_is_large_is_seen);
    RUN_TEST(test_what_is_small_is_not_mentioned);
    RUN_TEST(test_what_goes_with_the_position);
    RUN_TEST(test_spikes_are_seen);
    RUN_TEST(test_part_of_what_was_found_is_no_news);
    RUN_TEST(test_a_perfect_simulation);
    return UNITY_END();
}
