/* SPDX-License-Identifier: MIT */
/* The reference generator against arithmetic that does not share its method: long division for lines, sin() for sines.
 */
#include "motion/source.h"
#include "random.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>

#define TURN 4294967296.0 /* 2^32 */

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static double true_sine(uint32_t phase) {
    return sin(2.0 * acos(-1.0) * (phase / TURN));
}

static void test_a_sine_plays_whole_turns_and_ends_on_its_offset(void) {
    static const uint32_t increments[] = {1U << 31, 1U << 30, 429496730U, 123456789U, 42949673U};
    for (size_t k = 0; k < sizeof increments / sizeof increments[0]; k++) {
        source_t source;
        const source_settings_t settings = {
            .kind = SOURCE_SINE, .offset = 1000000, .amplitude = 1 << 30, .increment = increments[k], .cycles = 3};
        TEST_ASSERT_TRUE(source_settings_valid(&settings));
        source_reset(&source, 5, 1);
        source_start(&source, &settings);
        /* Every sample n with n * increment below three turns is played. */
        const uint64_t samples = ((UINT64_C(3) << 32) + increments[k] - 1U) / increments[k];
        for (uint64_t n = 0; n < samples; n++) {
            const double exact = settings.offset + settings.amplitude * true_sine((uint32_t)(n * increments[k]));
            const hyst_q31_t value = source_step(&source);
            TEST_ASSERT_TRUE(source.playing);
            TEST_ASSERT_DOUBLE_WITHIN(3.5, exact, value); /* half of 5 units, and one rounding */
        }
        for (int n = 0; n < 3; n++) {
            TEST_ASSERT_EQUAL_INT32(settings.offset, source_step(&source));
            TEST_ASSERT_FALSE(source.playing);
        }
    }
}

static void test_a_sine_saturates(void) {
    source_t source;
    const source_settings_t settings = {
        .kind = SOURCE_SINE, .offset = INT32_MAX, .amplitude = INT32_MIN, .increment = 1U << 28};
    source_reset(&source, 0, 1);
    source_start(&source, &settings);
    for (int n = 0; n < 64; n++) {
        const hyst_q31_t value = source_step(&source);
        const double exact =
            fmin(settings.offset + (double)settings.amplitude * true_sine((uint32_t)n << 28), INT32_MAX);
        TEST_ASSERT_DOUBLE_WITHIN(6.0, exact, value);
    }
    TEST_ASSERT_TRUE_MESSAGE(source.playing, "0 cycles is without end");
}

/* delta i / n rounded to nearest, halves up, at once: with delta = q n + r it is q i + round(r i / n), where r i <
 * 2^64. */
static hyst_q31_t point_of_line(hyst_q31_t from, hyst_q31_t to, uint32_t i, uint32_t n) {
    const int64_t delta = (int64_t)to - from;
    const uint64_t remainder = (uint64_t)(((delta % n) + n) % n);
    const int64_t quotient = (delta - (int64_t)remainder) / n;
    return (hyst_q31_t)(from + quotient * i + (int64_t)((remainder * i + n / 2U) / n));
}

static void play_and_compare(const source_point_t *points, uint32_t count, uint32_t cycles) {
    source_t source;
    const source_settings_t settings = {
        .kind = SOURCE_BREAKPOINTS, .points = points, .point_count = count, .cycles = cycles};
    hyst_q31_t from = random_q31(&rng);
    source_reset(&source, from, 1);
    source_start(&source, &settings);
    for (uint32_t point = 0; point < count * cycles; point++) {
        const source_point_t to = points[point % count];
        const uint32_t samples = to.samples > 0 ? to.samples : 1U;
        for (uint32_t i = 1; i <= samples; i++) {
            TEST_ASSERT_TRUE(source.playing);
            TEST_ASSERT_EQUAL_INT32(point_of_line(from, to.value, i, samples), source_step(&source));
        }
        TEST_ASSERT_EQUAL_INT32_MESSAGE(to.value, source.value, "a line ends exactly on its value");
        from = to.value;
    }
    TEST_ASSERT_FALSE(source.playing);
    TEST_ASSERT_EQUAL_INT32(from, source_step(&source));
}

static void test_lines_are_the_rounded_exact_ones(void) {
    for (int run = 0; run < 2000; run++) {
        source_point_t points[6];
        const uint32_t count = (uint32_t)random_between(&rng, 1, 6);
        for (uint32_t i = 0; i < count; i++) {
            static const int32_t longest[] = {0, 1, 3, 100, 5000};
            points[i].samples = (uint32_t)random_between(&rng, 0, longest[random_between(&rng, 0, 4)]);
            points[i].value =
                random_between(&rng, 0, 4) == 0 ? (run % 2 == 0 ? INT32_MIN : INT32_MAX) : random_q31(&rng);
        }
        play_and_compare(points, count, (uint32_t)random_between(&rng, 1, 3));
    }
}

