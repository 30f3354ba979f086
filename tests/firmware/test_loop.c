/* SPDX-License-Identifier: MIT */
/* The loop: codes, modes, counters and faults, conditioning. */
#include "amplifier.h"
#include "fake_board.h"
#include "loop/loop.h"
#include "master.h"
#include "unity.h"
#include <stdlib.h>

#define CODE_STEP (1 << 16) /* of 16 bits, in Q31 */

void setUp(void) {
    fake_board_power_on(0);
}
void tearDown(void) {
}

/* A model with hysteresis and with limits inside the converter's range. */
static hyst_parameters_t limited_model(void) {
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    p.drive_low = -(1 << 30);
    p.drive_high = 3 << 29;
    p.drive_park = -(1 << 28);
    p.pi_operators = 2;
    p.pi_weight[0] = HYST_Q28_ONE / 2;
    p.pi_weight[1] = p.pi_weight[2] = HYST_Q28_ONE / 4;
    p.pi_threshold[0] = 1 << 27;
    p.pi_threshold[1] = 1 << 28;
    return p;
}

static void commit(const hyst_parameters_t *p) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    const size_t length = hyst_parameters_encode(p, words, HYST_IMAGE_MAX_WORDS);
    master_write_words(ADDRESS_staging, words, length);
    master_command(COMMAND_COMMIT);
    TEST_ASSERT_EQUAL_UINT32(HYST_PARAMETERS_OK, master_get(INDEX_fault_code));
}

/* Runs until the drive stands still. */
static hyst_q31_t settle(void) {
    hyst_q31_t last = fake_board_run(1);
    for (int i = 0; i < 100000; i++) {
        const hyst_q31_t drive = fake_board_run(16);
        if (drive == last) {
            return drive;
        }
        last = drive;
    }
    TEST_FAIL_MESSAGE("the drive does not come to rest");
    return last;
}

static void test_codes_over_the_whole_range(void) {
    static const struct {
        hyst_q31_t drive;
        uint16_t code;
    } cases[] = {{INT32_MIN, 0x0000},
                 {INT32_MIN + 0x7FFF, 0x0000},
                 {INT32_MIN + 0x8000, 0x0001},
                 {-0x8001, 0x7FFF},
                 {-0x8000, 0x8000},
                 {0, 0x8000},
                 {0x7FFF, 0x8000},
                 {0x8000, 0x8001},
                 {0x7FFF7FFF, 0xFFFF},
                 {0x7FFF8000, 0xFFFF},
                 {INT32_MAX, 0xFFFF}};
    master_put(INDEX_mode, HYST_MODE_DIRECT);
    master_put(INDEX_setpoint_slew, INT32_MAX);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        master_put(INDEX_setpoint, (uint32_t)cases[i].drive);
        (void)settle();
        TEST_ASSERT_EQUAL_HEX16(cases[i].code, fake_board_sample(0));
    }
}

static void test_position_codes(void) {
    for (uint32_t code = 0; code < 0x10000U; code += 0xFFU) {
        const loop_input_t input = {.position_code = (uint16_t)code};
        (void)loop_sample(&input);
        TEST_ASSERT_EQUAL_INT32(((int32_t)code - 0x8000) * CODE_STEP, (int32_t)master_get(INDEX_position));
    }
}

static void test_parked_at_start(void) {
    TEST_ASSERT_EQUAL_UINT32(LOOP_PARKED, master_get(INDEX_state));
    TEST_ASSERT_EQUAL_HEX16(BOARD_CODE_MIDDLE, fake_board_sample(123));
    TEST_ASSERT_EQUAL_UINT32(LOOP_PARKED, master_get(INDEX_state));
    master_put(INDEX_setpoint, 1U << 30);
    master_put(INDEX_setpoint_slew, INT32_MAX);
    (void)fake_board_run(3);
    TEST_ASSERT_EQUAL_HEX16_MESSAGE(BOARD_CODE_MIDDLE, fake_board_sample(0), "parked ignores the reference");
}

