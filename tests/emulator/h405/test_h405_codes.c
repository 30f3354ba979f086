/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The image that would be flashed, under emulation: does the board's own path, from the timer's interrupt to the
 * converter's register, write what the library computed?
 *
 * The emulator has no model of the converters, but logs every write to them. The test steers the image over Modbus
 * through all modes. Then it runs the same application natively (tests/firmware) with the same commands in the same
 * samples, and demands the same codes, every one of them, from the first sample to the last.
 *
 * Which sample was the first after a command? The driver enable of the answer is in the log, among the codes. A sample
 * interrupt may, rarely, come between a command's execution and its answer; then the command took effect one sample
 * earlier than its mark says. The replay tries that for one command at a time before it calls the codes different.
 */
#include "emulated_h405.h"
#include "fake_board.h"
#include "hyst/parameters.h"
#include "master.h"
#include "motion/source.h"
#include "protection/power_state.h"
#include "registers/control.h"
#include "unity.h"

#define Q31(x) ((hyst_q31_t)((x)*2147483648.0))
#define Q28(x) ((hyst_q28_t)((x)*268435456.0))

/* A register to write, and samples to run then. */
typedef struct {
    unsigned index;
    uint32_t value;
    unsigned samples;
} action_t;

static const action_t actions[] = {
    {INDEX_watchdog, 0, 0},              /* nobody talks while this counts samples */
    {INDEX_command, COMMAND_COMMIT, 80}, /* parked elsewhere: a transition */
    {INDEX_command, COMMAND_ARM, POWER_PRECHARGE_MS * 10 + 20},
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
    {INDEX_command, COMMAND_DISARM, 40},
};
enum { ACTIONS = sizeof actions / sizeof actions[0], NONE = ACTIONS };

/* Steep lines, a step, and minor loops: samples and value of each point. */
static const uint32_t waveform[] = {40, (uint32_t)Q31(0.5), 1,  (uint32_t)Q31(-0.4),
                                    60, (uint32_t)Q31(0.2), 90, (uint32_t)Q31(0.05)};
enum { WAVEFORM_WORDS = sizeof waveform / sizeof waveform[0] };

static uint32_t image[HYST_IMAGE_MAX_WORDS];
static size_t image_words;
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
    p.hysteresis_offset = Q31(0.01);
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

/* Everything the test does to the emulated image. */
static void steer(void) {
    failure_t failure;
    uint16_t registers[2 * HYST_IMAGE_MAX_WORDS];
    to_registers(image, image_words, registers);
    check(device_write_block(h405_device, ADDRESS_staging, 0, 2 * image_words, registers, &failure), &failure);
    to_registers(waveform, WAVEFORM_WORDS, registers);
    check(device_write_block(h405_device, ADDRESS_waveform, 0, (size_t)2 * WAVEFORM_WORDS, registers, &failure),
          &failure);
    for (unsigned i = 0; i < ACTIONS; i++) {
        int64_t low, high; /* of the register: whether its bits have a sign */
        device_register_range((int)actions[i].index, &low, &high);
        h405_write(actions[i].index, low < 0 ? (int32_t)actions[i].value : (int64_t)actions[i].value);
        peripheral_log_read(&h405_log);
        mark[i] = h405_log.codes_at_answer;
        h405_wait(mark[i] + actions[i].samples);
    }
    int64_t value[REGISTER_COUNT];
    check(device_read(h405_device, INDEX_fault_code, &value[INDEX_fault_code], &failure), &failure);
    TEST_ASSERT_EQUAL_INT64_MESSAGE(HYST_PARAMETERS_OK, value[INDEX_fault_code], "the image was refused");

    /* The emulated chip has no clock control and no conversion ever ends: both waits were bounded, and both are
     * reported. */
    check(device_read_telemetry(h405_device, value, &failure), &failure);
    TEST_ASSERT_EQUAL_HEX64(FAULT_CLOCK_FALLBACK | FAULT_CONVERTER_TIMEOUT, value[INDEX_faults_sticky]);
    TEST_ASSERT_EQUAL_INT64(value[INDEX_samples], value[INDEX_converter_timeouts]);
    TEST_ASSERT_EQUAL_INT64(0, value[INDEX_overruns]);
    TEST_ASSERT_GREATER_THAN_INT64_MESSAGE(0, value[INDEX_drive_limited], "the limit is part of the test");
}

