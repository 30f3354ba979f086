/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The converter line and the twin on it, against a partner that the test plays in a process of its own. */
#include "base/monotonic_clock.h"
#include "bench/converter_line.h"
#include "bench/twin.h"
#include "chain/catalogue.h"
#include "random.h"
#include "recording/recording.h"
#include "unity.h"
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

static volatile sig_atomic_t stop;
static failure_t failure;
static model_t model;
static twin_t *twin;

void setUp(void) {
    stop = 0;
    failure.text[0] = '\0';
    twin = NULL;
    /* Straight: 0.5 um/V, no hysteresis. */
    model_create(&model, 10000.0);
    model_block_t *block = model_append(&model, catalogue_find("prandtl_ishlinskii"));
    const double weight = 0.5;
    model_set(block, "offset_um", 1.0);
    model_set_array(block, "weights", 1, &weight, NULL);
}

void tearDown(void) {
    twin_close(twin);
    model_free(&model);
}

static void test_every_code_survives_the_line(void) {
    converter_decoder_t decoder = {0};
    for (unsigned code = 0; code < 65536; code++) {
        uint8_t frame[CONVERTER_FRAME_BYTES];
        uint16_t back = 0;
        converter_encode((uint16_t)code, frame);
        TEST_ASSERT_FALSE(converter_decode(&decoder, frame[0], &back));
        TEST_ASSERT_FALSE(converter_decode(&decoder, frame[1], &back));
        TEST_ASSERT_TRUE(converter_decode(&decoder, frame[2], &back));
        TEST_ASSERT_EQUAL_HEX16(code, back);
        TEST_ASSERT_EQUAL_HEX8(0x80, frame[0] & 0xFC); /* as docs/DESIGN.md has it */
        TEST_ASSERT_EQUAL_HEX8(0, (frame[1] | frame[2]) & 0x80);
    }
}

/* Any one byte of a stream is lost, or any byte is inserted: at most two frames suffer, and none is made up after them.
 */
static void test_the_line_recovers_from_lost_and_foreign_bytes(void) {
    enum { FRAMES = 6 };
    for (unsigned hit = 0; hit < 2 * 3 * CONVERTER_FRAME_BYTES; hit++) {
        for (unsigned foreign = 0; foreign < 257; foreign++) { /* 256: the byte is lost */
            converter_decoder_t decoder = {0};
            uint16_t last = 0;
            unsigned position = 0;
            unsigned complete = 0;
            for (unsigned f = 0; f < FRAMES; f++) {
                uint8_t frame[CONVERTER_FRAME_BYTES];
                converter_encode((uint16_t)(0x1111U * (f + 1)), frame);
                for (unsigned b = 0; b < CONVERTER_FRAME_BYTES; b++, position++) {
                    if (position == hit && foreign < 256) {
                        complete += converter_decode(&decoder, (uint8_t)foreign, &last);
                    }
                    if (position != hit || foreign < 256) {
                        complete += converter_decode(&decoder, frame[b], &last);
                    }
                }
            }
            if (hit < (FRAMES - 1) * CONVERTER_FRAME_BYTES) {
                TEST_ASSERT_EQUAL_HEX16(0x1111 * FRAMES, last);
            }
            TEST_ASSERT_GREATER_OR_EQUAL_UINT(FRAMES - 1, complete);
            TEST_ASSERT_LESS_OR_EQUAL_UINT(FRAMES, complete);
        }
    }
}

static twin_options_t options_of(void) {
    return (twin_options_t){.sample_rate_hz = 10000.0,
                            .substeps = 4,
                            .drive_range_v = {0.0, 100.0},
                            .position_range_um = {-10.0, 90.0},
                            .seed = 1};
}

