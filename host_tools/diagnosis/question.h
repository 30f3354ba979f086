/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The question of a diagnosis: the recordings, which of their samples count, and what of them is noise. */
#ifndef QUESTION_H
#define QUESTION_H

#include "diagnosis/attempt.h"

/** What a search begins with that knows of no lines. */
void question_setting(const recording_t *recordings, size_t count, probe_setting_t *setting);

/** Fills what all that follows has in common: the recordings, the samples that are included, the steps of the
 * converter. The model says how long its memory is. */
bool question_begin(attempt_t *job, const model_t *model, const recording_t *recordings, size_t count);

/** The noise, with a model that explains the recordings as far as any does by now. */
bool question_noise(attempt_t *job, const model_t *model);

/** Where the drive never rests, the noise was found beside a model of few numbers, and what that leaves of the loops'
 * shape counts as noise. Where the universal operator (job->beside) leaves nothing but noise, it says it better. */
void question_noise_beside(attempt_t *job);

#endif
