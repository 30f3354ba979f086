/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The converter line and the twin on it, against a partner that the test plays in a process of its own. */
#include "base/monotonic_clock.h"
#include "bench/converter_line.h"
#include "bench/twin.h"
#include "chain/catalogue.h"
#include "recording/recording.h"
#include "unity.h"
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
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

/* A stage whose converter does not go above 0 V has no such supply. */
static void test_no_supply_is_not_sent(void) {
    twin_options_t options = options_of();
    options.drive_range_v[0] = -100.0;
    options.drive_range_v[1] = 0.0;
    open_twin(&options);
    TEST_ASSERT_EQUAL_UINT32(0, twin_supply_mv(twin));
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

/* The bench's side, as its firmware has it: asks `asks` times, each drive code is the position and 1, and leaves.
 * Between two parts of an ask, of `part` bytes each, and before each ask it waits. Writes the answers into a file of
 * its own. */
typedef struct {
    int asks;
    size_t part;
    int delay_ms;
    unsigned rate_hz; /* of its loop, in the first ask */
} bench_t;

#define HEARD "twin-answers.bin"

static bool written(int file, const uint8_t *bytes, size_t size, size_t part) {
    for (size_t done = 0; done < size;) {
        const size_t next = size - done < part ? size - done : part;
        const ssize_t count = write(file, bytes + done, next);
        if (count < 0) {
            return false;
        }
        done += (size_t)count;
    }
    return true;
}

static void ask_as_a_bench(bench_t bench, int asks, int answers) {
    uint8_t ask[CONVERTER_ASK_BYTES] = {(uint8_t)bench.rate_hz, (uint8_t)(bench.rate_hz >> 8)};
    uint8_t answer[CONVERTER_ANSWER_BYTES];
    FILE *heard = fopen(HEARD, "wb");
    for (int i = 0; i < bench.asks; i++) {
        sleep_until(monotonic_s() + bench.delay_ms / 1000.0);
        if (!written(asks, ask, sizeof ask, bench.part) || read(answers, answer, sizeof answer) != sizeof answer) {
            break;
        }
        (void)fwrite(answer, 1, sizeof answer, heard);
        const unsigned drive = (answer[0] | (unsigned)answer[1] << 8) + 1U;
        memcpy(ask, (uint8_t[]){(uint8_t)drive, (uint8_t)(drive >> 8), answer[2], 0}, sizeof ask);
    }
    (void)fclose(heard);
}

static pid_t start_bench(converter_line_t *line, bench_t bench) {
    int asks[2], answers[2];
    TEST_ASSERT_EQUAL_INT(0, pipe(asks));
    TEST_ASSERT_EQUAL_INT(0, pipe(answers));
    const pid_t partner = fork();
    if (partner == 0) {
        (void)close(asks[0]);
        (void)close(answers[1]);
        ask_as_a_bench(bench, asks[1], answers[0]);
        _exit(0);
    }
    TEST_ASSERT_TRUE(partner > 0);
    (void)close(asks[1]);
    (void)close(answers[0]);
    *line = (converter_line_t){.asks = asks[0], .answers = answers[1], .name = "test", .stop = &stop};
    return partner;
}

static void end_bench(converter_line_t *line, pid_t partner) {
    converter_close(line);
    TEST_ASSERT_EQUAL_INT(partner, waitpid(partner, NULL, 0));
}

/* Every code, whole or in parts, and every number beside it. */
static void test_every_code_survives_the_line(void) {
    for (size_t part = 1; part <= CONVERTER_ASK_BYTES; part++) {
        converter_line_t line;
        const pid_t partner =
            start_bench(&line, (bench_t){.asks = part == CONVERTER_ASK_BYTES ? 65537 : 1000, .part = part});
        bool driven = true;
        uint16_t drive = 0;
        uint32_t position = 0;
        for (; position < 65537; position++) {
            const converter_status_t status = converter_wait(&line, &driven, &drive, &failure);
            if (status == CONVERTER_ENDED) {
                break;
            }
            TEST_ASSERT_EQUAL_INT_MESSAGE(CONVERTER_DONE, status, failure.text);
            TEST_ASSERT_EQUAL(position > 0, driven);
            TEST_ASSERT_EQUAL_HEX16(driven ? position : 0, drive);
            TEST_ASSERT_EQUAL_INT(CONVERTER_DONE,
                                  converter_answer(&line, (uint16_t)position, 0x01020304U * position, &failure));
        }
        end_bench(&line, partner);
        TEST_ASSERT_EQUAL_UINT32(part == CONVERTER_ASK_BYTES ? 65537 : 1000, position);
    }
    FILE *heard = fopen(HEARD, "rb");
    TEST_ASSERT_NOT_NULL(heard);
    uint8_t answer[CONVERTER_ANSWER_BYTES];
    for (uint32_t i = 0; i < 1000; i++) {
        TEST_ASSERT_EQUAL_UINT(1, fread(answer, sizeof answer, 1, heard));
        const uint32_t mv = 0x01020304U * i;
        const uint8_t expected[CONVERTER_ANSWER_BYTES] = {
            (uint8_t)i,          (uint8_t)(i >> 8),  1, 0, (uint8_t)mv, (uint8_t)(mv >> 8),
            (uint8_t)(mv >> 16), (uint8_t)(mv >> 24)};
        TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, answer, sizeof answer);
    }
    (void)fclose(heard);
}