static void test_the_steepest_and_the_longest_line(void) {
    const source_point_t points[] = {
        {0, INT32_MIN}, {1, INT32_MAX}, {2, INT32_MIN}, {3, INT32_MAX}, {1000003, INT32_MIN}};
    play_and_compare(points, 5, 2);
    /* The longest line of all takes five days: look at its beginning, and jump to its end. */
    const source_point_t longest = {UINT32_MAX, INT32_MAX};
    const source_settings_t settings = {.kind = SOURCE_BREAKPOINTS, .points = &longest, .point_count = 1, .cycles = 1};
    source_t source;
    source_reset(&source, INT32_MIN, 1);
    source_start(&source, &settings);
    for (uint32_t i = 1; i < 100000; i++) {
        TEST_ASSERT_EQUAL_INT32(point_of_line(INT32_MIN, INT32_MAX, i, UINT32_MAX), source_step(&source));
    }
}

static void test_hold_moves_at_most_slew_and_arrives(void) {
    source_t source;
    source_reset(&source, INT32_MIN, 1 << 29);
    source.setpoint = INT32_MAX;
    hyst_q31_t last = INT32_MIN;
    for (int n = 0; n < 8; n++) {
        const hyst_q31_t value = source_step(&source);
        TEST_ASSERT_TRUE((int64_t)value - last <= 1 << 29 && value > last);
        last = value;
    }
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, last);
    source.setpoint = last - 7;
    TEST_ASSERT_EQUAL_INT32(last - 7, source_step(&source));
}

static void test_stopping_holds_the_last_value(void) {
    source_t source;
    const source_point_t point = {1000, 1000000};
    const source_settings_t settings = {.kind = SOURCE_BREAKPOINTS, .points = &point, .point_count = 1};
    source_reset(&source, 0, 1);
    source_start(&source, &settings);
    for (int n = 0; n < 300; n++) {
        (void)source_step(&source);
    }
    source_stop(&source);
    TEST_ASSERT_EQUAL_INT32(300000, source_step(&source));
    TEST_ASSERT_EQUAL_INT32(300000, source_step(&source));
}

/* The phase of sample n of a linear sweep, in turns: sums of an arithmetic progression, in whole units. */
static void test_a_sweep_is_a_sine_of_its_phase_and_ends_on_its_offset(void) {
    enum { SAMPLES = 5000, START = 1000000, END = 300000000, PASSES = 2 };
    source_t source;
    source_settings_t settings = {.kind = SOURCE_SWEEP, .offset = -70000000, .amplitude = 1 << 30, .cycles = PASSES};
    TEST_ASSERT_TRUE(sweep_make(START, END, SAMPLES, SWEEP_LINEAR, &settings.sweep));
    TEST_ASSERT_TRUE(source_settings_valid(&settings));
    source_reset(&source, 5, 1);
    source_start(&source, &settings);
    for (int pass = 0; pass < PASSES; pass++) {
        double turns = 0.0;
        double increment = START / TURN;
        bool turned = false; /* behind the sweep */
        for (int n = 0; n < SAMPLES || !turned; n++) {
            const double exact = settings.offset + settings.amplitude * sin(2.0 * acos(-1.0) * turns);
            TEST_ASSERT_DOUBLE_WITHIN(200.0, exact, source_step(&source)); /* phases of 1e-8 turn, from the doubles */
            TEST_ASSERT_TRUE(source.playing);
            const double next = turns + increment;
            turned = n + 1 >= SAMPLES && floor(next) > floor(turns);
            turns = next;
            increment = n + 1 < SAMPLES ? (START + (n + 1.0) * ((double)END - START) / SAMPLES) / TURN : END / TURN;
        }
        TEST_ASSERT_GREATER_THAN(150.0, turns);
    }
    for (int n = 0; n < 3; n++) {
        TEST_ASSERT_EQUAL_INT32(settings.offset, source_step(&source));
        TEST_ASSERT_FALSE(source.playing);
    }
}

static double true_chord(const source_settings_t *settings, uint32_t phase) {
    double sum = 0.0;
    for (uint32_t i = 0; i < settings->tone_count; i++) {
        const source_tone_t *tone = &settings->tones[i];
        sum += tone->amplitude / 0x1p31 * true_sine(tone->harmonic * phase + tone->phase);
    }
    return settings->offset + settings->amplitude * sum;
}

