/* SPDX-License-Identifier: MIT */
/* Off, armed, tripped: what lets the output move, what takes it back, and how. */
#include "amplifier.h"
#include "fake_board.h"
#include "loop/loop.h"
#include "master.h"
#include "protection/health_watch.h"
#include "random.h"
#include "store/parameter_store.h"
#include "unity.h"
#include <stdlib.h>

#define CODE_STEP   (1 << 16) /* of 16 bits, in Q31 */
#define PARK        (-(1 << 29))
#define SLEW        (1 << 22)
#define TIMEOUT     ((unsigned)LOOP_DEFAULT_TIMEOUT_MS * 1000U / FAKE_SAMPLE_US)
#define PRECHARGE   (POWER_PRECHARGE_MS * 1000U / FAKE_SAMPLE_US)
#define SAFE_DRIVE  HYST_Q31_MIN
#define RAMP_LENGTH 2000U /* samples in which the ramp to PARK is over from anywhere: 2^32 / SLEW = 1024 */

static random_t rng;

void setUp(void) {
    const board_start_t start = {.reset_cause = RESET_PIN, .starts = 7};
    fake_board_start(&start);
}
void tearDown(void) {
}

static uint32_t state(void) {
    return master_get(INDEX_amplifier_state);
}

static modbus_exception_t try_commit(hyst_q31_t park) {
    hyst_parameters_t p;
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    hyst_parameters_default(&p);
    p.drive_low = -(3 << 29);
    p.drive_high = 3 << 29;
    p.drive_park = park;
    p.transition_slew = SLEW;
    p.pi_operators = 1;
    p.pi_weight[0] = p.pi_weight[1] = HYST_Q28_ONE / 2;
    p.pi_threshold[0] = 1 << 28;
    master_write_words(ADDRESS_staging, words, hyst_parameters_encode(&p, words, HYST_IMAGE_MAX_WORDS));
    return master_set(INDEX_command, COMMAND_COMMIT);
}

static void commit(void) {
    TEST_ASSERT_EQUAL(MODBUS_OK, try_commit(PARK));
    TEST_ASSERT_EQUAL_UINT32(HYST_PARAMETERS_OK, master_get(INDEX_fault_code));
}

/* Runs; no step above `bound`. Returns the last drive. */
static hyst_q31_t run_within(hyst_q31_t last, unsigned samples, int32_t bound) {
    for (unsigned i = 0; i < samples; i++) {
        const hyst_q31_t drive = fake_board_run(1);
        TEST_ASSERT_INT32_WITHIN(bound + CODE_STEP, last, drive);
        last = drive;
    }
    return last;
}

/* Holding, in direct mode, at 0.5. */
static hyst_q31_t hold_somewhere(void) {
    commit();
    (void)fake_board_run(RAMP_LENGTH);
    master_command(COMMAND_ARM);
    master_put(INDEX_mode, HYST_MODE_DIRECT);
    master_put(INDEX_setpoint, 1U << 30);
    loop_master_heard();
    const hyst_q31_t drive = fake_board_run(TIMEOUT - 10);
    TEST_ASSERT_EQUAL_INT32(1 << 30, drive);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, state());
    loop_master_heard();
    return drive;
}

static void test_it_starts_off_at_the_safe_code(void) {
    TEST_ASSERT_EQUAL_HEX16(FAKE_SAFE_CODE, fake_board_sample(0));
    TEST_ASSERT_FALSE(fake_board.stage_enabled);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, state());
    TEST_ASSERT_EQUAL_UINT32(RESET_PIN, master_get(INDEX_reset_cause));
    TEST_ASSERT_EQUAL_UINT32(7, master_get(INDEX_starts));
    (void)fake_board_run(3 * TIMEOUT);
    TEST_ASSERT_EQUAL_HEX16(FAKE_SAFE_CODE, fake_board_sample(0));
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, master_get(INDEX_faults_sticky), "nobody has to talk to what is off");
}

static void expect_nothing_moves(void) {
    static const uint32_t commands[] = {COMMAND_START, COMMAND_CONDITION};
    for (uint32_t mode = HYST_MODE_DIRECT; mode <= HYST_MODE_COMPENSATE; mode++) {
        TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_mode, mode));
    }
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, commands[i]));
    }
    master_put(INDEX_mode, HYST_MODE_PARK);
    master_put(INDEX_setpoint, 1U << 30);
    const hyst_q31_t before = fake_board_run(1);
    TEST_ASSERT_EQUAL_INT32(before, fake_board_run(100));
}

