/* SPDX-License-Identifier: MIT */
/*
 * What the interrupts share with the main loop, under real interruption: a timer signal plays the interrupt and strikes
 * between any two instructions, while the main loop does nothing but what can be disturbed. And a fault that comes
 * within a request, at each place where the main loop lets interrupts through: it looks at the loop's memory under a
 * lock or at one word, so what it does between two locks is the same wherever the interrupt comes.
 */
#include "amplifier.h"
#include "fake_board.h"
#include "loop/loop.h"
#include "loop/telemetry.h"
#include "master.h"
#include "unity.h"
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/time.h>

enum { INTERRUPTS = 4000, PERIOD_US = 50 };

static volatile sig_atomic_t interrupts;

void setUp(void) {
    fake_board_power_on(0);
    interrupts = 0;
}

static void set_timer(long period_us, void (*handler)(int)) {
    struct sigaction action = {.sa_handler = handler};
    const struct itimerval timer = {.it_interval = {.tv_usec = period_us}, .it_value = {.tv_usec = period_us}};
    TEST_ASSERT_EQUAL_INT(0, sigaction(SIGALRM, &action, NULL));
    TEST_ASSERT_EQUAL_INT(0, setitimer(ITIMER_REAL, &timer, NULL));
}

void tearDown(void) {
    set_timer(0, SIG_IGN);
}

/* A sample in which every word is the same number, and so many samples with every limit. */
static void publish_next(int signal) {
    (void)signal;
    interrupts = interrupts + 1;
    static telemetry_t sample;
    static limit_counts_t limits;
    uint32_t words[sizeof sample / sizeof(uint32_t)];
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        words[i] = (uint32_t)interrupts;
    }
    memcpy(&sample, words, sizeof sample);
    limits.samples[LIMIT_SETS - 1] = (uint32_t)interrupts;
    telemetry_publish(&sample, &limits);
}
_Static_assert(sizeof(telemetry_t) % sizeof(uint32_t) == 0, "telemetry is words");

static void test_telemetry_is_never_torn(void) {
    publish_next(0);
    set_timer(PERIOD_US, publish_next);
    while (interrupts < INTERRUPTS) {
        telemetry_t sample;
        uint32_t words[sizeof sample / sizeof(uint32_t)];
        telemetry_read(&sample);
        TEST_ASSERT_EQUAL_HEX32(LIMIT_SETS - 1, sample.limits_sticky);
        /* Filled in on reading. */
        sample.capture_state = sample.capture_frames = sample.limits_sticky = sample.sequence;
        memcpy(words, &sample, sizeof sample);
        for (size_t i = 1; i < sizeof words / sizeof words[0]; i++) {
            TEST_ASSERT_EQUAL_UINT32(words[0], words[i]);
        }
    }
}

/* A register of a limit has the samples of all sets that it is in, and no others; sums saturate. */
static void test_counts_of_sets_of_limits_add_up(void) {
    static telemetry_t sample;
    static limit_counts_t limits;
    for (uint32_t set = 0; set < LIMIT_SETS; set++) {
        limits.samples[set] = 1000U + set;
    }
    limits.samples[LIMIT_DRIVE | LIMIT_REFERENCE] = 0;
    telemetry_publish(&sample, &limits);
    telemetry_t read;
    telemetry_read(&read);
    const uint32_t bits[] = {LIMIT_DRIVE, LIMIT_UNREACHABLE, LIMIT_FILTER, LIMIT_SLEW, LIMIT_REFERENCE};
    const uint32_t counters[] = {read.drive_limited, read.unreachable, read.filter_saturated, read.slew_limited,
                                 read.reference_limited};
    uint32_t samples = 0;
    uint32_t expected[sizeof bits / sizeof bits[0]] = {0};
    for (uint32_t set = 0; set < LIMIT_SETS; set++) {
        samples += limits.samples[set];
        for (size_t i = 0; i < sizeof bits / sizeof bits[0]; i++) {
            expected[i] += (set & bits[i]) != 0 ? limits.samples[set] : 0;
        }
    }
    TEST_ASSERT_EQUAL_UINT32_ARRAY(expected, counters, sizeof bits / sizeof bits[0]);
    TEST_ASSERT_EQUAL_UINT32(samples, read.samples);
    for (uint32_t set = 0; set < LIMIT_SETS; set++) {
        limits.samples[set] = 0;
    }
    limits.samples[0] = 7;
    limits.samples[LIMIT_SLEW] = limits.samples[LIMIT_SLEW | LIMIT_MEMORY] = UINT32_MAX;
    telemetry_read(&read);
    TEST_ASSERT_EQUAL_HEX32(LIMIT_SLEW | LIMIT_MEMORY, read.limits_sticky);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, read.slew_limited);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, read.samples);
    TEST_ASSERT_EQUAL_UINT32(0, read.drive_limited);
}

