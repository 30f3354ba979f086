/* SPDX-License-Identifier: GPL-3.0-or-later */
/** SIGINT, SIGTERM and SIGHUP as a request to end, for commands that must clean up first. */
#ifndef STOP_SIGNAL_H
#define STOP_SIGNAL_H

#include <signal.h>

/**
 * From now on SIGINT, SIGTERM and SIGHUP interrupt waiting system calls and set the returned flag to their number, and
 * writing to a closed line is an error instead of a signal. A SIGHUP that was ignored before (nohup) stays ignored.
 */
const volatile sig_atomic_t *stop_on_signal(void);

/** No signal's number: what a flag of the same kind has where the program itself ends the work. */
enum { STOP_BY_PROGRAM = -1 };

/** "SIGINT", "SIGTERM", "SIGHUP"; "by the program"; "a signal" for others. */
const char *stop_signal_name(int number);

/** The number of the signal that has come since; 0: none. */
int stop_signal(void);

#endif
