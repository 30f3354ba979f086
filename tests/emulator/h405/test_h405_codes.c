/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The image that would be flashed, under emulation: does the board's own path, from the timer's interrupt to the
 * converter's register, write what the library computed?
 *
 * The emulator has no model of the converters, but logs every write to them. The test steers the image over Modbus
 * through all modes; then it runs the same application natively (tests/firmware) with the same commands in the same
 * samples, and demands the same codes, every one of them, from the first sample to the last.
 *
 * Which sample was the first after a command? The driver enable of the answer is in the log, among the codes. A sample
 * interrupt may, rarely, come between a command's execution and its answer; then the command took effect one sample
 * earlier than its mark says. The replay tries that for one command at a time before it calls the codes different.
 */
#include "control.h"
#include "device.h"
#include "emulator.h"
#include "fake_board.h"
#include "hyst/parameters.h"
#include "master.h"
#include "peripheral_log.h"
#include "source.h"
#include "unity.h"
#include <stdlib.h>

#define Q31(x) ((hyst_q31_t)((x)*2147483648.0))
#define Q28(x) ((hyst_q28_t)((x)*268435456.0))

/* Emulated time follows the instructions, so it may be slow. What takes longer than this hangs. */
#define PATIENCE_S 60.0

/* A register to write, and samples to run then. */
typedef struct {
    unsigned index;
    uint32_t value;
    unsigned samples;
} action_t;

static const action_t actions[] = {
    {INDEX_command, COMMAND_COMMIT, 80}, /* parked elsewhere: a transition */
    {INDEX_setpoint_slew, (uint32_t)Q31(0.02), 0},
    {INDEX_setpoint, (uint32_t)Q31(0.3), 0},
    {INDEX_mode, HYST_MODE_DIRECT, 60},
    {INDEX_setpoint, (uint32_t)Q31(-0.7), 70},
    {INDEX_mode, HYST_MODE_COMPENSATE, 60},
    {INDEX_setpoint, (uint32_t)Q31(0.1), 60},
    {INDEX_source, SOURCE_SINE, 0},
    {INDEX_source_offset, (uint32_t)Q31(0.1), 0},
    {INDEX_source_amplitude, (uint32_t)Q31(0.35), 0},
    {INDEX_source_increment, 0xFFFFFFFFU / 97U, 0},
    {INDEX_source_cycles, 3, 0},
    {INDEX_command, COMMAND_START, 320},
    {INDEX_source, SOURCE_BREAKPOINTS, 0},
    {INDEX_source_cycles, 1, 0},
    {INDEX_waveform_points, 4, 0},
    {INDEX_command, COMMAND_START, 300},
    {INDEX_mode, HYST_MODE_LINEAR, 60},
    {INDEX_setpoint, (uint32_t)Q31(0.99), 120}, /* meets the drive limit */
    {INDEX_command, COMMAND_PARK, 40},
};
enum { ACTIONS = sizeof actions / sizeof actions[0], NONE = ACTIONS };

/* Steep lines, a step, and minor loops: samples and value of each point. */
static const uint32_t waveform[] = {40, (uint32_t)Q31(0.5), 1,  (uint32_t)Q31(-0.4),
                                    60, (uint32_t)Q31(0.2), 90, (uint32_t)Q31(0.05)};
enum { WAVEFORM_WORDS = sizeof waveform / sizeof waveform[0] };

static uint32_t image[HYST_IMAGE_MAX_WORDS];
static size_t image_words;
static emulator_t emulator;
static device_t *device;
static peripheral_log_t log_of_image;
/* Codes that were written before each action's answer. */
static size_t mark[ACTIONS];

