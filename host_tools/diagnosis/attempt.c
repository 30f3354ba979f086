/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/attempt.h"
#include "chain/catalogue.h"
#include "diagnosis/evidence/candidate.h"
#include "diagnosis/findings.h"
#include "diagnosis/measured_columns.h"
#include "diagnosis/names.h"
#include "diagnosis/noise/lattice.h"
#include "diagnosis/nuisance/past.h"
#include "diagnosis/nuisance/past_choice.h"
#include "diagnosis/reconsider.h"
#include "diagnosis/refitted.h"
#include "diagnosis/search_round.h"
#include "diagnosis/sides.h"
#include "diagnosis/verdict.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

enum { BASELINE_ITERATIONS = 4 };

void attempt_advance(attempt_t *job) {
    job->left *= 0.85;
    progress_update(&job->progress, 1.0 - job->left);
}

bool attempt_measure(const attempt_t *job, const model_t *model, double *percent, double *held_out_percent) {
    const samples_t *samples = &job->diagnosis->samples;
    double *simulated = samples_column(samples);
    const bool good = past_simulate(samples, &job->diagnosis->noise, model, simulated, job->failure);
    if (good) {
        *percent = samples_nrmse_percent(samples, SAMPLE_FITTED, simulated);
        *held_out_percent = samples_nrmse_percent(samples, SAMPLE_HELD_OUT, simulated);
    }
    free(simulated);
    return good;
}

unsigned attempt_blocks_found(const diagnosis_t *d, const model_t *model) {
    unsigned blocks = 0;
    for (size_t b = 0; b < model->blocks; b++) {
        const block_t *block = model->block[b].block;
        blocks |= block->probe != NULL && model_find(&d->baseline, block->name) == NULL ? 1U << b : 0U;
    }
    return blocks;
}

unsigned attempt_blocks_fitted(const diagnosis_t *d, const model_t *model) {
    return attempt_blocks_found(d, model) | refitted_blocks(d, model);
}

double attempt_excess(const diagnosis_t *d, double held) {
    return held / ((double)d->samples.held * d->noise.sigma_um * d->noise.sigma_um) - 1.0;
}

/* NULL: the catalogue has none. */
static const block_t *block_of_steps(void) {
    for (size_t i = 0; i < catalogue_count; i++) {
        if (catalogue[i]->readings == READINGS_STEPPED) {
            return catalogue[i];
        }
    }
    return NULL;
}

/* A converter's steps show in the readings themselves. */
static void find_steps(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    const block_t *steps = block_of_steps();
    const double step = job->step_um, error_um = step / sqrt(12.0);
    if (steps != NULL && step > 0.0 && error_um > threshold.least_steps * d->noise.rms_um &&
        d->findings < DIAGNOSIS_MOST_FINDINGS) {
        const double each = lattice_likelihood_per_sample();
        const double t = sqrt(each * (double)d->samples.fitted);
        model_block_t *block = model_append(&d->model, steps);
        model_set(block, steps->parameter[0].name, step);
        block->parameter[0].sigma = allocate(1, sizeof(double));
        *block->parameter[0].sigma = job->step_sigma_um;
        findings_add(d, &(finding_t){.block = steps,
                                     .t = t,
                                     .t_blocks = t,
                                     .certainty = NAMED,
                                     .in_readings = true,
                                     .margin = HUGE_VAL,
                                     .support = each * (double)d->samples.held,
                                     .held_out_before_percent = d->held_out_percent,
                                     .held_out_after_percent = d->held_out_percent});
    }
}

void attempt_without_noise(model_t *model) {
    for (size_t b = model->blocks; b-- > 0;) {
        if (model->block[b].block->readings != READINGS_AS_THEY_ARE) {
            model_remove(model, b);
        }
    }
}

/* A hysteresis that was fitted to an effect as well has taken a part of it. */
static bool begin_elsewhere(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    model_free(&d->model);
    model_copy(&d->model, job->begin);
    return joint_power(&d->samples, &d->noise, &d->model, &job->power, job->failure);
}

static bool fit_again(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    refitted_choose(d, &d->model);
    return joint_fit(&d->samples, &d->noise, &d->model, refitted_blocks(d, &d->model),
                     d->refitted > 0 ? ATTEMPT_ITERATIONS : BASELINE_ITERATIONS, &job->power, job->failure);
}

