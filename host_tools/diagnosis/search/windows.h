/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A window of each long recording (excerpt_window), with samples for fits: enough to choose by among what is strong.
 */
#ifndef WINDOWS_H
#define WINDOWS_H

#include "diagnosis/noise/samples.h"

typedef struct {
    const samples_t *samples; /**< of the windows, shared out by samples_share_ends; or the ones that were given */
    samples_t windowed;
    recording_t *recordings;
    size_t count; /**< 0: nothing was left out */
} windows_t;

/** Of at most `most` samples, all recordings together. All of them stay where they are no more, or a window does not
 * see both ends of its recording's drive, or the windows are too short for the model's memory. What was given must
 * outlive it. */
void windows_open(windows_t *windows, const samples_t *samples, const model_t *model, size_t most);
void windows_close(windows_t *windows);

#endif
