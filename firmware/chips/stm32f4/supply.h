/* SPDX-License-Identifier: MIT */
/** The supply: its supervision, the brown-out level, and why the processor started. */
#ifndef SUPPLY_H
#define SUPPLY_H

#include <stdbool.h>
#include <stdint.h>

/**
 * Sets the brown-out level to 2.7 V if it is not (option bytes: once in the life of a chip), switches the supply's
 * detector on at 2.9 V and waits, at most half a second, until the supply is above. Before the clocks (clock_init).
 * Returns whether the supply is there.
 */
bool supply_init(void);

/** Is it below 2.9 V now? Any context. */
bool supply_low(void);

/** RESET_ bits (board.h). Once: it clears them. */
uint16_t reset_cause(void);

/** Hardware watchdog, 1 s nominal (0.7 to 1.9 s: its oscillator is that inaccurate), stopped while a debugger halts the
 * processor. It cannot be stopped otherwise. */
void watchdog_start(void);
void watchdog_feed(void);

#endif