void setUp(void) {
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    p.drive_low = Q31(-0.9);
    p.drive_high = Q31(0.9);
    p.drive_park = Q31(-0.5);
    p.linear_gain = Q28(0.95);
    p.linear_offset = Q31(0.02);
    p.transition_slew = Q31(0.015);
    p.lookahead_samples = 3;
    p.pi_operators = 16;
    p.pi_offset = Q31(0.01);
    p.pi_weight[0] = Q28(0.55);
    for (unsigned i = 0; i < p.pi_operators; i++) {
        p.pi_weight[i + 1] = i % 5 == 4 ? Q28(-0.01) : Q28(0.025);
        p.pi_threshold[i] = Q31(0.004) + (hyst_q31_t)i * Q31(0.05);
    }
    p.pi_beta = 2 * HYST_Q20_ONE;
    p.pi_rate_gain = HYST_Q30_ONE / 8;
    p.shape_sections = 1; /* a zero-pole pair, gain 1 */
    p.shape[0] = (hyst_iir_section_t){.b0 = Q28(1.5), .b1 = Q28(-0.8), .b2 = Q28(0.1), .a1 = Q28(-0.3), .a2 = Q28(0.1)};
    p.equalise_sections = 1;
    p.equalise[0] = (hyst_iir_section_t){.b0 = Q28(1.25), .b1 = Q28(-0.25)};
    image_words = hyst_parameters_encode(&p, image, HYST_IMAGE_MAX_WORDS);
    TEST_ASSERT_NOT_EQUAL(0, image_words);
}

void tearDown(void) {
}

static void to_registers(const uint32_t *words, size_t count, uint16_t *registers) {
    for (size_t i = 0; i < count; i++) {
        registers[2 * i] = (uint16_t)(words[i] >> 16);
        registers[2 * i + 1] = (uint16_t)words[i];
    }
}

static void check(bool ok, const failure_t *failure) {
    TEST_ASSERT_TRUE_MESSAGE(ok, failure->text);
}

/* Everything the test does to the emulated image. */
static void steer(void) {
    failure_t failure;
    uint16_t registers[2 * HYST_IMAGE_MAX_WORDS];
    to_registers(image, image_words, registers);
    check(device_write_block(device, ADDRESS_staging, 0, 2 * image_words, registers, &failure), &failure);
    to_registers(waveform, WAVEFORM_WORDS, registers);
    check(device_write_block(device, ADDRESS_waveform, 0, (size_t)2 * WAVEFORM_WORDS, registers, &failure), &failure);
    for (unsigned i = 0; i < ACTIONS; i++) {
        check(device_write(device, (int)actions[i].index, actions[i].value, &failure), &failure);
        peripheral_log_read(&log_of_image);
        mark[i] = log_of_image.codes_at_answer;
        TEST_ASSERT_TRUE_MESSAGE(peripheral_log_wait(&log_of_image, mark[i] + actions[i].samples, PATIENCE_S),
                                 "the loop stands still");
    }
    int64_t value[REGISTER_COUNT];
    check(device_read(device, INDEX_fault_code, &value[INDEX_fault_code], &failure), &failure);
    TEST_ASSERT_EQUAL_INT64_MESSAGE(HYST_PARAMETERS_OK, value[INDEX_fault_code], "the image was refused");

    /* The emulated chip has no clock control and no conversion ever ends: both waits were bounded, and both are
     * reported. */
    check(device_read_telemetry(device, value, &failure), &failure);
    TEST_ASSERT_EQUAL_HEX64(FAULT_CLOCK_FALLBACK | FAULT_CONVERTER_TIMEOUT, value[INDEX_faults_sticky]);
    TEST_ASSERT_EQUAL_INT64(value[INDEX_samples], value[INDEX_converter_timeouts]);
    TEST_ASSERT_EQUAL_INT64(0, value[INDEX_overruns]);
    TEST_ASSERT_GREATER_THAN_INT64_MESSAGE(0, value[INDEX_drive_limited], "the limit is part of the test");
}

static void run_emulated(void) {
    failure_t failure;
    TEST_ASSERT_EQUAL(0, setenv("HYST_EMULATOR_LOG", H405_LOG, 1));
    (void)remove(H405_LOG);
    check(emulator_start(&emulator, LOGGED_EMULATOR, H405_IMAGE, &failure), &failure);
    TEST_ASSERT_TRUE_MESSAGE(peripheral_log_open(&log_of_image, H405_LOG), "the emulator writes no log");
    /* The line is deaf until the clocks' waits are over. */
    TEST_ASSERT_TRUE_MESSAGE(peripheral_log_wait(&log_of_image, 2, PATIENCE_S), "the image does not start its loop");
    const device_options_t options = {.port = emulator.port, .baud = 115200, .slave = 1, .timeout_s = 5.0};
    device = device_open(&options, &failure);
    check(device != NULL, &failure);
    steer();
    TEST_ASSERT_EQUAL_MESSAGE(0, device_repetitions(device), "a request was repeated: the marks mean nothing");
    peripheral_log_read(&log_of_image);
}

