/* SPDX-License-Identifier: MIT */
/*
 * Capture, and the alignment of what is captured. The "actuator" here repeats the drive FAKE_LATENCY samples after it
 * was computed, plus a transport delay of its own, so that a right alignment shows as equality.
 */
#include "fake_board.h"
#include "loop/capture.h"
#include "loop/loop.h"
#include "master.h"
#include "random.h"
#include "unity.h"

#define DELAY_MAX 128U

static random_t rng;
static hyst_q31_t drives[DELAY_MAX];
static unsigned now;

void setUp(void) {
    fake_board_power_on(0);
    now = 0;
    for (unsigned i = 0; i < DELAY_MAX; i++) {
        drives[i] = 0;
    }
}
void tearDown(void) {
}

/* One sample with the delaying actuator. */
static void sample(unsigned delay) {
    const hyst_q31_t position = drives[(now + DELAY_MAX - FAKE_LATENCY - delay) % DELAY_MAX];
    drives[now % DELAY_MAX] = fake_board_drive(position);
    now++;
}

static void read_frame(unsigned frame, int16_t values[3]) {
    uint16_t registers[3];
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read((uint16_t)(ADDRESS_capture + 3U * frame), 3, registers));
    for (int i = 0; i < 3; i++) {
        values[i] = (int16_t)registers[i];
    }
}

static void commit_lookahead(uint32_t lookahead) {
    hyst_parameters_t p;
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    hyst_parameters_default(&p);
    p.lookahead_samples = lookahead;
    master_write_words(ADDRESS_staging, words, hyst_parameters_encode(&p, words, HYST_IMAGE_MAX_WORDS));
    master_command(COMMAND_COMMIT);
    TEST_ASSERT_EQUAL_UINT32(HYST_PARAMETERS_OK, master_get(INDEX_fault_code));
}

enum { POINTS = 100, LEVEL_MOST = FAKE_DRIVE_SLEW_MAX / 2 / 65536 };

/* A random staircase of the largest steps that the board allows, one sample each, on the 16-bit grid: any misalignment
 * shows at once. */
static void load_random_staircase(int16_t levels[POINTS]) {
    uint32_t words[2 * POINTS];
    for (unsigned i = 0; i < POINTS; i++) {
        levels[i] = (int16_t)random_between(&rng, -LEVEL_MOST, LEVEL_MOST);
        words[2 * i] = 1;
        words[2 * i + 1] = (uint32_t)levels[i] << 16;
    }
    master_write_words(ADDRESS_waveform, words, sizeof words / sizeof words[0]);
    master_put(INDEX_waveform_points, POINTS);
    master_put(INDEX_source, SOURCE_BREAKPOINTS);
    master_put(INDEX_source_cycles, 1);
}

/* With lookahead = the actuator's delay, frame i has reference, drive and position of the same breakpoint i, from frame
 * 0 on. */
static void test_frames_are_aligned_for_every_lookahead(void) {
    for (uint32_t lookahead = 0; lookahead <= HYST_LOOKAHEAD_MAX; lookahead++) {
        setUp();
        int16_t levels[POINTS];
        commit_lookahead(lookahead);
        load_random_staircase(levels);
        master_put(INDEX_mode, HYST_MODE_LINEAR);
        for (unsigned i = 0; i < 200; i++) {
            sample(lookahead);
        }
        master_put(INDEX_capture_length, POINTS);
        master_put(INDEX_capture_trigger, CAPTURE_AT_SOURCE);
        master_command(COMMAND_ARM_CAPTURE);
        for (unsigned i = 0; i < 10; i++) {
            sample(lookahead);
        }
        TEST_ASSERT_EQUAL_UINT32(CAPTURE_ARMED, master_get(INDEX_capture_state));
        master_command(COMMAND_START);
        for (unsigned i = 0; i < POINTS + lookahead + FAKE_LATENCY; i++) {
            TEST_ASSERT_NOT_EQUAL(CAPTURE_DONE, master_get(INDEX_capture_state));
            sample(lookahead);
        }
        TEST_ASSERT_EQUAL_UINT32(CAPTURE_DONE, master_get(INDEX_capture_state));
        TEST_ASSERT_EQUAL_UINT32(POINTS, master_get(INDEX_capture_frames));
        for (unsigned i = 0; i < POINTS; i++) {
            int16_t frame[3];
            read_frame(i, frame);
            TEST_ASSERT_EQUAL_INT16(levels[i], frame[0]);
            TEST_ASSERT_EQUAL_INT16(levels[i], frame[2]);
            /* The drive belongs to the position that first shows it on an actuator without a delay of its own. */
            if (i + lookahead < POINTS) {
                TEST_ASSERT_EQUAL_INT16(levels[i + lookahead], frame[1]);
            }
        }
    }
}