static void test_nothing_moves_before_an_image_and_arming(void) {
    expect_nothing_moves();
    TEST_ASSERT_EQUAL_MESSAGE(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM), "there are no limits");
    commit();
    TEST_ASSERT_EQUAL_INT32(PARK, run_within(SAFE_DRIVE, RAMP_LENGTH, SLEW));
    expect_nothing_moves();
    TEST_ASSERT_FALSE(fake_board.stage_enabled);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, state());
}

static void test_precharge_comes_before_anything_moves(void) {
    commit();
    (void)fake_board_run(RAMP_LENGTH);
    master_command(COMMAND_ARM);
    master_put(INDEX_mode, HYST_MODE_DIRECT);
    TEST_ASSERT_EQUAL_MESSAGE(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_START), "not during precharge");
    for (unsigned i = 0; i < PRECHARGE; i++) {
        TEST_ASSERT_EQUAL_INT32(PARK, fake_board_run(1));
        TEST_ASSERT_TRUE(fake_board.stage_enabled);
        TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_PRECHARGE, state());
    }
    (void)run_within(PARK, RAMP_LENGTH, SLEW);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, state());
    TEST_ASSERT_EQUAL_UINT32(HYST_MODE_DIRECT, master_get(INDEX_active_mode));
    master_command(COMMAND_ARM); /* again: nothing */
    (void)fake_board_run(1);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, state());
}

/* An arming that comes while the output is still on its way to park waits for it. */
static void test_precharge_begins_at_park(void) {
    commit();
    master_command(COMMAND_ARM);
    hyst_q31_t drive = SAFE_DRIVE;
    while (drive != PARK) {
        drive = run_within(drive, 1, SLEW);
        TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_PRECHARGE, state());
    }
    (void)fake_board_run(PRECHARGE - 1U);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_PRECHARGE, state());
    (void)fake_board_run(3);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, state());
}

/* Ramp with the stage enabled, then off. */
static void expect_a_ramp_to_off(hyst_q31_t drive, amplifier_state_t under_way, amplifier_state_t end) {
    while (drive != PARK) {
        drive = run_within(drive, 1, SLEW);
        TEST_ASSERT_TRUE(fake_board.stage_enabled);
        TEST_ASSERT_EQUAL_UINT32(under_way, state());
    }
    TEST_ASSERT_EQUAL_INT32(PARK, fake_board_run(2));
    TEST_ASSERT_FALSE(fake_board.stage_enabled);
    TEST_ASSERT_EQUAL_UINT32(end, state());
    TEST_ASSERT_EQUAL_INT32(PARK, fake_board_run(TIMEOUT));
}

static void test_disarming_ramps_to_park_and_off(void) {
    const hyst_q31_t drive = hold_somewhere();
    master_command(COMMAND_DISARM);
    expect_a_ramp_to_off(drive, AMPLIFIER_STOP, AMPLIFIER_OFF);
    expect_nothing_moves();
}

/* Nothing but the command stop leads out of a fault, and then it is off. */
static void expect_fault_until_stop(uint32_t fault) {
    TEST_ASSERT_EQUAL_UINT32(fault, master_get(INDEX_faults_live) & fault);
    TEST_ASSERT_EQUAL_UINT32(fault, master_get(INDEX_faults_sticky) & fault);
    TEST_ASSERT_EQUAL_HEX32(fault, 1U << (master_get(INDEX_trip_cause) - 1U));
    static const uint32_t commands[] = {COMMAND_NONE, COMMAND_CLEAR, COMMAND_PARK, COMMAND_LATCH, COMMAND_DISARM};
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        master_command((control_command_t)commands[i]);
        (void)fake_board_run(10);
        TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
    }
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM));
    expect_nothing_moves();
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(fault, master_get(INDEX_faults_sticky) & fault, "live faults outlast clear");
    master_command(COMMAND_STOP);
    (void)fake_board_run(2);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, state());
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_trip_cause));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_faults_live));
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(fault, master_get(INDEX_faults_sticky) & fault, "sticky until clear");
    expect_nothing_moves();
    master_command(COMMAND_ARM);
    (void)fake_board_run(PRECHARGE + 3U);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, state());
}

