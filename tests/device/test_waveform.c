/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Waveforms: their corners are where and when they should be, and what cannot be played is refused. */
#include "amplifier/waveform.h"
#include "unity.h"
#include <math.h>

static const double range[2] = {-10.0, 30.0};

void setUp(void) {
}
void tearDown(void) {
}

static waveform_t choose(const waveform_options_t *options) {
    waveform_t w;
    failure_t failure;
    TEST_ASSERT_TRUE(waveform_make(options, range, "V", &w, &failure));
    return w;
}

static void test_defaults_use_four_fifths_of_the_range_around_its_middle(void) {
    waveform_options_t options = WAVEFORM_OPTIONS_DEFAULT;
    options.name = "sine";
    const waveform_t w = choose(&options);
    TEST_ASSERT_TRUE(w.offset == 10.0);
    TEST_ASSERT_TRUE(w.amplitude == 16.0);
    TEST_ASSERT_TRUE(waveform_start(&w) == 10.0);
}

/* At a rate that no period fits into, the corners stay within half a sample of their true times to the end. */
static void test_rounding_to_samples_does_not_add_up(void) {
    waveform_options_t options = WAVEFORM_OPTIONS_DEFAULT;
    options.name = "triangle";
    options.cycles = 63;
    options.frequency_hz = 7.0;
    const double rate_hz = 10007.3;
    const waveform_t w = choose(&options);
    breakpoint_t corner[WAVEFORM_MAX_BREAKPOINTS];
    const size_t corners = waveform_breakpoints(&w, rate_hz, corner);
    TEST_ASSERT_EQUAL_UINT(127, corners);
    double samples = 0.0;
    for (size_t i = 0; i + 1 < corners; i++) {
        samples += corner[i].samples;
        const double cycles = 0.25 + 0.5 * (double)i;
        TEST_ASSERT_DOUBLE_WITHIN(0.5, cycles * rate_hz / 7.0, samples);
        const size_t cycle = i / 2;
        const double swing = 16.0 * (63.0 - (double)cycle) / 63.0;
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, i % 2 == 0 ? 10.0 + swing : 10.0 - swing, corner[i].level);
    }
    samples += corner[corners - 1].samples;
    TEST_ASSERT_DOUBLE_WITHIN(0.5, 9.0 * rate_hz, samples);
    TEST_ASSERT_TRUE(corner[corners - 1].level == 10.0);
}

static void test_staircase_goes_up_and_down_and_closes(void) {
    waveform_options_t options = WAVEFORM_OPTIONS_DEFAULT;
    options.name = "staircase";
    options.steps = 32;
    const waveform_t w = choose(&options);
    breakpoint_t corner[WAVEFORM_MAX_BREAKPOINTS];
    const size_t corners = waveform_breakpoints(&w, 10000.0, corner);
    TEST_ASSERT_EQUAL_UINT(WAVEFORM_MAX_BREAKPOINTS, corners);
    double samples = 0.0;
    double previous = waveform_start(&w);
    for (size_t i = 0; i < corners; i += 2) {
        TEST_ASSERT_TRUE(corner[i].level == corner[i + 1].level); /* rises, then holds */
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, i < corners / 2 ? 1.0 : -1.0, corner[i].level - previous);
        previous = corner[i].level;
        samples += corner[i].samples + corner[i + 1].samples;
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, waveform_start(&w), previous);
    TEST_ASSERT_TRUE(samples == 10000.0);
}

static void expect_whole_length(const char *name, unsigned long steps, double rate_hz) {
    waveform_options_t options = WAVEFORM_OPTIONS_DEFAULT;
    options.name = name;
    options.cycles = 1;
    options.steps = steps;
    waveform_t w = choose(&options);
    w.frequency_hz = waveform_lowest_hz(&w, rate_hz);
    breakpoint_t corner[WAVEFORM_MAX_BREAKPOINTS];
    const size_t corners = waveform_breakpoints(&w, rate_hz, corner);
    double samples = 0.0;
    uint32_t longest = 0;
    for (size_t i = 0; i < corners; i++) {
        samples += corner[i].samples;
        longest = corner[i].samples > longest ? corner[i].samples : longest;
    }
    TEST_ASSERT_DOUBLE_WITHIN(1.0, rate_hz / w.frequency_hz, samples);
    TEST_ASSERT_GREATER_THAN_UINT32(UINT32_MAX - 4, longest);
}

/* And no lower: the longest line has all samples that the amplifier counts. */
static void test_the_lowest_frequency_has_its_whole_length(void) {
    expect_whole_length("triangle", 1, 10000.0);
    expect_whole_length("triangle", 1, 9999.7);
    expect_whole_length("staircase", 1, 10000.0);
    expect_whole_length("staircase", 32, 10000.0);
    waveform_options_t options = WAVEFORM_OPTIONS_DEFAULT;
    options.name = "sine";
    const waveform_t w = choose(&options);
    TEST_ASSERT_TRUE(waveform_lowest_hz(&w, 10000.0) == 0.0);
}

static void refuse(const char *name, double frequency, double amplitude, double offset, unsigned long cycles,
                   unsigned long steps) {
    waveform_options_t options = WAVEFORM_OPTIONS_DEFAULT;
    options.name = name;
    options.frequency_hz = frequency;
    options.amplitude = amplitude;
    options.offset = offset;
    options.cycles = cycles;
    options.steps = steps;
    waveform_t w;
    failure_t failure;
    TEST_ASSERT_FALSE(waveform_make(&options, range, "V", &w, &failure));
}

