/* SPDX-License-Identifier: MIT */
/* Where a mode begins: arming and a mode alone move nothing, whatever the setpoint was before, and a setpoint that was
 * written for the mode to come is kept. */
#include "amplifier.h"
#include "fake_board.h"
#include "loop/loop.h"
#include "master.h"
#include "unity.h"
#include <stdlib.h>

#define CODE_STEP  (1 << 16) /* of 16 bits, in Q31 */
#define PARK       (-(1 << 29))
#define SOMEWHERE  (HYST_Q31_MAX / 10 * 8)
#define SECOND     (1000000U / FAKE_SAMPLE_US)
#define PRECHARGED (SECOND / 5U)

void setUp(void) {
    fake_board_power_on(0);
}
void tearDown(void) {
}

static void plays(hyst_parameters_t *p) {
    p->pi_operators = 2;
    p->pi_weight[0] = HYST_Q28_ONE / 2;
    p->pi_weight[1] = p->pi_weight[2] = HYST_Q28_ONE / 4;
    p->pi_threshold[0] = 1 << 27;
    p->pi_threshold[1] = 1 << 28;
}

static void creep(hyst_parameters_t *p) {
    plays(p);
    p->creep_cells = 1;
    p->creep[0] = (hyst_creep_cell_t){.rate = HYST_Q30_ONE / 100, .gain = HYST_Q31_MAX / 20};
}

static void filters(hyst_parameters_t *p) {
    plays(p);
    p->shape_sections = p->equalise_sections = 1;
    p->shape[0] = (hyst_iir_section_t){.b0 = HYST_Q28_ONE / 4 * 3, .a1 = -(HYST_Q28_ONE / 2)}; /* 1.5 at rest */
    p->equalise[0] = (hyst_iir_section_t){.b0 = 2 * HYST_Q28_ONE, .b1 = -HYST_Q28_ONE};
}

static void curve(hyst_curve_t *curve, int64_t bend) {
    for (int64_t i = 0; i < HYST_CURVE_NODES; i++) {
        const int64_t x = (i - 16) * (1 << 27);
        curve->node[i] = hyst_saturate(x / 10 * 9 + bend * ((x * x >> 31) - (INT64_C(1) << 31)) / 20);
    }
}

static void curves(hyst_parameters_t *p) {
    plays(p);
    p->drive_curves = p->reference_curves = 1;
    curve(&p->drive_curve[0], 1);
    curve(&p->reference_curve[0], -1);
}

static void bouc_wen(hyst_parameters_t *p) {
    p->family = HYST_FAMILY_BOUC_WEN;
    p->bouc_wen_cells = 2;
    p->bouc_wen_direct = HYST_Q28_ONE / 2;
    p->bouc_wen_length[0] = p->bouc_wen_length[1] = 1 << 28;
    p->bouc_wen_slope[0] = HYST_Q28_ONE / 2;
    p->bouc_wen_slope[1] = HYST_Q28_ONE / 4;
}

static void preisach(hyst_parameters_t *p) {
    p->family = HYST_FAMILY_PREISACH;
    p->preisach_intervals = 4;
    for (int32_t i = 1, n = 0; i <= 4; i++) {
        for (int32_t j = 0; j < i; j++, n++) {
            p->preisach_everett[n] = (HYST_Q28_ONE / 8) * (i - j) + (HYST_Q28_ONE / 64) * (i - j) * (i - j);
        }
    }
}

static void modified_play(hyst_parameters_t *p) {
    p->family = HYST_FAMILY_MODIFIED_PLAY;
    p->modified_plays = 1;
    p->modified_play[0].divisions = 1;
    p->modified_play[0].direct = HYST_Q28_ONE;
    p->modified_play[0].rate_gain = HYST_Q30_ONE;
}

static void linear(hyst_parameters_t *p) {
    p->linear_offset = 1 << 28;
    p->linear_gain = HYST_Q28_ONE / 10 * 13;
}

