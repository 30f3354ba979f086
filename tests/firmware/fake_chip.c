/* SPDX-License-Identifier: MIT */
#include "fake_chip.h"

#define NOTHING_SENT UINT32_MAX
#define DRIVER_PIN   5U
#define UNWRITTEN    BIT(31) /* no bit of the flash's status: there until the program writes it */

fake_chip_t fake_chip;

void fake_chip_power_on(void) {
    fake_chip = (fake_chip_t){.crystal = true,
                              .pll = true,
                              .wait_states = true,
                              .idcode = DBGMCU_ID_F405,
                              .reference = 1500, /* 1.21 V of 3.3 V are 1502 */
                              .at_30 = 940,      /* 0.76 V at 25 C and 2.5 mV a degree */
                              .at_110 = 1190,
                              .transmits = true,
                              .looks_to_position = 1};
    fake_chip.flash.CR = FLASH_CR_LOCK;
    fake_chip.usart1.DR = NOTHING_SENT;
    fake_chip.driven = fake_chip.deaf = true;
}

static void follow(volatile uint32_t *reg, uint32_t bit, bool on) {
    *reg = on ? *reg | bit : *reg & ~bit;
}

rcc_t *fake_rcc(void) {
    rcc_t *const rcc = &fake_chip.rcc;
    if ((rcc->CSR & RCC_CSR_RMVF) != 0) {
        rcc->CSR &= RCC_CSR_RMVF - 1U; /* the causes of a reset, and the bit itself */
    }
    const bool pll_has_source = fake_chip.crystal || (rcc->PLLCFGR & RCC_PLLCFGR_HSE) == 0;
    follow(&rcc->CR, RCC_CR_HSERDY, fake_chip.crystal && (rcc->CR & RCC_CR_HSEON) != 0);
    follow(&rcc->CR, RCC_CR_PLLRDY, fake_chip.pll && pll_has_source && (rcc->CR & RCC_CR_PLLON) != 0);
    const bool chosen = (rcc->CFGR & RCC_CFGR_SW_MASK) == RCC_CFGR_SW_PLL;
    follow(&rcc->CFGR, RCC_CFGR_SWS_PLL, chosen && (rcc->CR & RCC_CR_PLLRDY) != 0);
    if (chosen && (fake_flash()->ACR & FLASH_ACR_LATENCY(5)) != FLASH_ACR_LATENCY(5)) {
        fake_chip.too_fast = true;
    }
    return rcc;
}

pwr_t *fake_pwr(void) {
    follow(&fake_chip.pwr.CSR, PWR_CSR_PVDO, fake_chip.low_supply);
    return &fake_chip.pwr;
}

flash_t *fake_flash(void) {
    flash_t *const flash = &fake_chip.flash;
    if (!fake_chip.wait_states) {
        flash->ACR = 0;
    }
    if ((flash->CR & FLASH_CR_STRT) != 0) {
        flash->CR &= ~FLASH_CR_STRT;
        fake_chip.erased++;
        fake_chip.flash_flags |= fake_chip.flash_errors;
    }
    if ((flash->SR & UNWRITTEN) == 0) { /* ones that are written clear */
        fake_chip.flash_flags &= ~flash->SR;
    }
    flash->SR = fake_chip.flash_flags | UNWRITTEN;
    return flash;
}

/* The flags are cleared by zeros, and ones that are written set none. */
adc_t *fake_adc(void) {
    adc_t *const adc = &fake_chip.adc;
    fake_chip.adc_flags &= adc->SR;
    if (fake_chip.looks_to_position > 0 && --fake_chip.looks_to_position == 0) {
        fake_chip.adc_flags |= ADC_SR_EOC;
    }
    adc->SR = fake_chip.adc_flags;
    return adc;
}

/* Each access sees what the one before has written. */
iwdg_t *fake_iwdg(void) {
    fake_chip.watchdog_runs = fake_chip.watchdog_runs || fake_chip.iwdg.KR == IWDG_KR_START;
    return &fake_chip.iwdg;
}

/* While it transmits, what was written is sent by the next access. */
usart_t *fake_usart(void) {
    usart_t *const usart = &fake_chip.usart1;
    const bool sends = (usart->CR1 & USART_CR1_TE) != 0 && fake_chip.transmits;
    if (sends && usart->DR != NOTHING_SENT && fake_chip.sent_count < sizeof fake_chip.sent) {
        fake_chip.sent[fake_chip.sent_count++] = (uint8_t)usart->DR;
        fake_chip.driven = fake_chip.driven && fake_chip.gpiob.BSRR == GPIO_BSRR_SET(DRIVER_PIN);
        fake_chip.deaf = fake_chip.deaf && (usart->CR1 & USART_CR1_RXNEIE) == 0;
        usart->DR = NOTHING_SENT;
    }
    follow(&usart->SR, USART_SR_TXE, sends);
    follow(&usart->SR, USART_SR_TC, sends);
    return usart;
}

/* What was held when the channel was switched on is the first that is at the output. */
dac_t *fake_dac(void) {
    dac_t *const dac = &fake_chip.dac;
    if (!fake_chip.output_on && (dac->CR & DAC_CR_EN1) != 0) {
        fake_chip.output_on = true;
        fake_chip.first_code = dac->DHR12L1;
    }
    return dac;
}
