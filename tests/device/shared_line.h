/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Several amplifiers on one two-wire line behind one pseudo-terminal, each the application on the fake board in a
 * process of its own. Each hears the master and all the others. What is sent without a pause is a burst, and between
 * bursts there is the silence that the standard asks for, so nothing depends on how busy this machine is. While a burst
 * is on the line each loop makes some samples.
 */
#ifndef TESTS_SHARED_LINE_H
#define TESTS_SHARED_LINE_H

#include <stdint.h>

#define SHARED_LINE_MAX 4U

/** What one of them does with its answers. */
typedef enum {
    ANSWERS_RIGHT,
    ANSWERS_NOT,
    ANSWERS_LATE,      /**< by delay_ms */
    ANSWERS_GARBLED,   /**< one bit flipped */
    ANSWERS_CUT,       /**< without the last three bytes */
    ANSWERS_AS_NOBODY, /**< in the name of an address that no one has */
    ANSWERS_TWICE
} answers_t;

typedef struct {
    volatile answers_t answers;
    volatile unsigned delay_ms;
    volatile unsigned sent; /**< answers */
} shared_line_node_t;

/** Starts `count` amplifiers at these addresses, each armed and holding, unlocked. Returns the port. */
const char *shared_line_start(const uint8_t *addresses, unsigned count);
shared_line_node_t *shared_line_node(unsigned which);

/** Ends their processes. */
void shared_line_stop(void);

#endif
