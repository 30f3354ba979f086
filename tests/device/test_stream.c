/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The stream, against the application itself: whatever the line does it has no gap, and where the line is too slow the
 * gap is reported. A sine is played, so that each frame shows by its value which one it is.
 */
#include "amplifier/amplifier_image.h"
#include "amplifier/device/opening.h"
#include "amplifier/model_guard.h"
#include "amplifier/stream_reader.h"
#include "fake_board.h"
#include "hyst/compensator.h"
#include "loop/capture.h"
#include "motion/source.h"
#include "simulated_device.h"
#include "unity.h"
#include <math.h>

/* Turns of the sine a sample: no two frames nearby are the same. */
#define INCREMENT 123456789U
#define AMPLITUDE (1 << 28)

enum { SIGNALS = CAPTURE_REFERENCE | CAPTURE_DRIVE };

static device_t *device;
static stream_reader_t reader;
static failure_t failure;

static void must(bool done) {
    TEST_ASSERT_TRUE_MESSAGE(done, failure.text);
}

void setUp(void) {
    device_options_t options = DEVICE_OPTIONS_DEFAULT;
    options.port = simulated_device_start(NULL);
    options.timeout_s = 0.3;
    simulated_device_line()->samples_per_request = 20;
    device = device_open(&options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(device, failure.text);
    reader = (stream_reader_t){.device = device};
    must(device_unlock(device, CONTROL_PARAMETERS | CONTROL_OUTPUT, &failure));
    must(device_write(device, INDEX_mode, HYST_MODE_DIRECT, &failure));
    must(device_write(device, INDEX_source, SOURCE_SINE, &failure));
    must(device_write(device, INDEX_source_amplitude, AMPLITUDE, &failure));
    must(device_write(device, INDEX_source_increment, INCREMENT, &failure));
}

void tearDown(void) {
    device_close(device);
    simulated_device_stop();
}

static void begin(unsigned decimation) {
    must(stream_arm(device, SIGNALS, decimation, CAPTURE_AT_SOURCE, &failure));
    must(device_start(device, &failure));
}

/* Frame n of a sine that was started with it, in 2^-15 of full scale. */
static double sine(uint32_t n, unsigned decimation) {
    const double turns = (double)((uint64_t)n * decimation % 4294967296U) * INCREMENT / 4294967296.0;
    return (double)AMPLITUDE / 65536.0 * sin(2.0 * 3.14159265358979323846 * (turns - floor(turns)));
}

static void expect_sine(const stream_block_t *block, unsigned decimation) {
    TEST_ASSERT_EQUAL_UINT(SIGNALS, block->signals);
    TEST_ASSERT_EQUAL_UINT(decimation, block->decimation);
    for (size_t i = 0; i < block->frames; i++) {
        const double expected = sine(block->first + (uint32_t)i, decimation);
        TEST_ASSERT_DOUBLE_WITHIN(1.5, expected, (int16_t)block->value[2 * i]);
    }
}

/* Reads so many frames, none of which may be missing. */
static void read_without_gap(uint32_t frames, unsigned decimation) {
    const uint32_t end = reader.next + frames;
    while ((int32_t)(end - reader.next) > 0) {
        stream_block_t block;
        must(stream_read(&reader, &block, &failure));
        TEST_ASSERT_EQUAL_UINT32(0, block.lost);
        TEST_ASSERT_EQUAL_UINT32(reader.next, block.first + block.frames);
        expect_sine(&block, decimation);
    }
}

static void test_every_sample_comes_once(void) {
    begin(1);
    read_without_gap(3 * CAPTURE_WORDS / 2, 1); /* three turns of the ring */
}

static void test_every_nth_sample_comes_once(void) {
    begin(3);
    read_without_gap(2000, 3);
}

/* Lost, late and damaged answers cost time, and no frame. */
static void test_a_bad_line_makes_no_gap(void) {
    static const line_fault_t faults[] = {LINE_LOSES_REQUEST, LINE_LOSES_ANSWER, LINE_FLIPS_BIT,   LINE_CUTS,
                                          LINE_WRONG_SLAVE,   LINE_BUSY,         LINE_NOISE_BEFORE};
    begin(1);
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++) {
        simulated_device_fault(faults[i], 2, 1);
        read_without_gap(300, 1);
    }
    TEST_ASSERT_GREATER_THAN_UINT(0, (unsigned)device_repetitions(device));
}

/* The line carries 57 frames a request, the loop makes many more: the gap is as long as it is said to be. */
static void test_a_gap_is_told(void) {
    begin(1);
    read_without_gap(100, 1);
    simulated_device_line()->samples_per_request = 3000;
    uint32_t next = reader.next, lost = 0;
    for (int i = 0; i < 40; i++) {
        stream_block_t block;
        must(stream_read(&reader, &block, &failure));
        TEST_ASSERT_EQUAL_UINT32(next + block.lost, block.first);
        expect_sine(&block, 1);
        next = block.first + (uint32_t)block.frames;
        lost += block.lost;
    }
    TEST_ASSERT_GREATER_THAN_UINT32(CAPTURE_WORDS / 4, lost);
    simulated_device_line()->samples_per_request = 20;
    stream_block_t block;
    do {
        must(stream_read(&reader, &block, &failure));
    } while (block.behind > 0);
    read_without_gap(1000, 1);
}

static void test_a_capture_that_is_armed_anew_is_read_from_its_beginning(void) {
    stream_block_t block;
    begin(1);
    must(stream_read(&reader, &block, &failure));
    TEST_ASSERT_TRUE(block.restarted);
    read_without_gap(500, 1);
    begin(2);
    must(stream_read(&reader, &block, &failure));
    TEST_ASSERT_TRUE(block.restarted);
    TEST_ASSERT_EQUAL_UINT32(0, block.first);
    TEST_ASSERT_EQUAL_UINT32(0, block.lost);
    read_without_gap(500, 2);
}

