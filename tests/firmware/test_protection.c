/* SPDX-License-Identifier: MIT */
/* What nobody may get past: the output range, the limits of the reference, temperature and supplies. */
#include "fake_board.h"
#include "loop/loop.h"
#include "master.h"
#include "protection/health_watch.h"
#include "random.h"
#include "unity.h"
#include <stdlib.h>

#define CODE_STEP (1 << 16)         /* of 16 bits, in Q31 */
#define LOOKS     HEALTH_WATCH_TURN /* samples between two looks at a channel */

static random_t rng;

void setUp(void) {
    fake_board_power_on(0);
}
void tearDown(void) {
}

static void set(unsigned index, int64_t value) {
    master_put(index, (uint32_t)value);
}

static void commit(hyst_q31_t low, hyst_q31_t high, hyst_q31_t park, uint32_t expected) {
    hyst_parameters_t p;
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    hyst_parameters_default(&p);
    p.drive_low = low;
    p.drive_high = high;
    p.drive_park = park;
    p.pi_operators = 1;
    p.pi_weight[0] = p.pi_weight[1] = HYST_Q28_ONE / 2;
    p.pi_threshold[0] = 1 << 28;
    master_write_words(ADDRESS_staging, words, hyst_parameters_encode(&p, words, HYST_IMAGE_MAX_WORDS));
    master_command(COMMAND_COMMIT);
    TEST_ASSERT_EQUAL_UINT32(expected, master_get(INDEX_fault_code));
}

/* A source of any kind, with settings of any kind. */
static void start_anything(void) {
    const uint32_t kind = (uint32_t)random_between(&rng, SOURCE_SINE, SOURCE_MULTISINE);
    uint32_t words[12];
    for (size_t i = 0; i < 12; i++) {
        words[i] = (uint32_t)random_bits(&rng);
    }
    words[0] = (uint32_t)random_between(&rng, 0, 40); /* samples of a line, or harmonics of 0, which are refused */
    words[2] = (uint32_t)random_between(&rng, 0, 40);
    words[3] = (uint32_t)random_between(&rng, 0, 3);
    (void)master_set(INDEX_command, COMMAND_STOP);
    (void)master_write(ADDRESS_waveform, 8, (const uint16_t *)words);
    master_write_words(kind == SOURCE_MULTISINE ? ADDRESS_tones : ADDRESS_waveform, words, 6);
    (void)master_set(INDEX_waveform_points, 2);
    (void)master_set(INDEX_source_tones, 2);
    (void)master_set(INDEX_source, kind);
    (void)master_set(INDEX_source_offset, (uint32_t)random_q31(&rng));
    (void)master_set(INDEX_source_amplitude, (uint32_t)random_q31(&rng));
    (void)master_set(INDEX_source_increment, (uint32_t)random_bits(&rng) >> random_between(&rng, 2, 16));
    (void)master_set(INDEX_sweep_increment, (uint32_t)random_bits(&rng) >> random_between(&rng, 2, 16));
    (void)master_set(INDEX_sweep_samples, (uint32_t)random_between(&rng, 1, 500));
    (void)master_set(INDEX_sweep_spacing, (uint32_t)random_between(&rng, 0, 1));
    (void)master_set(INDEX_command, COMMAND_START);
}

static void do_anything(void) {
    switch (random_between(&rng, 0, 7)) {
    case 0:
        (void)master_set(INDEX_setpoint, (uint32_t)random_q31(&rng));
        break;
    case 1:
        (void)master_set(INDEX_setpoint_slew, (uint32_t)random_q31(&rng) & INT32_MAX);
        break;
    case 2:
        (void)master_set(INDEX_mode, (uint32_t)random_between(&rng, HYST_MODE_PARK, HYST_MODE_COMPENSATE));
        break;
    case 3:
        (void)master_set(INDEX_command, COMMAND_STOP);
        break;
    default:
        start_anything();
        break;
    }
}