/* No change of mode steps the drive by more than the transition and the rounding of two codes. */
static void test_modes_change_without_a_step(void) {
    const hyst_parameters_t p = limited_model();
    static const hyst_mode_t modes[] = {HYST_MODE_DIRECT, HYST_MODE_COMPENSATE, HYST_MODE_LINEAR, HYST_MODE_PARK,
                                        HYST_MODE_LINEAR, HYST_MODE_DIRECT,     HYST_MODE_PARK,   HYST_MODE_COMPENSATE};
    commit(&p);
    master_put(INDEX_setpoint, 1U << 28);
    hyst_q31_t last = settle();
    for (size_t i = 0; i < sizeof modes / sizeof modes[0]; i++) {
        master_put(INDEX_mode, modes[i]);
        TEST_ASSERT_EQUAL_INT32(last, fake_board_run(1));
        TEST_ASSERT_EQUAL_UINT32(modes[i], master_get(INDEX_active_mode));
        for (int sample = 0; sample < 3000; sample++) {
            const hyst_q31_t drive = fake_board_run(1);
            /* in compensate the offset's decay comes out divided by the slope of the model at the most: 2 */
            TEST_ASSERT_INT32_WITHIN(2 * p.transition_slew + 2 * CODE_STEP, last, drive);
            last = drive;
        }
    }
}

static void test_stop_and_the_end_of_a_source_hold(void) {
    const uint32_t points[] = {100, 1U << 29, 100, 1U << 28};
    master_write_words(ADDRESS_waveform, points, 4);
    master_put(INDEX_waveform_points, 2);
    master_put(INDEX_source, SOURCE_BREAKPOINTS);
    master_put(INDEX_source_cycles, 1);
    master_put(INDEX_mode, HYST_MODE_DIRECT);
    master_command(COMMAND_START);
    (void)fake_board_run(50);
    TEST_ASSERT_EQUAL_UINT32(LOOP_PLAYING, master_get(INDEX_state));
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(1U << 28, master_get(INDEX_setpoint), "the setpoint follows");
    master_command(COMMAND_STOP);
    TEST_ASSERT_EQUAL_INT32(1 << 28, fake_board_run(50));
    TEST_ASSERT_EQUAL_UINT32(LOOP_IDLE, master_get(INDEX_state));
    master_command(COMMAND_START);
    TEST_ASSERT_EQUAL_INT32(1 << 28, fake_board_run(500));
    TEST_ASSERT_EQUAL_UINT32(LOOP_IDLE, master_get(INDEX_state));
    TEST_ASSERT_EQUAL_UINT32(1U << 28, master_get(INDEX_setpoint));
}

/* A setpoint that is on its way, or a reference on its way to where a source ended: stop holds both where they are. */
static void test_stop_holds_what_is_on_its_way(void) {
    master_put(INDEX_mode, HYST_MODE_DIRECT);
    master_put(INDEX_setpoint, 1U << 30);
    const hyst_q31_t there = fake_board_run(100);
    TEST_ASSERT_GREATER_THAN_INT32(1 << 26, there);
    TEST_ASSERT_LESS_THAN_INT32(1 << 29, there);
    master_command(COMMAND_STOP);
    TEST_ASSERT_EQUAL_INT32(there, fake_board_run(500));
    TEST_ASSERT_INT32_WITHIN(1 << 16, there, (int32_t)master_get(INDEX_setpoint)); /* a code */
    const uint32_t step[] = {0, 1U << 30};
    master_write_words(ADDRESS_waveform, step, 2);
    master_put(INDEX_waveform_points, 1);
    master_put(INDEX_source, SOURCE_BREAKPOINTS);
    master_put(INDEX_source_cycles, 1);
    master_put(INDEX_reference_slew, 1U << 16);
    master_command(COMMAND_START);
    const hyst_q31_t led = fake_board_run(100);
    TEST_ASSERT_INT32_WITHIN(2 << 16, there + (100 << 16), led);
    TEST_ASSERT_EQUAL_UINT32(LOOP_IDLE, master_get(INDEX_state));
    master_command(COMMAND_STOP);
    TEST_ASSERT_EQUAL_INT32(led, fake_board_run(500));
}

