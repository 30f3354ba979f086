/* SPDX-License-Identifier: MIT */
#include "supply.h"
#include "board.h"
#include "stm32f405.h"

/* Looks, 20 us or more apart at the 16 MHz that the processor starts with. */
#define SUPPLY_LOOKS 25000U
#define FLASH_LOOKS  100000U

static void wait_for_flash(void) {
    for (unsigned look = 0; look < FLASH_LOOKS && (FLASH->SR & FLASH_SR_BSY) != 0; look++) {
    }
}

/* RM0090 section 3.9.10: 00 is level 3, reset below 2.7 V. Delivered are chips with 11, off: reset below 1.8 V. */
static void brown_out_level(void) {
    if ((FLASH->OPTCR & FLASH_OPTCR_BOR_MASK) == 0) {
        return;
    }
    FLASH->OPTKEYR = FLASH_OPTKEY1;
    FLASH->OPTKEYR = FLASH_OPTKEY2;
    wait_for_flash();
    FLASH->OPTCR &= ~(FLASH_OPTCR_BOR_MASK | FLASH_OPTCR_OPTLOCK);
    FLASH->OPTCR |= FLASH_OPTCR_OPTSTRT;
    wait_for_flash();
    FLASH->OPTCR |= FLASH_OPTCR_OPTLOCK;
}

bool supply_low(void) {
    return (PWR->CSR & PWR_CSR_PVDO) != 0;
}

bool supply_init(void) {
    RCC->APB1ENR |= RCC_APB1ENR_PWR;
    PWR->CR = PWR_CR_VOS | PWR_CR_PLS_2V9 | PWR_CR_PVDE;
    for (unsigned look = 0; look < SUPPLY_LOOKS; look++) {
        for (unsigned turn = 0; turn < 80; turn++) {
            __asm__ volatile("nop");
        }
        if (!supply_low()) {
            brown_out_level(); /* not from a supply that sags: the flash is being written */
            return true;
        }
    }
    return false;
}

uint16_t reset_cause(void) {
    const uint32_t flags = RCC->CSR;
    RCC->CSR = flags | RCC_CSR_RMVF;
    /* The reset pin is pulled down by every cause, so it counts only alone. */
    const uint16_t cause = (uint16_t)(((flags & (RCC_CSR_PORRSTF | RCC_CSR_BORRSTF)) != 0 ? RESET_POWER : 0) |
                                      ((flags & RCC_CSR_IWDGRSTF) != 0 ? RESET_WATCHDOG : 0) |
                                      ((flags & RCC_CSR_SFTRSTF) != 0 ? RESET_SOFTWARE : 0));
    return cause != 0 || (flags & RCC_CSR_PINRSTF) == 0 ? cause : (uint16_t)RESET_PIN;
}

void watchdog_start(void) {
    DBGMCU_APB1_FZ |= DBGMCU_APB1_FZ_IWDG;
    IWDG->KR = IWDG_KR_START;
    IWDG->KR = IWDG_KR_UNLOCK;
    IWDG->PR = IWDG_PR_64;
    IWDG->RLR = 500; /* of 32 kHz / 64 */
    watchdog_feed();
}

void watchdog_feed(void) {
    IWDG->KR = IWDG_KR_FEED;
}