/* Asymmetric, and off the middle; changed while it moves; images of other ranges come and go. */
static void test_the_drive_stays_in_the_range_whatever_is_asked_for(void) {
    static const hyst_q31_t images[][2] = {
        {INT32_MIN, INT32_MAX}, {-(1 << 30), INT32_MAX}, {INT32_MIN, 1 << 30}, {-(1 << 29), 3 << 29}};
    hyst_q31_t image[2] = {INT32_MIN, INT32_MAX}, low = INT32_MIN, high = INT32_MAX, slew = FAKE_DRIVE_SLEW_MAX;
    hyst_q31_t last = fake_board_run(1);
    unsigned limited = 0, slow = 0;
    for (int round = 0; round < 3000; round++) {
        if (random_between(&rng, 0, 9) == 0) {
            const hyst_q31_t new_low = random_q31(&rng), new_high = random_q31(&rng);
            const uint16_t both[] = {(uint16_t)((uint32_t)new_low >> 16), (uint16_t)new_low,
                                     (uint16_t)((uint32_t)new_high >> 16), (uint16_t)new_high};
            const bool possible = new_low <= 0 && new_high >= 0 && new_low < new_high; /* parked at 0 */
            TEST_ASSERT_EQUAL(possible ? MODBUS_OK : MODBUS_ILLEGAL_VALUE, master_write(ADDRESS_drive_low, 4, both));
            low = possible ? new_low : low;
            high = possible ? new_high : high;
        } else if (random_between(&rng, 0, 9) == 0) {
            const size_t which = (size_t)random_between(&rng, 0, 3);
            commit(images[which][0], images[which][1], 0, HYST_PARAMETERS_OK);
            image[0] = images[which][0];
            image[1] = images[which][1];
        } else if (random_between(&rng, 0, 9) == 0) {
            const hyst_q31_t new_slew = random_q31(&rng) >> random_between(&rng, 0, 10);
            const bool possible = new_slew >= FAKE_FAULT_SLEW_MIN && new_slew <= FAKE_DRIVE_SLEW_MAX;
            TEST_ASSERT_EQUAL(possible ? MODBUS_OK : MODBUS_ILLEGAL_VALUE,
                              master_set(INDEX_drive_slew, (uint32_t)new_slew));
            slew = possible ? new_slew : slew;
        } else if (random_between(&rng, 0, 19) == 0) {
            (void)master_set(INDEX_command, COMMAND_CONDITION);
        } else {
            do_anything();
        }
        const hyst_q31_t from = low > image[0] ? low : image[0], to = high < image[1] ? high : image[1];
        for (int i = 0; i < 40; i++) {
            const hyst_q31_t drive = fake_board_run(1);
            TEST_ASSERT_INT32_WITHIN(slew + CODE_STEP, last, drive);
            /* What was outside comes back, and nothing goes out. */
            TEST_ASSERT_GREATER_OR_EQUAL_INT64((int64_t)(last < from ? last : from) - CODE_STEP, drive);
            TEST_ASSERT_LESS_OR_EQUAL_INT64((int64_t)(last > to ? last : to) + CODE_STEP, drive);
            last = drive;
        }
        limited += (master_get(INDEX_limits_live) & LIMIT_DRIVE) != 0 ? 1U : 0U;
        slow += slew < FAKE_DRIVE_SLEW_MAX && (master_get(INDEX_limits_live) & LIMIT_SLEW) != 0 ? 1U : 0U;
    }
    TEST_ASSERT_GREATER_THAN_UINT_MESSAGE(100, limited, "the range was hardly ever met");
    TEST_ASSERT_GREATER_THAN_UINT_MESSAGE(100, slow, "the largest step was hardly ever met");
}

static void test_a_range_without_the_parking_drive_is_refused(void) {
    set(INDEX_drive_high, 1 << 28);
    set(INDEX_drive_low, -(1 << 30));
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_drive_low, 1)); /* parked at 0 */
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_drive_high, UINT32_MAX));
    const uint16_t swapped[] = {0x1000, 0, 0xF000, 0};
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_write(ADDRESS_drive_low, 4, swapped));
    commit(INT32_MIN, INT32_MAX, (1 << 28) + 1, HYST_PARAMETERS_INCONSISTENT);
    TEST_ASSERT_EQUAL_UINT32(HYST_FIELD_DRIVE_PARK, master_get(INDEX_fault_field));
    commit(INT32_MIN, INT32_MAX, 1 << 28, HYST_PARAMETERS_OK);
}