static void test_telemetry_is_aligned_too(void) {
    enum { LOOKAHEAD = 5 };
    commit_lookahead(LOOKAHEAD);
    master_put(INDEX_mode, HYST_MODE_LINEAR);
    master_put(INDEX_source, SOURCE_SINE);
    master_put(INDEX_source_amplitude, 1U << 30);
    master_put(INDEX_source_increment, 1U << 27);
    for (unsigned i = 0; i < 200; i++) {
        sample(LOOKAHEAD);
    }
    master_command(COMMAND_START);
    for (unsigned i = 0; i < 200; i++) {
        sample(LOOKAHEAD);
        if (i > 20) {
            /* the position is the drive rounded to a code of 16 bits */
            TEST_ASSERT_INT32_WITHIN(1 << 15, (int32_t)master_get(INDEX_reference),
                                     (int32_t)master_get(INDEX_position));
        }
    }
}

/* With an actuator that has no delay of its own, the drive of a snapshot is the one that its position shows. */
static void test_telemetry_drive_is_aligned_with_position(void) {
    master_put(INDEX_mode, HYST_MODE_DIRECT);
    master_put(INDEX_source, SOURCE_SINE);
    master_put(INDEX_source_amplitude, 1U << 30);
    master_put(INDEX_source_increment, 1U << 27);
    master_command(COMMAND_START);
    for (unsigned i = 0; i < 200; i++) {
        sample(0);
        TEST_ASSERT_INT32_WITHIN(1 << 15, (int32_t)master_get(INDEX_drive), (int32_t)master_get(INDEX_position));
    }
}

static void test_decimation_takes_every_nth_sample(void) {
    enum { DECIMATION = 7, FRAMES = 12 };
    int16_t levels[POINTS];
    load_random_staircase(levels);
    master_put(INDEX_mode, HYST_MODE_LINEAR);
    master_put(INDEX_capture_decimation, DECIMATION);
    master_put(INDEX_capture_length, FRAMES);
    master_put(INDEX_capture_trigger, CAPTURE_AT_SOURCE);
    for (unsigned i = 0; i < 10; i++) {
        sample(0);
    }
    master_command(COMMAND_ARM_CAPTURE);
    master_command(COMMAND_START);
    for (unsigned i = 0; i < POINTS + FAKE_LATENCY; i++) {
        sample(0);
    }
    TEST_ASSERT_EQUAL_UINT32(CAPTURE_DONE, master_get(INDEX_capture_state));
    for (unsigned i = 0; i < FRAMES; i++) {
        int16_t frame[3];
        read_frame(i, frame);
        TEST_ASSERT_EQUAL_INT16(levels[DECIMATION * i], frame[0]);
        TEST_ASSERT_EQUAL_INT16(levels[DECIMATION * i], frame[2]);
    }
}

static void test_the_whole_buffer_at_once(void) {
    master_put(INDEX_capture_length, CAPTURE_CAPACITY);
    master_command(COMMAND_ARM_CAPTURE);
    for (unsigned i = 0; i < CAPTURE_CAPACITY; i++) {
        TEST_ASSERT_EQUAL_UINT16(i, capture_frames());
        (void)fake_board_sample((hyst_q31_t)(i << 16));
    }
    TEST_ASSERT_EQUAL_UINT32(CAPTURE_DONE, master_get(INDEX_capture_state));
    for (unsigned i = 0; i < 100; i++) {
        (void)fake_board_sample(-1); /* no more */
    }
    for (unsigned i = 0; i < CAPTURE_CAPACITY; i++) {
        int16_t frame[3];
        read_frame(i, frame);
        TEST_ASSERT_EQUAL_INT16(i, frame[2]);
    }
}

