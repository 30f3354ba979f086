/* SPDX-License-Identifier: MIT */
/*
 * STM32F405 on an Olimex STM32-H405: on-chip converters, RS-485 on USART1. Wiring: docs/WIRING.md. Never run on silicon
 * so far.
 *
 * One timer clocks everything. TIM2 counts to the sample rate and triggers by hardware
 *   - the ADC, by its compare channel 2, ADC_AHEAD_US before update k: position sample k;
 *   - the DAC, by its update k: the code that was written during the last period goes to the output.
 * So the position is sampled when the output has had all its period to settle, and the 2.7 us of sampling are over
 * before the output moves. The interrupt of update k reads position k and writes drive code k, which therefore appears
 * at update k + 1, free of any jitter of the software, and stays until update k + 2. Position k + 1 is sampled just
 * before drive k appears; position k + 2 is the first that shows drive k: latency_samples is 2.
 *
 * Time is counted in periods, not in interrupts: the cycle counter, which runs from the same clock, less what TIM2 has
 * counted since, tells when the newest update was, and so how many there were since the last interrupt's.
 *
 * Safe output: an interrupt that is late leaves the last code standing, since the DAC repeats what it holds. For a
 * piezo that is better than a neutral code written at the start of every interrupt, as motor drives do it, which would
 * turn one late sample into a full-scale step of the actuator. An interrupt or a main loop that never comes again is
 * the hardware watchdog's (supply.h): within 1.9 s it resets the processor, the stage goes off, and the output floats
 * to where its pull-down leads. A processor fault ramps to the parking code first.
 */
#include "board.h"
#include "clock.h"
#include "hyst/cost.h"
#include "loop/loop.h"
#include "modbus_line.h"
#include "startup.h"
#include "stm32f405.h"
#include "supply.h"

#define SAMPLE_PERIOD_US (1000000U / SAMPLE_RATE_HZ)
#define ADC_AHEAD_US     5U    /* a conversion takes 3.2 us */
#define SAMPLING_NS      2667U /* 56 cycles of 21 MHz of it; what counts is the voltage at their end */

#define PIN_DEFAULT_LINE 0U /* PA0, the user button of the Olimex board */
#define PIN_POSITION     1U /* PA1, ADC channel 1 */
#define PIN_DRIVE        4U /* PA4, DAC channel 1 */
#define PIN_STAGE_ENABLE 0U /* PB0, high is on */
#define CHANNEL_POSITION 1U

/* What these numbers are used with: port A for the position, whose pins 0 to 7 are the channels of the same number, in
 * the sampling register of channels 0 to 9, and port B for the stage. */
_Static_assert(PIN_POSITION == CHANNEL_POSITION && CHANNEL_POSITION < 8U, "PA0 to PA7 are the channels 0 to 7");
_Static_assert(PIN_POSITION != PIN_DRIVE && PIN_POSITION != PIN_DEFAULT_LINE, "a pin has one use");
_Static_assert(PIN_DRIVE == 4U, "DAC channel 1 is PA4");
_Static_assert(PIN_STAGE_ENABLE < 16U && (PIN_STAGE_ENABLE < 5U || PIN_STAGE_ENABLE > 7U),
               "a pin of port B, of which 5 to 7 are the line's");

/* What PA0 is while the button is held: high, and pulled down otherwise. From the board's description, not seen on
 * silicon; false for a button to ground, and the pull is up then (docs/WIRING.md). */
#define DEFAULT_LINE_HIGH true

/* The chip's temperature sensor and its reference, in the converter's injected group. They need 10 us of sampling; 480
 * cycles at 21 MHz are 22.9 us. So a conversion that the interrupt starts is over long before the next of the position.
 * One that is started too late delays that one by as much, and the sample reports it. */
_Static_assert(SAMPLE_PERIOD_US >= ADC_AHEAD_US + 30U, "a conversion of the temperature is over before the next");
enum { CHANNEL_TEMPERATURE = 16U, CHANNEL_REFERENCE = 17U };

/* After a processor fault: one 12-bit code in 500 turns of 4 cycles or more, so the whole range in 50 ms at 168 MHz and
 * in 0.5 s at 16 MHz, before the watchdog bites. */
#define SAFE_CODE       0U
#define SAFE_RAMP_TURNS 500U

/* A conversion takes 56 cycles of sampling and 12 of conversion at 21 MHz: 3.2 us. A look takes 8 cycles of the
 * processor or more, so the bound is at least 9.5 us at 168 MHz. Twice that, with the fall-back, is a fifth of 100 us
 * and half of 40 us. */