/* Steps of the reference, from the first sample of whatever source on. */
static void test_the_reference_is_held_back_whatever_its_source(void) {
    static const int32_t slews[] = {1, 1000, 1 << 20, 1 << 26, INT32_MAX};
    bool was_held = false, was_free = false;
    for (int run = 0; run < 40; run++) {
        fake_board_power_on(0);
        const hyst_q31_t low = -(random_q31(&rng) & INT32_MAX) / 2, high = (random_q31(&rng) & INT32_MAX) / 2;
        const int32_t slew = slews[run % 5];
        set(INDEX_reference_low, low);
        set(INDEX_reference_high, high);
        set(INDEX_reference_slew, slew);
        TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_reference_high, (uint32_t)(low - 1)));
        TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_reference_slew, 0));
        set(INDEX_mode, HYST_MODE_LINEAR);
        (void)fake_board_run(FAKE_LATENCY + 2);
        telemetry_t t;
        telemetry_read(&t);
        hyst_q31_t last = t.reference;
        int driven = 0; /* samples since it was parked, where the reference means nothing */
        for (int round = 0; round < 100; round++) {
            do_anything();
            for (int i = 0; i < 40; i++) {
                (void)fake_board_run(1);
                telemetry_read(&t);
                driven = t.active_mode == HYST_MODE_PARK ? 0 : driven + 1;
                TEST_ASSERT_TRUE(driven <= FAKE_LATENCY + 1 || llabs((long long)t.reference - last) <= slew);
                TEST_ASSERT_TRUE(t.reference >= low && t.reference <= high);
                was_held = was_held || (t.limits_live & LIMIT_REFERENCE) != 0;
                was_free = was_free || (t.limits_live & LIMIT_REFERENCE) == 0;
                last = t.reference;
            }
        }
        TEST_ASSERT_TRUE((master_get(INDEX_limits_sticky) & LIMIT_REFERENCE) == 0 ||
                         master_get(INDEX_reference_limited) > 0);
    }
    TEST_ASSERT_TRUE(was_held && was_free);
}

/* Stopping holds the reference where it is, not where the source had got to. */
static void test_stopping_a_source_that_is_held_back_holds(void) {
    set(INDEX_reference_slew, 1 << 16);
    set(INDEX_mode, HYST_MODE_DIRECT);
    set(INDEX_source, SOURCE_SINE);
    set(INDEX_source_offset, 1 << 30);
    set(INDEX_source_increment, 1 << 20);
    master_command(COMMAND_START);
    const hyst_q31_t drive = fake_board_run(1000);
    TEST_ASSERT_EQUAL_INT32(1000 << 16, drive);
    master_command(COMMAND_STOP);
    TEST_ASSERT_EQUAL_INT32(drive, fake_board_run(1));
    TEST_ASSERT_EQUAL_INT32(drive, fake_board_run(1000));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_limits_live));
}

/* New limits that exclude the reference: it comes back by its slew. */
static void test_a_reference_outside_of_new_limits_comes_back_by_its_slew(void) {
    set(INDEX_mode, HYST_MODE_DIRECT);
    set(INDEX_setpoint_slew, INT32_MAX);
    set(INDEX_setpoint, 1 << 30);
    (void)fake_board_run(3000); /* and the transition is over */
    set(INDEX_reference_slew, 1 << 24);
    set(INDEX_reference_high, 0);
    hyst_q31_t last = 1 << 30;
    for (int i = 0; i < 64; i++) {
        const hyst_q31_t drive = fake_board_run(1);
        TEST_ASSERT_EQUAL_INT32(last - (1 << 24), drive);
        last = drive;
    }
    TEST_ASSERT_EQUAL_INT32(0, fake_board_run(100));
}

static void hold_somewhere(void) {
    set(INDEX_mode, HYST_MODE_DIRECT);
    set(INDEX_setpoint, 1 << 30);
    (void)fake_board_run(3000);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, master_get(INDEX_amplifier_state));
}

