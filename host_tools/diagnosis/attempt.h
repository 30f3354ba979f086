/* SPDX-License-Identifier: GPL-3.0-or-later */
/** One attempt of a diagnosis: the whole search from one chain on. */
#ifndef ATTEMPT_H
#define ATTEMPT_H

#include "diagnose.h"
#include "lines.h"
#include "progress.h"

typedef struct {
    diagnosis_t *diagnosis;
    failure_t *failure;
    probe_setting_t setting;
    double line_hz[LINES_MOST];
    joint_power_t power;           /* of the model as it is */
    double found_um;               /* what all that was found changes, whitened, beyond J */
    double step_um, step_sigma_um; /* of the converter, 0: none to be seen */
    bool coarse;                   /* the steps' error is larger than the noise */
    progress_t progress;
    double left; /* of the work, by a guess: nobody knows how many rounds it takes */
} attempt_t;

/** Moves the progress on. */
void attempt_advance(attempt_t *job);

/**
 * Fits the chain's hysteresis, then finds block after block, takes out those that were superfluous or not determined,
 * and judges what remains. Fills the job's diagnosis, whose samples and noise are known, and its power.
 */
bool attempt_from(attempt_t *job, const model_t *given);

/** What is left of the held-out samples (a sum of squares) beyond the noise, in parts of it. */
double attempt_excess(const diagnosis_t *d, double held);

/** Takes noise and sensor steps out of a chain: they are no response to a drive, and the search goes without them. */
void attempt_without_noise(model_t *model);

#endif
