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

#include "base/failure.h"
#include <modbus/modbus.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>

typedef struct {
    const char *port;
    unsigned long baud;
    unsigned long slave;
    const char *parity;  /**< "none", "even" or "odd" */
    double timeout_s;    /**< to wait for an answer */
    bool look_elsewhere; /**< where nobody answers, find out at which other settings somebody does (line_search.h) */
} device_options_t;

#define DEVICE_OPTIONS_DEFAULT                                                                                         \
    { .port = NULL, .baud = 115200, .slave = 1, .parity = "none", .timeout_s = 0.5, .look_elsewhere = false }

/** The number of a parity (line_parity_t), or -1; and the name of a number, which may be unknown. */
int parity_number(const char *name);
const char *parity_name(int64_t number);

/** Whether they can be right. The messages call them by their names on the command line. */
bool device_options_check(const device_options_t *options, failure_t *failure);

/** Called before each try of a request, in the thread that makes it. False, with a line in *failure, makes the request
 * fail at once. Requests that it makes itself do not call it again. */
typedef bool device_turn_t(void *context, failure_t *failure);

typedef struct {
    modbus_t *modbus; /**< NULL: not open */
    char *port;
    unsigned long baud, slave;
    double timeout_s;
    unsigned long repetitions;         /**< of requests, since it was opened */
    const volatile sig_atomic_t *stop; /**< or NULL; see device_stop_when */
    device_turn_t *turn;               /**< or NULL; also while it runs */
    void *turn_context;
} serial_line_t;

/** Tries of a request that may be repeated. */
#define LINE_TRIES 3

/** One request, so that every kind of it is repeated and reported by the same code. Reads fill `read`. */
typedef struct {
    const char *what; /**< register or block, for messages */
    int address;
    int count;
    uint16_t *read;
    const uint16_t *write;
    int first_address,
        first_count; /**< with `read` as well as `write`: what is written before it is read, else unused */
} request_t;

/** Only after NO_ANSWER, which is silence or damage, another way may be tried. */
typedef enum { OUTCOME_DONE, OUTCOME_NO_ANSWER, OUTCOME_REFUSED, OUTCOME_INTERRUPTED } outcome_t;

/** Opens and locks the port; nothing is sent. False leaves a line that can be closed. */
bool serial_line_open(serial_line_t *line, const device_options_t *options, failure_t *failure);
/** A line that is not open is allowed. */
void serial_line_close(serial_line_t *line);

/** Makes one request. `silent`, or NULL: set when nothing at all came. */
outcome_t serial_line_request(serial_line_t *line, const request_t *request, int tries, bool *silent,
                              failure_t *failure);

/** Reads and drops what arrives until nothing has arrived for one timeout; gives up on a line that never falls
 * silent. */
void serial_line_settle(serial_line_t *line);

#endif