/* One look fewer than the count, any number of times, is nothing; as many as that trip, by a ramp. */
static void expect_trip(health_channel_t channel, int32_t bad, uint32_t fault) {
    const int32_t good = fake_board.health[channel];
    hold_somewhere();
    for (int i = 0; i < 20; i++) {
        fake_board.health[channel] = bad;
        (void)fake_board_run((HEALTH_WATCH_LOOKS - 1U) * LOOKS);
        fake_board.health[channel] = good;
        (void)fake_board_run(LOOKS);
    }
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, master_get(INDEX_amplifier_state));
    fake_board.health[channel] = bad;
    (void)fake_board_run(HEALTH_WATCH_LOOKS * LOOKS);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, master_get(INDEX_amplifier_state));
    TEST_ASSERT_EQUAL_HEX32(fault, 1U << (master_get(INDEX_trip_cause) - 1U));
    TEST_ASSERT_EQUAL_HEX32(fault, master_get(INDEX_faults_live));
    TEST_ASSERT_EQUAL_INT32(0, fake_board_run(5000)); /* parked */
    TEST_ASSERT_FALSE(fake_board.stage_enabled);
    master_command(COMMAND_STOP);
    (void)fake_board_run(5);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, master_get(INDEX_amplifier_state));
}

static void expect_arming_after(health_channel_t channel, int32_t good) {
    fake_board.health[channel] = good;
    (void)fake_board_run(LOOKS);
    master_command(COMMAND_ARM);
    (void)fake_board_run(3000);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, master_get(INDEX_amplifier_state));
}

static void test_heat_trips_and_holds_off_arming_while_it_lasts(void) {
    expect_trip(HEALTH_TEMPERATURE, 80001, FAULT_TEMPERATURE);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM));
    expect_arming_after(HEALTH_TEMPERATURE, 60000);
}

static void test_a_supply_outside_of_its_limits_trips(void) {
    expect_trip(HEALTH_SUPPLY, 2999, FAULT_SUPPLY);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM));
    expect_arming_after(HEALTH_SUPPLY, 3300);
    expect_trip(HEALTH_SUPPLY, 3601, FAULT_SUPPLY);
}

static void test_the_stages_supply_counts_while_it_is_up(void) {
    expect_trip(HEALTH_HIGH_VOLTAGE, 149999, FAULT_HIGH_VOLTAGE);
    fake_board.health[HEALTH_HIGH_VOLTAGE] = 0; /* off: there is none, and nothing is wrong with that */
    (void)fake_board_run(20 * HEALTH_WATCH_LOOKS * LOOKS);
    expect_arming_after(HEALTH_HIGH_VOLTAGE, 160000);
    expect_trip(HEALTH_HIGH_VOLTAGE, 170001, FAULT_HIGH_VOLTAGE);
}

static void arm_without_the_stages_supply(void) {
    master_command(COMMAND_DISARM);
    (void)fake_board_run(5000);
    fake_board.health[HEALTH_HIGH_VOLTAGE] = 0;
    (void)fake_board_run(LOOKS);
    master_command(COMMAND_ARM);
    set(INDEX_mode, HYST_MODE_DIRECT);
    set(INDEX_setpoint, 1 << 30);
}

enum { SELF_TEST = POWER_SELF_TEST_MS * 1000 / FAKE_SAMPLE_US };

/* Precharge waits for a stage that comes up late. */
static void test_a_stage_that_comes_up_late(void) {
    arm_without_the_stages_supply();
    for (unsigned i = 0; i < SELF_TEST - LOOKS; i++) {
        TEST_ASSERT_EQUAL_INT32(0, fake_board_run(1));
        TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_PRECHARGE, master_get(INDEX_amplifier_state));
    }
    fake_board.health[HEALTH_HIGH_VOLTAGE] = FAKE_HIGH_VOLTAGE;
    (void)fake_board_run(LOOKS);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_faults_sticky));
    (void)fake_board_run(3000);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, master_get(INDEX_amplifier_state));
}

/* One that does not come up is a fault of its own, and the drive has not moved. */
static void test_a_stage_that_does_not_come_up(void) {
    arm_without_the_stages_supply();
    TEST_ASSERT_EQUAL_INT32(0, fake_board_run(SELF_TEST - 1U));
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_PRECHARGE, master_get(INDEX_amplifier_state));
    TEST_ASSERT_TRUE(fake_board.stage_enabled);
    TEST_ASSERT_EQUAL_INT32(0, fake_board_run(3));
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, master_get(INDEX_amplifier_state));
    TEST_ASSERT_FALSE(fake_board.stage_enabled);
    TEST_ASSERT_EQUAL_HEX32(FAULT_HIGH_VOLTAGE, 1U << (master_get(INDEX_trip_cause) - 1U));
    master_command(COMMAND_STOP);
    (void)fake_board_run(3);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, master_get(INDEX_amplifier_state));
}

