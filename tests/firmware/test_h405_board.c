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
static bool power_came_on;    /* what last_run_take was given */
static last_run_t last_run;

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

last_run_t last_run_take(bool power) {
    power_came_on = power;
    return last_run;
}

void setUp(void) {
    fake_chip_power_on();
    next_code = 0;
    ends_in_the_loop = false;
    last_run = (last_run_t){0};
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

/* RM0090 7.3.21: each reset adds its flags to those that are there, and pulls the reset pin down, whatever it is. */
static void expect_cause(uint32_t flags, uint16_t cause) {
    fake_chip.rcc.CSR |= flags;
    const board_start_t start = board_init();
    TEST_ASSERT_EQUAL_HEX16(cause, start.reset_cause);
    TEST_ASSERT_EQUAL((cause & RESET_POWER) != 0, power_came_on);
}

static void test_why_it_was_reset(void) {
    expect_cause(RCC_CSR_PORRSTF | RCC_CSR_BORRSTF | RCC_CSR_PINRSTF, RESET_POWER);
    expect_cause(RCC_CSR_IWDGRSTF | RCC_CSR_PINRSTF, RESET_WATCHDOG);
    expect_cause(RCC_CSR_SFTRSTF | RCC_CSR_PINRSTF, RESET_SOFTWARE);
    expect_cause(RCC_CSR_PINRSTF, RESET_PIN);
    expect_cause(RCC_CSR_BORRSTF | RCC_CSR_PINRSTF, RESET_POWER);
    /* Two of them before the processor could read any, as when the supply sags in the watchdog's reset. */
    expect_cause(RCC_CSR_IWDGRSTF | RCC_CSR_BORRSTF | RCC_CSR_PINRSTF, RESET_WATCHDOG | RESET_POWER);
    expect_cause(0, 0);
}

static void test_a_fault_of_the_last_run_is_told(void) {
    last_run = (last_run_t){.starts = 6, .faulted = true, .fault_address = 0x08001234, .fault_status = 0x82};
    fake_chip.rcc.CSR = RCC_CSR_SFTRSTF | RCC_CSR_PINRSTF;
    const board_start_t start = board_init();
    TEST_ASSERT_EQUAL_HEX16(RESET_SOFTWARE | RESET_FAULT, start.reset_cause);
    TEST_ASSERT_EQUAL_UINT16(7, start.starts);
    TEST_ASSERT_EQUAL_HEX32(0x08001234, start.fault_address);
    TEST_ASSERT_EQUAL_HEX32(0x82, start.fault_status);
}

static void started(void) {
    (void)board_init();
    board_start(0);
}

/* RM0090 18.4.7: in PWM mode 2 the channel is high from the compare value on, if its output is enabled. */
static bool channel_2_is_high(uint32_t count) {
    const timer_t *timer = &fake_chip.tim2;
    TEST_ASSERT_EQUAL_HEX32(TIM_CCMR1_OC2_PWM2, timer->CCMR1);
    return (timer->CCER & TIM_CCER_CC2E) != 0 && count >= timer->CCR2;
}

/* The position is sampled and converted before the output moves, with the same clock and without the software: a
 * conversion that begins with the update would sample a half-settled output. */
static void test_the_position_is_converted_before_the_output_moves(void) {
    enum { TIMER_HZ = 84000000, ADC_HZ = TIMER_HZ / 4, SAMPLING = 56, CONVERSION = SAMPLING + 12 };
    started();
    const uint32_t period = fake_chip.tim2.ARR + 1U;
    TEST_ASSERT_EQUAL_UINT32(TIMER_HZ / SAMPLE_RATE_HZ, period);
    TEST_ASSERT_EQUAL_HEX32(TIM_CR2_MMS_UPDATE, fake_chip.tim2.CR2);
    TEST_ASSERT_EQUAL_HEX32(DAC_CR_EN1 | DAC_CR_TEN1 | DAC_CR_TSEL1_TIM2, fake_chip.dac.CR);
    TEST_ASSERT_EQUAL_HEX32(ADC_CR2_ADON | ADC_CR2_EXTSEL_TIM2_CC2 | ADC_CR2_EXTEN_RISING, fake_chip.adc.CR2);
    TEST_ASSERT_EQUAL_HEX32(ADC_CCR_ADCPRE_4, fake_chip.adc_common.CCR & ADC_CCR_ADCPRE_4);
    TEST_ASSERT_EQUAL_HEX32(ADC_SMPR_56_CYCLES, fake_chip.adc.SMPR2 >> 3 & 7U);
    unsigned edges = 0;
    uint32_t ahead = 0; /* counts, of the last rising edge before the update that ends the period */
    for (uint32_t count = 0; count < period; count++) {
        if (channel_2_is_high(count) && !channel_2_is_high(count > 0 ? count - 1U : period - 1U)) {
            edges++;
            ahead = period - count;
        }
    }
    TEST_ASSERT_EQUAL_UINT(1, edges);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(CONVERSION * (TIMER_HZ / ADC_HZ), ahead);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32_MESSAGE(TIMER_HZ / 100000U, ahead, "some microseconds: the output is to settle");
    const double sampled_ns = 1e9 * ((double)(period - ahead) / TIMER_HZ + (double)SAMPLING / ADC_HZ);
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1.0, sampled_ns, board_info.sampled_after_ns, "what a master is told");
}

