/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Where an amplifier is reached: a port, its settings, and an address on it. */
#ifndef LINE_OPTIONS_H
#define LINE_OPTIONS_H

#include "base/failure.h"
#include <stdbool.h>
#include <stdint.h>

typedef struct {
    const char *port;
    unsigned long baud;
    unsigned long slave;
    const char *parity;  /**< "none", "even" or "odd" */
    double timeout_s;    /**< to wait for an answer */
    bool look_elsewhere; /**< where none answers, find out at which other settings one does (line_search.h) */
    bool port_optional;  /**< device_options_check takes a port that is NULL: the amplifier may be elsewhere */
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

#endif