static void test_the_alert_warns_and_stops_nothing(void) {
    static const int32_t warm[] = {70001, HEALTH_COLDEST - 1};
    for (int i = 0; i < 2; i++) {
        fake_board_power_on(0);
        hold_somewhere();
        fake_board.health[HEALTH_TEMPERATURE] = warm[i];
        (void)fake_board_run((HEALTH_WATCH_LOOKS - 1U) * LOOKS);
        TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_warnings_sticky) & WARNING_TEMPERATURE);
        (void)fake_board_run(LOOKS);
        TEST_ASSERT_EQUAL_UINT32(WARNING_TEMPERATURE, master_get(INDEX_warnings_live) & WARNING_TEMPERATURE);
        TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, master_get(INDEX_amplifier_state));
        TEST_ASSERT_EQUAL_INT32(warm[i], (int32_t)master_get(INDEX_temperature));
        fake_board.health[HEALTH_TEMPERATURE] = FAKE_TEMPERATURE;
        (void)fake_board_run(LOOKS);
        TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_warnings_live) & WARNING_TEMPERATURE);
        TEST_ASSERT_EQUAL_UINT32(WARNING_TEMPERATURE, master_get(INDEX_warnings_sticky) & WARNING_TEMPERATURE);
    }
}

static void test_limits_and_the_debounce_are_registers(void) {
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_health_looks, 0));
    set(INDEX_health_looks, 2);
    set(INDEX_temperature_trip, FAKE_TEMPERATURE - 1);
    hyst_q31_t drive = 0;
    set(INDEX_mode, HYST_MODE_DIRECT);
    drive = fake_board_run(3U * LOOKS);
    TEST_ASSERT_EQUAL_INT32(0, drive);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_FAULT, master_get(INDEX_amplifier_state));
}

/* A master that writes limits all the time, the same or others. */
static void test_writing_limits_holds_no_trip_off(void) {
    static const unsigned indices[] = {INDEX_temperature_alert, INDEX_temperature_trip, INDEX_supply_low,
                                       INDEX_health_looks};
    static const int32_t values[][2] = {{60000, 70000}, {79999, 80000}, {3000, 3100}, {10, 11}};
    for (unsigned i = 0; i < sizeof indices / sizeof indices[0]; i++) {
        fake_board_power_on(0);
        hold_somewhere();
        fake_board.health[HEALTH_TEMPERATURE] = 150000;
        for (unsigned look = 0; look < HEALTH_WATCH_LOOKS + 2U; look++) {
            set(indices[i], values[i][look % 2U]);
            (void)fake_board_run(LOOKS);
        }
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(AMPLIFIER_FAULT, master_get(INDEX_amplifier_state),
                                         register_table[indices[i]].name);
        set(indices[i], values[i][0]);
        TEST_ASSERT_EQUAL_MESSAGE(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM), "still too hot");
    }
}

/* What the board can stand is not for a register to say. */
static void test_limits_are_within_the_boards(void) {
    static const struct {
        unsigned index;
        int32_t last, beyond;
    } bounds[] = {{INDEX_temperature_alert, 80000, 80001},
                  {INDEX_temperature_trip, 80000, 80001},
                  {INDEX_temperature_trip, INT32_MIN, INT32_MAX},
                  {INDEX_supply_low, 3000, 2999},
                  {INDEX_supply_high, 3600, 3601},
                  {INDEX_high_voltage_low, 150000, 149999},
                  {INDEX_high_voltage_high, 170000, 170001},
                  {INDEX_health_looks, HEALTH_WATCH_LOOKS_MAX, 101}};
    for (unsigned i = 0; i < sizeof bounds / sizeof bounds[0]; i++) {
        set(bounds[i].index, bounds[i].last);
        TEST_ASSERT_EQUAL_MESSAGE(MODBUS_ILLEGAL_VALUE, master_set(bounds[i].index, (uint32_t)bounds[i].beyond),
                                  register_table[bounds[i].index].name);
    }
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_health_looks, UINT16_MAX));
}

