/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What the h405 image wrote to its digital-to-analog converter and to the RS-485 driver enable, read from the log of
 * `qemu -d unimp` while it grows: "DAC: unimplemented device write (size 4, offset 0x00c, value 0x00008000)".
 */
#ifndef PERIPHERAL_LOG_H
#define PERIPHERAL_LOG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#define PERIPHERAL_LOG_CODES 100000

typedef struct {
    FILE *file;
    char line[256];
    size_t line_length;
    uint16_t code[PERIPHERAL_LOG_CODES]; /**< written to DHR12L1, in order */
    size_t codes;
    uint32_t control[8]; /**< first values written to the converter's control register */
    size_t controls;
    size_t codes_at_control[8]; /**< codes written before each of them */
    size_t
        codes_at_food[9];   /**< codes written before the hardware watchdog was first fed after so many of them, or 0 */
    size_t codes_at_answer; /**< codes written before the driver was last enabled: the last answer's place in time */
    size_t answers;
} peripheral_log_t;

/** False when there is no such file. */
bool peripheral_log_open(peripheral_log_t *log, const char *path);

/** Takes in what was written since. */
void peripheral_log_read(peripheral_log_t *log);

/** Reads until there are this many codes. False when that takes longer than `seconds`. */
bool peripheral_log_wait(peripheral_log_t *log, size_t codes, double seconds);

/** Likewise for writes to the converter's control register. */
bool peripheral_log_wait_for_control(peripheral_log_t *log, size_t controls, double seconds);

/** A log that was never opened is allowed. */
void peripheral_log_close(peripheral_log_t *log);

#endif
