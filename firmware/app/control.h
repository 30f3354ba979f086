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
#include "register_table.h"
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
    COMMAND_SAVE = 11
} control_command_t;

/** Identity and defaults. */
void control_init(uint32_t value[REGISTER_COUNT], const board_start_t *start);

/** Could these values be in force, as far as register `index` is concerned? For the command: is it possible now? */
bool control_setting_valid(unsigned index, const uint32_t value[REGISTER_COUNT]);

/** Register `index` was written: makes the loop follow. */
void control_apply(unsigned index, const uint32_t value[REGISTER_COUNT]);

/** Executes a command that control_setting_valid found possible. */
void control_execute(control_command_t command, uint32_t value[REGISTER_COUNT]);

/** Fetches the registers that change by themselves, other than telemetry. */
void control_refresh(uint32_t value[REGISTER_COUNT]);

/** Takes a telemetry snapshot. */
void control_latch(uint32_t value[REGISTER_COUNT]);

#endif
