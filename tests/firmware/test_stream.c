/* SPDX-License-Identifier: MIT */
/* The block `stream`: a capture that is read while it goes on, by the numbers of its frames. */
#include "fake_board.h"
#include "loop/capture.h"
#include "master.h"
#include "random.h"
#include "unity.h"

static random_t rng;

void setUp(void) {
    fake_board_power_on(0);
}
void tearDown(void) {
}

/* The block, asked for from a frame on with function 23. */
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
    master_put(INDEX_capture_signals, signals);
    master_put(INDEX_capture_length, CAPTURE_ENDLESS);
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

/* What is not written yet is none, however far ahead: not even of the capture before it. */
static void test_no_frame_is_read_ahead(void) {
    static const uint32_t ahead[] = {0, 1, CAPTURE_WORDS, INT32_MAX, UINT32_C(1) << 31, UINT32_MAX - 1U, UINT32_MAX};
    uint32_t made = 0;
    arm_endless(CAPTURE_POSITION);
    make_frames(&made, 2 * CAPTURE_WORDS);
    arm_endless(CAPTURE_POSITION);
    for (made = 0; made < 3; made++) {
        for (size_t i = made > 0 ? 3 : 0; i < sizeof ahead / sizeof ahead[0]; i++) {
            const stream_t s = read_stream(ahead[i], LENGTH_stream);
            TEST_ASSERT_EQUAL_UINT16(0, s.frames);
            TEST_ASSERT_EQUAL_UINT32(made, s.written);
        }
        (void)fake_board_sample(0);
    }
}

/* Which sample a frame is of: decimation apart, the newest one at most that old. */
static void test_a_stream_tells_the_samples_of_its_frames(void) {
    enum { DECIMATION = 7 };
    master_put(INDEX_capture_decimation, DECIMATION);
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
    master_put(INDEX_capture_trigger, CAPTURE_AT_FAULT);
    arm_endless(CAPTURE_POSITION);
    TEST_ASSERT_EQUAL_UINT16(number + 1, read_stream(0, LENGTH_stream).number);
    master_command(COMMAND_END_CAPTURE); /* it never began */
    TEST_ASSERT_EQUAL(CAPTURE_IDLE, capture_state());
}

/* A capture with an end, and frames before its trigger, is read by the numbers of its frames, too. */
static void test_any_capture_is_a_stream(void) {
    enum { LENGTH = 30, BEFORE = 20 };
    master_put(INDEX_capture_level, 0x10000);
    master_put(INDEX_capture_signals, CAPTURE_POSITION);
    master_put(INDEX_capture_length, LENGTH);
    master_put(INDEX_capture_before, BEFORE);
    master_put(INDEX_capture_trigger, CAPTURE_AT_LEVEL);
    master_command(COMMAND_ARM_CAPTURE);
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
    rng = random_start("firmware_stream", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_a_stream_has_no_gap);
    RUN_TEST(test_a_block_can_be_read_again);
    RUN_TEST(test_a_stream_that_is_read_too_late_says_so);
    RUN_TEST(test_no_frame_is_read_ahead);
    RUN_TEST(test_a_stream_tells_the_samples_of_its_frames);
    RUN_TEST(test_the_end_of_a_stream);
    RUN_TEST(test_any_capture_is_a_stream);
    return UNITY_END();
}
