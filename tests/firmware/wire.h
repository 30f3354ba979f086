/* SPDX-License-Identifier: MIT */
/**
 * The Modbus line as somebody sees it who listens to it and knows nothing of the server: which whole frames went over
 * it, in what order, and which of them were answered and how. Bytes take their time: the test moves the clock.
 */
#ifndef TESTS_WIRE_H
#define TESTS_WIRE_H

#include "modbus/modbus_server.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** Commands that were taken since the last wire_forget, or may have been: a broadcast is not answered. */
#define WIRE_COMMANDS_MAX 32U

typedef struct {
    uint32_t command[WIRE_COMMANDS_MAX];
    bool certain[WIRE_COMMANDS_MAX];
    unsigned count;
    bool heard;       /**< a request was accepted */
    bool maybe_heard; /**< or may have been */
    bool unasked;     /**< an answer without a request */
    bool unanswered;  /**< a whole request to this amplifier, read and not answered */
    unsigned answers; /**< since wire_start */
    unsigned accepted;
} wire_t;

extern wire_t wire;

/** Nothing on the line; listens to the fake board from now on. */
void wire_start(void);

/** A byte arrives, or a broken one. */
void wire_byte(uint8_t byte);
void wire_broken_byte(void);

/** The amplifier sends back what it sends. */
void wire_echoes(bool on);

/** The main loop is about to look at the line: frames that a silence has ended are complete. */
void wire_settle(void);

/** The main loop has looked at the line, and read what was complete. */
void wire_served(void);

/** Is this command among the requests that are complete and not read yet? */
bool wire_waits_for(uint32_t command);

/** What was taken is dealt with. */
void wire_forget(void);

#endif
