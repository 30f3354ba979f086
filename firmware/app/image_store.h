/* SPDX-License-Identifier: MIT */
/**
 * The parameter image that survives: two flash sectors, written in turn, so that one whole copy is always there.
 *
 * A copy is, in words: magic, layout version, sequence number, length of the image, the image, CRC-32 of all that. The
 * CRC is programmed last, so a copy is whole or it is none. A save erases the sector that does not hold the newest
 * copy, programs it, reads it back; the other one is not touched. After a cut at any moment the newest whole copy is
 * exactly the old image or exactly the new one (tests/firmware/test_power_loss.c).
 *
 * Wear: a save erases one sector, each sector every second save; 10,000 erasures a sector (STM32F405 datasheet) are
 * 20,000 saves.
 *
 * Main loop only, with the output parked and off: erasing stalls the processor of an h405 for up to 0.5 s, and the
 * sample interrupt with it.
 */
#ifndef IMAGE_STORE_H
#define IMAGE_STORE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** A copy of the newest image, at most `capacity` words. Returns its length, 0 if there is none. *sequence receives its
 * number, if it is not NULL. */
size_t image_store_load(uint32_t *image, size_t capacity, uint32_t *sequence);

/** Makes this image the newest. False when the flash did not take it: then the one before still is. */
bool image_store_save(const uint32_t *image, size_t length);

#endif
