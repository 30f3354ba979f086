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

/** "SIGINT", "SIGTERM", "SIGHUP"; "a signal" for others. */
const char *stop_signal_name(int number);

/** The number of the signal that has come since; 0: none. */
int stop_signal(void);

#endif
