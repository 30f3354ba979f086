/* SPDX-License-Identifier: MIT */
/**
 * Sine of a phase that wraps by itself: 2^32 is one turn.
 *
 * Within 5 units of 2^-31 (2.4e-9) of the true sine, 1 itself being one unit out of reach (tests/unit/test_sine.c).
 * May be called from: interrupt, main loop, host. Reentrant, no state. Six products.
 */
#ifndef HYST_SINE_H
#define HYST_SINE_H

#include "hyst/fixed.h"

#define HYST_PHASE_QUARTER_TURN 0x40000000U

/** sin(2 pi phase / 2^32). The cosine is the sine a quarter turn ahead. */
hyst_q31_t hyst_sine(uint32_t phase);

#endif
