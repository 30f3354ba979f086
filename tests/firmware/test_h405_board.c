/* SPDX-License-Identifier: MIT */
/*
 * The h405's own files on a chip made of variables (fake_chip.h): what the emulator cannot show, because it has no
 * clocks, no supply, no factory values and no output register. That the chip does what the variables do is RM0090's
 * word, and was not seen on silicon.
 */
#include "board.h"
#include "clock.h"
#include "fake_chip.h"
#include "loop/loop.h"
#include "modbus_line.h"
#include "random.h"
#include "startup.h"
#include "supply.h"
#include "unity.h"

static loop_input_t seen;
static uint16_t next_code;
static uint32_t bus_hz;       /* of the bus that the Modbus line sits on */
static bool ends_in_the_loop; /* a conversion, while the loop computes */

/* In place of the application and of what is not the board's. */
uint16_t loop_sample(const loop_input_t *input) {
    seen = *input;
    if (ends_in_the_loop) {
        fake_chip.looks_to_position = 1;
        (void)fake_adc();
    }
    return next_code;
}

void modbus_line_init(uint32_t apb2_hz, bool half_duplex) {
    (void)half_duplex;
    bus_hz = apb2_hz;
}

last_run_t last_run_take(bool power_came_on) {
    (void)power_came_on;
    return (last_run_t){0};
}

void setUp(void) {
    fake_chip_power_on();
    next_code = 0;
    ends_in_the_loop = false;
}
void tearDown(void) {
}

static void test_crystal_makes_the_full_clock(void) {
    const board_start_t start = board_init();
    TEST_ASSERT_EQUAL_HEX16(0, start.faults);
    TEST_ASSERT_EQUAL_UINT32(168000000, board_core_hz());
    TEST_ASSERT_EQUAL_UINT32(84000000, bus_hz);
    TEST_ASSERT_BITS_HIGH(RCC_CR_CSSON, fake_chip.rcc.CR);
    TEST_ASSERT_BITS_HIGH(PWR_CR_VOS, fake_chip.pwr.CR);
    TEST_ASSERT_FALSE(fake_chip.too_fast);
}

static void test_without_a_crystal_the_internal_oscillator_drives_the_pll(void) {
    fake_chip.crystal = false;
    TEST_ASSERT_EQUAL_HEX16(FAULT_CLOCK_FALLBACK, board_init().faults);
    TEST_ASSERT_EQUAL_UINT32(168000000, board_core_hz());
    TEST_ASSERT_BITS_LOW(RCC_CR_CSSON, fake_chip.rcc.CR); /* nothing to watch */
}

static void test_without_a_pll_all_rates_are_those_of_16_mhz(void) {
    fake_chip.pll = false;
    TEST_ASSERT_EQUAL_HEX16(FAULT_CLOCK_FALLBACK, board_init().faults);
    TEST_ASSERT_EQUAL_UINT32(16000000, board_core_hz());
    TEST_ASSERT_EQUAL_UINT32(16000000, bus_hz);
    TEST_ASSERT_EQUAL_HEX32(0, fake_chip.rcc.CFGR);
}

static void test_without_a_supply_the_clock_is_left_alone(void) {
    fake_chip.low_supply = true;
    TEST_ASSERT_EQUAL_HEX16(FAULT_CLOCK_FALLBACK | FAULT_SUPPLY, board_init().faults);
    TEST_ASSERT_EQUAL_UINT32(16000000, board_core_hz());
    TEST_ASSERT_EQUAL_HEX32(0, fake_chip.rcc.CR);
    TEST_ASSERT_EQUAL_HEX32(0, fake_chip.rcc.CFGR);
}

static void test_a_low_supply_writes_no_option_bytes(void) {
    fake_chip.flash.OPTCR = FLASH_OPTCR_BOR_MASK;
    fake_chip.low_supply = true;
    (void)board_init();
    TEST_ASSERT_EQUAL_HEX32(FLASH_OPTCR_BOR_MASK, fake_chip.flash.OPTCR);
    fake_chip_power_on();
    fake_chip.flash.OPTCR = FLASH_OPTCR_BOR_MASK;
    (void)board_init();
    TEST_ASSERT_BITS_LOW(FLASH_OPTCR_BOR_MASK, fake_chip.flash.OPTCR);
    TEST_ASSERT_BITS_HIGH(FLASH_OPTCR_OPTLOCK, fake_chip.flash.OPTCR);
}