static void test_frames_cannot_be_read_while_they_are_written(void) {
    uint16_t value;
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_capture, 1, &value));
    master_put(INDEX_capture_length, 3);
    master_command(COMMAND_ARM_CAPTURE);
    TEST_ASSERT_EQUAL(MODBUS_DEVICE_FAILURE, master_read(ADDRESS_capture, 1, &value));
    (void)fake_board_run(1);
    TEST_ASSERT_EQUAL(MODBUS_DEVICE_FAILURE, master_read(ADDRESS_capture + CAPTURE_WORDS - 1U, 1, &value));
    (void)fake_board_run(2);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read(ADDRESS_capture, 1, &value));
}

/* Longer than the buffer: frame n at place n % capacity, whole until the frame `capacity` later is begun. */
static void test_a_long_capture_goes_round_and_is_read_meanwhile(void) {
    enum { FRAMES = 65535 };
    master_put(INDEX_capture_length, FRAMES);
    master_command(COMMAND_ARM_CAPTURE);
    for (uint32_t n = 0; n < FRAMES; n++) {
        TEST_ASSERT_NOT_EQUAL(CAPTURE_DONE, capture_state());
        TEST_ASSERT_EQUAL_UINT16(n, capture_frames());
        (void)fake_board_sample((hyst_q31_t)(n << 16));
        if (n % 97 == 0 || n + 1 == FRAMES) {
            const uint32_t kept = n < CAPTURE_CAPACITY ? n + 1 : CAPTURE_CAPACITY;
            const uint32_t look[] = {n + 1 - kept, n - (uint32_t)random_between(&rng, 0, (int32_t)kept - 1), n};
            for (int i = 0; i < 3; i++) {
                int16_t frame[3];
                read_frame(look[i] % CAPTURE_CAPACITY, frame);
                TEST_ASSERT_EQUAL_INT16((int16_t)look[i], frame[2]);
            }
        }
    }
    TEST_ASSERT_EQUAL(CAPTURE_DONE, capture_state());
    TEST_ASSERT_EQUAL_UINT16(FRAMES, capture_frames());
    for (int i = 0; i < 10; i++) {
        (void)fake_board_sample(-1); /* no more */
    }
    int16_t last[3];
    read_frame((FRAMES - 1) % CAPTURE_CAPACITY, last);
    TEST_ASSERT_EQUAL_INT16((int16_t)(FRAMES - 1), last[2]);
}

/* The shortest that goes round: one frame takes the place of frame 0. */
static void test_a_capture_one_frame_longer_than_the_buffer(void) {
    master_put(INDEX_capture_length, CAPTURE_CAPACITY + 1);
    master_command(COMMAND_ARM_CAPTURE);
    for (uint32_t n = 0; n <= CAPTURE_CAPACITY; n++) {
        (void)fake_board_sample((hyst_q31_t)(n << 16));
    }
    TEST_ASSERT_EQUAL(CAPTURE_DONE, capture_state());
    int16_t frame[3];
    read_frame(0, frame);
    TEST_ASSERT_EQUAL_INT16(CAPTURE_CAPACITY, frame[2]);
    read_frame(1, frame);
    TEST_ASSERT_EQUAL_INT16(1, frame[2]);
}

static void test_arming_again_starts_anew(void) {
    master_put(INDEX_capture_length, 5);
    master_command(COMMAND_ARM_CAPTURE);
    (void)fake_board_run(3);
    master_command(COMMAND_ARM_CAPTURE);
    for (int i = 0; i < 5; i++) {
        TEST_ASSERT_NOT_EQUAL(CAPTURE_DONE, capture_state());
        (void)fake_board_sample((100 + i) << 16);
    }
    TEST_ASSERT_EQUAL(CAPTURE_DONE, capture_state());
    for (unsigned i = 0; i < 5; i++) {
        int16_t frame[3];
        read_frame(i, frame);
        TEST_ASSERT_EQUAL_INT16(100 + i, frame[2]);
    }
}

/* A source that was started before arming is not the trigger; the next start is. */
static void test_the_trigger_waits_for_the_next_start(void) {
    master_put(INDEX_mode, HYST_MODE_DIRECT);
    master_put(INDEX_source, SOURCE_SINE);
    master_put(INDEX_source_increment, 1U << 20);
    master_command(COMMAND_START);
    master_put(INDEX_capture_length, 1);
    master_put(INDEX_capture_trigger, CAPTURE_AT_SOURCE);
    master_command(COMMAND_ARM_CAPTURE);
    (void)fake_board_run(50);
    TEST_ASSERT_EQUAL(CAPTURE_ARMED, capture_state());
    master_command(COMMAND_START);
    (void)fake_board_run(FAKE_LATENCY + 1);
    TEST_ASSERT_EQUAL(CAPTURE_DONE, capture_state());
}

