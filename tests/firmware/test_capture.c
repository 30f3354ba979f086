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

static void set(unsigned index, uint32_t value) {
    TEST_ASSERT_EQUAL_MESSAGE(MODBUS_OK, master_set(index, value), register_table[index].name);
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
    set(INDEX_waveform_points, POINTS);
    set(INDEX_source, SOURCE_BREAKPOINTS);
    set(INDEX_source_cycles, 1);
}

/* With lookahead = the actuator's delay, frame i has reference, drive and position of the same breakpoint i, from frame
 * 0 on. */
static void test_frames_are_aligned_for_every_lookahead(void) {
    for (uint32_t lookahead = 0; lookahead <= HYST_LOOKAHEAD_MAX; lookahead++) {
        setUp();
        int16_t levels[POINTS];
        commit_lookahead(lookahead);
        load_random_staircase(levels);
        set(INDEX_mode, HYST_MODE_LINEAR);
        for (unsigned i = 0; i < 200; i++) {
            sample(lookahead);
        }
        set(INDEX_capture_length, POINTS);
        set(INDEX_capture_trigger, CAPTURE_AT_SOURCE);
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
    set(INDEX_mode, HYST_MODE_LINEAR);
    set(INDEX_source, SOURCE_SINE);
    set(INDEX_source_amplitude, 1U << 30);
    set(INDEX_source_increment, 1U << 27);
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
    set(INDEX_mode, HYST_MODE_DIRECT);
    set(INDEX_source, SOURCE_SINE);
    set(INDEX_source_amplitude, 1U << 30);
    set(INDEX_source_increment, 1U << 27);
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
    set(INDEX_mode, HYST_MODE_LINEAR);
    set(INDEX_capture_decimation, DECIMATION);
    set(INDEX_capture_length, FRAMES);
    set(INDEX_capture_trigger, CAPTURE_AT_SOURCE);
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
    set(INDEX_capture_length, CAPTURE_CAPACITY);
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
    set(INDEX_capture_length, 3);
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
    set(INDEX_capture_length, FRAMES);
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
    set(INDEX_capture_length, CAPTURE_CAPACITY + 1);
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
    set(INDEX_capture_length, 5);
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
    set(INDEX_mode, HYST_MODE_DIRECT);
    set(INDEX_source, SOURCE_SINE);
    set(INDEX_source_increment, 1U << 20);
    master_command(COMMAND_START);
    set(INDEX_capture_length, 1);
    set(INDEX_capture_trigger, CAPTURE_AT_SOURCE);
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
    set(INDEX_capture_signals, signals);
    set(INDEX_capture_length, length);
    set(INDEX_capture_before, before);
    set(INDEX_capture_trigger, trigger);
    master_command(COMMAND_ARM_CAPTURE);
}

static void test_what_was_before_the_trigger(void) {
    enum { LENGTH = 16000, BEFORE = 12000, DECIMATION = 2 };
    const uint32_t lives[] = {0, 5, 2 * BEFORE - 1, 2 * BEFORE, 2 * LENGTH + 7, 100001};
    for (unsigned i = 0; i < sizeof lives / sizeof lives[0]; i++) {
        setUp();
        set(INDEX_capture_decimation, DECIMATION);
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
    set(INDEX_capture_level, (uint32_t)LEVEL << 16);
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
        set(INDEX_source, SOURCE_SINE);
        set(INDEX_source_amplitude, 1U << 29);
        set(INDEX_source_increment, 1U << 27);
        set(INDEX_mode, HYST_MODE_COMPENSATE);
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
    set(INDEX_capture_signals, CAPTURE_DRIVE | CAPTURE_POSITION);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_capture_signals, 0));
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_capture_signals, CAPTURE_ALL + 1));
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_capture_trigger, CAPTURE_AT_WARNING + 1));
    set(INDEX_capture_length, 16000);
    set(INDEX_capture_before, 15999);
    master_command(COMMAND_ARM_CAPTURE);
    set(INDEX_capture_before, 16000);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM_CAPTURE));
    set(INDEX_capture_length, 16001);
    set(INDEX_capture_before, 1);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM_CAPTURE));
    set(INDEX_capture_before, 0);
    master_command(COMMAND_ARM_CAPTURE);
    set(INDEX_capture_trigger, CAPTURE_AT_LEVEL);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM_CAPTURE));
    set(INDEX_capture_length, CAPTURE_ENDLESS);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM_CAPTURE));
    set(INDEX_capture_trigger, CAPTURE_AT_FAULT);
    set(INDEX_capture_before, 1);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM_CAPTURE));
}

/* The block `stream`, asked for from a frame on with function 23. */
typedef struct {
    uint16_t number, decimation, signals, frames;
    uint32_t written, sample, first;
    uint16_t data[LENGTH_stream];
} stream_t;

