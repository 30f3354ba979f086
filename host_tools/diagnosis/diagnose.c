/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/diagnose.h"
#include "diagnosis/attempt.h"
#include "diagnosis/baseline.h"
#include "diagnosis/empirical.h"
#include "diagnosis/noise/lattice.h"
#include "diagnosis/noise/line_clock.h"
#include "diagnosis/review.h"
#include "diagnosis/trials.h"
#include "diagnosis/unseen.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

void diagnosis_setting(const recording_t *recordings, size_t count, probe_setting_t *s) {
    double volts[2], micrometres[2], first_preload_n = 0.0, preload_n;
    failure_t ignored;
    recordings_range(recordings, count, COLUMN_DRIVE, volts);
    recordings_range(recordings, count, COLUMN_DISPLACEMENT, micrometres);
    *s = (probe_setting_t){.drive_low_v = volts[0],
                           .drive_high_v = volts[1],
                           .displacement_low_um = micrometres[0],
                           .displacement_high_um = micrometres[1],
                           .sample_rate_hz = recordings[0].sample_rate_hz};
    for (size_t i = 0; i < count; i++) {
        const recording_t *r = &recordings[i];
        const double *drive = r->column[COLUMN_DRIVE];
        for (size_t k = 1; k < r->samples; k++) {
            s->largest_rate_v_per_s = fmax(s->largest_rate_v_per_s, fabs(drive[k] - drive[k - 1]) * r->sample_rate_hz);
        }
        s->longest_s = fmax(s->longest_s, (double)r->samples / r->sample_rate_hz);
        if (recording_preload(r, &preload_n, &ignored)) {
            first_preload_n = i == 0 ? preload_n : first_preload_n;
            s->preloads = s->preloads || preload_n != first_preload_n;
        }
    }
}

/* What all that follows has in common: the recordings, the samples that are included, the steps of the converter. */
static bool begin(attempt_t *job, const model_t *model, const recording_t *recordings, size_t count) {
    diagnosis_setting(recordings, count, &job->setting);
    job->setting.line_hz = job->line_hz;
    job->step_um = lattice_step_um(recordings, count, &job->step_sigma_um);
    diagnosis_t *d = job->diagnosis;
    d->recordings = allocate(count, sizeof *recordings);
    memcpy(d->recordings, recordings, count * sizeof *recordings);
    return samples_open(&d->samples, model, d->recordings, count, job->failure);
}

/* Readings that rest on a step of the converter do not move, and yet are wrong by the steps' error: nothing smaller is
 * seen. */
static void count_steps_as_noise(attempt_t *job, noise_t *noise) {
    const double error_um = job->step_um / sqrt(12.0);
    if (error_um > noise->sigma_um) {
        noise->filter = (noise_filter_t){0};
        noise->sigma_um = error_um;
        noise->rms_um = fmax(noise->rms_um, error_um);
        job->coarse = true;
    }
}

static bool has_own_clock(const model_t *model) {
    for (size_t b = 0; b < model->blocks; b++) {
        if (model->block[b].block->own_clock) {
            return true;
        }
    }
    return false;
}

/* The noise, with a model that explains the recordings as far as any does by now. */
static bool find_noise(attempt_t *job, const model_t *model) {
    diagnosis_t *d = job->diagnosis;
    double *simulated = samples_column(&d->samples), *residual = samples_column(&d->samples);
    bool good = samples_simulate(&d->samples, model, simulated, job->failure);
    if (good) {
        samples_residual(&d->samples, simulated, residual);
        job->setting.lines = baseline_lines(&d->samples, residual, job->line_hz);
        if (!has_own_clock(model)) {
            line_clock_set(d->recordings, &d->samples, residual, job->line_hz, job->setting.lines);
        }
        good = baseline_noise(&d->samples, model, &job->setting, &d->noise, job->failure);
        count_steps_as_noise(job, &d->noise);
    }
    free(simulated);
    free(residual);
    attempt_advance(job);
    return good;
}

/* Where the drive never rests, the noise was found beside a model of few numbers, and what that leaves of the loops'
 * shape counts as noise. Where the universal operator leaves nothing but noise, it says it better. */
static void find_noise_beside(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    const fitted_chain_t *beside = &job->beside;
    noise_t noise;
    if (d->noise.at_rest || !d->shape.whole) {
        return;
    }
    double *left = samples_column(&d->samples);
    for (size_t k = 0; k < d->samples.all; k++) {
        left[k] = beside->position_um[k] - beside->imitation.simulated_um[k];
    }
    noise_of(&d->samples, NULL, left, &noise);
    if (noise.rms_um < d->noise.rms_um) {
        job->coarse = false;
        count_steps_as_noise(job, &noise);
        d->noise = noise;
    }
    free(left);
}

/* What stands for itself whatever hysteresis the answer has. */
typedef struct {
    model_t chain;
    double nrmse_percent, held_out_percent, fitted_held_out_percent;
} as_given_t;

static void note_given(const diagnosis_t *d, as_given_t *given) {
    *given = (as_given_t){.nrmse_percent = d->given_nrmse_percent,
                          .held_out_percent = d->given_held_out_percent,
                          .fitted_held_out_percent = d->baseline_held_out_percent};
    model_copy(&given->chain, &d->given);
}

