/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A serial line with one amplifier on it, as device.h uses it: opened, locked, and asked one request after another.
 *
 * A request that gets no answer or a damaged one is repeated, as often as its caller allows. Before a repetition the
 * line must have been silent for one timeout, and once more after one that succeeded: a late answer would otherwise
 * count as that to the next request, because Modbus RTU has no sequence numbers.
 */
#ifndef SERIAL_LINE_H
#define SERIAL_LINE_H

#include "amplifier/line/line_options.h"
#include <modbus/modbus.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>

typedef struct {
    int lock;         /**< the port once more, with the lock on it; below 0: not open */
    modbus_t *modbus; /**< NULL: not open */
    char *port;
    unsigned long baud, slave;
    double timeout_s;
    unsigned long repetitions;         /**< of requests, since it was opened */
    const volatile sig_atomic_t *stop; /**< or NULL; see device_stop_when */
    device_turn_t *turn;               /**< or NULL; also while it runs */
    void *turn_context;
    int cleaning_up; /**< how often device_clean_up was begun and not ended */
} serial_line_t;

/** One request, so that every kind of it is repeated and reported by the same code. Reads fill `read`. */
typedef struct {
    const char *what; /**< register or block, for messages */
    int address;
    int count;
    uint16_t *read;
    const uint16_t *write;
    int first_address; /**< with `read` as well as `write`: what is written before it is read, else unused */
    int first_count;
    double patience_s; /**< for the answer, where the line's own timeout is shorter */
} request_t;

/** Only after NO_ANSWER, which is silence or damage, another way may be tried. */
typedef enum { LINE_DONE, LINE_NO_ANSWER, LINE_REFUSED, LINE_GONE, LINE_INTERRUPTED } line_outcome_t;

/** Opens and locks the port; nothing is sent. False leaves a line that can be closed. */
bool serial_line_open(serial_line_t *line, const device_options_t *options, failure_t *failure);
/** A line that is not open is allowed. */
void serial_line_close(serial_line_t *line);
/** One that is open, in a child process: device_leave_to_parent. */
void serial_line_leave_to_parent(const serial_line_t *line);

/** Makes one request. `silent`, or NULL: set when nothing at all came. */
line_outcome_t serial_line_request(serial_line_t *line, const request_t *request, int tries, bool *silent,
                                   failure_t *failure);

/** Reads and drops what arrives until nothing has arrived for one timeout; gives up on a line that never falls
 * silent. */
void serial_line_settle(serial_line_t *line);

#endif