static stream_t read_stream(uint32_t from, uint16_t count) {
    const uint8_t pdu[] = {23,
                           ADDRESS_stream >> 8,
                           ADDRESS_stream & 0xFF,
                           0,
                           (uint8_t)count,
                           ADDRESS_stream_from >> 8,
                           ADDRESS_stream_from & 0xFF,
                           0,
                           2,
                           4,
                           (uint8_t)(from >> 24),
                           (uint8_t)(from >> 16),
                           (uint8_t)(from >> 8),
                           (uint8_t)from};
    uint8_t answer[MODBUS_FRAME_MAX];
    uint16_t r[LENGTH_stream];
    stream_t s;
    TEST_ASSERT_EQUAL_UINT(2U + 2U * (size_t)count, master_ask(pdu, sizeof pdu, answer));
    for (size_t i = 0; i < count; i++) {
        r[i] = (uint16_t)(answer[2U + 2U * i] << 8 | answer[3U + 2U * i]);
        if (i >= 10) {
            s.data[i - 10] = r[i];
        }
    }
    s.number = r[0];
    s.decimation = r[1];
    s.signals = r[2];
    s.written = (uint32_t)r[3] << 16 | r[4];
    s.sample = (uint32_t)r[5] << 16 | r[6];
    s.first = (uint32_t)r[7] << 16 | r[8];
    s.frames = r[9];
    return s;
}

/* A position that tells the frame, and whether one was left out or comes twice. */
static hyst_q31_t position_of(uint32_t frame) {
    return (hyst_q31_t)((frame * 40503U) << 16);
}

static void make_frames(uint32_t *made, uint32_t count) {
    for (uint32_t i = 0; i < count; i++) {
        (void)fake_board_sample(position_of((*made)++));
    }
}

static void arm_endless(uint16_t signals) {
    set(INDEX_capture_signals, signals);
    set(INDEX_capture_length, CAPTURE_ENDLESS);
    master_command(COMMAND_ARM_CAPTURE);
}

/* Position is the only or the last signal. */
static void expect_frames(const stream_t *s, uint32_t from, uint16_t width) {
    TEST_ASSERT_EQUAL_UINT32(from, s->first);
    for (uint16_t i = 0; i < s->frames; i++) {
        TEST_ASSERT_EQUAL_HEX16((uint16_t)((uint32_t)position_of(from + i) >> 16),
                                s->data[(uint32_t)width * i + width - 1U]);
    }
}

/* Read in time it has every frame once, in order, over many turns of the ring, whatever the width. */
static void test_a_stream_has_no_gap(void) {
    static const uint16_t signals[] = {CAPTURE_POSITION, CAPTURE_DRIVE | CAPTURE_POSITION, CAPTURE_DEFAULT_SIGNALS};
    for (uint16_t width = 1; width <= 3; width++) {
        setUp();
        const uint32_t capacity = CAPTURE_WORDS / width;
        const uint16_t room = (uint16_t)(115U / width);
        uint32_t made = 0, read = 0;
        arm_endless(signals[width - 1U]);
        while (read < 5U * capacity) {
            make_frames(&made, (uint32_t)random_between(&rng, 0, 2 * room));
            while (read < made) {
                const stream_t s = read_stream(read, LENGTH_stream);
                TEST_ASSERT_EQUAL_UINT32(made, s.written);
                TEST_ASSERT_EQUAL_UINT16(made - read < room ? made - read : room, s.frames);
                TEST_ASSERT_EQUAL_UINT16(signals[width - 1U], s.signals);
                expect_frames(&s, read, width);
                read += s.frames;
            }
        }
        TEST_ASSERT_EQUAL(CAPTURE_RUNNING, capture_state());
        TEST_ASSERT_EQUAL_UINT16(0, read_stream(made, LENGTH_stream).frames);
        TEST_ASSERT_EQUAL_UINT16(0, read_stream(made + 5U, LENGTH_stream).frames); /* yet to come */
    }
}

/* A request that is repeated gets the same. */
static void test_a_block_can_be_read_again(void) {
    uint32_t made = 0;
    arm_endless(CAPTURE_POSITION);
    make_frames(&made, 3000);
    const stream_t once = read_stream(1000, LENGTH_stream), again = read_stream(1000, LENGTH_stream);
    TEST_ASSERT_EQUAL_UINT16(115, once.frames);
    TEST_ASSERT_EQUAL_HEX16_ARRAY(once.data, again.data, 115);
    const stream_t piece = read_stream(1000, 20);
    TEST_ASSERT_EQUAL_UINT16(10, piece.frames);
    expect_frames(&piece, 1000, 1);
    TEST_ASSERT_EQUAL_UINT16(0, read_stream(1000, 10).frames);
}