/* A sensor, or the converter behind it, that was there and is no more. */
static void test_a_reading_that_vanishes(void) {
    hold_somewhere();
    fake_board.health[HEALTH_TEMPERATURE] = HEALTH_ABSENT;
    (void)fake_board_run((HEALTH_WATCH_LOOKS + 1U) * LOOKS);
    TEST_ASSERT_EQUAL_UINT32(WARNING_TEMPERATURE, master_get(INDEX_warnings_live) & WARNING_TEMPERATURE);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, master_get(INDEX_amplifier_state));
    fake_board.health[HEALTH_TEMPERATURE] = FAKE_TEMPERATURE;
    (void)fake_board_run(LOOKS);
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_warnings_live) & WARNING_TEMPERATURE);
    expect_trip(HEALTH_SUPPLY, HEALTH_ABSENT, FAULT_SUPPLY);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM));
    expect_arming_after(HEALTH_SUPPLY, FAKE_SUPPLY);
    expect_trip(HEALTH_HIGH_VOLTAGE, HEALTH_ABSENT, FAULT_HIGH_VOLTAGE);
    master_command(COMMAND_ARM); /* the self test finds that it is not back */
    (void)fake_board_run(2 * SELF_TEST);
    TEST_ASSERT_EQUAL_HEX32(FAULT_HIGH_VOLTAGE, 1U << (master_get(INDEX_trip_cause) - 1U));
}

/* The drive's converter does not hold what it was given. A few looks, any number of times, are nothing. */
static void test_a_drive_converter_that_is_stuck_trips(void) {
    hold_somewhere();
    for (int i = 0; i < 20; i++) {
        fake_board.output_stuck = true;
        (void)fake_board_run((HEALTH_WATCH_LOOKS - 1U) * LOOKS);
        fake_board.output_stuck = false;
        (void)fake_board_run(LOOKS);
    }
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, master_get(INDEX_amplifier_state));
    fake_board.output_stuck = true;
    (void)fake_board_run(HEALTH_WATCH_LOOKS * LOOKS);
    TEST_ASSERT_EQUAL_HEX32(FAULT_OUTPUT, 1U << (master_get(INDEX_trip_cause) - 1U));
    (void)fake_board_run(5000);
    TEST_ASSERT_FALSE_MESSAGE(fake_board.stage_enabled, "the only way to make a stuck output safe");
    master_command(COMMAND_STOP);
    (void)fake_board_run(5);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM));
    fake_board.output_stuck = false;
    (void)fake_board_run(LOOKS);
    master_command(COMMAND_ARM);
    (void)fake_board_run(3000);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, master_get(INDEX_amplifier_state));
}

static void test_what_a_board_does_not_have_is_never_wrong(void) {
    for (int i = 0; i < HEALTH_CHANNELS; i++) {
        fake_board.health[i] = HEALTH_ABSENT;
    }
    health_watch_init(); /* as from the start */
    hold_somewhere();
    (void)fake_board_run(10U * HEALTH_WATCH_LOOKS * LOOKS);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_HOLD, master_get(INDEX_amplifier_state));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_warnings_sticky) & WARNING_TEMPERATURE);
    TEST_ASSERT_EQUAL_INT32(HEALTH_ABSENT, (int32_t)master_get(INDEX_high_voltage));
}

/* The largest step since start or clear, whatever made it. */
static void test_the_peak_of_the_current(void) {
    hold_somewhere();
    master_command(COMMAND_CLEAR);
    TEST_ASSERT_EQUAL_INT32(0, (int32_t)master_get(INDEX_current_peak));
    set(INDEX_setpoint_slew, 12345678);
    set(INDEX_setpoint, -(1 << 30));
    (void)fake_board_run(50);
    TEST_ASSERT_EQUAL_INT32(12345678, (int32_t)master_get(INDEX_current_peak));
    set(INDEX_setpoint_slew, 1 << 20);
    (void)fake_board_run(500);
    TEST_ASSERT_EQUAL_INT32(12345678, (int32_t)master_get(INDEX_current_peak));
    set(INDEX_setpoint_slew, INT32_MAX);
    set(INDEX_reference_slew, INT32_MAX);
    set(INDEX_setpoint, 1 << 30);
    (void)fake_board_run(50);
    TEST_ASSERT_EQUAL_INT32_MESSAGE(FAKE_DRIVE_SLEW_MAX, (int32_t)master_get(INDEX_current_peak), "the board's");
}