/* RM0090 3.5.1: read the wait states back before the clock goes up. */
static void test_flash_that_takes_no_wait_states_gets_no_fast_clock(void) {
    fake_chip.wait_states = false;
    TEST_ASSERT_EQUAL_HEX16(FAULT_CLOCK_FALLBACK, board_init().faults);
    TEST_ASSERT_FALSE(fake_chip.too_fast);
    TEST_ASSERT_EQUAL_UINT32(16000000, board_core_hz());
}

static void started(void) {
    (void)board_init();
    board_start(0);
}

static void sample(uint16_t position, unsigned looks) {
    fake_chip.adc.DR = position;
    fake_chip.looks_to_position = looks;
    fake_chip.cycles += 168000000U / SAMPLE_RATE_HZ;
    tim2_handler();
    fake_chip.adc_flags &= ~(uint32_t)ADC_SR_EOC; /* the position was read, if it was there */
}

static void test_a_position_that_does_not_come_is_the_last_one_and_a_fault(void) {
    started();
    sample(0x123, 1);
    TEST_ASSERT_EQUAL_HEX16(0x1230, seen.position_code);
    TEST_ASSERT_EQUAL_HEX32(0, seen.faults);
    sample(0x456, 0);
    TEST_ASSERT_EQUAL_HEX16(0x1230, seen.position_code);
    TEST_ASSERT_EQUAL_HEX32(FAULT_CONVERTER_TIMEOUT, seen.faults);
    TEST_ASSERT_BITS_HIGH(ADC_CR2_SWSTART, fake_chip.adc.CR2);
    sample(0x789, 1);
    TEST_ASSERT_EQUAL_HEX16(0x7890, seen.position_code);
    TEST_ASSERT_EQUAL_HEX32(0, seen.faults);
}

/* It is not the next sample's: that one has to wait for its own, and to say that it did not come. */
static void test_a_conversion_that_ends_too_late_is_dropped(void) {
    started();
    sample(0x123, 1);
    ends_in_the_loop = true;
    fake_chip.adc.DR = 0x456;
    fake_chip.cycles += 168000000U / SAMPLE_RATE_HZ;
    tim2_handler();
    TEST_ASSERT_EQUAL_HEX32(FAULT_CONVERTER_TIMEOUT, seen.faults);
    fake_chip.cycles += 168000000U / SAMPLE_RATE_HZ;
    tim2_handler();
    TEST_ASSERT_EQUAL_HEX32(FAULT_CONVERTER_TIMEOUT, seen.faults);
    TEST_ASSERT_EQUAL_HEX16(0x1230, seen.position_code);
}

/* An interrupt belongs to the newest update before it, however late it comes, and time is the number of updates. */
static void test_periods_are_counted_however_late_the_interrupts_are(void) {
    enum { PERIOD = 168000000U / SAMPLE_RATE_HZ, INTERRUPTS = 100000 };
    random_t random = random_start("h405_periods", 20261125);
    started();
    const uint32_t start_us = board_microseconds();
    uint32_t updates = 0; /* that the last interrupt saw */
    uint64_t now = 0;     /* cycles since the start */
    for (unsigned i = 0; i < INTERRUPTS; i++) {
        const uint64_t soonest = now > (updates + 1ULL) * PERIOD ? now : (updates + 1ULL) * PERIOD;
        now = soonest + (uint32_t)random_between(&random, 12, i % 4 == 0 ? 3 * PERIOD : PERIOD / 2);
        fake_chip.cycles = (uint32_t)now;
        fake_chip.tim2.CNT = (uint32_t)(now % PERIOD / 2U);
        fake_chip.looks_to_position = 1;
        tim2_handler();
        const uint32_t seen_updates = (uint32_t)(now / PERIOD);
        TEST_ASSERT_EQUAL_UINT32(seen_updates - updates - 1U, seen.missed);
        TEST_ASSERT_EQUAL_HEX32(seen.missed > 0 ? FAULT_OVERRUN : 0U, seen.faults & FAULT_OVERRUN);
        TEST_ASSERT_EQUAL_UINT32(seen_updates * (1000000U / SAMPLE_RATE_HZ), board_microseconds() - start_us);
        updates = seen_updates;
    }
}

