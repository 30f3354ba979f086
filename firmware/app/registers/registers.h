/* SPDX-License-Identifier: MIT */
/**
 * The register map as a Modbus server sees it: plain 16-bit registers by address (registers.def).
 *
 * A request succeeds or fails as a whole: everything is checked before anything is applied, so a refused write changes
 * nothing. A write that touches several settings and the command applies the settings first.
 *
 * Main loop only.
 */
#ifndef REGISTERS_H
#define REGISTERS_H

#include "board.h"
#include "modbus/modbus_exception.h"
#include <stdint.h>

/** Identity, defaults, a first telemetry snapshot. After loop_init. */
void registers_init(const board_start_t *start, const line_settings_t *line);

/**
 * May these registers be read now? MODBUS_ILLEGAL_ADDRESS when one of them does not exist, MODBUS_DEVICE_FAILURE for
 * the capture block while it is being filled. count >= 1.
 */
modbus_exception_t registers_check_read(uint16_t address, uint16_t count);

/** Reads what registers_check_read allowed. Includes the first register of `sequence`: takes a new snapshot first. */
void registers_read(uint16_t address, uint16_t count, uint16_t values[]);

/**
 * May these registers ever be written? MODBUS_ILLEGAL_ADDRESS as in registers_write. count >= 1.
 */
modbus_exception_t registers_check_write(uint16_t address, uint16_t count);

/**
 * May these registers be read once these values are written, in one request? As registers_check_read, for what the
 * write makes of it: it may arm a capture, or end it. What is wrong with the write itself comes first where it makes a
 * difference, and else is left to registers_write. Both counts >= 1.
 */
modbus_exception_t registers_check_read_after(uint16_t address, uint16_t count, uint16_t written, uint16_t write_count,
                                              const uint16_t values[]);

/**
 * MODBUS_ILLEGAL_ADDRESS when a register does not exist, is read only, or is half of a value whose other half is not
 * written. MODBUS_ILLEGAL_VALUE when a value is out of range or a command is not possible now; MODBUS_DEVICE_FAILURE
 * for what is locked (control.h), and for a table while it plays. count >= 1.
 */
modbus_exception_t registers_write(uint16_t address, uint16_t count, const uint16_t values[]);

/** The same for a request to every amplifier of the line, which is refused unless all of it is meant for that
 * (control_may_be_broadcast). */
modbus_exception_t registers_write_broadcast(uint16_t address, uint16_t count, const uint16_t values[]);

#endif
