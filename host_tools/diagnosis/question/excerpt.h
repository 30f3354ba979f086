/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a diagnosis uses of long recordings. Its memory and its time grow with the samples (some 2.8 kB each), so there
 * is a limit: threshold.most_samples of all recordings together. Below it everything is used. Above it each longer one
 * has an even share, and what is used of it is one window without gaps: filters, delays, creep and a hysteresis' memory
 * need the samples in between.
 *
 * The window is the one in which the drive shows most of what it does: of 8 levels by 16 octaves of its rate, the most
 * combinations; the first of equal ones. It has to see both ends of the drive's range. Where the drive is so slow that
 * no window does, the samples become means of 2, 4, 8 .. neighbours, as few as will do. The same number of them then
 * spans more time, and what is quicker than these is not seen.
 *
 * What takes longer than the window, or happens outside of it, is not seen either. The error that the answer's model
 * delivers is that of the whole recording (delivered.h).
 */
#ifndef EXCERPT_H
#define EXCERPT_H

#include "recording/recording.h"

/** Shortens recordings that have more than `most` samples together. A shortened one keeps the other as its `whole`. */
void excerpt(recording_t *recordings, size_t count, size_t most);

/** The part that this would use of one recording, by itself: a copy to be freed. */
void excerpt_copy(const recording_t *recording, size_t most, recording_t *part);

/** The best window of so many samples, fewer than the recording has. false: none sees both ends of the drive's range.
 */
bool excerpt_window(const recording_t *recording, size_t samples, size_t *first);

/** Of how many samples of the whole each sample is the mean; 1: the samples themselves, or nothing was left out. */
size_t excerpt_mean_of(const recording_t *recording);

/** Length of a line for excerpt_text. */
enum { EXCERPT_LINE = 400 };
/** What was used of the recording, in plain words. false: all of it. */
bool excerpt_text(const recording_t *recording, char text[EXCERPT_LINE]);

#endif