static void test_what_cannot_be_played_is_wrong_usage(void) {
    refuse(NULL, 1.0, 5.0, 10.0, 1, 10);
    refuse("square", 1.0, 5.0, 10.0, 1, 10);
    refuse("sine", 0.0, 5.0, 10.0, 1, 10);
    refuse("sine", -1.0, 5.0, 10.0, 1, 10);
    refuse("sine", 1.0, 0.0, 10.0, 1, 10);
    refuse("sine", 1.0, -5.0, 10.0, 1, 10);
    refuse("sine", 1.0, 20.1, 10.0, 1, 10); /* both ends outside */
    refuse("sine", 1.0, 5.0, 26.0, 1, 10);
    refuse("sine", 1.0, 5.0, -6.0, 1, 10);
    refuse("sine", 1.0, 5.0, 10.0, 0, 10);
    refuse("triangle", 1.0, 5.0, 10.0, 64, 10);
    refuse("staircase", 1.0, 5.0, 10.0, 1, 0);
    refuse("staircase", 1.0, 5.0, 10.0, 1, 33);
}

/* Looked at where no peak was looked for. */
static void expect_tones(double frequency_hz, double end_hz, unsigned long tones, size_t expected) {
    waveform_options_t options = WAVEFORM_OPTIONS_DEFAULT;
    options.name = "multisine";
    options.frequency_hz = frequency_hz;
    options.end_frequency_hz = end_hz;
    options.tones = tones;
    const waveform_t w = choose(&options);
    TEST_ASSERT_EQUAL_UINT(expected, w.tones);
    uint32_t last = 0;
    for (size_t i = 0; i < w.tones; i++) {
        TEST_ASSERT_EQUAL_UINT32(1, w.tone[i].harmonic % 2U);
        TEST_ASSERT_GREATER_THAN_UINT32(last, w.tone[i].harmonic);
        TEST_ASSERT_TRUE(w.tone[i].phase_turns >= 0.0 && w.tone[i].phase_turns < 1.0);
        last = w.tone[i].harmonic;
    }
    TEST_ASSERT_TRUE(last * frequency_hz <= end_hz * (1.0 + 1e-9));
    double peak = 0.0;
    const uint32_t instants = 1000 * last;
    double start = 0.0;
    for (uint32_t k = 0; k < instants; k++) {
        double sum = 0.0;
        for (size_t i = 0; i < w.tones; i++) {
            sum += w.tone[i].amplitude *
                   sin(2.0 * acos(-1.0) * (w.tone[i].harmonic * (double)k / instants + w.tone[i].phase_turns));
        }
        peak = fmax(peak, fabs(sum));
        start = k > 0 ? start : sum;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.001, 0.999, peak); /* no more than the amplitude, and hardly less */
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, w.offset + w.amplitude * start, waveform_start(&w));
}

static void test_the_tones_of_a_multisine(void) {
    expect_tones(1.0, 100.0, 16, 16);
    expect_tones(2.0, 200.0, 5, 5);
    expect_tones(1.0, 7.5, 16, 4); /* 1 3 5 7 */
    expect_tones(10.0, 10.0, 3, 1);
    expect_tones(0.7, 9.8, 2, 2);
}

static void refuse_tones(const char *name, double end_hz, double sweep_s, unsigned long tones) {
    waveform_options_t options = WAVEFORM_OPTIONS_DEFAULT;
    waveform_t w;
    failure_t failure;
    options.name = name;
    options.end_frequency_hz = end_hz;
    options.sweep_s = sweep_s;
    options.tones = tones;
    TEST_ASSERT_FALSE(waveform_make(&options, range, "V", &w, &failure));
}

static void test_what_cannot_be_swept_or_sounded_is_wrong_usage(void) {
    refuse_tones("sweep", 0.0, 1.0, 16);
    refuse_tones("sweep", -1.0, 1.0, 16);
    refuse_tones("sweep", 10.0, 0.0, 16);
    refuse_tones("sweep", 10.0, 1e9, 16);
    refuse_tones("sweep", (double)NAN, 1.0, 16);
    refuse_tones("multisine", 0.9, 1.0, 16);
    refuse_tones("multisine", 1e9, 1.0, 16);
    refuse_tones("multisine", (double)NAN, 1.0, 16);
    refuse_tones("multisine", 10.0, 1.0, 0);
    refuse_tones("multisine", 10.0, 1.0, 17);
}

static void test_the_whole_range_as_printed_is_accepted(void) {
    waveform_options_t options = WAVEFORM_OPTIONS_DEFAULT;
    options.name = "sine";
    options.amplitude = 20.0 + 1e-6;
    options.offset = 10.0;
    (void)choose(&options);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_defaults_use_four_fifths_of_the_range_around_its_middle);
    RUN_TEST(test_rounding_to_samples_does_not_add_up);
    RUN_TEST(test_staircase_goes_up_and_down_and_closes);
    RUN_TEST(test_the_lowest_frequency_has_its_whole_length);
    RUN_TEST(test_what_cannot_be_played_is_wrong_usage);
    RUN_TEST(test_the_tones_of_a_multisine);
    RUN_TEST(test_what_cannot_be_swept_or_sounded_is_wrong_usage);
    RUN_TEST(test_the_whole_range_as_printed_is_accepted);
    return UNITY_END();
}