/* Each tone is within 6 units, and the sum of 16 saturates nowhere here. */
static void test_a_multisine_is_the_sum_of_its_tones(void) {
    for (int run = 0; run < 200; run++) {
        source_tone_t tones[SOURCE_TONES_MAX];
        const uint32_t increment = ((uint32_t)random_bits(&rng) >> random_between(&rng, 8, 24)) + 1U;
        const source_settings_t settings = {.kind = SOURCE_MULTISINE,
                                            .offset = random_q31(&rng) / 4,
                                            .amplitude = random_q31(&rng) / 2,
                                            .increment = increment,
                                            .cycles = 2,
                                            .tones = tones,
                                            .tone_count = (uint32_t)random_between(&rng, 1, SOURCE_TONES_MAX)};
        for (uint32_t i = 0; i < settings.tone_count; i++) {
            const uint32_t most = (1U << 31) / increment;
            tones[i] =
                (source_tone_t){.harmonic = (uint32_t)random_between(&rng, 1, most < 1000 ? (int32_t)most : 1000),
                                .amplitude = random_q31(&rng) / (int32_t)settings.tone_count,
                                .phase = (uint32_t)random_bits(&rng)};
        }
        TEST_ASSERT_TRUE(source_settings_valid(&settings));
        source_t source;
        source_reset(&source, 0, 1);
        source_start(&source, &settings);
        const uint64_t samples = ((UINT64_C(2) << 32) + increment - 1U) / increment;
        const double allowed = 6.0 * settings.tone_count;
        for (uint64_t n = 0; n < samples && n < 20000; n++) {
            TEST_ASSERT_DOUBLE_WITHIN(allowed, true_chord(&settings, (uint32_t)(n * increment)), source_step(&source));
            TEST_ASSERT_TRUE(source.playing);
        }
        if (samples <= 20000) {
            TEST_ASSERT_DOUBLE_WITHIN(allowed, true_chord(&settings, 0), source_step(&source));
            TEST_ASSERT_FALSE(source.playing);
        }
    }
}

static void test_a_multisine_saturates(void) {
    source_tone_t tones[SOURCE_TONES_MAX];
    for (uint32_t i = 0; i < SOURCE_TONES_MAX; i++) {
        tones[i] = (source_tone_t){.harmonic = 1, .amplitude = INT32_MIN};
    }
    const source_settings_t settings = {.kind = SOURCE_MULTISINE,
                                        .amplitude = INT32_MIN,
                                        .increment = 1U << 28,
                                        .tones = tones,
                                        .tone_count = SOURCE_TONES_MAX};
    source_t source;
    source_reset(&source, 0, 1);
    source_start(&source, &settings);
    for (int n = 0; n < 64; n++) {
        const double sum = fmax(-1.0, fmin(1.0, -16.0 * true_sine((uint32_t)n << 28)));
        TEST_ASSERT_DOUBLE_WITHIN(100.0, fmin(-0x1p31 * sum, INT32_MAX), source_step(&source));
    }
}

static void test_tones_that_cannot_be_played_are_said_to_be_invalid(void) {
    source_tone_t tones[2] = {{.harmonic = 1}, {.harmonic = 4}};
    source_settings_t settings = {.kind = SOURCE_MULTISINE, .increment = 1U << 29, .tones = tones, .tone_count = 2};
    TEST_ASSERT_TRUE(source_settings_valid(&settings));
    tones[1].harmonic = 5; /* above half the sample rate */
    TEST_ASSERT_FALSE(source_settings_valid(&settings));
    tones[1].harmonic = UINT32_MAX;
    TEST_ASSERT_FALSE(source_settings_valid(&settings));
    tones[1].harmonic = 0;
    TEST_ASSERT_FALSE(source_settings_valid(&settings));
    settings.tone_count = 1;
    TEST_ASSERT_TRUE(source_settings_valid(&settings));
    settings.increment = 0;
    TEST_ASSERT_FALSE(source_settings_valid(&settings));
    settings.increment = 1;
    settings.tone_count = 0;
    TEST_ASSERT_FALSE(source_settings_valid(&settings));
    settings.tone_count = SOURCE_TONES_MAX + 1U;
    TEST_ASSERT_FALSE(source_settings_valid(&settings));
    settings.kind = SOURCE_SWEEP;
    TEST_ASSERT_FALSE(source_settings_valid(&settings));
}

static void test_what_cannot_be_played_is_said_to_be_invalid(void) {
    source_settings_t settings = {.kind = SOURCE_SINE};
    TEST_ASSERT_FALSE(source_settings_valid(&settings));
    settings.increment = (1U << 31) + 1U;
    TEST_ASSERT_FALSE(source_settings_valid(&settings));
    settings.kind = SOURCE_BREAKPOINTS;
    TEST_ASSERT_FALSE(source_settings_valid(&settings));
    settings.kind = (source_kind_t)5;
    TEST_ASSERT_FALSE(source_settings_valid(&settings));
    settings.kind = SOURCE_HOLD;
    TEST_ASSERT_TRUE(source_settings_valid(&settings));
}

int main(void) {
    rng = random_start("firmware_source", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_a_sine_plays_whole_turns_and_ends_on_its_offset);
    RUN_TEST(test_a_sine_saturates);
    RUN_TEST(test_lines_are_the_rounded_exact_ones);
    RUN_TEST(test_the_steepest_and_the_longest_line);
    RUN_TEST(test_hold_moves_at_most_slew_and_arrives);
    RUN_TEST(test_stopping_holds_the_last_value);
    RUN_TEST(test_a_sweep_is_a_sine_of_its_phase_and_ends_on_its_offset);
    RUN_TEST(test_a_multisine_is_the_sum_of_its_tones);
    RUN_TEST(test_a_multisine_saturates);
    RUN_TEST(test_tones_that_cannot_be_played_are_said_to_be_invalid);
    RUN_TEST(test_what_cannot_be_played_is_said_to_be_invalid);
    return UNITY_END();
}
