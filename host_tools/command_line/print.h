/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Output that all commands share. Only commands print: the lower rooms return values and failures. */
#ifndef PRINT_H
#define PRINT_H

#include "amplifier/experiment.h"
#include "base/failure.h"
#include <jansson.h>

/** Prints "hyst: line" to stderr. Returns STATUS_FAILED. */
int failure_print(const failure_t *failure);

/** Where JSON goes from now on: a file, or NULL: stdout. Set by options_parse, from --json[=FILE]. */
void json_into(const char *file);
/** That file, or NULL. */
const char *json_file(void);

/**
 * Writes the answer to stdout and ends the line, or writes it as the whole of the file; drops the reference. `flags` as
 * for json_dumpf: JSON_INDENT(2), JSON_COMPACT. A NULL value is a failure.
 */
bool json_print(json_t *value, size_t flags, failure_t *failure);

/** Writes one of many answers, on a separate line, to the same place; the file is complete when json_end closes it.
 */
bool json_print_line(json_t *value, failure_t *failure);
/** Ends what json_print_line began; nothing otherwise. Not good: the file stays as it was. */
bool json_end(bool good, failure_t *failure);

/** Whether the command also prints its text: unless JSON goes to stdout. json: whether the option was given. */
bool text_wanted(bool json);

/** Whether what was printed did not reach stdout because it is a pipe that its reader has closed (`| head`). That is no
 * failure to tell of: main ends as the signal for it would have ended the process. */
bool reader_has_left(void);

/** "note: ..." lines on stderr about events that a user should know of. */
void experiment_print_events(const experiment_events_t *events);

/** From now on what leads the amplifier out of a fault has one "note: ..." line on stderr of which it is. */
void device_print_left_fault(device_t *device);

/** Before an image is put into the amplifier: one "note: ..." line on stderr if that happens while it is driven. */
void device_print_driven(device_t *device);

/** Ends the program with a line and STATUS_FAILED: the handler for on_out_of_memory. */
void out_of_memory_print(size_t count, size_t size);

#endif
