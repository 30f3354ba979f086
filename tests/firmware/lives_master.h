/* SPDX-License-Identifier: MIT */
/**
 * The masters of a random life (lives.h): one that works with the amplifier, and a stranger that should not be there.
 * Both speak by bytes on the line.
 */
#ifndef TESTS_LIVES_MASTER_H
#define TESTS_LIVES_MASTER_H

#include "hyst/fixed.h"
#include "random.h"

/** Samples that the slowest image takes for the whole range. */
#define LIVES_SLOWEST_RAMP 20000

/** What an image asks for. */
typedef struct {
    uint32_t id;
    hyst_q31_t low, high, park, slew;
} lives_image_t;

/** A new life. */
void lives_master_begin(random_t *random);

/** The amplifier has started: what was being asked is not waited for any more. */
void lives_master_start(void);

/** The image of this number, as the master made it; that of an amplifier without one where it made none. */
lives_image_t lives_image(uint32_t id);

/** A sample passes: a byte goes out, or none. */
void lives_master_byte(void);
void lives_stranger_byte(void);

#endif