#define CONVERSION_LOOKS 200U

/* Of 4 cycles or more: 48 us at 168 MHz. Five time constants of a pull-down of 50 kOhm and a wire of 100 pF are 25. */
#define PULL_TURNS 2000U

const board_info_t board_info = {
    .id = BOARD_ID,
    .latency_samples = 2,
    .sampled_after_ns = 1000000000U / SAMPLE_RATE_HZ - ADC_AHEAD_US * 1000U + SAMPLING_NS,
    .position_bits = 12,
    .drive_bits = 12,
    .sample_rate_mhz = SAMPLE_RATE_HZ * 1000U,
    .cost_rate_hz = 168000000, /* processor cycles; 16 MHz after a fall-back to the bare internal oscillator */
    .modbus_silence_us = 1750, /* the fixed t3.5 of the Modbus standard above 19200 baud */
    .safe_code = SAFE_CODE,
    /* The whole range in 0.8 ms: 150 V into 3 uF, a large stack, are then 0.56 A. A sine over the whole range may have
     * 400 Hz. A slower stage needs a smaller number here. */
    .drive_slew_max = BOARD_RANGE_IN_US(800, SAMPLE_RATE_HZ),
    /* The whole range in half a second: shorter than the hardware watchdog ever is (0.7 s), and slow against any
     * mechanics that one would park in 10 ms. */
    .fault_slew_min = BOARD_RANGE_IN_US(500000, SAMPLE_RATE_HZ),
    /* Parking over the whole range takes between 10 ms, three periods of a mode of 300 Hz and 45 mA into those 3 uF,
     * and 10 s, the longest that somebody waits for it. A filter amplifies at most 64 times: one code of a 12-bit
     * position moves the drive by no more than 1/64 of its range. The host's roll-offs make up to 11. */
    .image_limits = {.transition_slew_min = BOARD_RANGE_IN_US(10000000, SAMPLE_RATE_HZ),
                     .transition_slew_max = BOARD_RANGE_IN_US(10000, SAMPLE_RATE_HZ),
                     .filter_gain_max = 64},
    /* The chip's own temperature; its junction may have 105 C. The supply: of 3.3 V, from where the detector trips to
     * what the chip may have. The stage's supply is not measured. */
    .health = {.temperature_alert = 85000, .temperature_trip = 105000, .supply_low = 2900, .supply_high = 3600},
};

/* Touched by the sample interrupt alone once it runs. */
static struct {
    uint16_t position_code;
    uint32_t ended_late;       /* FAULT_OVERRUN, if the last one's end was after the next update */
    uint32_t last_update;      /* cycle counter */
    volatile uint32_t periods; /* since start; read by the main loop */
    uint32_t cycles_per_period;
    uint32_t cycles_per_count; /* of TIM2; 0 where there is no cycle counter (emulator) */
    uint32_t late_cycles;      /* so many from update to update, rounded to periods, are two */
} sampling = {.position_code = BOARD_CODE_MIDDLE};

static uint32_t apb1_timer_hz, core_hz;

/* Sample interrupt. Codes, 0 before the first one, and again when no conversion ends any more. */
static uint32_t temperature_raw, reference_raw;
static uint32_t health_channel; /* that is being converted, 0 none */
static unsigned health_waits;   /* looks at a conversion that has not ended */

/* A conversion takes 23 us, and looks are 32 samples apart, so one that is not over at the next look has not begun. */
#define HEALTH_WAITS 3U

/* From the factory; 0 where the chip is not the one that has them there. */
static struct { int32_t reference, at_30, at_110; } calibration;

static void converters_init(void) {
    RCC->AHB1ENR |= RCC_AHB1ENR_GPIOA;
    RCC->APB1ENR |= RCC_APB1ENR_DAC | RCC_APB1ENR_TIM2;
    RCC->APB2ENR |= RCC_APB2ENR_ADC1;
    GPIOA->MODER |= GPIO_MODE_ANALOG << (2U * PIN_POSITION) | GPIO_MODE_ANALOG << (2U * PIN_DRIVE);

    ADC_COMMON->CCR = ADC_CCR_ADCPRE_4 | ADC_CCR_TSVREFE; /* 21 MHz of at most 36 */
    ADC1->SMPR1 = ADC_SMPR1_CHANNEL(CHANNEL_TEMPERATURE, ADC_SMPR_480_CYCLES) |
                  ADC_SMPR1_CHANNEL(CHANNEL_REFERENCE, ADC_SMPR_480_CYCLES);
    ADC1->SMPR2 = ADC_SMPR2_CHANNEL(CHANNEL_POSITION, ADC_SMPR_56_CYCLES);
    ADC1->SQR1 = 0; /* a sequence of one */
    ADC1->SQR3 = CHANNEL_POSITION;
    ADC1->CR2 = ADC_CR2_ADON; /* the first conversion comes long after the 3 us it needs to stabilise */
}

