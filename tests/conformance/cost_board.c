/* SPDX-License-Identifier: MIT */
/*
 * The h405's board code, for its sample interrupt: what is measured runs from its first instruction to its last. The
 * emulator's ADC never ends a conversion, so one that has just ended stands in memory in its place; and the emulator
 * has no cycle counter, so TIM5 is read instead, which takes the same instructions.
 */
#include "board.h"
#include "cost_loop.h"
#include "stm32f405.h"

static adc_t converted = {.SR = ADC_SR_EOC};

#undef ADC1
#define ADC1 (&converted)
#undef DWT_CYCCNT
#define DWT_CYCCNT        (TIM5->CNT)
#define outputs_to_safety cost_board_outputs_to_safety /* the console has one */

void outputs_to_safety(void);

#define board_info h405_info /* what is measured has limits of its own, below */
extern const board_info_t h405_info;
#include "../../firmware/boards/h405/board.c" /* NOLINT(bugprone-suspicious-include): its functions are static */
#undef board_info

/* As the h405, but no limit on what an image asks for or on the drive's step: the dearest histories are made by jumps.
 */
const board_info_t board_info = {.id = BOARD_ID,
                                 .latency_samples = 2,
                                 .position_bits = 12,
                                 .drive_bits = 12,
                                 .sample_rate_mhz = SAMPLE_RATE_HZ * 1000U,
                                 .cost_rate_hz = 168000000,
                                 .modbus_silence_us = 1750,
                                 .safe_code = SAFE_CODE,
                                 .drive_slew_max = HYST_Q31_MAX,
                                 .image_limits = {1, HYST_Q31_MAX, 0}};

void cost_board_init(void) {
    sampling.late_cycles = UINT32_MAX; /* every interrupt is in time: what is counted here are not cycles */
}
