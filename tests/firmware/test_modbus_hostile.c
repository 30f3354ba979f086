/* SPDX-License-Identifier: MIT */
/*
 * What a line or a bad master can do to the server: cut frames, flipped bits, random bytes, random requests with a
 * right CRC. It must neither act on what is broken, nor answer anything malformed, nor touch a byte outside its buffers
 * (the sanitizers watch; the reply has guard bytes besides). HYST_MODBUS_FRAMES sets how many random frames each of the
 * last three tests sends (200,000 without it). Runs with other seeds (HYST_TEST_SEED) add up: splitmix64 steps by the
 * golden ratio, so the numbers of seeds that differ by less than 8e8 do not meet within the first 1e10. The last line
 * says how many frames of which seed there were.
 */
#include "amplifier.h"
#include "fake_board.h"
#include "loop/loop.h"
#include "loop/telemetry.h"
#include "master.h"
#include "motion/source.h"
#include "random.h"
#include "unity.h"
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define GUARD 0xA5

static random_t rng;
static unsigned long frames = 200000;
static unsigned long sent; /* random frames that reached the server */

void setUp(void) {
    fake_board_power_on(0);
}
void tearDown(void) {
}

/* Serves a frame that lies at the very end of its memory, with guards around the reply. */
static modbus_outcome_t serve(const uint8_t *frame, size_t length, uint8_t reply[MODBUS_FRAME_MAX],
                              size_t *reply_length) {
    uint8_t guarded[MODBUS_FRAME_MAX + 32];
    memset(guarded, GUARD, sizeof guarded);
    const modbus_outcome_t outcome = modbus_serve(frame, length, guarded + 16, reply_length);
    for (size_t i = 0; i < 16; i++) {
        TEST_ASSERT_EQUAL_HEX8(GUARD, guarded[i]);
        TEST_ASSERT_EQUAL_HEX8(GUARD, guarded[16 + MODBUS_FRAME_MAX + i]);
    }
    memcpy(reply, guarded + 16, MODBUS_FRAME_MAX);
    return outcome;
}

/* One valid request of each kind; all would change something or answer something. */
static size_t valid_request(unsigned which, uint8_t frame[MODBUS_FRAME_MAX]) {
    static const struct {
        size_t length;
        uint8_t pdu[16];
    } requests[] = {
        {5, {3, 0x02, 0x00, 0, 33}},
        {5, {4, 0x40, 0x00, 0, 125}},
        {5, {6, 0x01, 0x01, 0, 3}},
        {10, {16, 0x01, 0x02, 0, 2, 4, 0x12, 0x34, 0x56, 0x78}},
        {14, {23, 0x02, 0x00, 0, 10, 0x01, 0x02, 0, 2, 4, 0x0A, 0x0B, 0x0C, 0x0D}},
        {4, {43, 14, 1, 0}},
        {5, {1, 0, 0, 0, 1}},
        {5, {2, 0, 0, 0, 69}},
        {5, {5, 0, 0, 0, 0}},
        {5, {8, 0, 10, 0, 0}},
        {7, {15, 0, 0, 0, 1, 1, 0}},
        {7, {22, 0x01, 0x01, 0, 0, 0, 3}},
    };
    if (which == sizeof requests / sizeof requests[0]) {
        return 0;
    }
    return master_frame(frame, MASTER_SERVER, requests[which].pdu, requests[which].length);
}

static void assert_nothing_happened(void) {
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_mode));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_setpoint));
    TEST_ASSERT_TRUE(loop_armed());
}

static void test_every_truncation_is_dropped(void) {
    uint8_t frame[MODBUS_FRAME_MAX], reply[MODBUS_FRAME_MAX];
    size_t length, reply_length;
    for (unsigned which = 0; (length = valid_request(which, frame)) != 0; which++) {
        for (size_t cut = 0; cut < length; cut++) {
            TEST_ASSERT_EQUAL(MODBUS_FRAME_BROKEN, serve(frame, cut, reply, &reply_length));
            TEST_ASSERT_EQUAL_UINT(0, reply_length);
            TEST_ASSERT_EQUAL(MODBUS_FRAME_BROKEN, serve(frame + length - cut, cut, reply, &reply_length));
        }
    }
    assert_nothing_happened();
}