static void run_emulated(void) {
    h405_start();
    steer();
    TEST_ASSERT_EQUAL_MESSAGE(0, device_repetitions(h405_device), "a request was repeated: the marks mean nothing");
    peripheral_log_read(&h405_log);
}

/*
 * The same natively. Returns the first sample whose code differs, or the number of samples when none does. The action
 * `early` takes effect one sample before its mark.
 */
static size_t replay(unsigned early, uint16_t *expected) {
    const board_start_t start = {.faults = FAULT_CLOCK_FALLBACK};
    fake_board_start(&start);
    master_write_words(ADDRESS_staging, image, image_words);
    master_write_words(ADDRESS_waveform, waveform, WAVEFORM_WORDS);
    unsigned next = 0;
    /* Code 0 was written by the initialisation, before the first sample. */
    for (size_t i = 1; i < h405_log.codes; i++) {
        while (next < ACTIONS && mark[next] - (next == early ? 1U : 0U) <= i) {
            TEST_ASSERT_EQUAL(MODBUS_OK, master_set(actions[next].index, actions[next].value));
            next++;
        }
        *expected = fake_board_sample(0);
        if (*expected != h405_log.code[i]) {
            return i;
        }
    }
    return h405_log.codes;
}

static void test_every_code_is_what_the_library_computes(void) {
    uint16_t expected = 0;
    const size_t first_difference = replay(NONE, &expected);
    size_t best = first_difference;
    for (unsigned early = 0; early < ACTIONS && best < h405_log.codes; early++) {
        uint16_t ignored;
        const size_t difference = replay(early, &ignored);
        best = difference > best ? difference : best;
    }
    char text[128];
    (void)snprintf(text, sizeof text, "%zu codes; code %zu is 0x%04x, the library says 0x%04x", h405_log.codes,
                   first_difference, first_difference < h405_log.codes ? h405_log.code[first_difference] : 0U,
                   expected);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(h405_log.codes, best, text);
    (void)printf("%zu codes equal\n", h405_log.codes);
}

/* Otherwise equal codes would prove little. */
static void test_the_codes_move(void) {
    uint16_t low = UINT16_MAX;
    uint16_t high = 0;
    size_t changes = 0;
    for (size_t i = 1; i < h405_log.codes; i++) {
        low = h405_log.code[i] < low ? h405_log.code[i] : low;
        high = h405_log.code[i] > high ? h405_log.code[i] : high;
        changes += h405_log.code[i] != h405_log.code[i - 1] ? 1U : 0U;
        TEST_ASSERT_EQUAL_HEX16_MESSAGE(0, h405_log.code[i] & 0xFU, "the converter has 12 bits");
    }
    TEST_ASSERT_LESS_OR_EQUAL_UINT16(0x2000, low);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT16(0xF000, high);
    TEST_ASSERT_GREATER_THAN_UINT(500, changes);
}

/* Control values: on without a trigger; then triggered by TIM2 (TSEL 4). */
static void test_the_safe_code_comes_before_the_output_is_on(void) {
    TEST_ASSERT_EQUAL_UINT(2, h405_log.controls);
    TEST_ASSERT_EQUAL_HEX32(0x01, h405_log.control[0]);
    TEST_ASSERT_EQUAL_UINT(1, h405_log.codes_at_control[0]);
    TEST_ASSERT_EQUAL_HEX16(FAKE_SAFE_CODE, h405_log.code[0]);
    TEST_ASSERT_EQUAL_HEX32(0x25, h405_log.control[1]);
    TEST_ASSERT_EQUAL_UINT(1, h405_log.codes_at_control[1]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(run_emulated);
    h405_end();
    if (Unity.TestFailures == 0) {
        RUN_TEST(test_every_code_is_what_the_library_computes);
        RUN_TEST(test_the_codes_move);
        RUN_TEST(test_the_safe_code_comes_before_the_output_is_on);
    }
    return UNITY_END();
}