/* The harmonics of a modified play model: what they do after a sine has begun does not depend on when it did. A sine
 * without an amplitude, so that nothing but the harmonics moves the drive. */
static void test_a_sine_locks_the_harmonics(void) {
    enum { PERIOD = 100, SAMPLES = 3 * PERIOD };
    static hyst_q31_t drive[2][SAMPLES];
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    p.family = HYST_FAMILY_MODIFIED_PLAY;
    p.modified_plays = 1;
    p.modified_play[0].divisions = 1;
    p.modified_play[0].direct = HYST_Q28_ONE;
    p.modified_play[0].rate_gain = HYST_Q30_ONE;
    p.modified_play[0].cosine[0] = HYST_Q28_ONE / 4;
    p.modified_play[0].phase_step = UINT32_MAX / PERIOD;
    for (unsigned run = 0; run < 2; run++) {
        fake_board_power_on(0);
        commit(&p);
        master_put(INDEX_mode, HYST_MODE_COMPENSATE);
        master_put(INDEX_setpoint, 1U << 29);
        master_put(INDEX_setpoint_slew, INT32_MAX);
        (void)fake_board_run(20000 + run * PERIOD / 3);
        master_put(INDEX_source, SOURCE_SINE);
        master_put(INDEX_source_offset, 1U << 29);
        master_put(INDEX_source_amplitude, 0);
        master_put(INDEX_source_increment, UINT32_MAX / PERIOD);
        master_put(INDEX_source_cycles, 0);
        master_command(COMMAND_START);
        for (unsigned k = 0; k < SAMPLES; k++) {
            drive[run][k] = fake_board_run(1);
        }
    }
    hyst_q31_t low = INT32_MAX, high = INT32_MIN;
    for (unsigned k = PERIOD; k < SAMPLES; k++) {
        low = drive[0][k] < low ? drive[0][k] : low;
        high = drive[0][k] > high ? drive[0][k] : high;
        TEST_ASSERT_INT32_WITHIN(CODE_STEP, drive[0][k], drive[1][k]);
    }
    TEST_ASSERT_GREATER_THAN_INT32(100 * CODE_STEP, high - low); /* or there is nothing to lock */
}

static void test_parking_stops_everything(void) {
    master_put(INDEX_mode, HYST_MODE_DIRECT);
    master_put(INDEX_source, SOURCE_SINE);
    master_put(INDEX_source_amplitude, 1U << 30);
    master_put(INDEX_source_increment, 1U << 24);
    master_command(COMMAND_START);
    (void)fake_board_run(100);
    master_command(COMMAND_PARK);
    TEST_ASSERT_EQUAL_INT32(0, settle());
    TEST_ASSERT_EQUAL_UINT32(LOOP_PARKED, master_get(INDEX_state));
    TEST_ASSERT_EQUAL_UINT32(HYST_MODE_PARK, master_get(INDEX_mode));
    master_put(INDEX_mode, HYST_MODE_DIRECT);
    (void)fake_board_run(1);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(LOOP_IDLE, master_get(INDEX_state), "the source does not come back by itself");
}