/* The main loop does not run at all: the interrupt decides. */
static void test_the_communication_timeout_trips_by_itself(void) {
    const hyst_q31_t drive = hold_somewhere();
    TEST_ASSERT_EQUAL_UINT32(LOOP_DEFAULT_TIMEOUT_MS, master_get(INDEX_watchdog));
    TEST_ASSERT_EQUAL_INT32(drive, fake_board_run(TIMEOUT));
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, state());
    expect_a_ramp_to_off(drive, AMPLIFIER_FAULT, AMPLIFIER_FAULT);
    expect_fault_until_stop(FAULT_WATCHDOG);
}

/* A valid request over the line; master_* goes around it. */
static void request_over_the_line(void) {
    static const uint8_t pdu[] = {3, 0, 0, 0, 1};
    uint8_t frame[MODBUS_FRAME_MAX];
    const size_t length = master_frame(frame, MASTER_SERVER, pdu, sizeof pdu);
    fake_board.microseconds += FAKE_SILENCE_US + 1;
    for (size_t i = 0; i < length; i++) {
        modbus_server_receive(frame[i]);
    }
    fake_board.microseconds += FAKE_SILENCE_US + 1;
    TEST_ASSERT_TRUE(amplifier_serve());
}

static void test_a_master_that_is_heard_keeps_it_on(void) {
    (void)hold_somewhere();
    master_put(INDEX_watchdog, 50);
    for (int i = 0; i < 20; i++) {
        request_over_the_line();
        (void)fake_board_run(499);
        TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, state());
    }
    (void)fake_board_run(2);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
    request_over_the_line();
    (void)fake_board_run(2);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(AMPLIFIER_FAULT, state(), "hearing it again is no way out");
}

static void test_what_is_parked_may_be_left_alone(void) {
    commit();
    master_command(COMMAND_ARM);
    (void)fake_board_run(5 * TIMEOUT);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, state());
    master_command(COMMAND_CONDITION); /* from now on somebody has to be there */
    (void)fake_board_run(TIMEOUT + 1U);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
}

static void sample_late(unsigned times) {
    const loop_input_t late = {.faults = FAULT_OVERRUN, .position_code = BOARD_CODE_MIDDLE};
    for (unsigned i = 0; i < times; i++) {
        (void)loop_sample(&late);
    }
}

/* In compensate mode, under a running sine, with a model: the ramp needs none of it. */
static void test_an_overload_ramps_without_the_compensator(void) {
    (void)hold_somewhere();
    master_put(INDEX_mode, HYST_MODE_COMPENSATE);
    master_put(INDEX_source, SOURCE_SINE);
    master_put(INDEX_source_amplitude, 1U << 29);
    master_put(INDEX_source_increment, 1U << 22);
    (void)fake_board_run(RAMP_LENGTH);
    master_command(COMMAND_START);
    (void)fake_board_run(100);
    sample_late(LOOP_OVERRUNS_TO_TRIP - 1U);
    (void)fake_board_run(1);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(AMPLIFIER_RUN, state(), "a few late samples are only counted");
    hyst_q31_t last = fake_board_run(1);
    const loop_input_t late = {.faults = FAULT_OVERRUN, .position_code = BOARD_CODE_MIDDLE};
    for (unsigned i = 1; i <= RAMP_LENGTH; i++) {
        const hyst_q31_t drive = (hyst_q31_t)((uint32_t)(loop_sample(&late) ^ BOARD_CODE_MIDDLE) << 16);
        const int32_t step = drive > last ? drive - last : last - drive;
        TEST_ASSERT_LESS_OR_EQUAL_INT32(i < LOOP_OVERRUNS_TO_TRIP ? FAKE_DRIVE_SLEW_MAX : SLEW + CODE_STEP, step);
        TEST_ASSERT_EQUAL(i < LOOP_OVERRUNS_TO_TRIP ? AMPLIFIER_RUN : AMPLIFIER_FAULT, state());
        last = drive;
    }
    TEST_ASSERT_EQUAL_INT32(PARK, last);
    TEST_ASSERT_EQUAL_UINT32(LIMIT_MEMORY, master_get(INDEX_limits_live));
    (void)fake_board_run(1); /* the load is gone */
    master_command(COMMAND_CLEAR);
    expect_fault_until_stop(FAULT_OVERLOAD);
    master_put(INDEX_mode, HYST_MODE_COMPENSATE);
    TEST_ASSERT_NOT_EQUAL(PARK, run_within(PARK, RAMP_LENGTH, FAKE_DRIVE_SLEW_MAX));
}