/* To and fro by this step from sample to sample. */
static void begin_moving(hyst_q31_t step) {
    set(INDEX_mode, HYST_MODE_DIRECT);
    set(INDEX_setpoint_slew, (uint32_t)step);
}

static void move(unsigned sample) {
    if (sample % 16 == 0) {
        set(INDEX_setpoint, (uint32_t)(sample % 32 == 0 ? 1 << 30 : -(1 << 30)));
    }
    (void)fake_board_run(1);
}

/* Over the whole register: the trip comes in the sample after the one whose average that can be read is above the
 * limit, and nowhere else. */
static void test_the_limit_of_the_average_current_means_what_it_says(void) {
    static const int32_t limits[] = {1,       2047,    2048,    5000,       1 << 20,    (1 << 24) - 1,
                                     1 << 29, 1 << 30, 3 << 29, 0x5FFFFFFF, 0x40000001, INT32_MAX};
    static const int32_t steps[] = {1 << 10, 1 << 12, 1 << 21, 1 << 25, FAKE_DRIVE_SLEW_MAX};
    unsigned trips = 0;
    for (size_t i = 0; i < sizeof limits / sizeof limits[0]; i++) {
        for (size_t k = 0; k < sizeof steps / sizeof steps[0]; k++) {
            fake_board_power_on(0);
            (void)fake_board_run(60000); /* of what the way to park has left, nothing that counts */
            set(INDEX_current_limit, limits[i]);
            begin_moving(steps[k]);
            bool above = false;
            for (unsigned n = 0; n < 6000 && !loop_in_fault(); n++) {
                above = loop_current_average() > limits[i];
                move(n);
                TEST_ASSERT_EQUAL_MESSAGE(above, loop_in_fault(), "the limit means another");
            }
            trips += above ? 1U : 0U;
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT(10, trips);
}

/* What is left of the average at rest is no current. */
static void test_the_smallest_limit_of_the_current_lets_it_rest(void) {
    begin_moving(1 << 25);
    for (unsigned n = 0; n < 2000; n++) {
        move(n);
    }
    master_command(COMMAND_STOP);
    (void)fake_board_run(200000);
    TEST_ASSERT_EQUAL_INT32(0, loop_current_average());
    set(INDEX_current_limit, 1);
    (void)fake_board_run(1000);
    TEST_ASSERT_FALSE(loop_in_fault());
    move(0);
    move(1);
    move(2);
    TEST_ASSERT_TRUE(loop_in_fault());
}

int main(void) {
    rng = random_start("firmware_protection", 20261125);
    UNITY_BEGIN();
    RUN_TEST(test_the_drive_stays_in_the_range_whatever_is_asked_for);
    RUN_TEST(test_a_range_without_the_parking_drive_is_refused);
    RUN_TEST(test_the_reference_is_held_back_whatever_its_source);
    RUN_TEST(test_stopping_a_source_that_is_held_back_holds);
    RUN_TEST(test_a_reference_outside_of_new_limits_comes_back_by_its_slew);
    RUN_TEST(test_heat_trips_and_holds_off_arming_while_it_lasts);
    RUN_TEST(test_a_supply_outside_of_its_limits_trips);
    RUN_TEST(test_the_stages_supply_counts_while_it_is_up);
    RUN_TEST(test_a_stage_that_comes_up_late);
    RUN_TEST(test_a_stage_that_does_not_come_up);
    RUN_TEST(test_the_alert_warns_and_stops_nothing);
    RUN_TEST(test_limits_and_the_debounce_are_registers);
    RUN_TEST(test_writing_limits_holds_no_trip_off);
    RUN_TEST(test_limits_are_within_the_boards);
    RUN_TEST(test_a_reading_that_vanishes);
    RUN_TEST(test_a_drive_converter_that_is_stuck_trips);
    RUN_TEST(test_the_peak_of_the_current);
    RUN_TEST(test_what_a_board_does_not_have_is_never_wrong);
    RUN_TEST(test_the_limit_of_the_average_current_means_what_it_says);
    RUN_TEST(test_the_smallest_limit_of_the_current_lets_it_rest);
    return UNITY_END();
}