static void open_twin(const twin_options_t *options) {
    twin = twin_open(&model, options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(twin, failure.text);
}

static void test_codes_are_linear_in_volts_and_micrometres_and_saturate(void) {
    const twin_options_t options = options_of();
    open_twin(&options);
    for (unsigned code = 0; code < 65536; code += 255) {
        twin_step(twin, (uint16_t)code);
        const double volts = 100.0 * code / 65536.0;
        const double position = 1.0 + 0.5 * volts;
        TEST_ASSERT_EQUAL_UINT16((uint16_t)lround((position + 10.0) / 100.0 * 65536.0), twin_position_code(twin));
    }
    twin_close(twin);
    twin_options_t narrow = options;
    narrow.position_range_um[0] = 20.0;
    narrow.position_range_um[1] = 30.0;
    open_twin(&narrow);
    twin_step(twin, 0);
    TEST_ASSERT_EQUAL_UINT16(0, twin_position_code(twin));
    twin_step(twin, UINT16_MAX);
    TEST_ASSERT_EQUAL_UINT16(UINT16_MAX, twin_position_code(twin));
}

static void test_noise_has_its_size_and_its_seed(void) {
    enum { SAMPLES = 20000 };
    twin_options_t options = options_of();
    options.noise_um = 0.5;
    static uint16_t first[SAMPLES];
    for (int round = 0; round < 3; round++) {
        options.seed = round < 2 ? 7 : 8;
        open_twin(&options);
        double sum = 0.0;
        double squares = 0.0;
        unsigned equal = 0;
        for (int i = 0; i < SAMPLES; i++) {
            twin_step(twin, 32768);
            const uint16_t code = twin_position_code(twin);
            const double um = -10.0 + 100.0 * code / 65536.0;
            sum += um - 26.0;
            squares += (um - 26.0) * (um - 26.0);
            equal += code == first[i];
            first[i] = round == 0 ? code : first[i];
        }
        /* Five standard errors: of a mean 0.5 / sqrt(n), of an RMS 0.5 / sqrt(2 n). */
        TEST_ASSERT_DOUBLE_WITHIN(5.0 * 0.5 / sqrt(SAMPLES), 0.0, sum / SAMPLES);
        TEST_ASSERT_DOUBLE_WITHIN(5.0 * 0.5 / sqrt(2.0 * SAMPLES), 0.5, sqrt(squares / SAMPLES));
        TEST_ASSERT_TRUE(round == 0 || (round == 1) == (equal == SAMPLES));
        twin_close(twin);
        twin = NULL;
    }
}

/* From its time on the voltage is never above the rail; below it nothing changes. */
static void test_the_supply_sags_at_its_time(void) {
    twin_options_t options = options_of();
    options.sags = true;
    options.sag_v = 40.0;
    options.sag_at_s = 0.01;
    open_twin(&options);
    for (int i = 0; i < 300; i++) {
        const double volts = i % 2 == 0 ? 30.0 : 80.0;
        twin_step(twin, (uint16_t)lround(volts / 100.0 * 65536.0));
        const double expected = 1.0 + 0.5 * (i < 100 ? volts : fmin(volts, 40.0));
        TEST_ASSERT_INT_WITHIN(1, (int)lround((expected + 10.0) / 100.0 * 65536.0), twin_position_code(twin));
    }
}

/* As the board takes it from the line: what came twice alike. A number of two halves needs two codes lost in a row; one
 * that counts needs that twice. Of 50 codes one is lost here: one in 10^5 runs with another seed would see it. */
static void test_the_supply_goes_beside_the_codes(void) {
    twin_options_t options = options_of();
    options.sags = true;
    options.sag_v = 40.123;
    options.sag_at_s = 0.01;
    open_twin(&options);
    converter_beside_t beside = {0};
    uint32_t bits = 0, last_mv = 0, seen[2] = {0};
    unsigned parts = CONVERTER_BESIDE_CODES;
    random_t rng = random_start("device_twin, supply", 20261124);
    for (unsigned i = 0; i < 800; i++) {
        uint8_t frame[CONVERTER_FRAME_BYTES];
        uint16_t code = 0;
        converter_decoder_t decoder = {0};
        converter_encode((uint16_t)(331U * i), frame);
        converter_put_beside(&beside, twin_supply_mv(twin), frame);
        TEST_ASSERT_EQUAL_HEX8(0x80, frame[0] & 0x80);
        TEST_ASSERT_FALSE(converter_decode(&decoder, frame[0], &code));
        TEST_ASSERT_FALSE(converter_decode(&decoder, frame[1], &code));
        TEST_ASSERT_TRUE(converter_decode(&decoder, frame[2], &code));
        TEST_ASSERT_EQUAL_UINT16((uint16_t)(331U * i), code);
        twin_step(twin, 32768);
        if (random_between(&rng, 0, 49) == 0) {
            continue; /* lost */
        }
        parts = (frame[0] & 0x40) != 0 ? 0 : parts;
        bits = bits << 4 | (frame[0] >> 2 & 0xFU);
        if (parts < CONVERTER_BESIDE_CODES && ++parts == CONVERTER_BESIDE_CODES) {
            const uint32_t mv = bits & CONVERTER_BESIDE_MOST;
            if (mv == last_mv) {
                TEST_ASSERT_TRUE(mv == 100000 || mv == 40123);
                TEST_ASSERT_TRUE(seen[1] == 0 || mv == 40123);
                seen[mv == 40123]++;
            }
            last_mv = mv;
        }
    }
    TEST_ASSERT_TRUE(seen[0] > 0 && seen[1] > 0);
}

/* A stage whose converter does not go above 0 V has no such supply: the line is as it was without. */
static void test_no_supply_is_not_sent(void) {
    converter_beside_t beside = {0};
    twin_options_t options = options_of();
    uint8_t frame[CONVERTER_FRAME_BYTES], plain[CONVERTER_FRAME_BYTES];
    options.drive_range_v[0] = -100.0;
    options.drive_range_v[1] = 0.0;
    open_twin(&options);
    for (int i = 0; i < 12; i++) {
        converter_encode(0xFFFF, frame);
        converter_encode(0xFFFF, plain);
        converter_put_beside(&beside, twin_supply_mv(twin), frame);
        TEST_ASSERT_EQUAL_MEMORY(plain, frame, sizeof plain);
    }
}

/* Until its time the load is not there; then a step rings with its mode. */
static void test_the_load_comes_at_its_time(void) {
    twin_options_t options = options_of();
    options.load_hz = 250.0;
    options.load_damping = 0.02;
    options.load_at_s = 0.02;
    options.substeps = 8;
    open_twin(&options);
    const int rest = (int)lround((1.0 + 25.0 + 10.0) / 100.0 * 65536.0);
    uint16_t top = 0;
    for (int i = 0; i < 2000; i++) {
        twin_step(twin, i < 100 || i >= 1900 ? 32768 : 16384);
        if (i < 100) {
            TEST_ASSERT_INT_WITHIN(1, rest, twin_position_code(twin));
        }
        top = i >= 1900 && twin_position_code(twin) > top ? twin_position_code(twin) : top;
    }
    TEST_ASSERT_GREATER_THAN(rest + 6000, top); /* of a step of 8192 codes, nearly as much beyond */
}

/* A mode rings at its frequency after a step: the first overshoot comes after half a period. */
static void test_resonance_rings(void) {
    twin_options_t options = options_of();
    options.resonance_hz = 250.0;
    options.resonance_damping = 0.02;
    options.substeps = 8;
    open_twin(&options);
    uint16_t top = 0;
    int when = 0;
    for (int i = 0; i < 40; i++) {
        twin_step(twin, 32768);
        if (twin_position_code(twin) > top) {
            top = twin_position_code(twin);
            when = i + 1;
        }
    }
    TEST_ASSERT_INT_WITHIN(1, 20, when);
    const double overshoot_um = -10.0 + 100.0 * top / 65536.0 - 26.0;
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * 25.0, 25.0 * exp(-acos(-1.0) * 0.02 / sqrt(1.0 - 0.02 * 0.02)), overshoot_um);
}

