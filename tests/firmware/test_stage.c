/* SPDX-License-Identifier: MIT */
/* The enable line of the power stage, and how a fault brings the output to rest. */
#include "amplifier.h"
#include "fake_board.h"
#include "loop/loop.h"
#include "loop/loop_memory.h"
#include "master.h"
#include "protection/health_watch.h"
#include "store/parameter_store.h"
#include "unity.h"

#define CODE_STEP (1 << 16) /* of 16 bits, in Q31 */
#define PARK      (-(1 << 29))
#define ELSEWHERE (1 << 29)
#define SLEW      (1 << 20)         /* 4096 samples for the whole range */
#define RAMP      6000U             /* samples in which any ramp of SLEW is over */
#define TURN      HEALTH_WATCH_TURN /* samples between two looks at the main loop */
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
    master_put(INDEX_mode, HYST_MODE_DIRECT);
    master_put(INDEX_setpoint, 1U << 30);
    while (last != 1 << 30) {
        run(1);
    }
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, state());
}

static hyst_q31_t drive_of(loop_input_t input) {
    return (hyst_q31_t)((uint32_t)(loop_sample(&input) ^ BOARD_CODE_MIDDLE) << 16);
}

static void sag(void) {
    last = drive_of((loop_input_t){.faults = FAULT_SUPPLY, .position_code = BOARD_CODE_MIDDLE});
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
}

static void late(unsigned times) {
    for (unsigned i = 0; i < times; i++) {
        last = drive_of((loop_input_t){.faults = FAULT_OVERRUN, .position_code = BOARD_CODE_MIDDLE});
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

/* Stop and arm within an overload's ramp: it is never off in between, and follows its reference all the same. */
static void test_arming_within_an_overloads_ramp_follows_again(void) {
    hold_somewhere(SLEW);
    late(LOOP_OVERRUNS_TO_TRIP);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
    run(10);
    master_command(COMMAND_STOP);
    master_command(COMMAND_ARM);
    while (last != PARK) {
        TEST_ASSERT_BITS_HIGH(LIMIT_MEMORY, master_get(INDEX_limits_live));
        run(1);
    }
    run(PRECHARGE + 3U);
    master_put(INDEX_mode, HYST_MODE_DIRECT);
    master_put(INDEX_setpoint, 1U << 30);
    run(RAMP);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, state());
    TEST_ASSERT_EQUAL_INT32(1 << 30, last);
    TEST_ASSERT_EQUAL_HEX32(0, master_get(INDEX_limits_live));
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

/* However slow the image's transitions are, a fault's ramp takes half a second for the whole range. */
static void expect_to_be_safe_in_time(void) {
    const hyst_q31_t from = last;
    unsigned samples = 0;
    while (fake_board.stage_enabled) {
        const hyst_q31_t before = last;
        run(1);
        TEST_ASSERT_INT32_WITHIN(FAKE_FAULT_SLEW_MIN + CODE_STEP, before, last);
        TEST_ASSERT_LESS_OR_EQUAL_UINT(5000, ++samples);
    }
    TEST_ASSERT_UINT_WITHIN(3, (unsigned)(((int64_t)from - PARK) / FAKE_FAULT_SLEW_MIN), samples);
    TEST_ASSERT_EQUAL_INT32(PARK, last);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
    master_command(COMMAND_STOP);
    run(2000);
    TEST_ASSERT_EQUAL_INT32_MESSAGE(PARK, last, "and it rests there");
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, state());
}

static void test_a_faults_ramp_is_no_slower_than_the_boards(void) {
    hold_somewhere(FAKE_TRANSITION_SLEW_MIN);
    sag();
    expect_to_be_safe_in_time();
    hold_somewhere(FAKE_TRANSITION_SLEW_MIN);
    late(LOOP_OVERRUNS_TO_TRIP);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
    expect_to_be_safe_in_time();
}

/* Outside of a range that was narrowed just before, too. */
static void test_a_faults_ramp_from_outside_of_the_range(void) {
    hold_somewhere(FAKE_TRANSITION_SLEW_MIN);
    master_put(INDEX_drive_high, 0);
    run(10);
    sag();
    expect_to_be_safe_in_time();
}

/* A stop is no fault: the image's own slew. */
static void test_a_stop_keeps_to_the_images_slew(void) {
    hold_somewhere(FAKE_TRANSITION_SLEW_MIN);
    master_command(COMMAND_DISARM);
    for (unsigned i = 0; i < 1000; i++) {
        const hyst_q31_t before = last;
        run(1);
        TEST_ASSERT_INT32_WITHIN(FAKE_TRANSITION_SLEW_MIN + CODE_STEP, before, last);
    }
    sag(); /* and a fault within it hastens it */
    expect_to_be_safe_in_time();
}

/* Any one bit of the coefficients, while they are in use: the main loop goes through them without end. */
static void test_an_image_that_changes_in_use_ramps(void) {
    const size_t from = offsetof(hyst_compensator_t, drive_park);
    const size_t places[] = {from, (from + sizeof(hyst_compensator_t)) / 2U, sizeof(hyst_compensator_t) - 1U};
    for (unsigned i = 0; i < sizeof places / sizeof places[0]; i++) {
        setUp();
        hold_somewhere(SLEW);
        for (unsigned turn = 0; turn < 5000; turn++) {
            (void)amplifier_serve();
            run(7);
        }
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(AMPLIFIER_HOLD, state(), "nothing has changed");
        ((unsigned char *)&loop.active->compensator)[places[i]] ^= 0x10U;
        unsigned samples = 0;
        while (state() == AMPLIFIER_HOLD) {
            (void)amplifier_serve();
            run(1);
            TEST_ASSERT_LESS_THAN_UINT(
                2U * (PARAMETER_STORE_CHECK_US / FAKE_SAMPLE_US) * (sizeof(loop_parameters_t) / 60U + 5U), ++samples);
        }
        TEST_ASSERT_EQUAL_HEX32(FAULT_IMAGE, 1U << (master_get(INDEX_trip_cause) - 1U));
        expect_a_ramp_with_the_stage_on(SLEW);
    }
}

/* Commits in the middle of going through one: what is compared is the image in force. */
static void test_commits_are_no_damage(void) {
    hold_somewhere(SLEW);
    for (unsigned i = 0; i < 40; i++) {
        commit(i % 2U == 0 ? ELSEWHERE : PARK, SLEW);
        for (unsigned turn = 0; turn < 37U * (i + 1U); turn++) {
            (void)amplifier_serve();
            run(PARAMETER_STORE_CHECK_US / FAKE_SAMPLE_US);
        }
        TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, state());
    }
}