static void convert(uint32_t reading) {
    (void)fake_adc();
    fake_chip.adc_flags |= ADC_SR_JEOC;
    fake_chip.adc.SR = fake_chip.adc_flags;
    fake_chip.adc.JDR1 = reading;
    board_health_convert();
}

static void test_temperature_and_supply_by_the_factory_values(void) {
    started();
    for (unsigned i = 0; i < 4; i++) {
        const bool temperature = fake_chip.adc.JSQR == ADC_JSQR_SINGLE(16U);
        convert(temperature ? 1190 : 1500);
    }
    TEST_ASSERT_EQUAL_INT32(3300, board_health(HEALTH_SUPPLY));
    TEST_ASSERT_EQUAL_INT32(110000, board_health(HEALTH_TEMPERATURE));
    TEST_ASSERT_EQUAL_INT32(HEALTH_ABSENT, board_health(HEALTH_HIGH_VOLTAGE));
}

static void test_health_that_is_not_converted_any_more_vanishes(void) {
    started();
    for (unsigned i = 0; i < 4; i++) {
        convert(1500);
    }
    TEST_ASSERT_NOT_EQUAL(HEALTH_ABSENT, board_health(HEALTH_SUPPLY));
    unsigned looks = 0;
    while (board_health(HEALTH_SUPPLY) != HEALTH_ABSENT && looks < 100) {
        board_health_convert();
        looks++;
    }
    TEST_ASSERT_LESS_OR_EQUAL_UINT(8, looks); /* three waits of a look each, for each of both channels */
    TEST_ASSERT_EQUAL_INT32(HEALTH_ABSENT, board_health(HEALTH_TEMPERATURE));
}

static void test_output_follows_only_what_the_converter_holds(void) {
    started();
    next_code = 0xABC0;
    sample(0, 1);
    fake_chip.dac.DOR1 = 0xABC;
    TEST_ASSERT_TRUE(board_output_follows());
    for (unsigned bit = 0; bit < 12; bit++) {
        fake_chip.dac.DOR1 = 0xABCU ^ 1U << bit;
        TEST_ASSERT_FALSE(board_output_follows());
    }
}

/* Under 2.7 V the flash may not be written 32 bits at a time. */
static void test_a_low_supply_erases_nothing(void) {
    TEST_ASSERT_TRUE(board_store_erase(0));
    TEST_ASSERT_EQUAL_UINT(1, fake_chip.erased);
    fake_chip.low_supply = true;
    TEST_ASSERT_FALSE(board_store_erase(0));
    TEST_ASSERT_EQUAL_UINT(1, fake_chip.erased);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_crystal_makes_the_full_clock);
    RUN_TEST(test_without_a_crystal_the_internal_oscillator_drives_the_pll);
    RUN_TEST(test_without_a_pll_all_rates_are_those_of_16_mhz);
    RUN_TEST(test_without_a_supply_the_clock_is_left_alone);
    RUN_TEST(test_a_low_supply_writes_no_option_bytes);
    RUN_TEST(test_flash_that_takes_no_wait_states_gets_no_fast_clock);
    RUN_TEST(test_a_position_that_does_not_come_is_the_last_one_and_a_fault);
    RUN_TEST(test_a_conversion_that_ends_too_late_is_dropped);
    RUN_TEST(test_periods_are_counted_however_late_the_interrupts_are);
    RUN_TEST(test_temperature_and_supply_by_the_factory_values);
    RUN_TEST(test_health_that_is_not_converted_any_more_vanishes);
    RUN_TEST(test_output_follows_only_what_the_converter_holds);
    RUN_TEST(test_a_low_supply_erases_nothing);
    return UNITY_END();
}