/* Takes what note_given has copied. */
static void put_given(diagnosis_t *d, const as_given_t *given) {
    model_free(&d->given);
    d->given = given->chain;
    d->given_nrmse_percent = given->nrmse_percent;
    d->given_held_out_percent = given->held_out_percent;
    d->own_shape_held_out_percent = given->fitted_held_out_percent;
    if (d->family != NULL && d->verdict == NOTHING_MISSING) {
        d->verdict = EXPLAINED;
    }
}

/* The given chain with hystereses of other shapes, behind the given one. Returns how many there are then; they are to
 * be freed. */
static size_t other_shapes(attempt_t *job, const model_t *chain, baseline_t shape[TRIALS_MOST_SHAPES]) {
    const diagnosis_t *d = job->diagnosis;
    baseline_t rough;
    size_t shapes = 1;
    failure_t refusal;
    if (!baseline_bank(d->recordings, d->samples.count, &shape[1], &rough, &refusal)) {
        return 1;
    }
    baseline_shapes(&d->samples, &d->noise, &job->setting, shape + 1, &rough, &shapes, &refusal);
    for (size_t i = 1; i <= shapes; i++) {
        baseline_put_into(&shape[i], chain);
    }
    baseline_free(&rough, 1);
    return 1 + shapes;
}

/* Frees what only the search needs. good: all of it went well. */
static bool end(attempt_t *job, baseline_t *shape, size_t shapes, bool good) {
    review_close(job);
    baseline_free(shape, shapes);
    progress_end(&job->progress);
    if (!progress_go_on(job->failure) || !good) {
        diagnosis_free(job->diagnosis);
        return false;
    }
    return true;
}

bool diagnose(const model_t *given, const recording_t *recordings, size_t count, diagnosis_t *diagnosis,
              failure_t *failure) {
    attempt_t job = {.diagnosis = diagnosis, .failure = failure, .left = 1.0};
    baseline_t shape[TRIALS_MOST_SHAPES] = {0};
    size_t shapes = 1;
    bool good;
    progress_begin(&job.progress, "diagnosing");
    memset(diagnosis, 0, sizeof *diagnosis);
    diagnosis->model_given = true;
    model_copy(&shape[0].model, given);
    attempt_without_noise(&shape[0].model);
    good = begin(&job, &shape[0].model, recordings, count) && find_noise(&job, &shape[0].model);
    if (good) {
        review_begin(&job, &shape[0].model);
        find_noise_beside(&job);
        good = trial_of_first(&job, &shape[0]);
    }
    if (good) {
        as_given_t as_given;
        note_given(diagnosis, &as_given);
        if (!trial_leaves_nothing(&job, &shape[0])) {
            shapes = other_shapes(&job, &shape[0].model, shape);
            trials_of_others(&job, shape, shapes);
        }
        trial_without_the_first(&job);
        trial_of_contest(&job, &shape[0].model);
        trial_of_heard(&job);
        good = review_end(&job);
        put_given(diagnosis, &as_given);
        good = good && unseen_complete(&job) && review_delivered(&job) && empirical_describe(&job);
    }
    return end(&job, shape, shapes, good);
}

bool diagnose_recordings(const recording_t *recordings, size_t count, diagnosis_t *diagnosis, failure_t *failure) {
    attempt_t job = {.diagnosis = diagnosis, .failure = failure, .left = 1.0};
    baseline_t baseline[BASELINE_SHAPES], rough;
    size_t shapes = 1;
    bool good;
    memset(diagnosis, 0, sizeof *diagnosis);
    if (!baseline_bank(recordings, count, &baseline[0], &rough, failure)) {
        return false;
    }
    progress_begin(&job.progress, "diagnosing");
    good = begin(&job, &baseline[0].model, recordings, count) && find_noise(&job, &baseline[0].model) &&
           baseline_shapes(&diagnosis->samples, &diagnosis->noise, &job.setting, baseline, &rough, &shapes, failure) &&
           (diagnosis->noise.at_rest || find_noise(&job, &baseline[0].model)); /* with a better model, better */
    if (good) {
        review_begin(&job, &baseline[0].model);
        find_noise_beside(&job);
        good = trial_of_first(&job, &baseline[0]);
    }
    if (good) {
        if (!trial_leaves_nothing(&job, &baseline[0])) {
            trials_of_others(&job, baseline, shapes);
        }
        trial_without_the_first(&job);
        trial_of_contest(&job, NULL);
        trial_of_heard(&job);
        good = review_end(&job) && unseen_complete(&job) && review_delivered(&job) && empirical_describe(&job);
    }
    baseline_free(&rough, 1);
    return end(&job, baseline, shapes, good);
}

void diagnosis_free_models(diagnosis_t *diagnosis) {
    model_free(&diagnosis->given);
    model_free(&diagnosis->baseline);
    model_free(&diagnosis->model);
}

void diagnosis_free(diagnosis_t *diagnosis) {
    samples_close(&diagnosis->samples);
    free(diagnosis->recordings);
    diagnosis->recordings = NULL;
    diagnosis_free_models(diagnosis);
}
