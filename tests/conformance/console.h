/* SPDX-License-Identifier: MIT */
/** Where a program that runs natively and under emulation prints. */
#ifndef CONSOLE_H
#define CONSOLE_H

#include <stdint.h>

void console_write(const char *text);

/** Ends the program, natively or emulated; 0 is success. */
_Noreturn void console_exit(int status);

#endif
