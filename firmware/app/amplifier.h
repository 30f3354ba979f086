/* SPDX-License-Identifier: MIT */
/**
 * The application as a whole: main.c on a board, and the native tests, run it through these two. Main loop only.
 */
#ifndef AMPLIFIER_H
#define AMPLIFIER_H

#include <stdbool.h>

#include "board.h"

/** Default parameters, off, parked. `start`: what board_init returned. Before board_start. */
void amplifier_init(const board_start_t *start);

/** One turn of the main loop: Modbus requests, and the hardware watchdog when the sample interrupt has run since it was
 * last fed. Returns whether there was a request. */
bool amplifier_serve(void);

#endif
