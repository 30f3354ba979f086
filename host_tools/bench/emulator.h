/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The bench: the amplifier's firmware under qemu, with its serial line on a pseudo-terminal and a converter line to
 * the twin. The image may use the files of this user (Arm semihosting): start none that you do not trust. */
#ifndef EMULATOR_H
#define EMULATOR_H

#include "base/failure.h"
#include "bench/converter_line.h"
#include <sys/types.h>

typedef struct {
    pid_t process;
    char port[64];         /**< pseudo-terminal of the Modbus line */
    converter_line_t line; /**< the twin's end of the converter line; `stop` is the caller's to set */
    int output;            /**< what the emulator prints */
    int port_holder;       /**< keeps the pseudo-terminal open */
} emulator_t;

/** One that was not started. */
#define EMULATOR_NONE                                                                                                  \
    { .process = -1, .line = {.asks = -1, .answers = -1}, .output = -1, .port_holder = -1 }

/**
 * Starts `program` (qemu-system-arm) with the image. The pseudo-terminal is used only while the emulator is known to
 * hold its other end, so `program` must be the emulator itself or exec it. On failure everything that was started has
 * ended. The emulator also ends when this process does, however that happens.
 */
bool emulator_start(emulator_t *emulator, const char *program, const char *image, failure_t *failure);

/** Ends the emulator. Returns false, with a line, if it had ended on its own before. */
bool emulator_stop(emulator_t *emulator, failure_t *failure);
/** When its line has closed, which its end does a moment before the process can be waited for: how it ended. False. */
bool emulator_has_ended(emulator_t *emulator, failure_t *failure);

#endif
