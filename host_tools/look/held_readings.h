/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A sensor that is slower than the rows of the file, so that each of its readings stands in several of them. */
#ifndef LOOK_HELD_READINGS_H
#define LOOK_HELD_READINGS_H

#include "look/fault.h"

typedef struct {
    size_t rows;       /**< in which each reading stands; 0: nothing of the kind */
    size_t first;      /**< row in which a reading is new; so is each `rows` later */
    double changes;    /**< of the reading, that come at whole multiples of `rows` and could have come between */
    double log_chance; /**< log10 of the chance of so many at such multiples, over all numbers of rows */
    double rate_hz;    /**< at which the sensor was read */
} held_readings_t;

/**
 * Changes of the reading are `rows` apart, most often, and nearly all of them at multiples of it, since two readings in
 * turn may be equal. A change counts if fresh readings would have shown it in pieces. For that, other readings have to
 * lie between those before and after it: a coarse converter goes on step by step. And in the `rows` up to it the drive
 * has to rest, or to move more than once: that of a slow converter moves once, and a position without noise with it.
 * That a change comes at such a multiple by chance has a probability of 1 / rows.
 */
void held_readings_find(const recording_t *recording, held_readings_t *held);

/** The fault that this is, if its chance is below the limit. */
fault_t *held_readings_add(fault_list_t *faults, size_t recording, const held_readings_t *held);

/** Keeps the first row of each reading. Does nothing and returns false unless all recordings then have enough samples
 * to be looked at. held: what was found in each. */
bool held_readings_undo(recording_t *recordings, size_t count, const held_readings_t *held);

#endif
