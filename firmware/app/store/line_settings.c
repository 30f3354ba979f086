/* SPDX-License-Identifier: MIT */
#include "store/line_settings.h"
#include "board.h"
#include "hyst/cost.h"

#define DIVIDER_MIN        16U
#define DIVIDER_MAX        65535U
#define PER_MILLE          1000U
#define RATE_MILLE         15U  /* 1.5 % */
#define MILLIBYTES_PER_BIT 100U /* 10 bits a byte */
#define MHZ_TIMES_US       1000000000U
#define SILENCE_BITUS      38500000U /* 3.5 characters of 11 bits, in bits times microseconds a second */

uint32_t line_divider(uint32_t clock_hz, uint32_t baud) {
    if (baud == 0 || clock_hz / baud > DIVIDER_MAX) {
        return 0;
    }
    const uint32_t divider = (uint32_t)(((uint64_t)clock_hz + baud / 2U) / baud);
    const uint64_t made = (uint64_t)divider * baud;
    const uint64_t error = made > clock_hz ? made - clock_hz : clock_hz - made;
    const bool good = divider >= DIVIDER_MIN && divider <= DIVIDER_MAX && error * PER_MILLE <= made * RATE_MILLE;
    return good ? divider : 0;
}

bool line_settings_valid(const line_settings_t *line) {
    return line->address >= 1U && line->address <= LINE_ADDRESS_MAX && line->parity <= LINE_PARITY_ODD &&
           line->baud >= LINE_BAUD_MIN && line->baud <= LINE_BAUD_MAX && board_modbus_baud_possible(line->baud);
}

uint32_t line_sample_budget(uint32_t core_hz, uint32_t baud) {
    const uint32_t byte = hyst_cost_budget(core_hz, baud * MILLIBYTES_PER_BIT);
    return byte > LINE_CYCLES_BESIDE ? byte - LINE_CYCLES_BESIDE : 0U;
}

uint32_t line_silence_us(uint32_t baud) {
    const uint32_t silence = SILENCE_BITUS / baud;
    return silence > board_info.modbus_silence_us ? silence : board_info.modbus_silence_us;
}

uint32_t line_gap_us(uint32_t baud) {
    const uint32_t period = MHZ_TIMES_US / board_info.sample_rate_mhz;
    return line_silence_us(baud) - period;
}
