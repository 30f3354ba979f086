/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What a signal that ends a command has to do first. */
#ifndef ENDING_SIGNALS_H
#define ENDING_SIGNALS_H

/**
 * From now on SIGINT, SIGTERM, SIGHUP and SIGPIPE remove the .part of every file that is being written
 * (base/output_file.h) before they end the process, where they would have ended it. For the beginning of a program;
 * commands that stop an amplifier first take the signals over (base/stop_signal.h).
 */
void ending_signals_remove_parts(void);

#endif