/* The partner: drops the first `deaf` frames, answers each further one with code + 1, and closes after `answers`. */
static pid_t start_partner(converter_line_t *line, int deaf, int answers, int delay_ms) {
    int ends[2];
    TEST_ASSERT_EQUAL_INT(0, socketpair(AF_UNIX, SOCK_STREAM, 0, ends));
    const pid_t partner = fork();
    if (partner == 0) {
        (void)close(ends[0]);
        converter_decoder_t decoder = {0};
        uint8_t byte;
        while (answers > 0 && read(ends[1], &byte, 1) == 1) {
            uint16_t code;
            if (!converter_decode(&decoder, byte, &code) || deaf-- > 0) {
                continue;
            }
            uint8_t frame[CONVERTER_FRAME_BYTES];
            converter_encode((uint16_t)(code + 1U), frame);
            sleep_until(monotonic_s() + delay_ms / 1000.0);
            if (write(ends[1], frame, sizeof frame) != sizeof frame) {
                break;
            }
            answers--;
        }
        _exit(0);
    }
    TEST_ASSERT_TRUE(partner > 0);
    (void)close(ends[1]);
    *line = (converter_line_t){.file = ends[0], .name = "test", .stop = &stop};
    return partner;
}

static void end_partner(converter_line_t *line, pid_t partner) {
    converter_close(line);
    TEST_ASSERT_EQUAL_INT(partner, waitpid(partner, NULL, 0));
}

