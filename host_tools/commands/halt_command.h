/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What `hyst stop` and `hyst park` share: one command to the amplifier, and the state that it then reports. */
#ifndef HALT_COMMAND_H
#define HALT_COMMAND_H

#include "amplifier/device/device.h"
#include "command_line/command_line.h"

typedef struct {
    control_command_t halt; /**< COMMAND_STOP, or COMMAND_PARK, which has the option --off (driving_halt) */
    const char *format;     /**< of the JSON */
    const char *sentence;   /**< what was done, without a full stop; what the drive does follows */
} halt_command_t;

/** Reads the options and does it. Returns the exit status. */
int halt_command_run(const command_t *command, const halt_command_t *halt, int argc, char **argv);

#endif