static void (*const models[])(hyst_parameters_t *) = {plays,    creep,    filters,       curves,
                                                      bouc_wen, preisach, modified_play, linear};
#define MODELS (sizeof models / sizeof models[0])

static void commit(void (*model)(hyst_parameters_t *), hyst_q31_t park) {
    hyst_parameters_t p;
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    hyst_parameters_default(&p);
    p.drive_park = park;
    model(&p);
    master_write_words(ADDRESS_staging, words, hyst_parameters_encode(&p, words, HYST_IMAGE_MAX_WORDS));
    master_command(COMMAND_COMMIT);
    TEST_ASSERT_EQUAL_UINT32(HYST_PARAMETERS_OK, master_get(INDEX_fault_code));
}

/* With turns of the main loop. */
static hyst_q31_t run(unsigned samples) {
    hyst_q31_t drive = 0;
    for (unsigned i = 0; i < samples; i++) {
        drive = fake_board_run(1);
        (void)amplifier_serve();
    }
    return drive;
}

static void expect_rest(hyst_q31_t drive, hyst_q31_t within, unsigned samples) {
    for (unsigned i = 0; i < samples; i++) {
        TEST_ASSERT_INT32_WITHIN_MESSAGE(within, drive, run(1), "it moves by itself");
    }
}

static void arm(void) {
    master_command(COMMAND_ARM);
    (void)run(PRECHARGED);
    TEST_ASSERT_TRUE(loop_ready());
}

/* The scene that a master had: a setpoint, silence, the communication timeout, stop, clear, arm, a mode alone. */
static void test_a_setpoint_does_not_outlive_a_trip(void) {
    commit(plays, PARK);
    (void)run(SECOND);
    for (uint32_t mode = HYST_MODE_DIRECT; mode <= HYST_MODE_COMPENSATE; mode++) {
        master_put(INDEX_mode, mode);
        master_put(INDEX_setpoint, SOMEWHERE);
        master_put(INDEX_watchdog, 500);
        TEST_ASSERT_GREATER_THAN_INT32(SOMEWHERE / 2, run(SECOND * 2U / 5U));
        (void)run(SECOND);
        TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, master_get(INDEX_amplifier_state));
        master_put(INDEX_watchdog, 0);
        master_command(COMMAND_STOP);
        master_command(COMMAND_CLEAR);
        TEST_ASSERT_EQUAL_INT32(PARK, run(SECOND));
        TEST_ASSERT_EQUAL_HEX32(PARK, master_get(INDEX_setpoint));
        arm();
        master_put(INDEX_mode, mode);
        expect_rest(PARK, CODE_STEP, SECOND);
        TEST_ASSERT_EQUAL_UINT32(mode, master_get(INDEX_active_mode));
        master_put(INDEX_mode, HYST_MODE_PARK);
    }
}

/* Parked by mode, by command, and disarmed; to the same mode and to another one. */
static void test_a_setpoint_does_not_outlive_parking(void) {
    static const uint32_t commands[] = {COMMAND_PARK, COMMAND_DISARM, COMMAND_NONE};
    commit(plays, PARK);
    (void)run(SECOND);
    for (size_t i = 0; i < 3; i++) {
        for (uint32_t mode = HYST_MODE_DIRECT; mode <= HYST_MODE_COMPENSATE; mode++) {
            master_put(INDEX_mode, HYST_MODE_DIRECT);
            master_put(INDEX_setpoint, SOMEWHERE);
            (void)run(SECOND);
            master_command((uint16_t)commands[i]);
            master_put(INDEX_mode, HYST_MODE_PARK);
            TEST_ASSERT_EQUAL_INT32(PARK, run(SECOND));
            arm();
            master_put(INDEX_mode, mode);
            expect_rest(PARK, CODE_STEP, SECOND / 2U);
            master_put(INDEX_mode, HYST_MODE_PARK);
        }
    }
}