/* The frames are on the time of the loop's samples. */
static void test_the_sample_of_a_frame(void) {
    stream_block_t block;
    begin(4);
    read_without_gap(100, 4);
    must(stream_read(&reader, &block, &failure));
    const uint32_t first = block.first, sample = block.sample;
    read_without_gap(200, 4);
    must(stream_read(&reader, &block, &failure));
    TEST_ASSERT_EQUAL_UINT32(sample + 4 * (block.first - first), block.sample);
}

static bool pause(void *context, failure_t *why) {
    (void)context;
    (void)why;
    return true;
}

/* A watch over the model has the recorder, and gives it back: nothing waits for a trigger then. */
static void test_the_recorder_is_free_after_a_watch(void) {
    const guard_settings_t settings = GUARD_SETTINGS_DEFAULT;
    hyst_parameters_t image;
    guard_t guard;
    int64_t state = 0;
    simulated_device_line()->samples_per_request = 500;
    must(device_write(device, INDEX_mode, HYST_MODE_COMPENSATE, &failure));
    must(amplifier_image_read(device, &image, &failure));
    must(guard_begin(&guard, device, &image, &settings, pause, NULL, &failure));
    must(device_read(device, INDEX_capture_state, &state, &failure));
    TEST_ASSERT_EQUAL_INT64(CAPTURE_ARMED, state);
    must(guard_end(&guard, &failure));
    must(device_read(device, INDEX_capture_state, &state, &failure));
    TEST_ASSERT_EQUAL_INT64(CAPTURE_IDLE, state);
}

/* The supply of the stage, from before and at the record's end, which has it in its header. */
static void test_a_watch_knows_the_supply(void) {
    const guard_settings_t settings = GUARD_SETTINGS_DEFAULT;
    const double supply_v = 1e-3 * FAKE_HIGH_VOLTAGE;
    double noted_v = 0.0;
    hyst_parameters_t image;
    recording_t record;
    guard_t guard;
    size_t warned;
    simulated_device_line()->samples_per_request = 500;
    must(device_write(device, INDEX_mode, HYST_MODE_COMPENSATE, &failure));
    must(amplifier_image_read(device, &image, &failure));
    must(guard_begin(&guard, device, &image, &settings, pause, NULL, &failure));
    TEST_ASSERT_EQUAL_DOUBLE(supply_v, guard.usual_supply_v);
    TEST_ASSERT_EQUAL_INT(GUARD_QUIET, guard_look(&guard, &failure));
    TEST_ASSERT_EQUAL_DOUBLE(supply_v, guard_supply_v(&guard));
    must(guard_end(&guard, &failure));
    must(device_write(device, INDEX_capture_length, 100, &failure));
    must(device_command(device, COMMAND_ARM_CAPTURE, &failure));
    do {
        TEST_ASSERT_NOT_EQUAL(GUARD_FAILED, guard_look(&guard, &failure));
    } while (guard.now[INDEX_capture_state] != CAPTURE_DONE);
    must(guard_fetch(&guard, &record, &warned, &failure));
    must(recording_stage_supply(&record, &noted_v, &failure));
    TEST_ASSERT_EQUAL_DOUBLE(supply_v, noted_v);
    guard.now[INDEX_high_voltage] = HEALTH_ABSENT;
    TEST_ASSERT_TRUE(isnan(guard_supply_v(&guard)));
    recording_free(&record);
    must(guard_fetch(&guard, &record, &warned, &failure));
    TEST_ASSERT_NULL(recording_key(&record, STAGE_SUPPLY_KEY));
    recording_free(&record);
}

/* What a line carries, and what it does not. */
static void test_the_decimation_is_what_the_line_carries(void) {
    stream_pace_t pace = {.block_s = 0.001, .samples_per_s = 10000.0};
    TEST_ASSERT_EQUAL_UINT(1, stream_decimation(&pace, SIGNALS, 1.0));
    pace.block_s = 0.0569;
    TEST_ASSERT_EQUAL_UINT(10, stream_decimation(&pace, SIGNALS, 1.0));
    TEST_ASSERT_EQUAL_UINT(20, stream_decimation(&pace, SIGNALS, 0.5));
    TEST_ASSERT_EQUAL_UINT(15, stream_decimation(&pace, CAPTURE_DEFAULT_SIGNALS, 1.0));
    must(stream_measure(device, &pace, &failure));
    TEST_ASSERT_TRUE(pace.block_s > 0.0 && pace.block_s < 0.3 && pace.samples_per_s > 0.0);
    simulated_device_line()->delay_ms = 100;
    simulated_device_fault(LINE_DELAYS, 3, 1);
    must(stream_measure(device, &pace, &failure));
    TEST_ASSERT_TRUE_MESSAGE(pace.block_s >= 0.1, "the longest block counts");
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_every_sample_comes_once);
    RUN_TEST(test_every_nth_sample_comes_once);
    RUN_TEST(test_a_bad_line_makes_no_gap);
    RUN_TEST(test_a_gap_is_told);
    RUN_TEST(test_a_capture_that_is_armed_anew_is_read_from_its_beginning);
    RUN_TEST(test_the_sample_of_a_frame);
    RUN_TEST(test_the_recorder_is_free_after_a_watch);
    RUN_TEST(test_a_watch_knows_the_supply);
    RUN_TEST(test_the_decimation_is_what_the_line_carries);
    return UNITY_END();
}