/* The pull has some microseconds to act. */
static bool default_line(void) {
    RCC->AHB1ENR |= RCC_AHB1ENR_GPIOA;
    GPIOA->PUPDR |= (DEFAULT_LINE_HIGH ? GPIO_PULL_DOWN : GPIO_PULL_UP) << (2U * PIN_DEFAULT_LINE);
    for (unsigned turn = 0; turn < PULL_TURNS; turn++) {
        __asm__ volatile("nop");
    }
    return ((GPIOA->IDR & 1UL << PIN_DEFAULT_LINE) != 0) == DEFAULT_LINE_HIGH;
}

static void stage_init(void) {
    RCC->AHB1ENR |= RCC_AHB1ENR_GPIOB;
    GPIOB->BSRR = GPIO_BSRR_RESET(PIN_STAGE_ENABLE);
    GPIOB->MODER |= GPIO_MODE_OUTPUT << (2U * PIN_STAGE_ENABLE);
}

/* An emulator has no such memory, and says that it is no such chip. */
static bool factory_values(void) {
    return (DBGMCU_IDCODE & DBGMCU_ID_MASK) == DBGMCU_ID_F405;
}

static void calibrate(void) {
    if (factory_values()) {
        calibration.reference = VREFINT_CAL;
        calibration.at_30 = TS_CAL_30;
        calibration.at_110 = TS_CAL_110;
    }
}

board_start_t board_init(void) {
    const uint16_t cause = reset_cause();
    const last_run_t last = last_run_take((cause & RESET_POWER) != 0);
    stage_init();
    const bool supplied = supply_init();
    const clocks_t clocks = clock_init(supplied);
    apb1_timer_hz = clocks.apb1_timer_hz;
    core_hz = clocks.core_hz;
    sampling.cycles_per_period = core_hz / SAMPLE_RATE_HZ;
    sampling.cycles_per_count = factory_values() ? core_hz / apb1_timer_hz : 0;
    sampling.late_cycles = 2U * sampling.cycles_per_period - sampling.cycles_per_period / 2U;
    DEMCR |= DEMCR_TRCENA;
    DWT_CTRL |= DWT_CTRL_CYCCNTENA;
    converters_init();
    calibrate();
    modbus_line_init(clocks.apb2_hz, true);
    const bool known = factory_values();
    return (board_start_t){.serial = {known ? UNIQUE_ID[2] : 0, known ? UNIQUE_ID[1] : 0, known ? UNIQUE_ID[0] : 0},
                           .default_line = default_line(),
                           .faults =
                               (uint16_t)((clocks.fallback ? FAULT_CLOCK_FALLBACK : 0) | (supplied ? 0 : FAULT_SUPPLY)),
                           .reset_cause = (uint16_t)(cause | (last.faulted ? RESET_FAULT : 0)),
                           .starts = (uint16_t)(last.starts + 1U),
                           .fault_address = last.fault_address,
                           .fault_status = last.fault_status};
}

/* An emulator models no clocks, so that they seem to have fallen back; as it is no such chip, it counts as one at its
 * full clock. So does a chip of revision A, whose fall-back then shows as overruns only. */
uint32_t board_core_hz(void) {
    return factory_values() ? core_hz : HYST_COST_CORE_HZ;
}

void board_stage_enable(bool on) {
    static bool enabled;
    if (on != enabled) {
        enabled = on;
        GPIOB->BSRR = on ? GPIO_BSRR_SET(PIN_STAGE_ENABLE) : GPIO_BSRR_RESET(PIN_STAGE_ENABLE);
    }
}

/* Takes the conversion that was started the last time, and starts that of the other channel. One that does not end
 * leaves no reading: what it read before is not the present. */
