/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/question.h"
#include "diagnosis/baseline.h"
#include "diagnosis/noise/lattice.h"
#include "diagnosis/noise/line_clock.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

void question_setting(const recording_t *recordings, size_t count, probe_setting_t *s) {
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

bool question_begin(attempt_t *job, const model_t *model, const recording_t *recordings, size_t count) {
    question_setting(recordings, count, &job->setting);
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

bool question_noise(attempt_t *job, const model_t *model) {
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

void question_noise_beside(attempt_t *job) {
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
