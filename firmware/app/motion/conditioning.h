/* SPDX-License-Identifier: MIT */
/**
 * Conditioning: a sweep over the whole drive range, which erases whatever memory of the past the actuator and the
 * model did not share (docs/MODELS.md, wiping-out).
 *
 * From where the drive is up to the end of its range, down to the other, back to the parking drive. A leg ends when the
 * drive itself has arrived, so that a transition that is still under way cannot cut the sweep short.
 *
 * May be called from: the context that owns the conditioning_t (the sample interrupt; the main loop under board_lock).
 */
#ifndef CONDITIONING_H
#define CONDITIONING_H

#include "motion/drive_range.h"
#include <stdbool.h>

typedef enum { CONDITIONING_OFF, CONDITIONING_UP, CONDITIONING_DOWN, CONDITIONING_TO_PARK } conditioning_leg_t;

typedef struct {
    conditioning_leg_t leg;
    bool begun;           /**< the first sample was made */
    hyst_q31_t reference; /**< direct drive of the last sample */
} conditioning_t;

/** Begins at `reference`, a direct drive. */
void conditioning_start(conditioning_t *conditioning, hyst_q31_t reference);

/** Before each sample: looks whether the last `drive` ended a leg. Returns whether the sweep goes on. */
bool conditioning_continues(conditioning_t *conditioning, const drive_range_t *range, hyst_q31_t drive);

/** The direct drive of this sample, at most `rate` from the last one. */
hyst_q31_t conditioning_step(conditioning_t *conditioning, const drive_range_t *range, hyst_q31_t rate);

#endif
