/* SPDX-License-Identifier: MIT */
/*
 * STM32F405 on an Olimex STM32-H405: on-chip converters, RS-485 on USART1. Wiring: docs/WIRING.md. Never run on silicon
 * so far.
 *
 * One timer clocks everything. Each update of TIM2, 10 kHz, triggers by hardware
 *   - the ADC: position sample k is taken within the 2.7 us that follow update k;
 *   - the DAC: the code that was written during the last period goes to the output.
 * The interrupt of update k reads position k and writes drive code k, which therefore appears at update k + 1, free of
 * any jitter of the software, and stays until update k + 2. Position k + 1 is sampled just as drive k appears, before
 * anything has moved; position k + 2 is the first that shows drive k: latency_samples is 2.
 *
 * Safe output: an interrupt that is late, or never comes again, leaves the last code standing, since the DAC repeats
 * what it holds. For a piezo that is the safe output; a neutral code written at the start of every interrupt, as motor
 * drives do it, would turn one late sample into a full-scale step of the actuator. Parking is for faults from which
 * nothing computes any more.
 */
#include "board.h"
#include "clock.h"
#include "loop.h"
#include "modbus_line.h"
#include "startup.h"
#include "stm32f405.h"

#define SAMPLE_RATE_HZ   10000U
#define SAMPLE_PERIOD_US (1000000U / SAMPLE_RATE_HZ)

#define PIN_POSITION     1U /* PA1, ADC channel 1: PA0 is the user button of the Olimex board */
#define PIN_DRIVE        4U /* PA4, DAC channel 1 */
#define CHANNEL_POSITION 1U

/* A conversion takes 56 cycles of sampling and 12 of conversion at 21 MHz: 3.2 us. A look takes 8 cycles of the
 * processor or more, so the bound is at least 9.5 us at 168 MHz; twice that, with the fall-back, is a fifth of the
 * period. */
#define CONVERSION_LOOKS 200U

const board_info_t board_info = {
    .id = 1,
    .latency_samples = 2,
    .position_bits = 12,
    .drive_bits = 12,
    .sample_rate_mhz = SAMPLE_RATE_HZ * 1000U,
    .cost_rate_hz = 168000000, /* processor cycles; 16 MHz after a fall-back to the bare internal oscillator */
    .modbus_silence_us = 1750, /* the fixed t3.5 of the Modbus standard above 19200 baud */
};

/* Touched by the sample interrupt alone once it runs; `samples` is also read by the main loop. */
static volatile uint32_t samples;
static uint16_t position_code = BOARD_CODE_MIDDLE;
static bool period_missed;

static uint32_t apb1_timer_hz;

static void converters_init(void) {
    RCC->AHB1ENR |= RCC_AHB1ENR_GPIOA;
    RCC->APB1ENR |= RCC_APB1ENR_DAC | RCC_APB1ENR_TIM2;
    RCC->APB2ENR |= RCC_APB2ENR_ADC1;
    GPIOA->MODER |= GPIO_MODE_ANALOG << (2U * PIN_POSITION) | GPIO_MODE_ANALOG << (2U * PIN_DRIVE);

    /* Not triggered yet: the parking code is at the output as soon as the channel is on. */
    DAC->DHR12L1 = BOARD_CODE_MIDDLE;
    DAC->CR = DAC_CR_EN1;

    ADC_COMMON->CCR = ADC_CCR_ADCPRE_4; /* 21 MHz of at most 36 */
    ADC1->SMPR2 = ADC_SMPR2_CHANNEL(CHANNEL_POSITION, ADC_SMPR_56_CYCLES);
    ADC1->SQR1 = 0; /* a sequence of one */
    ADC1->SQR3 = CHANNEL_POSITION;
    ADC1->CR2 = ADC_CR2_ADON; /* the first conversion comes long after the 3 us it needs to stabilise */
}

uint16_t board_init(void) {
    const clocks_t clocks = clock_init();
    apb1_timer_hz = clocks.apb1_timer_hz;
    DEMCR |= DEMCR_TRCENA;
    DWT_CTRL |= DWT_CTRL_CYCCNTENA;
    converters_init();
    modbus_line_init(clocks.apb2_hz);
    return clocks.fallback ? FAULT_CLOCK_FALLBACK : 0;
}

void board_start(void) {
    TIM2->ARR = apb1_timer_hz / SAMPLE_RATE_HZ - 1U;
    TIM2->EGR =
        TIM_EGR_UG; /* loads ARR, and raises an update that is no period: the converters must not be triggered yet */
    TIM2->SR = ~TIM_SR_UIF;
    TIM2->CR2 = TIM_CR2_MMS_UPDATE;
    DAC->CR = DAC_CR_EN1 | DAC_CR_TEN1 | DAC_CR_TSEL1_TIM2;
    ADC1->CR2 = ADC_CR2_ADON | ADC_CR2_EXTSEL_TIM2_TRGO | ADC_CR2_EXTEN_RISING;
    nvic_enable(IRQ_TIM2, PRIORITY_SAMPLE);
    TIM2->DIER = TIM_DIER_UIE;
    TIM2->CR1 = TIM_CR1_CEN;
}

static bool conversion_done(void) {
    for (unsigned look = 0; look < CONVERSION_LOOKS; look++) {
        if ((ADC1->SR & ADC_SR_EOC) != 0) {
            return true;
        }
    }
    return false;
}

/* Returns whether a conversion was ready in time. If the trigger started none, the software does, and the fault is
 * reported all the same: such a position is some microseconds late. */
static bool read_position(void) {
    const bool in_time = conversion_done();
    if (!in_time) {
        ADC1->CR2 |= ADC_CR2_SWSTART;
    }
    if (in_time || conversion_done()) {
        position_code = (uint16_t)(ADC1->DR << 4); /* reading clears EOC */
    }
    return in_time;
}

/*
 * The loop. Period 100 us; deadline: the code must be written before the next update. Cost: docs/TIMING.md, and the
 * registers cost_last and cost_max. On an overrun the DAC repeats the last code for one period and the next sample
 * reports it.
 */
void tim2_handler(void) {
    TIM2->SR = ~TIM_SR_UIF;
    samples++;
    loop_input_t input = {.overrun = period_missed};
    input.converter_timeout = !read_position();
    input.position_code = position_code;
    DAC->DHR12L1 = loop_sample(&input);
    if (input.converter_timeout) {
        ADC1->SR = ~ADC_SR_EOC; /* a conversion that ended after all must not pass for the next sample's */
    }
    period_missed = (TIM2->SR & TIM_SR_UIF) != 0;
}

/* With the trigger off, a code goes from the holding register to the output at once. The middle of the range, and not
 * the image's drive_park: after a fault no memory is to be trusted. docs/WIRING.md tells the power stage's designer. */
void outputs_to_safety(void) {
    DAC->CR = DAC_CR_EN1;
    DAC->DHR12L1 = BOARD_CODE_MIDDLE;
}

uint32_t board_cost_counter(void) {
    return DWT_CYCCNT;
}

/* In steps of one sample: all that this clock times, the end of a Modbus frame and the watchdog, is long against 100
 * us. And there is no second timer that could disagree with the loop about what time it is, whatever the oscillator (or
 * the emulator) makes of its rate. */
uint32_t board_microseconds(void) {
    return samples * SAMPLE_PERIOD_US;
}
