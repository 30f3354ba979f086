/* SPDX-License-Identifier: MIT */
/**
 * A board that is made of variables, so that the application runs natively: time stands still unless the test moves it.
 */
#ifndef TESTS_FAKE_BOARD_H
#define TESTS_FAKE_BOARD_H

#include "board.h"
#include "hyst/fixed.h"

enum { FAKE_LATENCY = 2, FAKE_SAMPLE_US = 100, FAKE_SILENCE_US = 1750 };

typedef struct {
    uint32_t microseconds;
    uint32_t cost;          /**< what board_cost_counter says */
    uint32_t cost_per_look; /**< and how much more at each look */
    unsigned locks;         /**< depth of board_lock */
    uint8_t sent[256];      /**< last frame on the Modbus line */
    size_t sent_length;
    unsigned frames_sent;
} fake_board_t;

extern fake_board_t fake_board;

/* FAKE_CONVERTER_BITS comes from CMakeLists.txt. */

/** Power-on: everything zero, then amplifier_init. */
void fake_board_power_on(uint16_t faults);

/** One sample period passes: the sample interrupt. Returns the drive code. */
uint16_t fake_board_sample(hyst_q31_t position);

/** The same as a Q31 number. */
hyst_q31_t fake_board_drive(hyst_q31_t position);

/** `count` samples at position 0. Returns the last drive. */
hyst_q31_t fake_board_run(unsigned count);

#endif