static void test_frames_are_repeated_until_the_board_is_up_and_paired_afterwards(void) {
    converter_line_t line;
    const pid_t partner = start_partner(&line, 3, 1000, 0);
    for (unsigned i = 0; i < 200; i++) {
        uint16_t drive = 0;
        TEST_ASSERT_EQUAL_INT_MESSAGE(CONVERTER_DONE, converter_exchange(&line, (uint16_t)(300 * i), &drive, &failure),
                                      failure.text);
        TEST_ASSERT_EQUAL_HEX16((uint16_t)(300 * i + 1), drive);
    }
    TEST_ASSERT_GREATER_OR_EQUAL_UINT(3, line.repetitions);
    end_partner(&line, partner);
}

/* A board that boots slowly answers the first frame only after it was repeated: the extra answers must not be taken for
 * those of the following codes. */
static void test_answers_to_repeated_frames_are_dropped(void) {
    converter_line_t line;
    const pid_t partner = start_partner(&line, 0, 1000, 50);
    uint16_t drive = 0;
    TEST_ASSERT_EQUAL_INT(CONVERTER_DONE, converter_exchange(&line, 1000, &drive, &failure));
    TEST_ASSERT_EQUAL_HEX16(1001, drive);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT(1, line.repetitions);
    for (unsigned i = 2; i < 6; i++) {
        TEST_ASSERT_EQUAL_INT(CONVERTER_DONE, converter_exchange(&line, (uint16_t)(1000 * i), &drive, &failure));
        TEST_ASSERT_EQUAL_HEX16(1000 * i + 1, drive);
    }
    end_partner(&line, partner);
}