/* Samples that an answer takes, in which the main loop waits for it. */
static unsigned sending;

static void send_for_long(const uint8_t *frame, size_t length) {
    (void)frame;
    (void)length;
    fake_board.main_stalls = true;
    run(sending);
    fake_board.main_stalls = false;
}

/* A master reads as much as fits into an answer, and again as soon as it has it: at 115200 and at 9600 baud. */
static void test_a_damaged_image_is_found_in_time_on_a_busy_line(void) {
    static const unsigned bauds[] = {115200, 9600};
    static const uint8_t pdu[] = {3, ADDRESS_active >> 8, ADDRESS_active & 0xFF, 0, MODBUS_READ_MAX};
    uint8_t frame[MODBUS_FRAME_MAX];
    const size_t length = master_frame(frame, MASTER_SERVER, pdu, sizeof pdu);
    fake_board_sends = send_for_long;
    for (size_t i = 0; i < 2; i++) {
        hold_somewhere(SLEW);
        const uint32_t byte_us = 10000000U / bauds[i];
        sending = 256U * byte_us / FAKE_SAMPLE_US;
        unsigned samples = 0;
        for (unsigned request = 0; request < 1000U && !loop_in_fault(); request++) {
            if (request == 5U) {
                loop.active->compensator.linear_offset ^= 1;
                samples = 0;
            }
            const uint32_t before = loop_samples();
            for (size_t at = 0; at < length; at++) {
                modbus_server_receive(frame[at]);
                for (unsigned turn = 0; turn <= byte_us / FAKE_SAMPLE_US; turn++) {
                    run(1);
                    (void)amplifier_serve();
                }
            }
            const unsigned sent = fake_board.frames_sent;
            for (unsigned turn = 0; turn < 100U && fake_board.frames_sent == sent; turn++) {
                run(1);
                (void)amplifier_serve();
            }
            TEST_ASSERT_EQUAL_UINT(sent + 1U, fake_board.frames_sent);
            samples += loop_samples() - before;
        }
        TEST_ASSERT_TRUE(loop_in_fault());
        TEST_ASSERT_EQUAL_HEX32(FAULT_IMAGE, 1U << (master_get(INDEX_trip_cause) - 1U));
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(500U * 1000U / FAKE_SAMPLE_US, samples);
        const board_start_t start = {.reset_cause = RESET_POWER, .starts = 1};
        fake_board_start(&start);
    }
    fake_board_sends = NULL;
}