/* An address with a right CRC, and nothing between them. */
static void test_a_frame_without_a_function_is_dropped(void) {
    static const uint8_t nothing[1];
    uint8_t frame[MODBUS_FRAME_MAX], reply[MODBUS_FRAME_MAX];
    size_t reply_length;
    const size_t length = master_frame(frame, MASTER_SERVER, nothing, 0);
    TEST_ASSERT_EQUAL_UINT(3, length);
    TEST_ASSERT_EQUAL(MODBUS_FRAME_BROKEN, serve(frame, length, reply, &reply_length));
}

/* CRC-16 finds every error of one, two and three bits in frames this short, and every burst up to 16 bits. */
static void test_every_flip_of_one_and_two_bits_is_dropped(void) {
    uint8_t frame[MODBUS_FRAME_MAX], reply[MODBUS_FRAME_MAX];
    size_t length, reply_length;
    for (unsigned which = 0; (length = valid_request(which, frame)) != 0; which++) {
        for (size_t first = 0; first < 8U * length; first++) {
            frame[first / 8U] ^= (uint8_t)(1U << first % 8U);
            TEST_ASSERT_EQUAL(MODBUS_FRAME_BROKEN, serve(frame, length, reply, &reply_length));
            for (size_t second = first + 1U; second < 8U * length; second++) {
                frame[second / 8U] ^= (uint8_t)(1U << second % 8U);
                TEST_ASSERT_EQUAL(MODBUS_FRAME_BROKEN, serve(frame, length, reply, &reply_length));
                frame[second / 8U] ^= (uint8_t)(1U << second % 8U);
            }
            frame[first / 8U] ^= (uint8_t)(1U << first % 8U);
        }
    }
    assert_nothing_happened();
}

/* An answer must be one that the request allows. */
static void check_answer(const uint8_t *frame, const uint8_t *reply, size_t length) {
    TEST_ASSERT_TRUE(length >= 5 && length <= MODBUS_FRAME_MAX);
    TEST_ASSERT_EQUAL_HEX16(0, modbus_crc(reply, length));
    TEST_ASSERT_EQUAL_HEX8(frame[0], reply[0]);
    if (reply[1] == (frame[1] | 0x80U)) {
        TEST_ASSERT_EQUAL_UINT(5, length);
        TEST_ASSERT_TRUE(reply[2] >= 1 && reply[2] <= 4);
        return;
    }
    TEST_ASSERT_EQUAL_HEX8(frame[1], reply[1]);
    if (frame[1] == 3 || frame[1] == 4 || frame[1] == 23) {
        TEST_ASSERT_EQUAL_UINT(5U + reply[2], length);
        TEST_ASSERT_EQUAL_UINT(2U * frame[5], reply[2]);
    } else if (frame[1] == 1 || frame[1] == 2) {
        TEST_ASSERT_EQUAL_UINT(5U + reply[2], length);
    } else if (frame[1] == 22) {
        TEST_ASSERT_EQUAL_UINT(10, length);
    } else if (frame[1] == 8 && frame[2] == 0 && frame[3] == 0) { /* query data: the request itself, CRC and all */
        TEST_ASSERT_TRUE(length >= 8 && length % 2U == 0);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(frame, reply, length);
    } else if (frame[1] == 8) {
        TEST_ASSERT_EQUAL_UINT(8, length);
    } else if (frame[1] != 43) {
        TEST_ASSERT_EQUAL_UINT(8, length);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(frame + 2, reply + 2, 4);
    }
}

/* Eight bytes a draw: random numbers must not cost more than what they are for. */
static void random_bytes(uint8_t *bytes, size_t length) {
    for (size_t i = 0; i < length; i += 8) {
        const uint64_t bits = random_bits(&rng);
        memcpy(bytes + i, &bits, length - i < 8 ? length - i : 8);
    }
}

static void test_random_bytes(void) {
    for (unsigned long run = 0; run < frames; run++) {
        uint8_t frame[MODBUS_FRAME_MAX + 40], reply[MODBUS_FRAME_MAX];
        size_t reply_length;
        const size_t length = (size_t)random_between(&rng, 0, (int32_t)sizeof frame);
        random_bytes(frame, length);
        const modbus_outcome_t outcome = serve(frame, length, reply, &reply_length);
        if (outcome == MODBUS_FRAME_ANSWERED || (outcome == MODBUS_FRAME_REFUSED && frame[0] != 0)) {
            check_answer(frame, reply, reply_length);
        } else {
            TEST_ASSERT_EQUAL_UINT(0, reply_length);
        }
    }
    sent += frames;
}

