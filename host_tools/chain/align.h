/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Drive and position of a recording at the same instants.
 *
 * Converters that are read in turn sample the two columns a part of a sample apart, and a filter of one of them delays
 * it by whole samples. That is no property of the actuator. Where the header says it (displacement_sampled_after_s,
 * recording_sampled_after), it is undone before anything is fitted, simulated or diagnosed. A delay that is found
 * afterwards is the actuator's and its amplifier's.
 */
#ifndef ALIGN_H
#define ALIGN_H

#include "recording/recording.h"

/**
 * Takes drive and reference at the instants at which the position was sampled. The readings stay as they are. Between
 * two samples the drive is what smooth_drive.h and so a block transport_delay says: a fraction of a sample is the
 * inverse of that block. Of whole samples it is exact. Where a drive has a corner between two instants, the corner is
 * cut, by at most half of what the drive moves in one sample.
 *
 * Where the header says that the drive is held (drive_between_samples), nothing is between two samples: whole samples
 * are moved, and recording->held_since is the rest, how long a row's drive is out when its position is sampled. The key
 * is then that rest.
 *
 * Where it says that the drive goes from row to row in steps of a time (drive_step_s), recording->steps is how many.
 *
 * Rows at an end that have no drive at their instant are dropped: one for a part of a sample. The key is then 0, and
 * the key drive_moved_s says what was done; so a second call changes nothing. A line of recording->understood says it,
 * too. Without the key nothing is changed. Fails on a bad key, and on one that leaves less than half of the recording.
 */
bool recording_align(recording_t *recording, failure_t *failure);

#endif
