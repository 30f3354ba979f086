/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnose.h"
#include "attempt.h"
#include "baseline.h"
#include "catalogue.h"
#include "hysteresis_numbers.h"
#include "lattice.h"
#include "line_clock.h"
#include "parallel.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* 2 log likelihood of the held-out samples by which a diagnosis has to be better that contains a block which another
 * shape of hysteresis can imitate; and, in parts of their deviation, one that is not the whole answer. */
static const double shape_price = 10.0, number_price = 1.0, incomplete_handicap = 1.05;
/* What the held-out samples have beyond the noise, in parts of its square, that is worth trying another shape for; or
 * one that promises to leave less. */
static const double worth_another_shape = 0.03, little_more = 0.1;
/* A promise leaves out what blocks do that are far from linear: beyond this, it is none. */
static const double known_promise = 0.5;
/* A free plane promises more than a symmetric one if it leaves less than this part of what that leaves. */
static const double better_plane = 0.99;

static void describe(attempt_t *job, const recording_t *recordings, size_t count) {
    probe_setting_t *s = &job->setting;
    double volts[2], micrometres[2], first_preload_n = 0.0, preload_n;
    failure_t ignored;
    recordings_range(recordings, count, COLUMN_DRIVE, volts);
    recordings_range(recordings, count, COLUMN_DISPLACEMENT, micrometres);
    *s = (probe_setting_t){.drive_low_v = volts[0],
                           .drive_high_v = volts[1],
                           .displacement_low_um = micrometres[0],
                           .displacement_high_um = micrometres[1],
                           .sample_rate_hz = recordings[0].sample_rate_hz,
                           .line_hz = job->line_hz};
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

/* What all that follows has in common: the recordings, the samples that take part, the steps of the converter. */
static bool begin(attempt_t *job, const model_t *model, const recording_t *recordings, size_t count) {
    describe(job, recordings, count);
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

/* The noise, with a model that explains the recordings as far as any does by now. */
static bool find_noise(attempt_t *job, const model_t *model) {
    diagnosis_t *d = job->diagnosis;
    double *simulated = samples_column(&d->samples), *residual = samples_column(&d->samples);
    bool good = samples_simulate(&d->samples, model, simulated, job->failure);
    if (good) {
        samples_residual(&d->samples, simulated, residual);
        job->setting.lines = baseline_lines(&d->samples, residual, job->line_hz);
        if (model_find(model, block_mains_interference.name) == NULL) {
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

static bool shape_found(const diagnosis_t *d) {
    for (size_t i = 0; i < d->findings; i++) {
        if (d->finding[i].shape) {
            return true;
        }
    }
    return false;
}

/* What a diagnosis leaves of the held-out samples, raised where part of it could as well be another shape's, and where
 * it is not the whole answer. */
static double cost_of(const diagnosis_t *d, double held) {
    const double price =
        (shape_found(d) ? shape_price : 0.0) + number_price * (double)hysteresis_numbers_count(&d->model);
    return held * exp(price / (double)d->samples.held) *
           (d->remainder.structured ? incomplete_handicap * incomplete_handicap : 1.0);
}

static void free_models(diagnosis_t *diagnosis) {
    model_free(&diagnosis->given);
    model_free(&diagnosis->baseline);
    model_free(&diagnosis->model);
}

/* Keeps the better of two diagnoses of the same samples, and frees what the other one holds of its own. */
static void keep_better(attempt_t *job, diagnosis_t *other, const joint_power_t *power) {
    diagnosis_t *d = job->diagnosis;
    diagnosis_t worse = *other;
    if (cost_of(other, power->held) < cost_of(d, job->power.held)) {
        worse = *d;
        *d = *other;
        job->power = *power;
    }
    free_models(&worse);
}

/* The search from one shape. */
typedef struct {
    const model_t *from;
    attempt_t attempt;
    diagnosis_t diagnosis;
    failure_t refusal;
    bool good;
} trial_t;

/* What all have in common is in `job`. */
static void prepare(trial_t *trial, const attempt_t *job, const model_t *from, const family_t *family) {
    trial->from = from;
    trial->attempt = *job;
    trial->attempt.diagnosis = &trial->diagnosis;
    trial->attempt.failure = &trial->refusal;
    trial->attempt.setting.line_hz = trial->attempt.line_hz;
    trial->attempt.found_um = 0.0;
    trial->diagnosis = (diagnosis_t){.recordings = job->diagnosis->recordings,
                                     .samples = job->diagnosis->samples,
                                     .noise = job->diagnosis->noise,
                                     .family = family};
}

static void try_shape(void *context, size_t index) {
    trial_t *trial = &((trial_t *)context)[index];
    trial->good = attempt_from(&trial->attempt, trial->from);
    if (!trial->good) {
        free_models(&trial->diagnosis);
    }
}

/* What two blocks do, a third may seem to do alone, and then hides them. Where a hysteresis of few numbers did not
 * lead to the whole answer, the search is made once more without the block that came first. */
static void try_without_the_first(attempt_t *job) {
    const diagnosis_t *d = job->diagnosis;
    if (!d->remainder.structured || d->findings == 0 || d->finding[0].in_readings ||
        d->finding[0].block->probe->shape || !hysteresis_numbers_few(hysteresis_numbers_count(&d->model))) {
        return;
    }
    trial_t again;
    prepare(&again, job, &d->given, d->family);
    again.attempt.without = d->finding[0].block;
    try_shape(&again, 0);
    if (again.good) {
        keep_better(job, &again.diagnosis, &again.attempt.power);
    }
    job->progress = again.attempt.progress;
    job->left = again.attempt.left;
}

/* What the best of the other shapes leaves beside all that may be missing (shape_judgement.h). */
static double promised(const baseline_t *baseline, size_t shapes) {
    double least = HUGE_VAL;
    for (size_t shape = 1; shape < shapes; shape++) {
        least = fmin(least, baseline[shape].held);
    }
    return least;
}

/* Whether the answer from the first shape leaves nothing for another one: hardly more than noise; or little more, and
 * no more than another one promises. */
static bool answers_all(const trial_t *first, const baseline_t *baseline, size_t shapes) {
    const diagnosis_t *d = &first->diagnosis;
    const double held = first->attempt.power.held, excess = attempt_excess(d, held);
    const double promise = promised(baseline, shapes);
    if (d->remainder.structured || baseline->many_numbers || excess > little_more) {
        return false;
    }
    if (shape_found(d)) { /* a bank with a curve may be a plane without */
        return d->family != family_find("prandtl_ishlinskii") && attempt_excess(d, promise) < known_promise &&
               cost_of(d, held) < promise;
    }
    return excess < worth_another_shape || cost_of(d, held) < promise;
}

/* A free plane that promises no more than a symmetric one. */
static bool is_no_better(const baseline_t *free_plane, const baseline_t *baseline, size_t shapes) {
    for (size_t shape = 0; shape < shapes && free_plane->many_numbers; shape++) {
        if (baseline[shape].family == free_plane->family && !baseline[shape].many_numbers) {
            return free_plane->held > better_plane * baseline[shape].held;
        }
    }
    return false;
}

/* Shapes from one on, to before another one, at the same time. One of them may not apply. */
static void try_some(attempt_t *job, trial_t *trial, size_t from, size_t to) {
    for (size_t shape = from; shape < to; shape++) {
        trial[shape].attempt.left = trial[0].attempt.left;
    }
    parallel(to - from, try_shape, trial + from);
    for (size_t shape = from; shape < to; shape++) {
        if (trial[shape].good) {
            keep_better(job, &trial[shape].diagnosis, &trial[shape].attempt.power);
        }
    }
}

/* From the first shape, and where that is not the whole answer from the others. */
static bool try_shapes(attempt_t *job, const baseline_t *baseline, size_t shapes) {
    trial_t *trial = allocate(shapes, sizeof *trial);
    for (size_t shape = 0; shape < shapes; shape++) {
        prepare(&trial[shape], job, &baseline[shape].model, baseline[shape].family);
        trial[shape].attempt.progress.terminal = job->progress.terminal && shape < 2; /* one bar at a time */
    }
    try_shape(trial, 0);
    const bool good = trial[0].good;
    if (!good) {
        *job->failure = trial[0].refusal;
    } else {
        *job->diagnosis = trial[0].diagnosis;
        job->power = trial[0].attempt.power;
    }
    if (good && !answers_all(&trial[0], baseline, shapes)) {
        /* The free plane is the last one. What it has and the others have not is that it imitates curves. */
        const bool later = job->diagnosis->remainder.structured && !shape_found(job->diagnosis) &&
                           is_no_better(&baseline[shapes - 1], baseline, shapes);
        try_some(job, trial, 1, later ? shapes - 1 : shapes);
        if (later && shape_found(job->diagnosis)) {
            try_some(job, trial, shapes - 1, shapes);
        }
    }
    free(trial);
    return good;
}

bool diagnose(const model_t *given, const recording_t *recordings, size_t count, diagnosis_t *diagnosis,
              failure_t *failure) {
    attempt_t job = {.diagnosis = diagnosis, .failure = failure, .left = 1.0};
    model_t chain;
    bool good;
    progress_begin(&job.progress, "diagnosing");
    memset(diagnosis, 0, sizeof *diagnosis);
    model_copy(&chain, given);
    attempt_without_noise(&chain);
    good = begin(&job, &chain, recordings, count) && find_noise(&job, &chain) && attempt_from(&job, &chain);
    if (good) {
        try_without_the_first(&job);
    }
    model_free(&chain);
    progress_end(&job.progress);
    if (!good) {
        diagnosis_free(diagnosis);
    }
    return good;
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
           (diagnosis->noise.at_rest || find_noise(&job, &baseline[0].model)) && /* with a better model, better */
           try_shapes(&job, baseline, shapes);
    if (good) {
        try_without_the_first(&job);
    }
    baseline_free(baseline, shapes);
    baseline_free(&rough, 1);
    progress_end(&job.progress);
    if (!good) {
        diagnosis_free(diagnosis);
    }
    return good;
}

void diagnosis_free(diagnosis_t *diagnosis) {
    samples_close(&diagnosis->samples);
    free(diagnosis->recordings);
    diagnosis->recordings = NULL;
    free_models(diagnosis);
}
