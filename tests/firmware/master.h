/* SPDX-License-Identifier: MIT */
/**
 * A Modbus master for tests, one call away from the server: every register access of the tests goes through frames.
 */
#ifndef TESTS_MASTER_H
#define TESTS_MASTER_H

#include "modbus/modbus_exception.h"
#include "modbus/modbus_server.h"
#include "registers/control.h"
#include "registers/register_table.h"

/** The server's address, unless a test has changed it. */
#define MASTER_SERVER 1U

/** Address, PDU and CRC. Returns the frame's length. */
size_t master_frame(uint8_t frame[MODBUS_FRAME_MAX], uint8_t address, const uint8_t *pdu, size_t length);

/** Sends a PDU to the server at its address; the test fails unless it answers with a well-formed frame. Returns the
 * length of the answer's PDU. */
size_t master_ask(const uint8_t *pdu, size_t length, uint8_t answer[MODBUS_FRAME_MAX]);

/** Functions 3 and 16. */
modbus_exception_t master_read(uint16_t address, uint16_t count, uint16_t values[]);
modbus_exception_t master_write(uint16_t address, uint16_t count, const uint16_t values[]);

/** One register of the table, by its INDEX_; two-register values as a whole. A telemetry register is read from a new
 * snapshot. The test fails on an exception. */
uint32_t master_get(unsigned index);

/** Likewise; returns the exception. */
modbus_exception_t master_set(unsigned index, uint32_t value);

/** Likewise; the test fails on an exception. */
void master_put(unsigned index, uint32_t value);

/** A value that a writable register takes after a start, and not the one that it has then where that can be. */
uint32_t master_value_in_range(unsigned index);

/** Master_put of the command; the test fails on an exception. */
void master_command(control_command_t command);

/** Writes words to a block, in as many requests as it takes; the test fails on an exception. */
void master_write_words(uint16_t block, const uint32_t *words, size_t count);

/** The command that this request of so many bytes writes, by whichever function: to the register, or by the coil. 0 for
 * none. A request that is malformed writes nothing, whatever this says. */
uint32_t master_command_of(const uint8_t *pdu, size_t length);

#endif