/* Right CRC, right address, mostly real functions and addresses near real registers: these get past the first checks.
 * Mostly small numbers, so that there are commands and modes among them. Returns the length. */
enum { PDU_MAX = 40, COUNT_MAX = 12 };
static size_t random_request(uint8_t pdu[PDU_MAX]) {
    static const uint8_t functions[] = {3, 4, 6, 16, 16, 23, 43, 1, 2, 5, 8, 15, 22};
    static const uint16_t bases[] = {0,
                                     0x0100,
                                     0x0101,
                                     0x0111,
                                     0x0180,
                                     ADDRESS_drive_low,
                                     ADDRESS_unlock,
                                     ADDRESS_sequence,
                                     ADDRESS_line_address,
                                     ADDRESS_tones,
                                     ADDRESS_waveform,
                                     ADDRESS_staging,
                                     ADDRESS_active,
                                     ADDRESS_capture,
                                     ADDRESS_event_log,
                                     ADDRESS_stream,
                                     0xFFF0};
    size_t length = (size_t)random_between(&rng, 1, PDU_MAX);
    random_bytes(pdu, PDU_MAX);
    uint64_t small = random_bits(&rng);
    for (size_t i = 0; i < PDU_MAX; i++, small >>= 1) {
        pdu[i] = (small & 1U) != 0 ? pdu[i] & 0x0FU : pdu[i];
    }
    pdu[0] = functions[random_between(&rng, 0, sizeof functions - 1)];
    const int32_t which = random_between(&rng, 0, sizeof bases / sizeof bases[0] - 1);
    const uint16_t base = (uint16_t)(bases[which] + random_between(&rng, 0, 4));
    const uint8_t count = (uint8_t)random_between(&rng, 0, COUNT_MAX);
    pdu[1] = (uint8_t)(base >> 8);
    pdu[2] = (uint8_t)base;
    if (pdu[0] != 6 && pdu[0] != 22) {
        pdu[3] = 0;
    }
    if (pdu[0] == 16 && random_between(&rng, 0, 9) != 0) {
        pdu[4] = count;
        pdu[5] = (uint8_t)(2U * count);
        length = 6U + 2U * (size_t)count;
    } else if (pdu[0] == 23 && random_between(&rng, 0, 9) != 0) {
        memcpy(pdu + 5, pdu + 1, 2);
        pdu[7] = 0;
        pdu[8] = count;
        pdu[9] = (uint8_t)(2U * count);
        length = 10U + 2U * (size_t)count;
    } else if (pdu[0] <= 6) {
        length = 5;
    }
    return length;
}

/* One that a master would send to get ahead: keys, an arming, a start. */
static size_t useful_request(uint8_t pdu[PDU_MAX]) {
    static const uint16_t writes[][2] = {
        {ADDRESS_unlock, CONTROL_KEY_PARAMETERS}, {ADDRESS_unlock, CONTROL_KEY_OUTPUT}, {ADDRESS_command, COMMAND_ARM},
        {ADDRESS_command, COMMAND_STOP},          {ADDRESS_command, COMMAND_START},     {ADDRESS_watchdog, 0},
        {ADDRESS_command, COMMAND_CONDITION},     {ADDRESS_source, SOURCE_SINE},        {ADDRESS_mode, 1},
        {ADDRESS_source_increment, 0x0040},
    };
    const int32_t which = random_between(&rng, 0, sizeof writes / sizeof writes[0] - 1);
    const uint16_t *write = writes[which];
    const bool wide = write[0] == ADDRESS_source_increment;
    const uint8_t bytes[] = {wide ? 16 : 6,
                             (uint8_t)(write[0] >> 8),
                             (uint8_t)write[0],
                             wide ? 0 : (uint8_t)(write[1] >> 8),
                             wide ? 2 : (uint8_t)write[1],
                             4,
                             0,
                             (uint8_t)write[1],
                             0,
                             0};
    memcpy(pdu, bytes, sizeof bytes);
    return wide ? sizeof bytes : 5;
}

static size_t disarming(uint8_t pdu[PDU_MAX]) {
    static const uint8_t request[] = {6, ADDRESS_command >> 8, ADDRESS_command & 0xFF, 0, COMMAND_DISARM};
    memcpy(pdu, request, sizeof request);
    return sizeof request;
}

