/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Which blocks of time of a recording are held out: one of each three, by its drive alone. */
#ifndef HELD_OUT_H
#define HELD_OUT_H

#include "recording/recording.h"

enum { HELD_OUT_BLOCKS = 36, HELD_OUT_EVERY = 3, HELD_OUT_GROUPS = HELD_OUT_BLOCKS / HELD_OUT_EVERY };

typedef struct {
    unsigned char of_three[HELD_OUT_GROUPS]; /**< of each three blocks the one */
} held_out_t;

/** The last of each three. */
held_out_t held_out_usually(void);

/**
 * The usual ones, or, where fitted or held-out samples had hardly one near an end of the drive's range, the ones that
 * share those samples better: an amplifier's rails are found and confirmed only where both parts reach them.
 *
 * A drive may go its paths again in step with the blocks: 4, 6 or 12 periods, or 12 triangles of several widths. The
 * same part of each path would be held out, and no fit would see it. A path is known by the level and that of its last
 * turn, each in 24 steps. Where more than most_unseen_paths of the held-out samples are on paths that no fit sees, the
 * ones are chosen by which both parts share all paths as evenly as can be.
 *
 * `from`: the first sample that counts.
 */
held_out_t held_out_choose(const recording_t *recording, size_t from);

/** Whether a value of the drive is near one end of its range (0: the low one), as rails show. */
bool drive_near_end(double drive_v, size_t end, const double range[2]);

/** Of so many samples, in 36 blocks. */
bool is_held_out(const held_out_t *order, size_t samples, size_t sample);

#endif