/* Whatever the image is. What creep still adds to the position moves the drive in compensate mode: that is its purpose.
 */
static void test_a_mode_alone_moves_nothing_with_any_model(void) {
    static const hyst_q31_t parks[] = {PARK, 0, 1 << 28};
    for (size_t i = 0; i < MODELS; i++) {
        for (size_t k = 0; k < 3; k++) {
            commit(models[i], parks[k]);
            (void)run(2U * SECOND);
            for (uint32_t mode = HYST_MODE_DIRECT; mode <= HYST_MODE_COMPENSATE; mode++) {
                master_put(INDEX_mode, mode);
                expect_rest(parks[k], CODE_STEP, SECOND / 5U);
                TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_limits_live));
                master_put(INDEX_mode, HYST_MODE_PARK);
                (void)run(SECOND / 5U);
            }
        }
    }
}

/* The model's memory has turned often, and is not what a start has. */
static void test_a_mode_alone_moves_nothing_with_any_memory(void) {
    for (size_t i = 0; i < MODELS; i++) {
        commit(models[i], PARK);
        (void)run(SECOND);
        master_put(INDEX_mode, HYST_MODE_DIRECT);
        master_put(INDEX_setpoint_slew, HYST_Q31_MAX / 100);
        for (int32_t size = SOMEWHERE, sign = 1; size > SOMEWHERE / 20; size = size / 4 * 3, sign = -sign) {
            master_put(INDEX_setpoint, (uint32_t)(sign * size));
            (void)run(200);
        }
        master_put(INDEX_mode, HYST_MODE_PARK);
        TEST_ASSERT_EQUAL_INT32(PARK, run(2U * SECOND));
        master_put(INDEX_mode, HYST_MODE_COMPENSATE);
        expect_rest(PARK, CODE_STEP, SECOND / 5U);
        master_put(INDEX_mode, HYST_MODE_PARK);
        (void)run(SECOND / 5U);
    }
}

/* While it is still on its way to park a mode stops it where it is. */
static void test_a_mode_on_the_way_to_park_holds(void) {
    commit(plays, PARK);
    (void)run(SECOND);
    for (uint32_t mode = HYST_MODE_DIRECT; mode <= HYST_MODE_COMPENSATE; mode++) {
        master_put(INDEX_mode, HYST_MODE_DIRECT);
        master_put(INDEX_setpoint, SOMEWHERE);
        (void)run(SECOND);
        master_put(INDEX_mode, HYST_MODE_PARK);
        const hyst_q31_t there = run(SECOND / 20U);
        TEST_ASSERT_GREATER_THAN_INT32(0, there);
        master_put(INDEX_mode, mode);
        expect_rest(there, CODE_STEP, SECOND / 5U);
        master_put(INDEX_mode, HYST_MODE_PARK);
        (void)run(SECOND);
    }
}

/* A mode that is taken in precharge, with the output still on its way to a new park: it begins where that comes to
 * rest. */
static void test_a_mode_in_precharge_waits_where_the_output_comes_to_rest(void) {
    for (uint32_t mode = HYST_MODE_DIRECT; mode <= HYST_MODE_COMPENSATE; mode++) {
        master_command(COMMAND_DISARM);
        commit(plays, PARK);
        (void)run(SECOND);
        commit(plays, 1 << 28);
        master_command(COMMAND_ARM);
        master_put(INDEX_mode, mode);
        (void)run(SECOND);
        TEST_ASSERT_TRUE(loop_ready());
        TEST_ASSERT_EQUAL_UINT32(mode, master_get(INDEX_active_mode));
        expect_rest(1 << 28, CODE_STEP, SECOND / 5U);
    }
}

