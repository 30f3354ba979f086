/* SPDX-License-Identifier: GPL-3.0-or-later */
/** SIGINT and SIGTERM as a wish to end, for commands that run until they are told to stop. */
#ifndef STOP_SIGNAL_H
#define STOP_SIGNAL_H

#include <signal.h>

/**
 * From now on SIGINT and SIGTERM interrupt waiting system calls and set the returned flag, and writing to a closed line
 * is an error instead of a signal.
 */
const volatile sig_atomic_t *stop_on_signal(void);

#endif