static void test_a_low_supply_trips(void) {
    const hyst_q31_t drive = hold_somewhere();
    const loop_input_t low = {.faults = FAULT_SUPPLY, .position_code = BOARD_CODE_MIDDLE};
    (void)loop_sample(&low);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
    expect_a_ramp_to_off(drive - SLEW, AMPLIFIER_FAULT, AMPLIFIER_FAULT);
    expect_fault_until_stop(FAULT_SUPPLY);
}

static void test_the_hardware_watchdog_wants_interrupt_and_main_loop(void) {
    (void)amplifier_serve();
    const unsigned fed = fake_board.watchdog_fed;
    for (unsigned i = 0; i < 10; i++) {
        (void)amplifier_serve(); /* the interrupt stands still */
    }
    TEST_ASSERT_EQUAL_UINT(fed, fake_board.watchdog_fed);
    (void)fake_board_run(10); /* the main loop stands still */
    TEST_ASSERT_EQUAL_UINT(fed, fake_board.watchdog_fed);
    (void)amplifier_serve();
    TEST_ASSERT_EQUAL_UINT(fed + 1U, fake_board.watchdog_fed);
}

/* Samples come, but most of their periods were missed: the timeout is a time all the same. */
static void test_missed_periods_count_for_the_timeout(void) {
    enum { MISSED = 9 };
    (void)hold_somewhere();
    master_put(INDEX_watchdog, TIMEOUT / (1000U / FAKE_SAMPLE_US));
    const uint32_t began = loop_periods();
    for (unsigned sample = 0; state() == AMPLIFIER_HOLD && sample < 2U * TIMEOUT; sample++) {
        const bool late = sample % 2U == 0; /* not in a row, which is an overload */
        const loop_input_t input = {
            .faults = late ? FAULT_OVERRUN : 0U, .missed = late ? MISSED : 0, .position_code = BOARD_CODE_MIDDLE};
        health_watch_main_turned();
        (void)loop_sample(&input);
    }
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
    TEST_ASSERT_UINT32_WITHIN(MISSED + 1U, TIMEOUT, loop_periods() - began);
}

/* A supply that was low at the start is reported, and is live no longer than it is low. */
static void test_a_supply_that_recovers_after_the_start(void) {
    const board_start_t start = {
        .reset_cause = RESET_POWER, .starts = 1, .faults = FAULT_SUPPLY | FAULT_CLOCK_FALLBACK};
    const loop_input_t low = {.faults = FAULT_SUPPLY, .position_code = BOARD_CODE_MIDDLE};
    fake_board_start(&start);
    (void)loop_sample(&low);
    TEST_ASSERT_EQUAL_HEX32(FAULT_SUPPLY | FAULT_CLOCK_FALLBACK, master_get(INDEX_faults_live));
    (void)fake_board_run(1);
    TEST_ASSERT_EQUAL_HEX32(FAULT_CLOCK_FALLBACK, master_get(INDEX_faults_live));
    TEST_ASSERT_EQUAL_HEX32(FAULT_SUPPLY | FAULT_CLOCK_FALLBACK, master_get(INDEX_faults_sticky));
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, state());
}

/* Where a processor fault leads to. */
static void test_the_board_keeps_the_park_code_of_the_image_in_force(void) {
    hyst_parameters_t parameters;
    hyst_parameters_default(&parameters);
    parameters.drive_park = HYST_Q31_MIN / 4;
    (void)hyst_parameters_encode(&parameters, parameter_store_staging(), PARAMETER_STORE_WORDS);
    master_command(COMMAND_COMMIT);
    TEST_ASSERT_EQUAL_HEX16(FAKE_SAFE_CODE, fake_board.kept_park);
    (void)fake_board_run(1000);
    TEST_ASSERT_FALSE(loop_adoption_pending());
    TEST_ASSERT_EQUAL_HEX16(0x6000, fake_board.kept_park);
    TEST_ASSERT_EQUAL_HEX16(loop_park_code(), fake_board.kept_park);
}

static void test_limits_have_codes_of_their_own(void) {
    (void)hold_somewhere();
    master_command(COMMAND_CLEAR);
    master_put(INDEX_setpoint, (uint32_t)HYST_Q31_MAX);
    (void)fake_board_run(TIMEOUT / 2U);
    TEST_ASSERT_EQUAL_UINT32(LIMIT_DRIVE, master_get(INDEX_limits_live));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_faults_sticky));
    master_put(INDEX_setpoint, 0);
    (void)fake_board_run(TIMEOUT / 4U);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_limits_live));
    TEST_ASSERT_EQUAL_UINT32(LIMIT_DRIVE, master_get(INDEX_limits_sticky));
    master_command(COMMAND_CLEAR);
    (void)fake_board_run(1);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_limits_sticky));
}

