/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/verdict.h"
#include "diagnosis/findings.h"
#include "diagnosis/nuisance/past.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

/* A curve of few numbers takes most of any other curve. If nothing else was found, and what it leaves goes with the
 * position, it is another one. */
static bool is_another_curve(const diagnosis_t *d) {
    size_t curves = 0, others = 0;
    for (size_t f = 0; f < d->findings; f++) {
        curves += d->finding[f].shape ? 1 : 0;
        others += d->finding[f].shape || d->finding[f].in_readings ? 0 : 1;
    }
    return curves > 0 && others == 0 && d->remainder.at_levels;
}

/* missing, and what is left now, are beyond the noise; where that is not known, all of them counts. */
static bool comes_near_only(const attempt_t *job, double missing) {
    const diagnosis_t *d = job->diagnosis;
    const double noise = remainder_knows_noise(&d->samples, &d->noise) ? 0.0 : 1.0;
    return attempt_blocks_found(d, &d->model) != 0 &&
           (is_another_curve(d) ||
            attempt_excess(d, job->power.held) + noise > threshold.leaves_too_much * (missing + noise));
}

/* Where more than noise remains, what that is may be in the place of any finding: no name is without reservation. */
static void reserve(diagnosis_t *d, certainty_t at_most) {
    for (size_t f = 0; f < d->findings; f++) {
        if (!d->finding[f].in_readings) {
            finding_at_most(&d->finding[f], at_most);
        }
    }
}

static void judge(attempt_t *job, double missing) {
    diagnosis_t *d = job->diagnosis;
    for (size_t f = 0; f < d->findings; f++) {
        d->finding[f].settled = d->finding[f].certainty;
    }
    if (!d->remainder.structured) {
        d->verdict = d->findings == 0 ? NOTHING_MISSING : EXPLAINED;
    } else if (d->findings > 0 && !comes_near_only(job, missing)) {
        d->verdict = PARTLY_EXPLAINED;
        reserve(d, ISOLATED);
    } else {
        d->verdict = UNKNOWN_PHYSICS;
        reserve(d, DETECTED);
    }
}

bool verdict_look(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    double *simulated = samples_column(&d->samples);
    model_t smooth;
    model_copy(&smooth, &d->model);
    attempt_without_noise(&smooth);
    double *change = samples_change(&d->samples, &smooth, &d->baseline, job->failure);
    const bool good = change != NULL && past_simulate(&d->samples, &d->noise, &smooth, simulated, job->failure);
    if (good) {
        d->remainder = remainder_of(&d->samples, &d->noise, simulated, change, job->step_um / sqrt(12.0));
    }
    model_free(&smooth);
    free(simulated);
    free(change);
    return good;
}

bool verdict_reach(attempt_t *job, double missing) {
    const bool good = verdict_look(job);
    if (good) {
        judge(job, missing);
    }
    return good;
}