/* Never answered, and no way to anything but a safer output. */
static void check_broadcast(modbus_outcome_t outcome, const uint8_t *pdu, size_t length, size_t reply_length) {
    TEST_ASSERT_EQUAL_UINT(0, reply_length);
    TEST_ASSERT_TRUE(outcome != MODBUS_FRAME_ANSWERED && outcome != MODBUS_FRAME_BROKEN);
    const uint32_t command = master_command_of(pdu, length);
    TEST_ASSERT_TRUE(outcome != MODBUS_FRAME_BROADCAST || command == COMMAND_NONE || command == COMMAND_STOP ||
                     command == COMMAND_CLEAR || command == COMMAND_PARK || command == COMMAND_LATCH ||
                     command == COMMAND_DISARM);
}

/* The loop runs in between, so commands and sources really act; and a new life begins now and then, so that no request
 * decides for good what the others meet. */
static void test_random_requests(void) {
    enum { FRAMES_OF_A_LIFE = 20000, FRAMES_OF_A_MOOD = 2000, FRAMES_OF_A_FAULT = 9000 };
    unsigned long accepted = 0, refused = 0, broadcasts = 0, visits[AMPLIFIER_FAULT + 1] = {0};
    uint32_t state = AMPLIFIER_HOLD;
    for (unsigned long run = 0; run < frames; run++) {
        uint8_t pdu[PDU_MAX], frame[MODBUS_FRAME_MAX], reply[MODBUS_FRAME_MAX];
        if (run % FRAMES_OF_A_LIFE == 0) {
            fake_board_power_on(0);
            state = AMPLIFIER_HOLD;
        }
        const bool helps = run / FRAMES_OF_A_MOOD % 2 == 0; /* else it disarms, so that it is off for a while, too */
        const bool means_it = random_between(&rng, 0, helps ? 7 : FRAMES_OF_A_MOOD / 10) == 0;
        const size_t length = !means_it ? random_request(pdu) : helps ? useful_request(pdu) : disarming(pdu);
        size_t reply_length;
        const bool to_all = random_between(&rng, 0, 15) == 0;
        const uint8_t to = to_all ? (uint8_t)MODBUS_BROADCAST_ADDRESS : (uint8_t)MASTER_SERVER;
        const size_t frame_length = master_frame(frame, to, pdu, length);
        const modbus_outcome_t outcome = serve(frame, frame_length, reply, &reply_length);
        if (to_all) {
            check_broadcast(outcome, pdu, length, reply_length);
        } else {
            TEST_ASSERT_TRUE(outcome == MODBUS_FRAME_ANSWERED || outcome == MODBUS_FRAME_REFUSED);
            check_answer(frame, reply, reply_length);
        }
        const bool taken = outcome == MODBUS_FRAME_ANSWERED || outcome == MODBUS_FRAME_BROADCAST;
        accepted += taken ? 1UL : 0UL;
        refused += outcome == MODBUS_FRAME_REFUSED ? 1UL : 0UL;
        broadcasts += outcome == MODBUS_FRAME_BROADCAST ? 1UL : 0UL;
        if (run % FRAMES_OF_A_FAULT == FRAMES_OF_A_FAULT - 1) {
            (void)loop_sample(&(loop_input_t){.faults = FAULT_SUPPLY, .position_code = BOARD_CODE_MIDDLE});
        }
        (void)fake_board_sample(random_q31(&rng));
        (void)amplifier_serve();
        telemetry_t t;
        telemetry_read(&t);
        const uint32_t command = taken ? master_command_of(pdu, length) : (uint32_t)COMMAND_NONE;
        TEST_ASSERT_TRUE_MESSAGE(fake_board_lawful(state, t.amplifier_state, command, true), "transition");
        state = t.amplifier_state;
        TEST_ASSERT_TRUE(state != AMPLIFIER_OFF || !fake_board.stage_enabled);
        visits[state]++;
    }
    sent += frames;
    TEST_ASSERT_TRUE_MESSAGE(accepted > frames / 10 && refused > frames / 10, "the requests must reach both outcomes");
    TEST_ASSERT_TRUE_MESSAGE(broadcasts > frames / 5000, "hardly a broadcast was executed");
    printf("firmware_modbus_hostile: frames in state");
    for (unsigned i = 0; i <= AMPLIFIER_FAULT; i++) {
        printf(" %u: %lu", i, visits[i]);
    }
    printf("\n");
    for (unsigned i = 0; i <= AMPLIFIER_FAULT; i++) {
        TEST_ASSERT_TRUE_MESSAGE(visits[i] > frames / 2000, "a state that was hardly visited");
    }
}

