/* SPDX-License-Identifier: MIT */
#include "clock.h"
#include "stm32f405.h"

#define HSI_HZ 16000000U
#define PLL_HZ 168000000U

/* RM0090 recommends 2 MHz at the PLL's input against jitter: 8 MHz / 4 or 16 MHz / 8. Its oscillator runs at 2 MHz *
 * 168 = 336 MHz. */
#define PLL_M_HSE 4U
#define PLL_M_HSI 8U
#define PLL_N     168U
#define PLL_Q     7U /* 48 MHz for USB and RNG: not used, but the divider has to be legal */

/*
 * Waits until the bits under `mask` read as `value`: at most 1000 looks, 100 us or more apart (400 turns of 4 cycles or
 * more at 16 MHz). A crystal typically needs 2 ms; the datasheet gives no maximum, so the bound is generous.
 */
static bool wait_for(const volatile uint32_t *reg, uint32_t mask, uint32_t value) {
    for (unsigned look = 0; look < 1000; look++) {
        if ((*reg & mask) == value) {
            return true;
        }
        for (unsigned turn = 0; turn < 400; turn++) {
            __asm__ volatile("nop");
        }
    }
    return false;
}

/* False: the clock is as a reset leaves it. */
static bool start_pll(bool *crystal) {
    RCC->CR |= RCC_CR_HSEON;
    *crystal = wait_for(&RCC->CR, RCC_CR_HSERDY, RCC_CR_HSERDY);
    if (*crystal) {
        RCC->CR |= RCC_CR_CSSON;
    }

    RCC->PLLCFGR = RCC_PLLCFGR_M(*crystal ? PLL_M_HSE : PLL_M_HSI) | RCC_PLLCFGR_N(PLL_N) | RCC_PLLCFGR_P2 |
                   (*crystal ? RCC_PLLCFGR_HSE : 0U) | RCC_PLLCFGR_Q(PLL_Q);
    RCC->CR |= RCC_CR_PLLON;
    if (!wait_for(&RCC->CR, RCC_CR_PLLRDY, RCC_CR_PLLRDY)) {
        return false;
    }
    /* Order matters: wait states (5 at 168 MHz and 3.3 V) and bus dividers first, then the fast clock. The voltage
     * regulator's scale 1, which 168 MHz needs, is the reset value. The wait states are read back, as RM0090 asks. */
    FLASH->ACR = FLASH_ACR_LATENCY(5) | FLASH_ACR_PRFTEN | FLASH_ACR_ICEN | FLASH_ACR_DCEN;
    if (!wait_for(&FLASH->ACR, FLASH_ACR_LATENCY_MASK, FLASH_ACR_LATENCY(5))) {
        return false;
    }
    RCC->CFGR = RCC_CFGR_PPRE1_4 | RCC_CFGR_PPRE2_2 | RCC_CFGR_SW_PLL;
    return wait_for(&RCC->CFGR, RCC_CFGR_SWS_MASK, RCC_CFGR_SWS_PLL);
}

clocks_t clock_init(bool supplied) {
    bool crystal = false;
    if (supplied && start_pll(&crystal)) {
        /* Timers on a divided bus count at twice its rate: 2 * 42 MHz. */
        return (clocks_t){
            .core_hz = PLL_HZ, .apb1_timer_hz = PLL_HZ / 2U, .apb2_hz = PLL_HZ / 2U, .fallback = !crystal};
    }
    RCC->CFGR = 0; /* internal oscillator, undivided */
    return (clocks_t){.core_hz = HSI_HZ, .apb1_timer_hz = HSI_HZ, .apb2_hz = HSI_HZ, .fallback = true};
}