void board_health_convert(void) {
    const bool ended = (ADC1->SR & ADC_SR_JEOC) != 0;
    if (health_channel != 0 && !ended && health_waits < HEALTH_WAITS) {
        health_waits++;
        return;
    }
    uint32_t *const raw = health_channel == CHANNEL_TEMPERATURE ? &temperature_raw : &reference_raw;
    if (health_channel != 0) {
        *raw = ended ? ADC1->JDR1 : 0; /* and the next one is tried */
    }
    health_waits = 0;
    health_channel = health_channel == CHANNEL_TEMPERATURE ? CHANNEL_REFERENCE : CHANNEL_TEMPERATURE;
    ADC1->SR = ~ADC_SR_JEOC;
    ADC1->JSQR = ADC_JSQR_SINGLE(health_channel);
    ADC1->CR2 |= ADC_CR2_JSWSTART;
}

/* VDDA in mV: the reference reads less the higher it is. */
static int32_t supply_mv(void) {
    return reference_raw == 0 || calibration.reference == 0 ? HEALTH_ABSENT
                                                            : 3300 * calibration.reference / (int32_t)reference_raw;
}

/* A straight line through the two codes of the factory, which were taken at 3.3 V. */
static int32_t temperature_mc(void) {
    const int32_t supply = supply_mv();
    const int32_t span = calibration.at_110 - calibration.at_30;
    if (supply == HEALTH_ABSENT || temperature_raw == 0 || span <= 0) {
        return HEALTH_ABSENT;
    }
    return 30000 + ((int32_t)temperature_raw * supply / 3300 - calibration.at_30) * 80000 / span;
}

int32_t board_health(health_channel_t channel) {
    switch (channel) {
    case HEALTH_TEMPERATURE:
        return temperature_mc();
    case HEALTH_SUPPLY:
        return supply_mv();
    default:
        return HEALTH_ABSENT;
    }
}

/* The last update has moved the holding register into the output register, unless its trigger or the converter is dead.
 * That is what the digital side says; nothing measures the pin. Not seen on silicon. An emulator knows no output
 * register. */
bool board_output_follows(void) {
    return calibration.reference == 0 || (DAC->DOR1 & 0xFFFU) == (DAC->DHR12L1 >> 4 & 0xFFFU);
}

void board_watchdog_feed(void) {
    watchdog_feed();
}

/* In the compare channel 3 of TIM2, which compares with nothing: no pin, no interrupt, no trigger. Nothing writes there
 * by a stray pointer into memory. The upper half is the complement of the lower, so a reset leaves no code there. One
 * store: a processor fault at any instruction finds the code before or the new one. */
void board_keep_park(uint16_t drive_code) {
    TIM2->CCR3 = (uint32_t)(uint16_t)~drive_code << 16 | drive_code;
}

void board_start(uint16_t drive_code) {
    board_keep_park(drive_code);
    /* Not triggered yet: the parking code is at the output as soon as the channel is on. */
    DAC->DHR12L1 = drive_code;
    DAC->CR = DAC_CR_EN1;
    TIM2->ARR = apb1_timer_hz / SAMPLE_RATE_HZ - 1U;
    /* High from the compare value to the end of the period: the rising edge starts the conversion. */
    TIM2->CCMR1 = TIM_CCMR1_OC2_PWM2;
    TIM2->CCR2 = TIM2->ARR + 1U - apb1_timer_hz / 1000000U * ADC_AHEAD_US;
    TIM2->CCER = TIM_CCER_CC2E;
    TIM2->EGR =
        TIM_EGR_UG; /* loads ARR, and raises an update that is no period: the converters must not be triggered yet */
    TIM2->SR = ~TIM_SR_UIF;
    TIM2->CR2 = TIM_CR2_MMS_UPDATE;
    DAC->CR = DAC_CR_EN1 | DAC_CR_TEN1 | DAC_CR_TSEL1_TIM2;
    ADC1->CR2 = ADC_CR2_ADON | ADC_CR2_EXTSEL_TIM2_CC2 | ADC_CR2_EXTEN_RISING;
    sampling.last_update = DWT_CYCCNT;
    nvic_enable(IRQ_TIM2, PRIORITY_SAMPLE);
    TIM2->DIER = TIM_DIER_UIE;
    TIM2->CR1 = TIM_CR1_CEN;
    watchdog_start();
}

static bool conversion_done(void) {
    for (unsigned look = 0; look < CONVERSION_LOOKS; look++) {
        if ((ADC1->SR & ADC_SR_EOC) != 0) {
            return true;
        }
    }
    return false;
}

/* Returns FAULT_CONVERTER_TIMEOUT unless a conversion was ready in time. If the trigger started none, the software
 * does, and the fault is reported all the same: such a position is some microseconds late. */
