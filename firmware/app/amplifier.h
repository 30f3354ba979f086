/* SPDX-License-Identifier: MIT */
/**
 * The application as a whole: main.c on a board, and the native tests, run it through these two. Main loop only.
 */
#ifndef AMPLIFIER_H
#define AMPLIFIER_H

#include <stdbool.h>
#include <stdint.h>

/** Default parameters, parked. `faults`: what board_init returned. Before board_start. */
void amplifier_init(uint16_t faults);

/** One turn of the main loop: Modbus requests and the watchdog. Returns whether there was a request. */
bool amplifier_serve(void);

#endif
