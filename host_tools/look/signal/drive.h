/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What the drive was: where it rests and jumps, whether it repeats itself, its kind, and how it moves between samples.
 *
 * All of it is read off the drive column alone.
 *
 * - A converter slower than the recording holds each value for some samples, always as many, and fewer than a rest has.
 * - A rest is a run of equal values of at least 0.02 s and 16 samples, and of four times the time for which a slow
 *   converter holds each value.
 * - A step is a change between two samples of at least 1 % of the range and eight times the changes around it.
 * - A period is one that two or more passes follow within 0.3 % of the range (RMS), or within the noise of a drive
 *   column that is itself measured.
 */
#ifndef LOOK_DRIVE_H
#define LOOK_DRIVE_H

#include "look/signal/drive_look.h"
#include "recording/recording.h"

/** Of a recording of 16 samples or more; to be freed. false: drive_between_samples is not one of held, line, smooth. */
bool drive_look(const recording_t *recording, drive_look_t *drive, failure_t *failure);
void drive_look_free(drive_look_t *drive);

/** "one sine over and over" */
const char *drive_kind_text(drive_kind_t kind);
/** "sine", as the JSON has it */
const char *drive_kind_name(drive_kind_t kind);

/** Number of whole periods; 0 without any. */
size_t drive_periods(const drive_look_t *drive);
/** How many of them, at the beginning, may not have forgotten what was before: one, or none where there are only two.
 */
size_t drive_unsettled_passes(const drive_look_t *drive);

#endif
