/* SPDX-License-Identifier: MIT */
/**
 * What a parameter image costs the sample interrupt at worst, from the image alone: its family, how many operators,
 * sections and cells it has. So amplifier and host say the same number, of an old image as of a new one, and no image
 * can state a wrong one.
 *
 * The numbers are those of docs/TIMING.md, rounded up: the largest counts of instructions that were observed with the
 * boards' whole sample interrupt on an emulated Cortex-M4. Every signal is captured; the tones of a multisine are
 * counted apart (HYST_COST_TONE). tests/unit/test_cost.c holds them against the budget of
 * tests/conformance/budget.txt: never below a line of it, and never far above.
 *
 * Limitations. Observed, not proven. Instructions are not cycles: how many cycles one takes has not been measured on
 * silicon, and HYST_COST_CYCLES_PER_INSTRUCTION is an assumption. The samples that adopt an image take more than what
 * is stated here: some 2700 instructions with a play bank, up to 6100 with other families. Where that exceeds the
 * period, they come late, are counted, and do not trip (firmware/app/loop/loop.h).
 *
 * May be called from: main loop, host.
 */
#ifndef HYST_COST_H
#define HYST_COST_H

#include "hyst/parameters.h"

/** Assumed, not measured. A Cortex-M4 takes one cycle for most instructions, two or three for a load or a taken branch,
 * up to twelve for a division, and waits for flash that its cache does not hold. */
#define HYST_COST_CYCLES_PER_INSTRUCTION 2U

/** Instructions of each tone of a multisine, beside what the image costs. */
#define HYST_COST_TONE 50U

/** Clock of the boards' processor, for a host that is not connected to one. */
#define HYST_COST_CORE_HZ 168000000U

/** Instructions of a sample at worst. The counts in *parameters are in range (hyst_parameters_decode). */
uint32_t hyst_cost_instructions(const hyst_parameters_t *parameters);

/** The same in cycles, by the assumption above. */
uint32_t hyst_cost_cycles(const hyst_parameters_t *parameters);

/**
 * Cycles of one sample period that the interrupt may take at this clock: all of it but 24, to enter and leave it, and
 * 3.2 us, the wait for a conversion. core_hz: 1 MHz or more. 0 when nothing is left.
 */
uint32_t hyst_cost_budget(uint32_t core_hz, uint32_t sample_rate_mhz);

#endif
