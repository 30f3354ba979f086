/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The way to an amplifier and back: opens its line, and looks whether it is one that is known here. */
#ifndef OPENING_H
#define OPENING_H

#include "amplifier/device/device.h"

/** Connects, locks the port, and checks that an amplifier with a known register map answers. NULL on failure. Where
 * none does and the options say so, the line names the settings at which one does (line_search.h). */
device_t *device_open(const device_options_t *options, failure_t *failure);
/** The same, also with an amplifier whose register map has another version. Then only device_command with COMMAND_STOP,
 * COMMAND_PARK and COMMAND_DISARM is of use, which mean the same in every version. */
device_t *device_open_any_map(const device_options_t *options, failure_t *failure);
/** NULL is allowed. */
void device_close(device_t *device);

/** In a child process, after fork(): closes what it has inherited of the port. Nothing is sent; the line stays the
 * parent's, and its lock ends with the parent. */
void device_leave_to_parent(const device_t *device);

#endif