/* Conditioning, from any mode and with any left-over: whole range, no step, and back to work. */
static void condition_and_check(hyst_mode_t mode, hyst_parameters_t p) {
    const hyst_q31_t fixed = (hyst_q31_t)((UINT64_C(1) << 32) * FAKE_SAMPLE_US / 1000000U);
    const hyst_q31_t rate = fixed < p.transition_slew ? fixed : p.transition_slew;
    const unsigned most =
        (unsigned)((UINT64_C(3) << 32) / (uint32_t)rate); /* three times the range, less by the image's */
    hyst_q31_t highest = INT32_MIN, lowest = INT32_MAX;
    master_put(INDEX_setpoint_slew, (uint32_t)p.transition_slew); /* one bound for both ways back */
    hyst_q31_t last = fake_board_run(1), end;
    master_command(COMMAND_CONDITION);
    unsigned samples = 0;
    do {
        const hyst_q31_t drive = fake_board_run(1);
        TEST_ASSERT_INT32_WITHIN(rate + p.transition_slew + 2 * CODE_STEP, last, drive);
        highest = drive > highest ? drive : highest;
        lowest = drive < lowest ? drive : lowest;
        end = last; /* the drive before the first sample that does something else again */
        last = drive;
        samples++;
        TEST_ASSERT_TRUE_MESSAGE(samples < most, "conditioning takes at most three seconds, unless a slew says more");
    } while (master_get(INDEX_state) == LOOP_CONDITIONING);
    TEST_ASSERT_EQUAL_INT32(p.drive_high, highest);
    TEST_ASSERT_EQUAL_INT32(p.drive_low, lowest);
    TEST_ASSERT_EQUAL_INT32_MESSAGE(p.drive_park, end, "conditioning ends at drive_park");
    TEST_ASSERT_EQUAL_UINT32(mode, master_get(INDEX_active_mode));
    for (int i = 0; i < 20000; i++) {
        const hyst_q31_t drive = fake_board_run(1);
        TEST_ASSERT_INT32_WITHIN(2 * p.transition_slew + 2 * CODE_STEP, last, drive);
        last = drive;
    }
}

static void test_conditioning_from_every_mode(void) {
    const hyst_parameters_t p = limited_model();
    for (int mode = HYST_MODE_PARK; mode <= HYST_MODE_COMPENSATE; mode++) {
        fake_board_power_on(0);
        commit(&p);
        master_put(INDEX_mode, (uint32_t)mode);
        master_put(INDEX_setpoint, 1U << 28);
        const hyst_q31_t before = settle();
        condition_and_check((hyst_mode_t)mode, p);
        const hyst_q31_t after = settle();
        if (mode != HYST_MODE_COMPENSATE) { /* there the drive depends on the memory, which is another one now */
            TEST_ASSERT_EQUAL_INT32(before, after);
        }
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(1U << 28, master_get(INDEX_setpoint), "the setpoint is kept");
    }
}

/* A transition in direct mode that outlasts the way up must not cut the sweep short: the drive lags behind the sweep by
 * up to a quarter of full scale, for 5400 samples; the way up takes 700. */
static void test_conditioning_during_a_transition(void) {
    hyst_parameters_t p = limited_model();
    p.linear_offset = -(1 << 29);
    p.transition_slew = 100000;
    commit(&p);
    master_put(INDEX_mode, HYST_MODE_LINEAR);
    master_put(INDEX_setpoint, (uint32_t)(p.drive_high - (1 << 26)));
    (void)settle();
    master_put(INDEX_mode, HYST_MODE_DIRECT);
    (void)fake_board_run(5);
    condition_and_check(HYST_MODE_DIRECT, p);
}

/* And from another mode there is none, however slow transitions are. */
static void test_conditioning_does_not_wait_for_slow_transitions(void) {
    hyst_parameters_t p = limited_model();
    p.linear_offset = -(1 << 29);
    commit(&p);
    master_put(INDEX_mode, HYST_MODE_LINEAR);
    (void)settle();
    p.transition_slew = FAKE_TRANSITION_SLEW_MIN;
    commit(&p);
    (void)fake_board_run(1);
    condition_and_check(HYST_MODE_LINEAR, p);
}

static void test_conditioning_from_a_running_sine(void) {
    const hyst_parameters_t p = limited_model();
    commit(&p);
    master_put(INDEX_mode, HYST_MODE_DIRECT);
    master_put(INDEX_source, SOURCE_SINE);
    master_put(INDEX_source_amplitude, 1U << 29);
    master_put(INDEX_source_increment, 1U << 22);
    master_command(COMMAND_START);
    (void)fake_board_run(300);
    condition_and_check(HYST_MODE_DIRECT, p);
}

