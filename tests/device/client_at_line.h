/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The Modbus client at the application behind a simulated line: what tests of the client share. Their setUp and
 * tearDown begin and end it.
 */
#ifndef CLIENT_AT_LINE_H
#define CLIENT_AT_LINE_H

#include "amplifier/device/device.h"

/** Short, so that faults cost little time, and long enough for a loaded machine to answer. */
#define TIMEOUT_S 0.25

extern device_options_t options;
extern device_t *device; /**< NULL: closed */
extern failure_t failure;

/** For setUp: an amplifier, at which nothing is opened yet. */
void client_at_line_open(void);
/** For tearDown. */
void client_at_line_close(void);

/** Opens `device`, and unlocks it. */
void open_device(void);
/** It does not open, and this is a part of the line that says why. */
void refuses_to_open(const char *part);
/** The failure is one line with this part in it. */
void expect_line(const char *part);
int64_t read_register(int which);

#endif
