/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The h405 image under emulation, its log and a Modbus master, for the tests in this folder. Fails the running test.
 */
#ifndef EMULATED_H405_H
#define EMULATED_H405_H

#include "amplifier/device/device.h"
#include "peripheral_log.h"

/* Emulated time follows the instructions, so it may be slow. What takes longer than this hangs. */
#define PATIENCE_S 60.0

extern device_t *h405_device;
extern peripheral_log_t h405_log;

/** Starts the image and waits until its loop runs. */
void h405_start(void);

/** Starts the bench image in its place: the same start-up code, without a twin. */
void bench_start(void);

/** Writes a register, in one request. */
void h405_write(unsigned index, int64_t value);

/** Waits until there are this many codes in the log. */
void h405_wait(size_t codes);

/** Through the debugger: the processor goes on where there is no code. */
void h405_crash(void);

/** Likewise: its stack pointer is in the middle of the guard, the lowest 256 bytes of the memory. */
void h405_overflow_stack(void);

/** Call outside of any test, so that a failed one leaves no emulator behind. Allowed when nothing was started. */
void h405_end(void);

/** Fails the test with the failure's line unless ok. */
void check(bool ok, const failure_t *failure);

#endif