static uint8_t request[MODBUS_FRAME_MAX];
static size_t request_length;
static size_t next_byte;

/* A byte of an endless row of requests, with the silence after each of them. */
static void receive_next(int signal) {
    (void)signal;
    interrupts = interrupts + 1;
    fake_board.microseconds += 90;
    if (next_byte < request_length) {
        modbus_server_receive(request[next_byte++]);
    } else {
        fake_board.microseconds += FAKE_SILENCE_US;
        next_byte = 0;
    }
}

static void test_no_frame_is_lost_or_split(void) {
    static const uint8_t pdu[] = {3, 0, 0, 0, 2};
    request_length = master_frame(request, MASTER_SERVER, pdu, sizeof pdu);
    next_byte = 0;
    fake_board.microseconds += 2 * FAKE_SILENCE_US;
    set_timer(PERIOD_US, receive_next);
    while (interrupts < INTERRUPTS) {
        (void)amplifier_serve();
    }
    set_timer(0, SIG_IGN);
    fake_board.microseconds += 2 * FAKE_SILENCE_US;
    (void)amplifier_serve();
    const modbus_counters_t counters = modbus_server_counters();
    const unsigned whole = (unsigned)interrupts / (unsigned)(request_length + 1U);
    const unsigned left = (unsigned)interrupts % (unsigned)(request_length + 1U);
    /* The last one may have been cut by the end of the test. */
    TEST_ASSERT_EQUAL_UINT(whole + (left == request_length ? 1U : 0U), counters.served);
    TEST_ASSERT_EQUAL_UINT(left != 0 && left != request_length ? 1U : 0U, counters.errors);
}

/* A request that moves, stops, arms or changes something, and what comes before it. */
typedef struct {
    unsigned index;
    uint32_t value;
    bool off; /* from off; else while it holds elsewhere than at park */
} write_t;

static const write_t writes[] = {
    {INDEX_mode, HYST_MODE_LINEAR, false},
    {INDEX_mode, HYST_MODE_COMPENSATE, false},
    {INDEX_mode, HYST_MODE_PARK, false},
    {INDEX_setpoint, 1U << 28, false},
    {INDEX_drive_high, 1U << 28, false},
    {INDEX_reference_high, 1U << 28, false},
    {INDEX_reference_slew, 1U << 28, false},
    {INDEX_supply_high, FAKE_SUPPLY + 1, false},
    {INDEX_current_limit, 1U << 28, false},
    {INDEX_model_error_limit, 1U << 28, false},
    {INDEX_watchdog, 100, false},
    {INDEX_command, COMMAND_START, false},
    {INDEX_command, COMMAND_CONDITION, false},
    {INDEX_command, COMMAND_STOP, false},
    {INDEX_command, COMMAND_PARK, false},
    {INDEX_command, COMMAND_ARM, false},
    {INDEX_command, COMMAND_DISARM, false},
    {INDEX_command, COMMAND_CLEAR, false},
    {INDEX_command, COMMAND_COMMIT, false},
    {INDEX_command, COMMAND_ARM_CAPTURE, false},
    {INDEX_command, COMMAND_ARM, true},
    {INDEX_command, COMMAND_STOP, true},
    {INDEX_command, COMMAND_COMMIT, true},
    {INDEX_command, COMMAND_SAVE, true},
};

static unsigned places_left; /* until the fault comes */
static bool fault_came;