/* A mode that is taken while conditioning, too. */
static void test_a_mode_within_conditioning_goes_on_at_its_end(void) {
    commit(plays, PARK);
    (void)run(SECOND);
    for (uint32_t mode = HYST_MODE_DIRECT; mode <= HYST_MODE_COMPENSATE; mode++) {
        master_command(COMMAND_CONDITION);
        (void)run(SECOND / 4U);
        master_put(INDEX_mode, mode);
        (void)run(3U * SECOND);
        TEST_ASSERT_EQUAL_UINT32(LOOP_IDLE, master_get(INDEX_state));
        /* A sweep does 0.2 thousandths of full scale a sample, and the last turn of the main loop was one before. */
        expect_rest(PARK, 8 * CODE_STEP, SECOND / 5U);
        master_put(INDEX_mode, HYST_MODE_PARK);
        (void)run(SECOND);
    }
}

/* First the setpoint, then the mode, before and after arming: it goes there, from where it rests, by setpoint_slew. */
static void test_a_setpoint_that_is_written_while_parked_is_kept(void) {
    commit(linear, PARK);
    (void)run(SECOND);
    for (unsigned before = 0; before < 2; before++) {
        for (uint32_t mode = HYST_MODE_DIRECT; mode <= HYST_MODE_COMPENSATE; mode++) {
            master_command(COMMAND_DISARM);
            TEST_ASSERT_EQUAL_INT32(PARK, run(SECOND));
            if (before != 0) {
                master_put(INDEX_setpoint, 1U << 28);
            }
            arm();
            if (before == 0) {
                master_put(INDEX_setpoint, 1U << 28);
            }
            TEST_ASSERT_EQUAL_HEX32(1U << 28, master_get(INDEX_setpoint));
            expect_rest(PARK, 0, SECOND / 5U);
            master_put(INDEX_mode, mode);
            hyst_q31_t last = PARK;
            for (unsigned i = 0; i < SECOND; i++) {
                const hyst_q31_t drive = run(1);
                /* setpoint_slew, of which linear mode makes 1.3 times as much, and a first sample as a transition */
                TEST_ASSERT_INT32_WITHIN(LOOP_DEFAULT_SLEW / 10 * 24 + CODE_STEP, last, drive);
                last = drive;
            }
            TEST_ASSERT_EQUAL_HEX32(1U << 28, master_get(INDEX_setpoint));
            TEST_ASSERT_EQUAL_HEX32(1U << 28, master_get(INDEX_reference));
        }
    }
}

/* But not over a stop, a fault or another disarming. */
static void test_a_setpoint_of_a_mode_that_did_not_come_is_forgotten(void) {
    static const uint32_t commands[] = {COMMAND_STOP, COMMAND_PARK, COMMAND_DISARM};
    commit(plays, PARK);
    (void)run(SECOND);
    for (size_t i = 0; i < 3; i++) {
        master_put(INDEX_setpoint, SOMEWHERE);
        (void)run(10);
        master_command((uint16_t)commands[i]);
        TEST_ASSERT_EQUAL_HEX32(PARK, master_get(INDEX_setpoint));
        arm();
        master_put(INDEX_mode, HYST_MODE_DIRECT);
        expect_rest(PARK, CODE_STEP, SECOND / 2U);
        master_put(INDEX_mode, HYST_MODE_PARK);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_setpoint_does_not_outlive_a_trip);
    RUN_TEST(test_a_setpoint_does_not_outlive_parking);
    RUN_TEST(test_a_mode_alone_moves_nothing_with_any_model);
    RUN_TEST(test_a_mode_alone_moves_nothing_with_any_memory);
    RUN_TEST(test_a_mode_on_the_way_to_park_holds);
    RUN_TEST(test_a_mode_in_precharge_waits_where_the_output_comes_to_rest);
    RUN_TEST(test_a_mode_within_conditioning_goes_on_at_its_end);
    RUN_TEST(test_a_setpoint_that_is_written_while_parked_is_kept);
    RUN_TEST(test_a_setpoint_of_a_mode_that_did_not_come_is_forgotten);
    return UNITY_END();
}
