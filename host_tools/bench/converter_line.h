/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The converter line of the bench, seen from the actuator's side: two pipes, one each way, in lock step.
 *
 * docs/DESIGN.md, section 6. The bench asks, with the drive code that answers the last position; the next position goes
 * back, and with it the supply of the stage. Every ask is answered at once, if only to say that the next sample is not
 * due yet: the emulator stands still while it waits. Numbers are little-endian.
 */
#ifndef CONVERTER_LINE_H
#define CONVERTER_LINE_H

#include "base/failure.h"
#include <signal.h>
#include <stdint.h>

/** An ask: the drive code, 2 bytes, and whether it is one, 2 bytes. The first ask has none, and in its place the rate
 * of the bench's loop in Hz, 0 if it does not say. An answer: the position code, 2 bytes, whether there is one, 2
 * bytes, the supply of the stage in mV (0: not measured), 4 bytes. */
enum { CONVERTER_ASK_BYTES = 4, CONVERTER_ANSWER_BYTES = 8 };

/** The open line. */
typedef struct {
    int asks, answers;                 /**< read from and written to; -1: closed */
    const char *name;                  /**< for messages */
    const volatile sig_atomic_t *stop; /**< ends every wait when it becomes nonzero */
    double first_ask_s;                /**< the first ask comes within so long; 0: without limit */
    bool asked;                        /**< once */
    unsigned rate_hz;                  /**< of the bench's loop, as its first ask says it; 0: it does not */
} converter_line_t;

typedef enum {
    CONVERTER_DONE,
    CONVERTER_ENDED /**< closed by the other end, or stop requested */,
    CONVERTER_FAILED
} converter_status_t;

/**
 * Makes the named pipes `path`.asks and `path`.answers, waits until a bench has opened both, and removes the names.
 */
converter_status_t converter_open(converter_line_t *line, const char *path, const volatile sig_atomic_t *stop,
                                  failure_t *failure);

/**
 * Waits for an ask: as long as the line says for the first, since a bench has to start, later ten seconds. *driven
 * tells whether it has a drive code; then *drive is valid.
 */
converter_status_t converter_wait(converter_line_t *line, bool *driven, uint16_t *drive, failure_t *failure);

/** Answers the ask with a position. */
converter_status_t converter_answer(const converter_line_t *line, uint16_t position, uint32_t supply_mv,
                                    failure_t *failure);

/** Answers that the next sample is not due yet: the bench asks again, within about a millisecond. */
converter_status_t converter_not_yet(const converter_line_t *line, failure_t *failure);

void converter_close(converter_line_t *line);

#endif