/* The main loop makes no turn any more. Ramp and stage off, well before the hardware watchdog bites, which is fed until
 * then and no longer: it is to find the main loop where it stands. */
static void expect_a_stall_to_end_in_a_ramp(hyst_q31_t slew, amplifier_state_t before) {
    const unsigned most = HEALTH_WATCH_STALL_MS * 1000U / FAKE_SAMPLE_US - TURN;
    fake_board.main_stalls = true;
    const unsigned fed = fake_board.watchdog_fed;
    for (unsigned i = 0; i < most; i++) {
        run(1);
        TEST_ASSERT_EQUAL_UINT32(before, state());
    }
    TEST_ASSERT_EQUAL_UINT(fed, fake_board.watchdog_fed);
    run(2U * TURN);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
    TEST_ASSERT_EQUAL_HEX32(FAULT_STALL, 1U << (master_get(INDEX_trip_cause) - 1U));
    unsigned starving = 0, food = fake_board.watchdog_fed;
    while (fake_board.stage_enabled) {
        const hyst_q31_t drive = last;
        run(1);
        TEST_ASSERT_INT32_WITHIN(slew + CODE_STEP, drive, last);
        starving = fake_board.watchdog_fed != food ? 0 : starving + 1U;
        food = fake_board.watchdog_fed;
        TEST_ASSERT_LESS_THAN_UINT_MESSAGE(1000, starving, "0.1 s without food within the ramp");
    }
    TEST_ASSERT_EQUAL_INT32(PARK, last);
    run(10);
    food = fake_board.watchdog_fed;
    run(20000);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(food, fake_board.watchdog_fed, "a main loop that stands still is not to be fed");
    fake_board.main_stalls = false; /* it was only slow */
    run(10);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
    master_command(COMMAND_STOP);
    run(3);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, state());
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_faults_live));
}

static void test_a_main_loop_that_stands_still(void) {
    hold_somewhere(FAKE_TRANSITION_SLEW_MIN);
    expect_a_stall_to_end_in_a_ramp(FAKE_FAULT_SLEW_MIN, AMPLIFIER_HOLD);
    hold_somewhere(SLEW);
    expect_a_stall_to_end_in_a_ramp(SLEW, AMPLIFIER_HOLD);
}

/* On the way off there is more time to be lost than the hardware watchdog has. */
static void test_a_main_loop_that_stands_still_within_a_stop(void) {
    hold_somewhere(FAKE_TRANSITION_SLEW_MIN);
    master_command(COMMAND_DISARM);
    run(1);
    expect_a_stall_to_end_in_a_ramp(FAKE_FAULT_SLEW_MIN, AMPLIFIER_STOP);
}

/* Periods without a sample are time, too. */
static void test_missed_periods_count_for_a_stall(void) {
    hold_somewhere(SLEW);
    fake_board.main_stalls = true;
    unsigned samples = 0;
    while (state() == AMPLIFIER_HOLD) {
        loop_master_heard();
        const bool late_one = samples % 2U == 0;
        last = drive_of((loop_input_t){.faults = late_one ? FAULT_OVERRUN : 0U, .missed = late_one ? 18U : 0U});
        samples++;
    }
    TEST_ASSERT_EQUAL_HEX32(FAULT_STALL, 1U << (master_get(INDEX_trip_cause) - 1U));
    TEST_ASSERT_UINT_WITHIN(TURN, HEALTH_WATCH_STALL_MS * 1000U / FAKE_SAMPLE_US / 10U, samples);
}

/* Off, a stall is the hardware watchdog's alone. */
static void test_a_stall_while_off_is_no_fault(void) {
    commit(PARK, SLEW);
    run(RAMP);
    fake_board.main_stalls = true;
    run(20000);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, state());
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_faults_sticky));
}

