/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Where on a port an amplifier answers, when none does at the settings that were given. */
#ifndef LINE_SEARCH_H
#define LINE_SEARCH_H

#include "amplifier/line/serial_line.h"

/**
 * Asks once at every other rate and parity that an amplifier can have (LINE_BAUD_MIN to LINE_BAUD_MAX, as far as
 * serial ports have them), at the address that was given, and at address 1 if that is another. Only the register
 * `magic` is read: a device of another kind, or at another rate, takes no harm. Each waits 0.1 s for an answer and 0.1
 * s for silence, which is 5 s an address. Other addresses are not tried.
 *
 * Returns whether one answers, with its settings in *found, which has the port and the timeout of `options`.
 */
bool line_search(const device_options_t *options, device_options_t *found);

#endif