/* Off, only an overload trips. */
static void fault_comes(void) {
    if (fault_came || places_left-- > 0) {
        return;
    }
    fault_came = true;
    for (unsigned i = 0; i < LOOP_OVERRUNS_TO_TRIP; i++) {
        const loop_input_t input = {.position_code = BOARD_CODE_MIDDLE,
                                    .faults = FAULT_OVERRUN | (loop_armed() ? FAULT_SUPPLY : 0U)};
        (void)loop_sample(&input);
    }
    (void)fake_board_run(1);
}

static void begin(const write_t *write) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    hyst_parameters_t p;
    fake_board_power_on(0);
    hyst_parameters_default(&p);
    master_write_words(ADDRESS_staging, words, hyst_parameters_encode(&p, words, HYST_IMAGE_MAX_WORDS));
    master_put(INDEX_source, SOURCE_SINE);
    master_put(INDEX_source_increment, 1U << 20);
    if (write->off) {
        master_command(COMMAND_DISARM);
        (void)fake_board_run(3000);
        return;
    }
    master_put(INDEX_mode, HYST_MODE_DIRECT);
    master_put(INDEX_setpoint, 1U << 29);
    TEST_ASSERT_EQUAL_INT32(1 << 29, fake_board_run(3000));
}

/* It stays where the fault has led: parked in the end, off, and nothing moves any more. */
static void expect_it_to_stay_off(void) {
    const amplifier_state_t state = (amplifier_state_t)master_get(INDEX_amplifier_state);
    hyst_q31_t last = 1 << 29;
    for (unsigned i = 0; i < 6000; i++) {
        const hyst_q31_t drive = fake_board_run(1);
        TEST_ASSERT_LESS_OR_EQUAL_INT32(last, drive);
        TEST_ASSERT_FALSE(loop_armed());
        last = drive;
    }
    TEST_ASSERT_EQUAL_INT32(0, last);
    TEST_ASSERT_FALSE(fake_board.stage_enabled);
    TEST_ASSERT_EQUAL(HYST_MODE_PARK, loop_mode());
    const uint32_t end = master_get(INDEX_amplifier_state);
    TEST_ASSERT_TRUE(end == (uint32_t)state || (state == AMPLIFIER_STOP && end == AMPLIFIER_OFF));
}

/* A stop may come behind it, and then leads out of it. Late samples of a commit or a save do not trip. To clear is not
 * to forget what is still there. */
static void expect_the_fault(const write_t *write, unsigned place) {
    const bool may_be_none =
        (write->index == INDEX_command && write->value == COMMAND_STOP) || (write->off && write->value != COMMAND_ARM);
    char where[64];
    (void)fake_board_run(1);
    (void)snprintf(where, sizeof where, "%s %u, at its place %u", register_table[write->index].name,
                   (unsigned)write->value, place);
    TEST_ASSERT_TRUE_MESSAGE(may_be_none || loop_in_fault(), where);
    TEST_ASSERT_FALSE(loop_armed());
    if (loop_in_fault()) {
        const uint32_t live = master_get(INDEX_faults_live);
        TEST_ASSERT_NOT_EQUAL(0, live);
        TEST_ASSERT_BITS_HIGH(live, master_get(INDEX_faults_sticky));
    }
    TEST_ASSERT_FALSE(loop_plays(SOURCE_SINE));
    TEST_ASSERT_FALSE(loop_conditioning());
    expect_it_to_stay_off();
}

static void test_a_fault_within_a_request_has_the_last_word(void) {
    for (size_t i = 0; i < sizeof writes / sizeof writes[0]; i++) {
        unsigned place = 0;
        for (bool came = true; came; place++) {
            begin(&writes[i]);
            places_left = place;
            fault_came = false;
            fake_board.interrupt = fault_comes;
            (void)master_set(writes[i].index, writes[i].value);
            fake_board.interrupt = NULL;
            came = fault_came;
            if (came) {
                expect_the_fault(&writes[i], place);
            }
        }
        TEST_ASSERT_GREATER_THAN_UINT_MESSAGE(2, place, "the request takes no lock");
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_telemetry_is_never_torn);
    RUN_TEST(test_counts_of_sets_of_limits_add_up);
    RUN_TEST(test_no_frame_is_lost_or_split);
    RUN_TEST(test_a_fault_within_a_request_has_the_last_word);
    return UNITY_END();
}