/* What is slow begins with the position that the hysteresis had then, though the recording erases it. With what was
 * found it is known better than it was with the baseline alone. */
static void choose_beginning(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    if (d->findings == 0 || d->family == NULL || d->samples.past_matters || d->samples.count > 1) {
        return;
    }
    model_t model;
    joint_power_t power;
    failure_t refusal;
    model_copy(&model, &d->model);
    if (choose_past(&d->samples, left_of_beginning, NULL, &model) &&
        joint_fit(&d->samples, &d->noise, &model, attempt_blocks_fitted(d, &model), ATTEMPT_ITERATIONS, &power,
                  &refusal) &&
        power.fitted < job->power.fitted) {
        const model_t worse = d->model;
        d->model = model;
        model = worse;
        job->power = power;
    }
    model_free(&model);
}

/* It was estimated before anything was found, and may have had a part of that in it: it is no more than what is left.
 */
static double told_noise(const diagnosis_t *d) {
    const double left_percent = fmax(d->nrmse_percent, d->held_out_percent);
    return remainder_knows_noise(&d->samples, &d->noise)
               ? fmin(samples_percent(&d->samples, d->noise.rms_um), left_percent)
               : HUGE_VAL;
}

static bool reach_end(attempt_t *job, double missing) {
    job->diagnosis->noise_percent = told_noise(job->diagnosis);
    find_steps(job);
    return verdict_reach(job, missing);
}

/* missing: beyond the noise, in parts of it, with the chain fitted again. */
static bool fit_baseline(attempt_t *job, const model_t *given, double *missing) {
    diagnosis_t *d = job->diagnosis;
    model_copy(&d->given, given);
    model_copy(&d->model, given);
    const bool good = fit_again(job);
    model_copy(&d->baseline, &d->model);
    *missing = attempt_excess(d, job->power.held);
    return good && attempt_measure(job, &d->given, &d->given_nrmse_percent, &d->given_held_out_percent) &&
           attempt_measure(job, &d->baseline, &d->baseline_nrmse_percent, &d->baseline_held_out_percent);
}

bool attempt_from(attempt_t *job, const model_t *given) {
    diagnosis_t *d = job->diagnosis;
    bool found = true;
    double missing;
    bool good = fit_baseline(job, given, &missing) && (job->begin == NULL || begin_elsewhere(job));
    while (good && found && d->findings < DIAGNOSIS_MOST_FINDINGS) {
        good = search_round(job, &found);
    }
    good = good && reconsider_superfluous(job, threshold.least_size, 0);
    if (good) {
        choose_beginning(job);
    }
    good = good && names_settle(job) && sides_settle(job) && reconsider_undetermined(job) && temperature_settle(job) &&
           attempt_measure(job, &d->model, &d->nrmse_percent, &d->held_out_percent);
    return good && reach_end(job, missing);
}

bool attempt_with(attempt_t *job, const model_t *given, const suspect_t *heard) {
    diagnosis_t *d = job->diagnosis;
    double missing, value[BLOCK_MAX_PARAMETERS];
    model_t with;
    if (!fit_baseline(job, given, &missing)) {
        return false;
    }
    candidate_value(&heard->chain.block[heard->at], value);
    candidate_insert(&with, &d->model, heard->block, value);
    model_free(&d->model);
    d->model = with;
    findings_add(d, &(finding_t){.block = heard->block,
                                 .t = heard->amplitude / heard->sigma,
                                 .t_blocks = heard->amplitude / heard->sigma,
                                 .certainty = ISOLATED,
                                 .heard = true,
                                 .margin = HUGE_VAL,
                                 .support = 2.0 * heard->gain,
                                 .held_out_before_percent = d->baseline_held_out_percent});
    const bool good = joint_fit(&d->samples, &d->noise, &d->model, refitted_blocks(d, &d->model), ATTEMPT_ITERATIONS,
                                &job->power, job->failure) &&
                      findings_errors(d, job->failure) &&
                      attempt_measure(job, &d->model, &d->nrmse_percent, &d->held_out_percent);
    d->finding[0].held_out_after_percent = d->held_out_percent;
    return good && reach_end(job, missing);
}