/* Outside of any test, so that a failed one leaves no emulator behind. */
static void end_emulation(void) {
    failure_t failure;
    device_close(device);
    peripheral_log_close(&log_of_image);
    if (!emulator_stop(&emulator, &failure)) {
        (void)failure_print(&failure);
    }
}

/*
 * The same natively. Returns the first sample whose code differs, or the number of samples when none does. The action
 * `early` takes effect one sample before its mark.
 */
static size_t replay(unsigned early, uint16_t *expected) {
    fake_board_power_on(FAULT_CLOCK_FALLBACK);
    master_write_words(ADDRESS_staging, image, image_words);
    master_write_words(ADDRESS_waveform, waveform, WAVEFORM_WORDS);
    unsigned next = 0;
    /* Code 0 was written by the initialisation, before the first sample. */
    for (size_t i = 1; i < log_of_image.codes; i++) {
        while (next < ACTIONS && mark[next] - (next == early ? 1U : 0U) <= i) {
            TEST_ASSERT_EQUAL(MODBUS_OK, master_set(actions[next].index, actions[next].value));
            next++;
        }
        *expected = fake_board_sample(0);
        if (*expected != log_of_image.code[i]) {
            return i;
        }
    }
    return log_of_image.codes;
}

static void test_every_code_is_what_the_library_computes(void) {
    uint16_t expected = 0;
    const size_t first_difference = replay(NONE, &expected);
    size_t best = first_difference;
    for (unsigned early = 0; early < ACTIONS && best < log_of_image.codes; early++) {
        uint16_t ignored;
        const size_t difference = replay(early, &ignored);
        best = difference > best ? difference : best;
    }
    char text[128];
    (void)snprintf(text, sizeof text, "%zu codes; code %zu is 0x%04x, the library says 0x%04x", log_of_image.codes,
                   first_difference, first_difference < log_of_image.codes ? log_of_image.code[first_difference] : 0U,
                   expected);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(log_of_image.codes, best, text);
    (void)printf("%zu codes equal\n", log_of_image.codes);
}

/* Otherwise equal codes would prove little. */
static void test_the_codes_move(void) {
    uint16_t low = UINT16_MAX;
    uint16_t high = 0;
    size_t changes = 0;
    for (size_t i = 1; i < log_of_image.codes; i++) {
        low = log_of_image.code[i] < low ? log_of_image.code[i] : low;
        high = log_of_image.code[i] > high ? log_of_image.code[i] : high;
        changes += log_of_image.code[i] != log_of_image.code[i - 1] ? 1U : 0U;
        TEST_ASSERT_EQUAL_HEX16_MESSAGE(0, log_of_image.code[i] & 0xFU, "the converter has 12 bits");
    }
    TEST_ASSERT_LESS_OR_EQUAL_UINT16(0x2000, low);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT16(0xF000, high);
    TEST_ASSERT_GREATER_THAN_UINT(500, changes);
}

/* Control values: on without a trigger; then triggered by TIM2 (TSEL 4). */
static void test_the_safe_code_comes_before_the_output_is_on(void) {
    TEST_ASSERT_EQUAL_UINT(2, log_of_image.controls);
    TEST_ASSERT_EQUAL_HEX32(0x01, log_of_image.control[0]);
    TEST_ASSERT_EQUAL_UINT(1, log_of_image.codes_at_control[0]);
    TEST_ASSERT_EQUAL_HEX16(BOARD_CODE_MIDDLE, log_of_image.code[0]);
    TEST_ASSERT_EQUAL_HEX32(0x25, log_of_image.control[1]);
    TEST_ASSERT_EQUAL_UINT(1, log_of_image.codes_at_control[1]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(run_emulated);
    end_emulation();
    if (Unity.TestFailures == 0) {
        RUN_TEST(test_every_code_is_what_the_library_computes);
        RUN_TEST(test_the_codes_move);
        RUN_TEST(test_the_safe_code_comes_before_the_output_is_on);
    }
    return UNITY_END();
}
