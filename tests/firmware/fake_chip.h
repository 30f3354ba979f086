/* SPDX-License-Identifier: MIT */
/**
 * The STM32F405 as variables: included ahead of the sources of a board (-include), it puts its own memory where the
 * chip's registers were. So the h405's files run natively as they are. Each access goes through a function that does
 * what the chip would have done by then: a bit that reports, and one that only zeros clear.
 */
#ifndef FAKE_CHIP_H
#define FAKE_CHIP_H

#include "stm32f405.h"
#include <stdbool.h>

typedef struct {
    rcc_t rcc;
    pwr_t pwr;
    iwdg_t iwdg;
    flash_t flash;
    gpio_t gpioa, gpiob;
    timer_t tim2;
    adc_t adc;
    adc_common_t adc_common;
    dac_t dac;
    usart_t usart1;
    volatile uint32_t demcr, dwt_ctrl, cycles, freeze, idcode;
    volatile uint32_t id[3];
    volatile uint16_t reference, at_30, at_110;

    /* What this chip can do. */
    bool crystal, pll, wait_states;
    bool low_supply;
    uint32_t flash_errors;      /* flags of an operation of the flash */
    bool transmits;             /* the transmitter of USART1 */
    unsigned looks_to_position; /* accesses of the converter until a conversion of the position has ended, 0 never */

    /* What was seen. */
    uint8_t sent[8]; /* by USART1 */
    unsigned sent_count;
    bool driven, deaf; /* the driver of the line was on, and the receiver off, at each of these */
    uint32_t adc_flags;
    bool watchdog_runs;
    bool too_fast; /* the fast clock was chosen before the flash had its wait states */
    unsigned erased;
    uint32_t flash_flags;
    bool output_on;
    uint32_t first_code; /* at the output */
} fake_chip_t;

extern fake_chip_t fake_chip;

/** A chip after power came on: a crystal, a PLL, a supply, factory values, no conversion. */
void fake_chip_power_on(void);

rcc_t *fake_rcc(void);
pwr_t *fake_pwr(void);
flash_t *fake_flash(void);
adc_t *fake_adc(void);
dac_t *fake_dac(void);
iwdg_t *fake_iwdg(void);
usart_t *fake_usart(void);

#undef RCC
#undef PWR
#undef IWDG
#undef FLASH
#undef GPIOA
#undef GPIOB
#undef TIM2
#undef ADC1
#undef ADC_COMMON
#undef DAC
#undef USART1
#undef DEMCR
#undef DWT_CTRL
#undef DWT_CYCCNT
#undef DBGMCU_APB1_FZ
#undef DBGMCU_IDCODE
#undef UNIQUE_ID
#undef VREFINT_CAL
#undef TS_CAL_30
#undef TS_CAL_110
#define RCC                     fake_rcc()
#define PWR                     fake_pwr()
#define IWDG                    fake_iwdg()
#define FLASH                   fake_flash()
#define GPIOA                   (&fake_chip.gpioa)
#define GPIOB                   (&fake_chip.gpiob)
#define TIM2                    (&fake_chip.tim2)
#define ADC1                    fake_adc()
#define ADC_COMMON              (&fake_chip.adc_common)
#define DAC                     fake_dac()
#define USART1                  fake_usart()
#define DEMCR                   fake_chip.demcr
#define DWT_CTRL                fake_chip.dwt_ctrl
#define DWT_CYCCNT              fake_chip.cycles
#define DBGMCU_APB1_FZ          fake_chip.freeze
#define DBGMCU_IDCODE           fake_chip.idcode
#define UNIQUE_ID               fake_chip.id
#define VREFINT_CAL             fake_chip.reference
#define TS_CAL_30               fake_chip.at_30
#define TS_CAL_110              fake_chip.at_110
#define wait_for_stores()       ((void)0)
#define nvic_enable(irq, order) ((void)(irq), (void)(order))

#endif