/* A sample that is not due has no drive code, and makes none. */
static void test_an_answer_of_nothing_makes_no_sample(void) {
    converter_line_t line;
    const pid_t partner = start_bench(&line, (bench_t){.asks = 100, .part = CONVERTER_ASK_BYTES});
    bool driven = false, expected = false;
    uint16_t drive = 0;
    unsigned position = 500, samples = 0;
    for (unsigned i = 0; converter_wait(&line, &driven, &drive, &failure) == CONVERTER_DONE; i++) {
        TEST_ASSERT_EQUAL(expected, driven);
        TEST_ASSERT_TRUE(!driven || drive == position + 1);
        samples += driven;
        expected = i % 3 == 0;
        position += expected;
        TEST_ASSERT_EQUAL_INT(CONVERTER_DONE, expected ? converter_answer(&line, (uint16_t)position, 0, &failure)
                                                       : converter_not_yet(&line, &failure));
    }
    TEST_ASSERT_EQUAL_UINT(33, samples); /* 34 positions; the last one is not answered any more */
    end_bench(&line, partner);
}

/* What the firmware says of its loop. One of an earlier release says nothing. */
static void test_a_loop_of_another_rate_is_refused(void) {
    static const struct {
        double twin_hz;
        unsigned said_hz;
        bool taken;
    } cases[] = {{10000.0, 10000, true},  {25000.0, 25000, true},  {50000.0, 50000, true}, {12345.0, 0, true},
                 {10000.0, 25000, false}, {25000.0, 10000, false}, {10000.4, 10000, false}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        twin_options_t options = options_of();
        options.sample_rate_hz = cases[i].twin_hz;
        open_twin(&options);
        converter_line_t line;
        const pid_t partner = start_bench(&line, (bench_t){.asks = 11, .part = 4, .rate_hz = cases[i].said_hz});
        twin_run_t run;
        failure.text[0] = '\0';
        TEST_ASSERT_EQUAL_MESSAGE(cases[i].taken, twin_run(twin, &line, NULL, NULL, &run, &failure), failure.text);
        TEST_ASSERT_EQUAL_UINT(cases[i].taken ? 10 : 0, run.samples);
        end_bench(&line, partner);
        twin_close(twin);
        twin = NULL;
    }
    TEST_ASSERT_EQUAL_STRING("the loop of the firmware has 10000 Hz, its twin 10000.4 Hz: --sample-rate 10000 gives "
                             "the twin that rate",
                             failure.text);
}

/* Firmware of another board runs, and asks nothing. */
static void test_a_bench_that_never_asks_is_given_up(void) {
    int asks[2];
    bool driven;
    uint16_t drive;
    TEST_ASSERT_EQUAL_INT(0, pipe(asks));
    converter_line_t line = {.asks = asks[0], .answers = -1, .name = "bench", .stop = &stop, .first_ask_s = 0.5};
    TEST_ASSERT_EQUAL_INT(CONVERTER_FAILED, converter_wait(&line, &driven, &drive, &failure));
    TEST_ASSERT_EQUAL_STRING("bench: no ask in 0.5 s: is the image firmware of the board `bench`?", failure.text);
    converter_close(&line);
    (void)close(asks[1]);
}