static void sample(uint16_t position, unsigned looks) {
    fake_chip.adc.DR = position;
    fake_chip.looks_to_position = looks;
    fake_chip.cycles += 168000000U / SAMPLE_RATE_HZ;
    tim2_handler();
    fake_chip.adc_flags &= ~(uint32_t)ADC_SR_EOC; /* the position was read, if it was there */
}

/* 17 to 47 kHz, by the datasheet: a second is 0.7 to 1.9 then. */
static void test_the_hardware_watchdog_runs_from_the_start_of_the_loop_on(void) {
    (void)board_init();
    (void)fake_iwdg();
    TEST_ASSERT_FALSE(fake_chip.watchdog_runs);
    board_start(0);
    (void)fake_iwdg();
    TEST_ASSERT_TRUE(fake_chip.watchdog_runs);
    TEST_ASSERT_EQUAL_HEX32(IWDG_PR_64, fake_chip.iwdg.PR);
    TEST_ASSERT_EQUAL_UINT32(500, fake_chip.iwdg.RLR);
    TEST_ASSERT_EQUAL_HEX32(IWDG_KR_FEED, fake_chip.iwdg.KR);
    fake_chip.iwdg.KR = 0;
    sample(0, 1);
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(0, fake_chip.iwdg.KR, "the interrupt alone does not feed it");
    board_watchdog_feed();
    TEST_ASSERT_EQUAL_HEX32(IWDG_KR_FEED, fake_chip.iwdg.KR);
}

