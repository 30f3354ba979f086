/* SPDX-License-Identifier: MIT */
/**
 * The clock tree: 168 MHz from the 8 MHz crystal, else from the internal oscillator (1 % at room temperature), else the
 * internal oscillator's plain 16 MHz. Every wait is bounded, so a dead crystal, or an emulator without a model of the
 * clock control, delays the start but does not stop it.
 */
#ifndef CLOCK_H
#define CLOCK_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint32_t core_hz;       /**< processor and cycle counter */
    uint32_t apb1_timer_hz; /**< TIM2 and TIM5 count at this rate */
    uint32_t apb2_hz;       /**< USART1 and the ADC's prescaler */
    bool fallback;          /**< not what was requested: no crystal, or no PLL */
} clocks_t;

/** Call once, after supply_init, with what it says. Without a supply the internal oscillator's plain 16 MHz: a PLL that
 * locks below its voltage runs a processor that does anything. Takes at most about 0.3 s. From then on a failing
 * crystal raises NMI (clock security system), which is a fault. */
clocks_t clock_init(bool supplied);

#endif
