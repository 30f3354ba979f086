/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/reconsider.h"
#include "diagnosis/findings.h"
#include "thresholds/thresholds.h"
#include <math.h>

/* The model without a finding, fitted again. */
static bool fit_without(attempt_t *job, const finding_t *finding, model_t *without, joint_power_t *power) {
    const diagnosis_t *d = job->diagnosis;
    finding_left_out(d, finding, without);
    attempt_advance(job);
    if (!joint_fit(&d->samples, &d->noise, without, attempt_blocks_fitted(d, without), ATTEMPT_ITERATIONS, power,
                   job->failure)) {
        model_free(without);
        return false;
    }
    return true;
}

/* The finding goes, and its model with it. */
static void drop(attempt_t *job, size_t finding, outcome_t why, model_t *without, const joint_power_t *power) {
    diagnosis_t *d = job->diagnosis;
    finding_considered_gone(d, d->finding[finding].block, why);
    findings_remove(d, finding);
    model_free(&d->model);
    d->model = *without;
    job->power = *power;
}

bool reconsider_take_out(attempt_t *job, size_t finding, outcome_t why) {
    model_t without;
    joint_power_t power;
    const bool good = fit_without(job, &job->diagnosis->finding[finding], &without, &power);
    if (good) {
        drop(job, finding, why, &without, &power);
    }
    return good;
}

bool reconsider_superfluous(attempt_t *job, double least_size, unsigned spared) {
    diagnosis_t *d = job->diagnosis;
    const double least = least_size * least_size * (double)d->samples.fitted;
    for (size_t f = d->findings; f-- > 0 && d->findings > 1;) {
        model_t without;
        joint_power_t power;
        if ((spared >> f & 1U) != 0) {
            continue;
        }
        if (!fit_without(job, &d->finding[f], &without, &power)) {
            return false;
        }
        if ((double)d->samples.fitted * log(power.fitted / job->power.fitted) < least ||
            (double)d->samples.held * log(power.held / job->power.held) < threshold.least_support) {
            drop(job, f, SUPERFLUOUS, &without, &power);
        } else {
            model_free(&without);
        }
    }
    return true;
}

bool reconsider_undetermined(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    bool settled = false;
    while (!settled) {
        size_t f = d->findings;
        if (!findings_errors(d, job->failure)) {
            return false;
        }
        while (f > 0 && finding_determined(d, &d->finding[f - 1])) {
            f--;
        }
        settled = f == 0;
        if (!settled && !reconsider_take_out(job, f - 1, SUPERFLUOUS)) {
            return false;
        }
    }
    return true;
}