static void test_the_stage_is_off_until_it_is_enabled_and_after_a_processor_fault(void) {
    started();
    TEST_ASSERT_EQUAL_HEX32(GPIO_MODE_OUTPUT, fake_chip.gpiob.MODER & 3U);
    TEST_ASSERT_EQUAL_HEX32(GPIO_BSRR_RESET(0U), fake_chip.gpiob.BSRR);
    board_stage_enable(true);
    TEST_ASSERT_EQUAL_HEX32(GPIO_BSRR_SET(0U), fake_chip.gpiob.BSRR);
    board_stage_enable(false);
    TEST_ASSERT_EQUAL_HEX32(GPIO_BSRR_RESET(0U), fake_chip.gpiob.BSRR);
    board_stage_enable(true);
    board_keep_park(0x4560);
    fake_chip.dac.DOR1 = 0x900;
    outputs_to_safety();
    TEST_ASSERT_EQUAL_HEX32(0x4560, fake_chip.dac.DHR12L1);
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(DAC_CR_EN1, fake_chip.dac.CR, "without a trigger: codes go out at once");
    TEST_ASSERT_EQUAL_HEX32(0, fake_chip.tim2.CR1 | fake_chip.tim2.DIER);
    TEST_ASSERT_EQUAL_HEX32(GPIO_BSRR_RESET(0U), fake_chip.gpiob.BSRR);
    board_stage_enable(false); /* as a new start has it */
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

static void test_a_supply_that_sags_is_a_fault_of_the_next_sample(void) {
    started();
    sample(0, 1);
    TEST_ASSERT_EQUAL_HEX32(0, seen.faults);
    fake_chip.low_supply = true;
    sample(0, 1);
    TEST_ASSERT_EQUAL_HEX32(FAULT_SUPPLY, seen.faults);
    fake_chip.low_supply = false;
    sample(0, 1);
    TEST_ASSERT_EQUAL_HEX32(0, seen.faults);
}

static void test_the_output_begins_at_the_parking_code(void) {
    (void)board_init();
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(0, fake_chip.dac.CR, "the channel is off until there is a code");
    board_start(0x4560);
    (void)fake_dac();
    TEST_ASSERT_TRUE(fake_chip.output_on);
    TEST_ASSERT_EQUAL_HEX32(0x4560, fake_chip.first_code);
    TEST_ASSERT_EQUAL_HEX32(0x4560, fake_chip.dac.DHR12L1);
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

static void test_an_erasure_that_fails_is_noticed_and_so_is_the_next(void) {
    fake_chip.flash_errors = FLASH_SR_ERRORS & ~(FLASH_SR_ERRORS - 1U);
    TEST_ASSERT_FALSE(board_store_erase(0));
    TEST_ASSERT_BITS_HIGH(FLASH_CR_LOCK, fake_chip.flash.CR);
    TEST_ASSERT_FALSE(board_store_erase(0));
    fake_chip.flash_errors = 0;
    TEST_ASSERT_TRUE_MESSAGE(board_store_erase(0), "an error of the past");
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_crystal_makes_the_full_clock);
    RUN_TEST(test_without_a_crystal_the_internal_oscillator_drives_the_pll);
    RUN_TEST(test_without_a_pll_all_rates_are_those_of_16_mhz);
    RUN_TEST(test_without_a_supply_the_clock_is_left_alone);
    RUN_TEST(test_a_low_supply_writes_no_option_bytes);
    RUN_TEST(test_flash_that_takes_no_wait_states_gets_no_fast_clock);
    RUN_TEST(test_why_it_was_reset);
    RUN_TEST(test_a_fault_of_the_last_run_is_told);
    RUN_TEST(test_the_position_is_converted_before_the_output_moves);
    RUN_TEST(test_the_hardware_watchdog_runs_from_the_start_of_the_loop_on);
    RUN_TEST(test_the_stage_is_off_until_it_is_enabled_and_after_a_processor_fault);
    RUN_TEST(test_a_position_that_does_not_come_is_the_last_one_and_a_fault);
    RUN_TEST(test_a_supply_that_sags_is_a_fault_of_the_next_sample);
    RUN_TEST(test_the_output_begins_at_the_parking_code);
    RUN_TEST(test_a_conversion_that_ends_too_late_is_dropped);
    RUN_TEST(test_periods_are_counted_however_late_the_interrupts_are);
    RUN_TEST(test_temperature_and_supply_by_the_factory_values);
    RUN_TEST(test_health_that_is_not_converted_any_more_vanishes);
    RUN_TEST(test_output_follows_only_what_the_converter_holds);
    RUN_TEST(test_a_low_supply_erases_nothing);
    RUN_TEST(test_an_erasure_that_fails_is_noticed_and_so_is_the_next);
    return UNITY_END();
}
