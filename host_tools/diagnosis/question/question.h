/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The question of a diagnosis: the recordings, which of their samples count, and what of them is noise. The first
 * stages make it; those that search have it as const. */
#ifndef QUESTION_H
#define QUESTION_H

#include "belief/rivals.h"
#include "belief/shape.h"
#include "diagnosis/noise/lines.h"
#include "diagnosis/noise/remainder.h"

typedef struct question {
    recording_t *recordings; /**< as they were given, but for clock_s (line_clock.h); their columns are the caller's */
    samples_t samples;       /**< of these */
    noise_t noise;
    noise_t heard_noise; /**< at rest, beside the answer of a diagnosis before; samples 0: none */
    bool model_given;
    probe_seen_t seen;             /**< by the look; all 0: it was not asked */
    double step_um, step_sigma_um; /**< of the converter, 0: none to be seen */
    bool coarse;                   /**< the steps' error is larger than the noise */
    shape_t shape; /**< the universal operator in the place of the hysteresis, before anything is found */
    probe_setting_t setting;
    double line_hz[LINES_MOST];
} question_t;

/** What a search begins with that knows of no lines. */
void question_setting(const recording_t *recordings, size_t count, probe_setting_t *setting);

/** To be freed, also where question_begin fails. seen: what a look has shown, or NULL. */
question_t *question_open(bool model_given, const probe_seen_t *seen);
void question_free(const question_t *question);

/** Fills what all that follows has in common: the recordings, the samples that are included, the steps of the
 * converter. The model says how long its memory is. */
bool question_begin(question_t *question, const model_t *model, const recording_t *recordings, size_t count,
                    failure_t *failure);

/** The noise, with a model that explains the recordings as far as any does by now. */
bool question_noise(question_t *question, const model_t *model, failure_t *failure);

/** Whether what rings or creeps into the rests was taken for most of their noise: beside what this model explains of
 * the readings, the rests are quieter by threshold.quieter. *noise is what they have then. */
bool question_rests_quieter(const question_t *question, const model_t *model, noise_t *noise);

/** What the operator says, in the place of the chain's hysteresis, and its noise. beside: fitted to the question's
 * samples, or empty. Where the drive never rests, the noise was found beside a model of few numbers, and what that
 * leaves of the loops' shape counts as noise. Where the operator leaves nothing but noise, it says it better. */
void question_imitate(question_t *question, fitted_chain_t *beside);
/** Which blocks speak beside the operator: of the question's shape, what shape_scan adds to it. A search reads none of
 * this before it asks what was heard, so it may go on meanwhile. */
void question_listen(question_t *question, fitted_chain_t *beside);

/** The same question with its samples shared out anew (samples_share_ends), and how to free it: all else is the other
 * one's. */
question_t *question_share_ends(const question_t *question);
void question_free_shared(const question_t *shared);

#endif
