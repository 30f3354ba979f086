/* SPDX-License-Identifier: MIT */
/**
 * The loop: one call per sample, from the sample interrupt. docs/DESIGN.md, section 4.
 */
#ifndef LOOP_H
#define LOOP_H

#include "hyst/compensator.h"
#include "hyst/parameters.h"

/** What the converters delivered. */
typedef struct {
    uint16_t position_code; /**< offset binary, board_info.position_bits wide, left-aligned to 16 bits */
    bool converter_timeout; /**< no fresh position; the code is the last one */
    bool overrun;           /**< more than one period passed since the last sample */
} loop_input_t;

/** Sample interrupt only. Returns the drive code: offset binary, left-aligned to 16 bits. */
uint16_t loop_sample(const loop_input_t *input);

#endif