/* Nothing moves faster than what a lab sets for its load, conditioning neither. */
static void test_conditioning_keeps_to_the_slews(void) {
    static const uint32_t slews[][2] = {{FAKE_TRANSITION_SLEW_MIN, INT32_MAX}, {1 << 20, 54321}, {1 << 20, INT32_MAX}};
    const hyst_q31_t fixed = (hyst_q31_t)((UINT64_C(1) << 32) * FAKE_SAMPLE_US / 1000000U);
    for (unsigned i = 0; i < sizeof slews / sizeof slews[0]; i++) {
        fake_board_power_on(0);
        hyst_parameters_t p = limited_model();
        p.transition_slew = (hyst_q31_t)slews[i][0];
        commit(&p);
        master_put(INDEX_reference_slew, slews[i][1]);
        hyst_q31_t last = settle(), largest = 0;
        master_command(COMMAND_CONDITION);
        for (int sample = 0; sample < 10000; sample++) {
            const hyst_q31_t drive = fake_board_run(1);
            largest = abs(drive - last) > largest ? abs(drive - last) : largest;
            last = drive;
        }
        TEST_ASSERT_EQUAL_UINT32(LOOP_CONDITIONING, master_get(INDEX_state));
        const uint32_t slower = slews[i][0] < slews[i][1] ? slews[i][0] : slews[i][1];
        TEST_ASSERT_INT32_WITHIN(CODE_STEP, slower < (uint32_t)fixed ? (hyst_q31_t)slower : fixed, largest);
    }
}

/* Two amplifiers with different pasts agree to the bit after conditioning: the memory is erased. */
static void test_conditioning_erases_the_past(void) {
    hyst_q31_t drive[2];
    const hyst_parameters_t p = limited_model();
    for (int past = 0; past < 2; past++) {
        fake_board_power_on(0);
        commit(&p);
        master_put(INDEX_mode, HYST_MODE_DIRECT);
        master_put(INDEX_setpoint, past == 0 ? 3U << 28 : 0U - (3U << 28));
        (void)settle();
        master_put(INDEX_mode, HYST_MODE_COMPENSATE);
        master_put(INDEX_setpoint, 1U << 26);
        (void)settle();
        master_command(COMMAND_CONDITION);
        (void)fake_board_run(40000);
        TEST_ASSERT_EQUAL_UINT32(LOOP_IDLE, master_get(INDEX_state));
        drive[past] = settle();
    }
    TEST_ASSERT_EQUAL_INT32(drive[0], drive[1]);
}

static void test_start_is_refused_while_conditioning_and_stop_ends_it(void) {
    master_put(INDEX_mode, HYST_MODE_DIRECT);
    master_command(COMMAND_CONDITION);
    const hyst_q31_t before = fake_board_run(500);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_START));
    master_command(COMMAND_STOP);
    TEST_ASSERT_EQUAL_INT32(before, fake_board_run(500));
    TEST_ASSERT_EQUAL_UINT32(LOOP_IDLE, master_get(INDEX_state));
}

static void test_counters_count_and_clear(void) {
    const hyst_parameters_t p = limited_model();
    commit(&p);
    master_put(INDEX_mode, HYST_MODE_LINEAR);
    master_put(INDEX_setpoint, INT32_MAX);
    (void)settle();
    master_command(COMMAND_CLEAR);
    (void)fake_board_run(10);
    TEST_ASSERT_EQUAL_UINT32(10, master_get(INDEX_samples));
    TEST_ASSERT_EQUAL_UINT32(10, master_get(INDEX_drive_limited));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_unreachable));
    master_put(INDEX_mode, HYST_MODE_COMPENSATE);
    hyst_parameters_t q = p;
    q.hysteresis_offset = -(1 << 30); /* INT32_MAX is now beyond any drive */
    commit(&q);
    (void)fake_board_run(7);
    TEST_ASSERT_EQUAL_UINT32(7, master_get(INDEX_unreachable));
    TEST_ASSERT_EQUAL_UINT32(17, master_get(INDEX_samples));
    master_command(COMMAND_CLEAR);
    (void)fake_board_run(1);
    TEST_ASSERT_EQUAL_UINT32(1, master_get(INDEX_samples));
    TEST_ASSERT_EQUAL_UINT32(1, master_get(INDEX_unreachable));
}

