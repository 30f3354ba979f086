/* SPDX-License-Identifier: MIT */
/* The enable line of the power stage, and how a fault brings the output to rest. */
#include "fake_board.h"
#include "loop/loop.h"
#include "loop/loop_memory.h"
#include "master.h"
#include "unity.h"

#define CODE_STEP (1 << 16) /* of 16 bits, in Q31 */
#define PARK      (-(1 << 29))
#define ELSEWHERE (1 << 29)
#define SLEW      (1 << 20) /* 4096 samples for the whole range */
#define RAMP      6000U     /* samples in which any ramp of SLEW is over */
#define PRECHARGE (POWER_PRECHARGE_MS * 1000U / FAKE_SAMPLE_US)

static hyst_q31_t last; /* drive */

void setUp(void) {
    const board_start_t start = {.reset_cause = RESET_POWER, .starts = 1};
    fake_store_clear();
    fake_board_start(&start);
    last = HYST_Q31_MIN;
}
void tearDown(void) {
}

static void set(unsigned index, uint32_t value) {
    TEST_ASSERT_EQUAL_MESSAGE(MODBUS_OK, master_set(index, value), register_table[index].name);
}

static uint32_t state(void) {
    return master_get(INDEX_amplifier_state);
}

static void commit(hyst_q31_t park, hyst_q31_t slew) {
    hyst_parameters_t p;
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    hyst_parameters_default(&p);
    p.drive_low = -(3 << 29);
    p.drive_high = 3 << 29;
    p.drive_park = park;
    p.transition_slew = slew;
    master_write_words(ADDRESS_staging, words, hyst_parameters_encode(&p, words, HYST_IMAGE_MAX_WORDS));
    master_command(COMMAND_COMMIT);
    TEST_ASSERT_EQUAL_UINT32(HYST_PARAMETERS_OK, master_get(INDEX_fault_code));
}

/* A master that talks. */
static void run(unsigned samples) {
    for (unsigned i = 0; i < samples; i++) {
        loop_master_heard();
        last = fake_board_run(1);
    }
}

static void hold_somewhere(hyst_q31_t slew) {
    commit(PARK, slew);
    while (last != PARK) {
        run(1);
    }
    run(2);
    master_command(COMMAND_ARM);
    run(PRECHARGE + 3U);
    set(INDEX_mode, HYST_MODE_DIRECT);
    set(INDEX_setpoint, 1U << 30);
    while (last != 1 << 30) {
        run(1);
    }
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, state());
}

static void sag(void) {
    const loop_input_t low = {.supply_low = true, .position_code = BOARD_CODE_MIDDLE};
    (void)loop_sample(&low);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
}

static void late(unsigned times) {
    const loop_input_t input = {.overrun = true, .position_code = BOARD_CODE_MIDDLE};
    for (unsigned i = 0; i < times; i++) {
        (void)loop_sample(&input);
    }
}

static void expect_off_for(unsigned samples) {
    for (unsigned i = 0; i < samples; i++) {
        run(1);
        TEST_ASSERT_FALSE_MESSAGE(fake_board.stage_enabled, "the stage came on by itself");
    }
}

/* Parked with the stage off; then another image's park is elsewhere. */
static void test_a_fault_that_is_over_enables_nothing(void) {
    hold_somewhere(SLEW);
    sag();
    run(RAMP);
    TEST_ASSERT_EQUAL_INT32(PARK, last);
    TEST_ASSERT_FALSE(fake_board.stage_enabled);
    commit(ELSEWHERE, SLEW);
    expect_off_for(RAMP);
    TEST_ASSERT_EQUAL_INT32(ELSEWHERE, last);
    commit(PARK, SLEW);
    expect_off_for(500);
    TEST_ASSERT_NOT_EQUAL(PARK, last);
    master_command(COMMAND_STOP); /* on its way still: stopping */
    expect_off_for(RAMP);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, state());
}

static void test_a_failed_self_test_enables_nothing_later(void) {
    commit(PARK, SLEW);
    run(RAMP);
    fake_board.health[HEALTH_HIGH_VOLTAGE] = 0;
    run(100);
    master_command(COMMAND_ARM);
    run(POWER_SELF_TEST_MS * 10U + 10U);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
    TEST_ASSERT_FALSE(fake_board.stage_enabled);
    commit(ELSEWHERE, SLEW);
    expect_off_for(RAMP);
}

static void test_an_overload_while_off_enables_nothing(void) {
    commit(ELSEWHERE, SLEW);
    run(1000);
    late(LOOP_OVERRUNS_TO_TRIP + 1U);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
    expect_off_for(RAMP);
}

/* Armed again while a fault's ramp with the stage off is under way: on at its end, not within it. */
static void test_arming_within_a_ramp_waits_for_its_end(void) {
    commit(ELSEWHERE, SLEW);
    run(10);
    master_command(COMMAND_ARM);
    while (last != ELSEWHERE) {
        TEST_ASSERT_FALSE_MESSAGE(fake_board.stage_enabled, "at a drive that is not the parking one");
        run(1);
    }
    run(2);
    TEST_ASSERT_TRUE(fake_board.stage_enabled);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_PRECHARGE, state());
}

static void expect_a_ramp_with_the_stage_on(hyst_q31_t slew) {
    while (last != PARK) {
        const hyst_q31_t before = last;
        TEST_ASSERT_TRUE_MESSAGE(fake_board.stage_enabled, "cut within a ramp");
        run(1);
        TEST_ASSERT_INT32_WITHIN(slew + CODE_STEP, before, last);
    }
    run(2);
    TEST_ASSERT_FALSE(fake_board.stage_enabled);
    TEST_ASSERT_EQUAL_INT32(PARK, last);
}

/* What is armed within the ramp of a stop still has its stage on. */
static void test_a_damaged_image_that_is_armed_within_a_ramp_ramps_on(void) {
    hold_somewhere(SLEW);
    master_command(COMMAND_DISARM);
    run(10);
    loop.active->compensator.linear_offset ^= 1;
    master_command(COMMAND_ARM);
    run(1);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
    TEST_ASSERT_EQUAL_UINT32(FAULT_IMAGE, master_get(INDEX_faults_live) & FAULT_IMAGE);
    expect_a_ramp_with_the_stage_on(SLEW);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_fault_that_is_over_enables_nothing);
    RUN_TEST(test_a_failed_self_test_enables_nothing_later);
    RUN_TEST(test_an_overload_while_off_enables_nothing);
    RUN_TEST(test_arming_within_a_ramp_waits_for_its_end);
    RUN_TEST(test_a_damaged_image_that_is_armed_within_a_ramp_ramps_on);
    return UNITY_END();
}