/* The oldest frame is read while it is there. One frame later the gap is reported, and what comes then is in order. */
static void test_a_stream_that_is_read_too_late_says_so(void) {
    enum { CAPACITY = CAPTURE_WORDS / 2 };
    uint32_t made = 0;
    arm_endless(CAPTURE_DRIVE | CAPTURE_POSITION);
    make_frames(&made, 7 * CAPACITY / 2);
    stream_t s = read_stream(made - CAPACITY, LENGTH_stream);
    TEST_ASSERT_EQUAL_UINT16(57, s.frames);
    expect_frames(&s, made - CAPACITY, 2);
    const uint32_t late = made - CAPACITY;
    make_frames(&made, 1);
    s = read_stream(late, LENGTH_stream);
    TEST_ASSERT_EQUAL_UINT16(57, s.frames);
    expect_frames(&s, made - CAPACITY / 2, 2); /* not `late` */
    s = read_stream(s.first + s.frames, LENGTH_stream);
    expect_frames(&s, made - CAPACITY / 2 + 57, 2);
}

/* Which sample a frame is of: decimation apart, the newest one at most that old. */
static void test_a_stream_tells_the_samples_of_its_frames(void) {
    enum { DECIMATION = 7 };
    set(INDEX_capture_decimation, DECIMATION);
    arm_endless(CAPTURE_POSITION);
    (void)fake_board_run(1);
    const uint32_t frame_0 = master_get(INDEX_sequence);
    for (int i = 0; i < 40; i++) {
        const stream_t s = read_stream(0, LENGTH_stream);
        TEST_ASSERT_EQUAL_UINT16(DECIMATION, s.decimation);
        TEST_ASSERT_EQUAL_UINT32(frame_0 + DECIMATION * (s.written - 1U), s.sample);
        TEST_ASSERT_LESS_THAN_UINT32(DECIMATION, master_get(INDEX_sequence) - s.sample);
        (void)fake_board_run(1);
    }
}

/* Command 12. What there is can be read, by either block. A capture that is armed anew has another number. */
static void test_the_end_of_a_stream(void) {
    uint32_t made = 0;
    uint16_t value;
    arm_endless(CAPTURE_POSITION);
    const uint16_t number = read_stream(0, LENGTH_stream).number;
    make_frames(&made, CAPTURE_WORDS + 100);
    TEST_ASSERT_EQUAL(MODBUS_DEVICE_FAILURE, master_read(ADDRESS_capture, 1, &value));
    master_command(COMMAND_END_CAPTURE);
    TEST_ASSERT_EQUAL(CAPTURE_DONE, capture_state());
    uint32_t ignored = made;
    make_frames(&ignored, 500); /* no more */
    const stream_t last = read_stream(made - 50, LENGTH_stream);
    TEST_ASSERT_EQUAL_UINT32(made, last.written);
    TEST_ASSERT_EQUAL_UINT16(50, last.frames);
    TEST_ASSERT_EQUAL_UINT16(number, last.number);
    expect_frames(&last, made - 50, 1);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read((uint16_t)(ADDRESS_capture + (made - 1) % CAPTURE_WORDS), 1, &value));
    TEST_ASSERT_EQUAL_HEX16(last.data[49], value);
    set(INDEX_capture_trigger, CAPTURE_AT_FAULT);
    arm_endless(CAPTURE_POSITION);
    TEST_ASSERT_EQUAL_UINT16(number + 1, read_stream(0, LENGTH_stream).number);
    master_command(COMMAND_END_CAPTURE); /* it never began */
    TEST_ASSERT_EQUAL(CAPTURE_IDLE, capture_state());
}

/* A capture with an end, and frames before its trigger, is read by the numbers of its frames, too. */
static void test_any_capture_is_a_stream(void) {
    enum { LENGTH = 30, BEFORE = 20 };
    set(INDEX_capture_level, 0x10000);
    arm_history(CAPTURE_POSITION, LENGTH, BEFORE, CAPTURE_AT_LEVEL);
    for (int n = -30000; n < 100; n++) {
        (void)fake_board_sample((hyst_q31_t)((uint32_t)n << 16));
    }
    TEST_ASSERT_EQUAL_UINT32(CAPTURE_DONE, master_get(INDEX_capture_state));
    const stream_t s = read_stream(0, LENGTH_stream);
    TEST_ASSERT_EQUAL_UINT16(LENGTH, s.frames);
    for (int i = 0; i < LENGTH; i++) {
        TEST_ASSERT_EQUAL_INT16(1 - BEFORE + i, (int16_t)s.data[i]);
    }
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
    RUN_TEST(test_a_stream_has_no_gap);
    RUN_TEST(test_a_block_can_be_read_again);
    RUN_TEST(test_a_stream_that_is_read_too_late_says_so);
    RUN_TEST(test_a_stream_tells_the_samples_of_its_frames);
    RUN_TEST(test_the_end_of_a_stream);
    RUN_TEST(test_any_capture_is_a_stream);
    return UNITY_END();
}