static void test_a_partner_that_leaves_ends_the_run_cleanly(void) {
    const twin_options_t options = options_of();
    open_twin(&options);
    converter_line_t line;
    const pid_t partner = start_partner(&line, 0, 500, 0);
    twin_run_t run;
    TEST_ASSERT_TRUE_MESSAGE(twin_run(twin, &line, NULL, NULL, &run, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT(500, run.samples + run.repetitions);
    end_partner(&line, partner);
}

static void request_stop(void *context) {
    (void)context;
    stop = 1;
}

static void test_a_wish_to_stop_ends_the_run_cleanly(void) {
    const twin_options_t options = options_of();
    open_twin(&options);
    converter_line_t line;
    const pid_t partner = start_partner(&line, 0, 1000, 0);
    twin_run_t run;
    TEST_ASSERT_TRUE_MESSAGE(twin_run(twin, &line, request_stop, NULL, &run, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT(1, run.samples);
    end_partner(&line, partner);
}

/* Never faster than the clock: 1000 samples of 100 us. How much slower is the machine's affair. */
static void test_real_time_is_kept_from_below(void) {
    twin_options_t options = options_of();
    options.real_time = true;
    open_twin(&options);
    converter_line_t line;
    const pid_t partner = start_partner(&line, 0, 1000, 0);
    twin_run_t run;
    TEST_ASSERT_TRUE_MESSAGE(twin_run(twin, &line, NULL, NULL, &run, &failure), failure.text);
    TEST_ASSERT_TRUE(run.seconds > ((double)run.samples - 1.0) / 10000.0 - 0.0021);
    end_partner(&line, partner);
}

static void test_the_log_is_a_recording_of_what_happened(void) {
    char path[] = "twin-log-XXXXXX";
    const int file = mkstemp(path);
    TEST_ASSERT_TRUE(file >= 0);
    (void)close(file);
    twin_options_t options = options_of();
    options.log = path;
    open_twin(&options);
    converter_line_t line;
    const pid_t partner = start_partner(&line, 0, 300, 0);
    twin_run_t run;
    TEST_ASSERT_TRUE_MESSAGE(twin_run(twin, &line, NULL, NULL, &run, &failure), failure.text);
    end_partner(&line, partner);
    recording_t log;
    const bool read_back = recording_read(&log, path, &failure);
    (void)unlink(path);
    TEST_ASSERT_TRUE_MESSAGE(read_back, failure.text);
    TEST_ASSERT_EQUAL_UINT(run.samples, log.samples);
    for (size_t i = 0; i < log.samples; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0 + 0.5 * log.column[COLUMN_DRIVE][i], log.column[COLUMN_DISPLACEMENT][i]);
    }
    recording_free(&log);
}

static void test_a_socket_path_that_is_taken_or_too_long_is_one_line(void) {
    converter_line_t line;
    char path[300];
    memset(path, 'x', sizeof path);
    path[sizeof path - 1] = '\0';
    TEST_ASSERT_EQUAL_INT(CONVERTER_FAILED, converter_open(&line, path, &stop, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "too long for a socket"), failure.text);
    TEST_ASSERT_EQUAL_INT(CONVERTER_FAILED, converter_open(&line, ".", &stop, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "cannot listen there"), failure.text);
    TEST_ASSERT_EQUAL_INT(CONVERTER_FAILED, converter_open(&line, "/dev/null", &stop, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "cannot be opened as a serial line"), failure.text);
}

int main(void) {
    (void)signal(SIGPIPE, SIG_IGN);
    UNITY_BEGIN();
    RUN_TEST(test_every_code_survives_the_line);
    RUN_TEST(test_the_line_recovers_from_lost_and_foreign_bytes);
    RUN_TEST(test_codes_are_linear_in_volts_and_micrometres_and_saturate);
    RUN_TEST(test_noise_has_its_size_and_its_seed);
    RUN_TEST(test_the_supply_sags_at_its_time);
    RUN_TEST(test_the_supply_goes_beside_the_codes);
    RUN_TEST(test_no_supply_is_not_sent);
    RUN_TEST(test_the_load_comes_at_its_time);
    RUN_TEST(test_resonance_rings);
    RUN_TEST(test_frames_are_repeated_until_the_board_is_up_and_paired_afterwards);
    RUN_TEST(test_answers_to_repeated_frames_are_dropped);
    RUN_TEST(test_a_partner_that_leaves_ends_the_run_cleanly);
    RUN_TEST(test_a_wish_to_stop_ends_the_run_cleanly);
    RUN_TEST(test_real_time_is_kept_from_below);
    RUN_TEST(test_the_log_is_a_recording_of_what_happened);
    RUN_TEST(test_a_socket_path_that_is_taken_or_too_long_is_one_line);
    return UNITY_END();
}
