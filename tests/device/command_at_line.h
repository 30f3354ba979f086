/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The command itself, as a process with real signals, at the application behind a simulated line. Test and command take
 * turns on the line.
 */
#ifndef COMMAND_AT_LINE_H
#define COMMAND_AT_LINE_H

#include "amplifier/device/device.h"
#include <sys/types.h>

/** For what surely comes: a process that ends, a run that begins. */
#define PATIENCE_S 30.0

extern device_t *device; /**< while the test has the line */
extern device_options_t options;
extern failure_t failure;
extern pid_t process;               /**< the command that runs; 0: none */
extern const char *standard_output; /**< where its goes */
extern char errors[4096];           /**< what it said */

/** For setUp: an amplifier whose image has 0..100 V and 0..100 um, parked at 10 V. */
void command_at_line_open(void);
/** For tearDown: ends the command, and the amplifier. */
void command_at_line_close(void);

void must(bool done);
void take_line(void);
void leave_line(void);
int64_t value_of(int which);
/** It is off, or becomes so. */
void expect_goes_off(void);
/** The same image with this number. */
void push(uint32_t model_id);

/** Runs the command with these arguments, the line's added. */
void start(const char *const argument[]);
/** Waits until it has ended: its wait status, and what it said in `errors`. */
int end(void);
/** After a waitpid of the test's own. */
void forget(void);
void wait_for_start(void);
/** Waits for the first line that it says of an error. */
void wait_for_line(void);
/** It said one line, the user's error or a note, with this part in it. */
void expect_error(const char *part);

#endif
