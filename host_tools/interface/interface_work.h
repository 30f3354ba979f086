/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Long work behind hyst_interface.h: one at a time, with the listener of the calling thread. */
#ifndef INTERFACE_WORK_H
#define INTERFACE_WORK_H

#include <signal.h>

/** Waits for other long work of the process to end. Until interface_work_end OpenBLAS has one thread. */
void interface_work_begin(void);
void interface_work_end(void);

/** Reports of progress go to the listener of the calling thread. For work that is not long work, and may run beside it:
 * a listener that wants it to end sets this flag to the number of a signal. */
void interface_listen(volatile sig_atomic_t *flag);

#endif