/* A frame of the capture, in the order that it was taken in. */
static int16_t signal_of(unsigned frame, unsigned width, unsigned capacity, unsigned signal) {
    uint16_t value;
    const unsigned place = (master_get(INDEX_capture_first) + frame) % capacity;
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read((uint16_t)(ADDRESS_capture + width * place + signal), 1, &value));
    return (int16_t)value;
}

/* As soon as it waits, the newest frames are kept; a trigger keeps the last of them, and the rest follow. */
static void arm_history(uint16_t signals, uint16_t length, uint16_t before, capture_trigger_t trigger) {
    master_put(INDEX_capture_signals, signals);
    master_put(INDEX_capture_length, length);
    master_put(INDEX_capture_before, before);
    master_put(INDEX_capture_trigger, trigger);
    master_command(COMMAND_ARM_CAPTURE);
}

static void test_what_was_before_the_trigger(void) {
    enum { LENGTH = 16000, BEFORE = 12000, DECIMATION = 2 };
    const uint32_t lives[] = {0, 5, 2 * BEFORE - 1, 2 * BEFORE, 2 * LENGTH + 7, 100001};
    for (unsigned i = 0; i < sizeof lives / sizeof lives[0]; i++) {
        setUp();
        master_put(INDEX_capture_decimation, DECIMATION);
        arm_history(CAPTURE_DRIVE | CAPTURE_POSITION, LENGTH, BEFORE, CAPTURE_AT_FAULT);
        uint32_t n = 0;
        for (; n < lives[i]; n++) {
            (void)fake_board_sample((hyst_q31_t)(n << 16));
        }
        TEST_ASSERT_EQUAL(CAPTURE_ARMED, capture_state());
        const loop_input_t low = {.position_code = (uint16_t)(n ^ BOARD_CODE_MIDDLE), .faults = FAULT_SUPPLY};
        (void)loop_sample(&low);
        for (n++; master_get(INDEX_capture_state) != CAPTURE_DONE; n++) {
            (void)fake_board_sample((hyst_q31_t)(n << 16));
        }
        /* Every other sample since it was armed, from sample 0 on; the trigger came with sample lives[i]. */
        const uint32_t frames_before = (lives[i] + 1U) / 2U;
        const uint32_t first = frames_before > BEFORE ? frames_before - BEFORE : 0;
        TEST_ASSERT_EQUAL_UINT32(LENGTH, master_get(INDEX_capture_frames));
        for (unsigned frame = 0; frame < LENGTH; frame += 777) {
            TEST_ASSERT_EQUAL_INT16((int16_t)(DECIMATION * (first + frame)), signal_of(frame, 2, 16000, 1));
        }
        TEST_ASSERT_EQUAL_INT16((int16_t)(DECIMATION * (first + LENGTH - 1)), signal_of(LENGTH - 1, 2, 16000, 1));
    }
}

static void test_the_trigger_at_a_level(void) {
    enum { LENGTH = 50, BEFORE = 9, LEVEL = 1000 };
    master_put(INDEX_capture_level, (uint32_t)LEVEL << 16);
    arm_history(CAPTURE_POSITION, LENGTH, BEFORE, CAPTURE_AT_LEVEL);
    for (int n = 0; n < 100; n++) {
        (void)fake_board_sample((LEVEL + 500 - n) << 16); /* above it from the beginning on, and down: no crossing */
    }
    TEST_ASSERT_EQUAL_UINT32(CAPTURE_ARMED, master_get(INDEX_capture_state));
    for (int n = 0; n < 600; n++) {
        (void)fake_board_sample((LEVEL - 500 + n) << 16);
    }
    TEST_ASSERT_EQUAL_UINT32(CAPTURE_DONE, master_get(INDEX_capture_state));
    TEST_ASSERT_EQUAL_INT16(LEVEL, signal_of(BEFORE, 1, CAPTURE_WORDS, 0));
    TEST_ASSERT_EQUAL_INT16(LEVEL - 1, signal_of(BEFORE - 1, 1, CAPTURE_WORDS, 0));
    TEST_ASSERT_EQUAL_INT16(LEVEL + LENGTH - BEFORE - 1, signal_of(LENGTH - 1, 1, CAPTURE_WORDS, 0));
}