static void test_no_unlawful_transition(void) {
    enum { STEPS = 60000 };
    unsigned visits[AMPLIFIER_FAULT + 1] = {0};
    bool stage = false, armed = false; /* armed: accepted since the stage was last on */
    commit();
    master_put(INDEX_source, SOURCE_SINE);
    master_put(INDEX_source_amplitude, 1U << 28);
    master_put(INDEX_source_increment, 1U << 24);
    hyst_q31_t last = fake_board_run(1);
    for (unsigned step = 0; step < STEPS; step++) {
        const uint32_t before = state();
        uint32_t command = COMMAND_NONE;
        if (random_between(&rng, 0, 3) == 0) {
            command = (uint32_t)random_between(&rng, COMMAND_START, COMMAND_DISARM);
            if (master_set(INDEX_command, command) != MODBUS_OK) {
                command = COMMAND_NONE;
            }
            armed = armed || command == COMMAND_ARM;
        } else if (random_between(&rng, 0, 9) == 0) {
            (void)try_commit(random_between(&rng, -(3 << 29), 3 << 29)); /* parked elsewhere, refused while one waits */
        } else if (random_between(&rng, 0, 3) == 0) {
            (void)master_set(INDEX_mode, (uint32_t)random_between(&rng, 0, 3));
        }
        const bool late = random_between(&rng, 0, 300) == 0;
        const bool low = random_between(&rng, 0, 300) == 0;
        const unsigned samples = (unsigned)random_between(&rng, 1, 200);
        loop_master_heard();
        health_watch_main_turned();
        uint32_t now = before;
        for (unsigned i = 0; i < samples; i++) {
            const loop_input_t input = {.faults = (late ? FAULT_OVERRUN : 0U) | (low && i == 0 ? FAULT_SUPPLY : 0U),
                                        .position_code = BOARD_CODE_MIDDLE};
            const hyst_q31_t drive = (hyst_q31_t)((uint32_t)(loop_sample(&input) ^ BOARD_CODE_MIDDLE) << 16);
            TEST_ASSERT_TRUE(llabs((long long)drive - last) <= FAKE_DRIVE_SLEW_MAX + CODE_STEP);
            last = drive;
            telemetry_t t;
            telemetry_read(&t);
            TEST_ASSERT_TRUE_MESSAGE(fake_board_lawful(now, t.amplifier_state, command, late || low), "transition");
            now = t.amplifier_state;
            TEST_ASSERT_TRUE(now != AMPLIFIER_OFF || !fake_board.stage_enabled);
            TEST_ASSERT_TRUE_MESSAGE(!fake_board.stage_enabled || stage || armed, "the stage came on by itself");
            armed = armed && !fake_board.stage_enabled;
            stage = fake_board.stage_enabled;
            visits[now]++;
        }
    }
    for (unsigned i = 0; i <= AMPLIFIER_FAULT; i++) {
        TEST_ASSERT_GREATER_THAN_UINT_MESSAGE(100, visits[i], "a state that was never visited");
    }
}

int main(void) {
    rng = random_start("firmware_power", 20261123);
    UNITY_BEGIN();
    RUN_TEST(test_it_starts_off_at_the_safe_code);
    RUN_TEST(test_nothing_moves_before_an_image_and_arming);
    RUN_TEST(test_precharge_comes_before_anything_moves);
    RUN_TEST(test_precharge_begins_at_park);
    RUN_TEST(test_disarming_ramps_to_park_and_off);
    RUN_TEST(test_the_communication_timeout_trips_by_itself);
    RUN_TEST(test_a_master_that_is_heard_keeps_it_on);
    RUN_TEST(test_what_is_parked_may_be_left_alone);
    RUN_TEST(test_an_overload_ramps_without_the_compensator);
    RUN_TEST(test_a_low_supply_trips);
    RUN_TEST(test_the_hardware_watchdog_wants_interrupt_and_main_loop);
    RUN_TEST(test_missed_periods_count_for_the_timeout);
    RUN_TEST(test_a_supply_that_recovers_after_the_start);
    RUN_TEST(test_the_board_keeps_the_park_code_of_the_image_in_force);
    RUN_TEST(test_limits_have_codes_of_their_own);
    RUN_TEST(test_no_unlawful_transition);
    return UNITY_END();
}
