/* SPDX-License-Identifier: MIT */
/* What happened since the start, and when. */
#include "amplifier.h"
#include "fake_board.h"
#include "loop/loop.h"
#include "loop/loop_memory.h"
#include "master.h"
#include "store/event_log.h"
#include "unity.h"

void setUp(void) {
    fake_board_power_on(0);
    (void)fake_board_sample(1 << 24); /* the reading had stood still while the drive went to park: that was a warning */
    (void)amplifier_serve();
    master_command(COMMAND_CLEAR);
}
void tearDown(void) {
}

static void expect_event(uint32_t number, uint16_t kind, uint16_t detail, uint32_t milliseconds) {
    uint16_t event[EVENT_LOG_REGISTERS];
    const uint32_t place = number % EVENT_LOG_LENGTH;
    TEST_ASSERT_EQUAL(MODBUS_OK, master_read((uint16_t)(ADDRESS_event_log + EVENT_LOG_REGISTERS * place),
                                             EVENT_LOG_REGISTERS, event));
    TEST_ASSERT_EQUAL_UINT16(kind, event[2]);
    TEST_ASSERT_EQUAL_UINT16(detail, event[3]);
    TEST_ASSERT_UINT32_WITHIN(1, milliseconds, (uint32_t)event[0] << 16 | event[1]);
}

static uint32_t now_ms(void) {
    return loop_samples() / (1000U / FAKE_SAMPLE_US);
}

static void test_the_start_comes_first(void) {
    const board_start_t start = {.reset_cause = RESET_WATCHDOG, .starts = 2};
    fake_board_start(&start);
    TEST_ASSERT_EQUAL_UINT32(1, master_get(INDEX_events));
    expect_event(0, EVENT_START, RESET_WATCHDOG, 0);
}

static void test_commands_and_commits(void) {
    const uint32_t before = master_get(INDEX_events);
    (void)fake_board_run(12345);
    master_command(COMMAND_PARK);
    const uint32_t parked_ms = now_ms();
    (void)fake_board_run(1000);
    master_command(COMMAND_LATCH);  /* changes nothing */
    master_command(COMMAND_COMMIT); /* what is staged is in force already */
    TEST_ASSERT_EQUAL_UINT32(before + 2, master_get(INDEX_events));
    expect_event(before, EVENT_COMMAND, COMMAND_PARK, parked_ms);
    expect_event(before + 1, EVENT_COMMIT, (uint16_t)master_get(INDEX_fault_code), now_ms());
}

static void test_a_trip_and_a_warning(void) {
    const uint32_t before = master_get(INDEX_events);
    const loop_input_t low = {.faults = FAULT_SUPPLY, .position_code = BOARD_CODE_MIDDLE};
    (void)loop_sample(&low);
    (void)amplifier_serve();
    expect_event(before, EVENT_TRIP, FAULT_SUPPLY, now_ms());
    for (int i = 0; i < 2000; i++) {
        (void)fake_board_sample(HYST_Q31_MIN); /* a sensor that is lost */
    }
    (void)amplifier_serve();
    expect_event(before + 1, EVENT_WARNING, WARNING_SENSOR, now_ms());
    (void)fake_board_run(1);
    (void)amplifier_serve();
    expect_event(before + 2, EVENT_WARNING, 0, now_ms());
    TEST_ASSERT_EQUAL_UINT32(before + 3, master_get(INDEX_events));
}

/* Each trip is one event, ahead of the stop that ends it, also when no turn of the main loop lies between them. */
static void test_every_trip_is_there(void) {
    const uint32_t before = master_get(INDEX_events);
    const loop_input_t low = {.faults = FAULT_SUPPLY, .position_code = BOARD_CODE_MIDDLE};
    for (uint32_t n = 0; n < 3; n++) {
        (void)loop_sample(&low); /* the supply is still low: it trips anew */
        master_command(COMMAND_STOP);
        expect_event(before + 2U * n, EVENT_TRIP, FAULT_SUPPLY, now_ms());
        expect_event(before + 2U * n + 1U, EVENT_COMMAND, COMMAND_STOP, now_ms());
    }
    (void)loop_sample(&low);
    (void)amplifier_serve();
    (void)amplifier_serve();
    expect_event(before + 6U, EVENT_TRIP, FAULT_SUPPLY, now_ms());
    TEST_ASSERT_EQUAL_UINT32(before + 7U, master_get(INDEX_events));
}

static void test_the_newest_are_kept(void) {
    for (unsigned i = 0; i < 3 * EVENT_LOG_LENGTH; i++) {
        event_log_add(EVENT_COMMAND, (uint16_t)i);
    }
    const uint32_t count = master_get(INDEX_events);
    for (uint32_t i = 0; i < EVENT_LOG_LENGTH; i++) {
        expect_event(count - 1U - i, EVENT_COMMAND, (uint16_t)(3 * EVENT_LOG_LENGTH - 1U - i), now_ms());
    }
}

static void test_nobody_writes_it(void) {
    const uint16_t value = 0;
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_ADDRESS, master_write(ADDRESS_event_log, 1, &value));
}

/* Samples and missed periods are counted in 32 bits each, and wrap after five days at 10 kHz. */
static void test_time_goes_on_when_the_counts_wrap(void) {
    (void)amplifier_serve();
    uint64_t periods = loop_periods();
    const uint32_t before = master_get(INDEX_events);
    for (unsigned i = 0; i < 9; i++) { /* a main loop comes round more often than once in five days */
        const uint32_t leap = UINT32_C(0x70000000);
        (i % 2U == 0 ? &loop.telemetry.sequence : &loop.missed)[0] += leap;
        periods += leap;
        (void)amplifier_serve();
    }
    (void)fake_board_run(1000);
    periods += 1000;
    master_command(COMMAND_PARK);
    expect_event(before, EVENT_COMMAND, COMMAND_PARK, (uint32_t)(periods * FAKE_SAMPLE_US / 1000U));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_start_comes_first);
    RUN_TEST(test_commands_and_commits);
    RUN_TEST(test_a_trip_and_a_warning);
    RUN_TEST(test_every_trip_is_there);
    RUN_TEST(test_the_newest_are_kept);
    RUN_TEST(test_nobody_writes_it);
    RUN_TEST(test_time_goes_on_when_the_counts_wrap);
    return UNITY_END();
}