/* Each signal alone and all at once are the same numbers. */
static void test_every_signal(void) {
    enum { FRAMES = 40 };
    int16_t all[FRAMES][CAPTURE_SIGNALS_MOST];
    for (unsigned pass = 0; pass <= CAPTURE_SIGNALS_MOST; pass++) {
        setUp();
        master_put(INDEX_source, SOURCE_SINE);
        master_put(INDEX_source_amplitude, 1U << 29);
        master_put(INDEX_source_increment, 1U << 27);
        master_put(INDEX_mode, HYST_MODE_COMPENSATE);
        for (int n = 0; n < 20; n++) {
            sample(0);
        }
        arm_history((uint16_t)(pass == 0 ? CAPTURE_ALL : 1U << (pass - 1U)), FRAMES, 0, CAPTURE_AT_ONCE);
        master_command(COMMAND_START);
        for (int n = 0; n < FRAMES; n++) {
            sample(1); /* a sample late, so that there is an error */
        }
        for (unsigned frame = 0; frame < FRAMES; frame++) {
            for (unsigned s = 0; pass == 0 && s < CAPTURE_SIGNALS_MOST; s++) {
                all[frame][s] = signal_of(frame, CAPTURE_SIGNALS_MOST, CAPTURE_WORDS / CAPTURE_SIGNALS_MOST, s);
            }
            if (pass > 0) {
                TEST_ASSERT_EQUAL_INT16(all[frame][pass - 1], signal_of(frame, 1, CAPTURE_WORDS, 0));
            }
            TEST_ASSERT_INT_WITHIN(1, all[frame][2] - all[frame][0], all[frame][3]);
            if (frame > 0) {
                TEST_ASSERT_INT_WITHIN(1, all[frame][1] - all[frame - 1][1], all[frame][4]);
            }
        }
    }
}

static void test_what_does_not_fit_is_refused(void) {
    master_put(INDEX_capture_signals, CAPTURE_DRIVE | CAPTURE_POSITION);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_capture_signals, 0));
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_capture_signals, CAPTURE_ALL + 1));
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_capture_trigger, CAPTURE_AT_WARNING + 1));
    master_put(INDEX_capture_length, 16000);
    master_put(INDEX_capture_before, 15999);
    master_command(COMMAND_ARM_CAPTURE);
    master_put(INDEX_capture_before, 16000);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM_CAPTURE));
    master_put(INDEX_capture_length, 16001);
    master_put(INDEX_capture_before, 1);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM_CAPTURE));
    master_put(INDEX_capture_before, 0);
    master_command(COMMAND_ARM_CAPTURE);
    master_put(INDEX_capture_trigger, CAPTURE_AT_LEVEL);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM_CAPTURE));
    master_put(INDEX_capture_length, CAPTURE_ENDLESS);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM_CAPTURE));
    master_put(INDEX_capture_trigger, CAPTURE_AT_FAULT);
    master_put(INDEX_capture_before, 1);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM_CAPTURE));
}

int main(void) {
    rng = random_start("firmware_capture", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_frames_are_aligned_for_every_lookahead);
    RUN_TEST(test_telemetry_is_aligned_too);
    RUN_TEST(test_telemetry_drive_is_aligned_with_position);
    RUN_TEST(test_decimation_takes_every_nth_sample);
    RUN_TEST(test_the_whole_buffer_at_once);
    RUN_TEST(test_frames_cannot_be_read_while_they_are_written);
    RUN_TEST(test_a_long_capture_goes_round_and_is_read_meanwhile);
    RUN_TEST(test_a_capture_one_frame_longer_than_the_buffer);
    RUN_TEST(test_arming_again_starts_anew);
    RUN_TEST(test_the_trigger_waits_for_the_next_start);
    RUN_TEST(test_what_was_before_the_trigger);
    RUN_TEST(test_the_trigger_at_a_level);
    RUN_TEST(test_every_signal);
    RUN_TEST(test_what_does_not_fit_is_refused);
    return UNITY_END();
}
