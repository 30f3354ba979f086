/* SPDX-License-Identifier: MIT */
/**
 * The parameter image, the limits that belong to it and the settings of the line that survive: two flash sectors,
 * written in turn, so that one whole copy is always there.
 *
 * A copy begins with these words: magic, layout version (3), sequence number, length of the image, address (bits 0 to
 * 7) and parity (8 to 15) of the line, its rate, number of limits. Then come two words for each limit (address of the
 * register, value), the image, and a CRC-32 of all that. A copy may have no image. Layout 2 had no limits, and the
 * image followed the rate. Layout 1 had no line either, and the image followed its length. Both are read: without
 * limits, and layout 1 with LINE_SETTINGS_DEFAULT.
 *
 * The CRC is programmed last, so a copy is whole or it is none. A save erases the sector that does not hold the newest
 * copy, programs it, reads it back; the other one is not touched. What a save does not change it takes from the newest
 * copy. After a cut at any moment the newest whole copy is exactly the old one or exactly the new one
 * (tests/firmware/test_power_loss.c).
 *
 * Wear: a save erases one sector, each sector every second save; 10,000 erasures a sector (STM32F405 datasheet) are
 * 20,000 saves.
 *
 * Main loop only, with the output parked and off: erasing stalls the processor of an h405 for up to 0.5 s, and the
 * sample interrupt with it.
 */
#ifndef IMAGE_STORE_H
#define IMAGE_STORE_H

#include "store/line_settings.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** A limit that is stored: what a register held. By address, which is a contract; an index is not. */
typedef struct {
    uint32_t address, value;
} stored_limit_t;

/** Limits that a copy can hold. */
#define IMAGE_STORE_LIMITS_MAX 32U

/** The newest image, at most `capacity` words. Returns its length, 0 if there is none. */
size_t image_store_load(uint32_t *image, size_t capacity);

/** The limits that were stored with it. Returns how many. */
size_t image_store_limits(stored_limit_t limits[IMAGE_STORE_LIMITS_MAX]);

/** The newest settings of the line; those of LINE_SETTINGS_DEFAULT if none are stored. Not checked. */
line_settings_t image_store_line(void);

/** Number of the newest copy, 0 if there is none. */
uint32_t image_store_sequence(void);

/** Makes this image with these limits the newest, or these settings. False when the flash did not take it: then the one
 * before still is. */
bool image_store_save(const uint32_t *image, size_t length, const stored_limit_t *limits, size_t limit_count);
bool image_store_save_line(const line_settings_t *line);

#endif
