/* SPDX-License-Identifier: MIT */
/**
 * What the registers mean: which values they may take, what happens when they are written, where their values come
 * from. registers.c does the addresses.
 *
 * `value` is the value of every register by INDEX_ (register_table.h).
 * Main loop only.
 */
#ifndef CONTROL_H
#define CONTROL_H

#include "board.h"
#include "registers/register_table.h"
#include <stdbool.h>

/** Register `command`. */
typedef enum {
    COMMAND_NONE = 0,
    COMMAND_COMMIT = 1,
    COMMAND_START = 2,
    COMMAND_STOP = 3,
    COMMAND_CONDITION = 4,
    COMMAND_ARM_CAPTURE = 5,
    COMMAND_CLEAR = 6,
    COMMAND_PARK = 7,
    COMMAND_LATCH = 8,
    COMMAND_ARM = 9,
    COMMAND_DISARM = 10,
    COMMAND_SAVE = 11,
    COMMAND_END_CAPTURE = 12,
    COMMAND_SAVE_LINE = 13
} control_command_t;

/** Register `write_refused`. Append only. */
typedef enum {
    WRITE_TAKEN = 0,
    WRITE_NO_REGISTER = 1,
    WRITE_READ_ONLY = 2,
    WRITE_HALF = 3,
    WRITE_VALUE = 4,
    WRITE_COMMAND = 5,
    WRITE_PARAMETERS_LOCKED = 6,
    WRITE_OUTPUT_LOCKED = 7,
    WRITE_BROADCAST = 8,
    WRITE_PLAYS = 9
} write_refusal_t;

/** Register `unlock`, beside 0. */
enum { CONTROL_KEY_PARAMETERS = 0x5041, CONTROL_KEY_OUTPUT = 0x4F4E };

/** Bits of the register `unlocked`, and what a write needs of them. */
enum { CONTROL_PARAMETERS = 1, CONTROL_OUTPUT = 2 };

/** What writing this value to register `index` needs; 0: nothing, it makes nothing move and changes no parameter. */
uint32_t control_needs(unsigned index, uint32_t value);

/** May a broadcast write this value to register `index`? It reaches every amplifier of the line, whatever each of them
 * is doing: only what makes the output safe, or changes nothing that moves or protects. */
bool control_may_be_broadcast(unsigned index, uint32_t value);

/** Identity, defaults, and the limits that were stored with the image: they are put in force. After loop_init. */
void control_init(uint32_t value[REGISTER_COUNT], const board_start_t *start, const line_settings_t *line);

/** Could these values be in force, as far as register `index` is concerned? For the command: is it possible now? */
bool control_setting_valid(unsigned index, const uint32_t value[REGISTER_COUNT]);

/** Could the captured frames be read once these values are in force and their command, which is possible, was executed?
 */
bool control_leaves_capture_readable(const uint32_t value[REGISTER_COUNT]);

/** Register `index` was written: makes the loop follow. */
void control_apply(unsigned index, uint32_t value[REGISTER_COUNT]);

/** Executes a command that control_setting_valid found possible. */
void control_execute(control_command_t command, uint32_t value[REGISTER_COUNT]);

/** Fetches the registers that change by themselves, other than telemetry. */
void control_refresh(uint32_t value[REGISTER_COUNT]);

/** Takes a telemetry snapshot. */
void control_latch(uint32_t value[REGISTER_COUNT]);

#endif
