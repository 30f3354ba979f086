/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "commands/command.h"

#define COMMAND_ADDRESS(name) &command_##name,
const command_t *const commands[] = {COMMAND_LIST(COMMAND_ADDRESS)};
const size_t commands_count = sizeof commands / sizeof commands[0];
