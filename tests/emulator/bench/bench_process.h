/* SPDX-License-Identifier: GPL-3.0-or-later */
/** `hyst bench` as a child process of the test. */
#ifndef TESTS_BENCH_PROCESS_H
#define TESTS_BENCH_PROCESS_H

#include <stdbool.h>

/** Starts it with the image under test and the model at this path. Returns the port it prints; ends the test program if
 * it prints none. */
const char *bench_start(const char *model, const char *log);

/** Asks it to end. Returns whether it ended cleanly. It also ends when the test program does. */
bool bench_stop(void);

#endif