static uint32_t read_position(void) {
    const bool in_time = conversion_done();
    if (!in_time) {
        ADC1->CR2 |= ADC_CR2_SWSTART;
    }
    if (in_time || conversion_done()) {
        sampling.position_code = (uint16_t)(ADC1->DR << 4); /* reading clears EOC */
    }
    return in_time ? 0U : FAULT_CONVERTER_TIMEOUT;
}

static HYST_APART uint32_t periods_in(uint32_t cycles) {
    return (cycles + sampling.cycles_per_period / 2U) / sampling.cycles_per_period;
}

/* Periods that passed without an interrupt, from the newest update that the last interrupt knew to the newest one now,
 * however late either interrupt is. Before the interrupt's flag is cleared: an update that comes between the two then
 * is one that has no interrupt, and the next one counts it. (An emulator without a cycle counter says 0 cycles; a chip
 * of revision A is taken for one, and counts from entry to entry.) Whether the cycle counter stands still while the
 * processor sleeps was not seen on silicon; it does no harm, as no interrupt is missed there. */
static uint32_t count_periods(void) {
    const uint32_t update = DWT_CYCCNT - TIM2->CNT * sampling.cycles_per_count;
    const uint32_t since = update - sampling.last_update;
    uint32_t missed = 0;
    sampling.last_update = update;
    if (since >= sampling.late_cycles) {
        missed = periods_in(since) - 1U;
    }
    sampling.periods += 1U + missed;
    return missed;
}

/*
 * The loop. Period SAMPLE_PERIOD_US; deadline: the code must be written before the next update. Cost: docs/TIMING.md,
 * and the registers cost_last and cost_max. On an overrun the DAC repeats the last code for one period and the next
 * sample reports it.
 */
void tim2_handler(void) {
    const uint32_t missed = count_periods();
    TIM2->SR = ~TIM_SR_UIF;
    const uint32_t faults =
        sampling.ended_late | (missed > 0 ? FAULT_OVERRUN : 0U) | (supply_low() ? FAULT_SUPPLY : 0U) | read_position();
    const loop_input_t input = {.position_code = sampling.position_code, .missed = missed, .faults = faults};
    DAC->DHR12L1 = loop_sample(&input);
    if ((faults & FAULT_CONVERTER_TIMEOUT) != 0) {
        ADC1->SR = ~ADC_SR_EOC; /* a conversion that ended after all must not pass for the next sample's */
    }
    sampling.ended_late = (TIM2->SR & TIM_SR_UIF) != 0 ? FAULT_OVERRUN : 0U;
}

/* Of 12 bits. */
static int32_t rest_code(void) {
    const uint32_t kept = TIM2->CCR3;
    const uint32_t code = kept & UINT16_MAX;
    return (int32_t)(((kept >> 16 ^ code) == UINT16_MAX ? code : SAFE_CODE) >> 4);
}

/*
 * With the trigger off, a code goes from the holding register to the output at once. From what is at the output now,
 * which the converter knows itself, one code at a time to the parking code of the image in force, as board_keep_park
 * has it: after a fault no memory is to be trusted. Both lie within the image's limits, and so does all between.
 * Without a whole code there, to the safe one. Then the stage goes off. docs/WIRING.md tells the power stage's
 * designer.
 */
void outputs_to_safety(void) {
    TIM2->CR1 = 0;
    TIM2->DIER = 0;
    int32_t code = (int32_t)(DAC->DOR1 & 0xFFFU);
    DAC->DHR12L1 = (uint32_t)code << 4;
    DAC->CR = DAC_CR_EN1;
    watchdog_feed(); /* the main loop may have been about to: the ramp has all the watchdog's time */
    const int32_t rest = rest_code();
    while (code != rest) {
        code += code < rest ? 1 : -1;
        DAC->DHR12L1 = (uint32_t)code << 4;
        for (unsigned turn = 0; turn < SAFE_RAMP_TURNS; turn++) {
            __asm__ volatile("nop");
        }
    }
    GPIOB->BSRR = GPIO_BSRR_RESET(PIN_STAGE_ENABLE);
}

uint32_t board_cost_counter(void) {
    return DWT_CYCCNT;
}

/* In steps of one period: all that this clock times, the end of a Modbus frame and its echo, is long against it. */
uint32_t board_microseconds(void) {
    return sampling.periods * SAMPLE_PERIOD_US;
}
