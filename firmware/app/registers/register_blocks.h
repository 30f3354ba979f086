/* SPDX-License-Identifier: MIT */
/**
 * The blocks of the register map: breakpoint table, tones, staged and active parameter image, captured frames, stream.
 * A request that starts in a block must end in it.
 *
 * Main loop only.
 */
#ifndef REGISTER_BLOCKS_H
#define REGISTER_BLOCKS_H

#include "modbus/modbus_exception.h"
#include "motion/source.h"

/** Empties the breakpoint table and that of the tones. */
void register_blocks_init(void);

/** The breakpoint table. */
const source_point_t *register_blocks_waveform(void);

/** The tones of the multisine, SOURCE_TONES_MAX. */
const source_tone_t *register_blocks_tones(void);

/** Number of the frame that the block `stream` begins with, unless it was overwritten. */
void register_blocks_stream_from(uint32_t frame);

/** Do all these registers lie in one block? */
bool register_blocks_hold(uint16_t address, uint16_t count);

/* The following: only registers that register_blocks_hold. Errors as in registers.h. */

/** Is it the capture, which cannot always be read? */
bool register_blocks_capture(uint16_t address);
modbus_exception_t register_blocks_check_read(uint16_t address);
void register_blocks_read(uint16_t address, uint16_t count, uint16_t values[]);
modbus_exception_t register_blocks_check_write(uint16_t address);
/** What a write needs: CONTROL_ bits (control.h). */
uint32_t register_blocks_need(uint16_t address);
/** Of what register_blocks_check_write allowed. */
modbus_exception_t register_blocks_write(uint16_t address, uint16_t count, const uint16_t values[]);

#endif