static void test_a_partner_that_leaves_ends_the_run_cleanly(void) {
    const twin_options_t options = options_of();
    open_twin(&options);
    converter_line_t line;
    const pid_t partner = start_bench(&line, (bench_t){.asks = 501, .part = 4});
    twin_run_t run;
    TEST_ASSERT_TRUE_MESSAGE(twin_run(twin, &line, NULL, NULL, &run, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT(500, run.samples);
    end_bench(&line, partner);
}

static void request_stop(void *context) {
    (void)context;
    stop = 1;
}

static void test_a_wish_to_stop_ends_the_run_cleanly(void) {
    const twin_options_t options = options_of();
    open_twin(&options);
    converter_line_t line;
    const pid_t partner = start_bench(&line, (bench_t){.asks = 1001, .part = 4});
    twin_run_t run;
    TEST_ASSERT_TRUE_MESSAGE(twin_run(twin, &line, request_stop, NULL, &run, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT(1, run.samples);
    end_bench(&line, partner);
}

/* Never faster than the clock: of 1000 asks, a millisecond and no less apart from 100 us samples, or as fast as they
 * come, no sample comes before its time. How much slower is the machine's affair. */
static void test_real_time_is_kept_from_below(void) {
    for (int delay_ms = 0; delay_ms < 2; delay_ms++) {
        twin_options_t options = options_of();
        options.real_time = true;
        open_twin(&options);
        converter_line_t line;
        const pid_t partner = start_bench(&line, (bench_t){.asks = 1000, .part = 4, .delay_ms = delay_ms});
        twin_run_t run;
        TEST_ASSERT_TRUE_MESSAGE(twin_run(twin, &line, NULL, NULL, &run, &failure), failure.text);
        /* One sample more than periods. The run ends when the bench has gone, after the last. */
        TEST_ASSERT_TRUE(run.samples >= 1 && run.seconds > ((double)run.samples - 2.0) / 10000.0);
        end_bench(&line, partner);
        twin_close(twin);
        twin = NULL;
    }
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
    const pid_t partner = start_bench(&line, (bench_t){.asks = 301, .part = 4});
    twin_run_t run;
    TEST_ASSERT_TRUE_MESSAGE(twin_run(twin, &line, NULL, NULL, &run, &failure), failure.text);
    end_bench(&line, partner);
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

/* By name, as an emulator that was started by hand opens them: asks first. The names are gone when both are open. */
static void test_the_line_is_two_named_pipes(void) {
    (void)unlink("line.asks");
    (void)unlink("line.answers");
    const pid_t partner = fork();
    if (partner == 0) {
        int asks, answers;
        while ((asks = open("line.asks", O_WRONLY)) < 0) { /* not made yet */
            sleep_until(monotonic_s() + 0.001);
        }
        while ((answers = open("line.answers", O_RDONLY)) < 0) {
            sleep_until(monotonic_s() + 0.001);
        }
        ask_as_a_bench((bench_t){.asks = 11, .part = 4}, asks, answers);
        _exit(0);
    }
    const twin_options_t options = options_of();
    open_twin(&options);
    converter_line_t line;
    twin_run_t run;
    TEST_ASSERT_EQUAL_INT_MESSAGE(CONVERTER_DONE, converter_open(&line, "line", &stop, &failure), failure.text);
    TEST_ASSERT_EQUAL_INT(-1, access("line.asks", F_OK));
    TEST_ASSERT_EQUAL_INT(-1, access("line.answers", F_OK));
    TEST_ASSERT_TRUE_MESSAGE(twin_run(twin, &line, NULL, NULL, &run, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT(10, run.samples);
    end_bench(&line, partner);
}

static void test_a_wish_to_stop_ends_the_wait_for_a_bench(void) {
    converter_line_t line;
    stop = 1;
    TEST_ASSERT_EQUAL_INT(CONVERTER_ENDED, converter_open(&line, "line", &stop, &failure));
    TEST_ASSERT_EQUAL_INT(-1, access("line.asks", F_OK));
    TEST_ASSERT_EQUAL_INT(-1, access("line.answers", F_OK));
}

static void test_a_name_that_is_taken_or_too_long_is_one_line(void) {
    converter_line_t line;
    static char path[5000];
    memset(path, 'x', sizeof path - 1);
    TEST_ASSERT_EQUAL_INT(CONVERTER_FAILED, converter_open(&line, path, &stop, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "too long for a file's name"), failure.text);
    TEST_ASSERT_EQUAL_INT(CONVERTER_FAILED, converter_open(&line, "no/folder", &stop, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "no/folder.asks: cannot be made"), failure.text);
    FILE *taken = fopen("taken.answers", "w");
    TEST_ASSERT_NOT_NULL(taken);
    (void)fclose(taken);
    TEST_ASSERT_EQUAL_INT(CONVERTER_FAILED, converter_open(&line, "taken", &stop, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "taken.answers: cannot be made"), failure.text);
    TEST_ASSERT_EQUAL_INT(-1, access("taken.asks", F_OK)); /* made, and removed again */
    TEST_ASSERT_EQUAL_INT(0, access("taken.answers", F_OK));
    (void)unlink("taken.answers");
}

int main(void) {
    (void)signal(SIGPIPE, SIG_IGN);
    UNITY_BEGIN();
    RUN_TEST(test_every_code_survives_the_line);
    RUN_TEST(test_an_answer_of_nothing_makes_no_sample);
    RUN_TEST(test_codes_are_linear_in_volts_and_micrometres_and_saturate);
    RUN_TEST(test_noise_has_its_size_and_its_seed);
    RUN_TEST(test_the_supply_sags_at_its_time);
    RUN_TEST(test_no_supply_is_not_sent);
    RUN_TEST(test_the_load_comes_at_its_time);
    RUN_TEST(test_resonance_rings);
    RUN_TEST(test_a_loop_of_another_rate_is_refused);
    RUN_TEST(test_a_bench_that_never_asks_is_given_up);
    RUN_TEST(test_a_partner_that_leaves_ends_the_run_cleanly);
    RUN_TEST(test_a_wish_to_stop_ends_the_run_cleanly);
    RUN_TEST(test_real_time_is_kept_from_below);
    RUN_TEST(test_the_log_is_a_recording_of_what_happened);
    RUN_TEST(test_the_line_is_two_named_pipes);
    RUN_TEST(test_a_wish_to_stop_ends_the_wait_for_a_bench);
    RUN_TEST(test_a_name_that_is_taken_or_too_long_is_one_line);
    return UNITY_END();
}