/* A fault's ramp is fed, however long it takes, no longer than LOOP_FAULT_FEED_MS: here it never ends, because the
 * image is replaced again and again. */
static void test_food_within_a_fault_is_bounded(void) {
    hold_somewhere(SLEW);
    sag();
    fake_board.main_stalls = true;
    hyst_q31_t *const park = &loop.active->range.park;
    for (unsigned i = 0; i < 30000; i++) {
        *park = last > 0 ? -(1 << 30) : 1 << 30;
        run(1);
    }
    TEST_ASSERT_LESS_OR_EQUAL_UINT(LOOP_FAULT_FEED_MS * 1000U / FAKE_SAMPLE_US, fake_board.watchdog_fed);
}

/* Programming a word stalls the interrupt for a fifth of a period, erasing for thousands: after each step some samples
 * are late. */
static void samples_late_by_storing(void) {
    late(LOOP_OVERRUNS_TO_TRIP + 1U);
}

static void test_saving_is_no_overload(void) {
    commit(PARK, SLEW);
    run(RAMP);
    fake_store.after_each_step = samples_late_by_storing;
    master_command(COMMAND_SAVE);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, state());
    master_command(COMMAND_SAVE_LINE);
    fake_store.after_each_step = NULL;
    run(2);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, state());
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_faults_sticky));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_overruns));
    late(LOOP_OVERRUNS_TO_TRIP);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(AMPLIFIER_FAULT, state(), "afterwards they count as ever");
}

/* A commit and an arming that are read in one turn of the main loop: the new image's park is elsewhere. */
static void test_arming_behind_a_commit_waits_for_its_park(void) {
    commit(PARK, SLEW);
    run(RAMP);
    commit(ELSEWHERE, SLEW);
    master_command(COMMAND_ARM);
    while (last != ELSEWHERE) {
        TEST_ASSERT_FALSE_MESSAGE(fake_board.stage_enabled, "the stage came on before the output rested");
        run(1);
    }
    run(PRECHARGE + 3U);
    TEST_ASSERT_TRUE(fake_board.stage_enabled);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, state());
}

/* A stop that is read in the turn that ends a stall, at any sample between two looks: it does not trip again. */
static void test_a_stop_that_ends_a_stall_is_the_end_of_it(void) {
    for (unsigned offset = 0; offset < TURN; offset++) {
        setUp();
        hold_somewhere(SLEW);
        fake_board.main_stalls = true;
        run(HEALTH_WATCH_STALL_MS * 1000U / FAKE_SAMPLE_US + RAMP + offset);
        TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, state());
        fake_board.main_stalls = false;
        health_watch_main_turned();
        master_command(COMMAND_STOP);
        run(2U * TURN);
        TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, state());
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_arming_behind_a_commit_waits_for_its_park);
    RUN_TEST(test_a_stop_that_ends_a_stall_is_the_end_of_it);
    RUN_TEST(test_a_fault_that_is_over_enables_nothing);
    RUN_TEST(test_a_failed_self_test_enables_nothing_later);
    RUN_TEST(test_an_overload_while_off_enables_nothing);
    RUN_TEST(test_arming_within_a_ramp_waits_for_its_end);
    RUN_TEST(test_arming_within_an_overloads_ramp_follows_again);
    RUN_TEST(test_a_damaged_image_that_is_armed_within_a_ramp_ramps_on);
    RUN_TEST(test_a_faults_ramp_is_no_slower_than_the_boards);
    RUN_TEST(test_a_faults_ramp_from_outside_of_the_range);
    RUN_TEST(test_a_stop_keeps_to_the_images_slew);
    RUN_TEST(test_an_image_that_changes_in_use_ramps);
    RUN_TEST(test_commits_are_no_damage);
    RUN_TEST(test_a_damaged_image_is_found_in_time_on_a_busy_line);
    RUN_TEST(test_a_main_loop_that_stands_still);
    RUN_TEST(test_a_main_loop_that_stands_still_within_a_stop);
    RUN_TEST(test_missed_periods_count_for_a_stall);
    RUN_TEST(test_a_stall_while_off_is_no_fault);
    RUN_TEST(test_food_within_a_fault_is_bounded);
    RUN_TEST(test_saving_is_no_overload);
    return UNITY_END();
}