/* Registers that may be written without a key and do something: what makes the output safe, and the key itself. */
static bool reaches_what_is_not_locked(const uint8_t *pdu) {
    const bool writes = pdu[0] == 5 || pdu[0] == 6 || pdu[0] == 15 || pdu[0] == 16 || pdu[0] == 22 || pdu[0] == 23;
    const unsigned at = (unsigned)pdu[pdu[0] == 23 ? 5 : 1] << 8 | pdu[pdu[0] == 23 ? 6 : 2];
    const unsigned most = 16; /* longer than any span that random_request makes */
    return writes && (pdu[0] == 5 || pdu[0] == 15 || (at <= ADDRESS_mode && at + most > ADDRESS_command) ||
                      (at <= ADDRESS_unlock && at + most > ADDRESS_unlock));
}

/* One that must change nothing: broken, for somebody else, or locked. */
static void disturb(void) {
    uint8_t pdu[PDU_MAX], frame[MODBUS_FRAME_MAX], reply[MODBUS_FRAME_MAX];
    size_t reply_length;
    size_t length = random_request(pdu);
    const int kind = random_between(&rng, 0, 4);
    if (kind <= 1 && reaches_what_is_not_locked(pdu)) {
        return;
    }
    length = master_frame(frame,
                          kind == 1   ? (uint8_t)MODBUS_BROADCAST_ADDRESS
                          : kind == 2 ? (uint8_t)random_between(&rng, 2, 255)
                                      : (uint8_t)MASTER_SERVER,
                          pdu, length);
    if (kind == 3) {
        frame[random_between(&rng, 0, (int32_t)length - 1)] ^= (uint8_t)(1U << random_between(&rng, 0, 7));
    } else if (kind == 4) {
        length = (size_t)random_between(&rng, 0, (int32_t)length - 1);
    }
    if (kind >= 3 && modbus_crc(frame, length) == 0) {
        return; /* one in 65536 is whole by chance */
    }
    const modbus_outcome_t outcome = serve(frame, length, reply, &reply_length);
    sent++;
    TEST_ASSERT_TRUE(kind <= 1 || outcome == MODBUS_FRAME_BROKEN || outcome == MODBUS_FRAME_FOREIGN);
}

/* A sine in direct mode, locked again; each drive code of so many samples, by a running sum of Fletcher's kind. */
static uint64_t life(unsigned long samples, unsigned disturbances) {
    uint64_t first = 0, second = 0;
    fake_board_power_on(0);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_DIRECT));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source, SOURCE_SINE));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_amplitude, 1 << 30));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_increment, 4294967));
    master_command(COMMAND_START);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_unlock, 0));
    for (unsigned long i = 0; i < samples; i++) {
        for (unsigned k = 0; k < disturbances; k++) {
            disturb();
        }
        first += fake_board_sample((hyst_q31_t)(uint32_t)(i * 2654435761U));
        second += first;
        (void)amplifier_serve();
    }
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_RUN, master_get(INDEX_amplifier_state));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_unlocked));
    return second;
}

static void test_the_output_is_the_undisturbed_one_to_the_bit(void) {
    enum { EACH_SAMPLE = 10 };
    const unsigned long samples = frames / EACH_SAMPLE;
    const uint64_t undisturbed = life(samples, 0);
    const uint64_t disturbed = life(samples, EACH_SAMPLE);
    TEST_ASSERT_EQUAL_HEX64(undisturbed, disturbed);
}

int main(void) {
    const char *wanted = getenv("HYST_MODBUS_FRAMES");
    frames = wanted != NULL ? strtoul(wanted, NULL, 10) : frames;
    rng = random_start("firmware_modbus_hostile", 20261121);
    const uint64_t seed = rng.state;
    UNITY_BEGIN();
    RUN_TEST(test_every_truncation_is_dropped);
    RUN_TEST(test_a_frame_without_a_function_is_dropped);
    RUN_TEST(test_every_flip_of_one_and_two_bits_is_dropped);
    RUN_TEST(test_random_bytes);
    RUN_TEST(test_random_requests);
    RUN_TEST(test_the_output_is_the_undisturbed_one_to_the_bit);
    const int failures = UNITY_END();
    const double seconds = (double)clock() / CLOCKS_PER_SEC;
    printf("firmware_modbus_hostile: seed %" PRIu64 ", %lu random frames, %.0f a second of processor time\n", seed,
           sent, (double)sent / seconds);
    return failures;
}