static void test_a_saturating_filter_is_counted(void) {
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    p.shape_sections = 1;
    p.shape[0] = (hyst_iir_section_t){.b0 = 4 * HYST_Q28_ONE};
    commit(&p);
    master_put(INDEX_mode, HYST_MODE_COMPENSATE);
    master_put(INDEX_setpoint, 1U << 30);
    master_put(INDEX_setpoint_slew, INT32_MAX);
    (void)fake_board_run(5);
    TEST_ASSERT_EQUAL_UINT32(5, master_get(INDEX_filter_saturated));
}

static void test_faults_first_sticky_live(void) {
    const loop_input_t good = {.position_code = 0}, late = {.faults = FAULT_OVERRUN},
                       blind = {.faults = FAULT_CONVERTER_TIMEOUT};
    (void)loop_sample(&good);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_fault_first));
    (void)loop_sample(&blind);
    TEST_ASSERT_EQUAL_UINT32(FAULT_CONVERTER_TIMEOUT, master_get(INDEX_faults_live));
    (void)loop_sample(&late);
    TEST_ASSERT_EQUAL_UINT32(FAULT_OVERRUN, master_get(INDEX_faults_live));
    (void)loop_sample(&good);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_faults_live));
    TEST_ASSERT_EQUAL_UINT32(FAULT_OVERRUN | FAULT_CONVERTER_TIMEOUT, master_get(INDEX_faults_sticky));
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(2, master_get(INDEX_fault_first), "the converter was first: bit 1, plus 1");
    TEST_ASSERT_EQUAL_UINT32(1, master_get(INDEX_overruns));
    TEST_ASSERT_EQUAL_UINT32(1, master_get(INDEX_converter_timeouts));
    master_command(COMMAND_CLEAR);
    (void)loop_sample(&good);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_faults_sticky));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_fault_first));
}

static void test_a_fault_of_the_start_stays_live(void) {
    fake_board_power_on(FAULT_CLOCK_FALLBACK);
    (void)fake_board_run(2);
    TEST_ASSERT_EQUAL_UINT32(4, master_get(INDEX_fault_first));
    master_command(COMMAND_CLEAR);
    (void)fake_board_run(1);
    TEST_ASSERT_EQUAL_UINT32(FAULT_CLOCK_FALLBACK, master_get(INDEX_faults_live));
    TEST_ASSERT_EQUAL_UINT32(FAULT_CLOCK_FALLBACK, master_get(INDEX_faults_sticky));
}

static void test_cost_last_and_worst(void) {
    static const uint32_t costs[] = {50, 900, 70};
    for (size_t i = 0; i < 3; i++) {
        fake_board.cost_per_look = costs[i];
        (void)fake_board_run(1);
        TEST_ASSERT_EQUAL_UINT32(costs[i], master_get(INDEX_cost_last));
    }
    TEST_ASSERT_EQUAL_UINT32(900, master_get(INDEX_cost_max));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_codes_over_the_whole_range);
    RUN_TEST(test_position_codes);
    RUN_TEST(test_parked_at_start);
    RUN_TEST(test_modes_change_without_a_step);
    RUN_TEST(test_stop_and_the_end_of_a_source_hold);
    RUN_TEST(test_stop_holds_what_is_on_its_way);
    RUN_TEST(test_a_sine_locks_the_harmonics);
    RUN_TEST(test_parking_stops_everything);
    RUN_TEST(test_conditioning_from_every_mode);
    RUN_TEST(test_conditioning_during_a_transition);
    RUN_TEST(test_conditioning_does_not_wait_for_slow_transitions);
    RUN_TEST(test_conditioning_from_a_running_sine);
    RUN_TEST(test_conditioning_keeps_to_the_slews);
    RUN_TEST(test_conditioning_erases_the_past);
    RUN_TEST(test_start_is_refused_while_conditioning_and_stop_ends_it);
    RUN_TEST(test_counters_count_and_clear);
    RUN_TEST(test_a_saturating_filter_is_counted);
    RUN_TEST(test_faults_first_sticky_live);
    RUN_TEST(test_a_fault_of_the_start_stays_live);
    RUN_TEST(test_cost_last_and_worst);
    return UNITY_END();
}
