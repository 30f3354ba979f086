/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/question/question.h"
#include "diagnosis/noise/lattice.h"
#include "diagnosis/noise/line_clock.h"
#include "diagnosis/question/baseline.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void set_short_supply(const recording_t *recordings, size_t count, probe_setting_t *s) {
    for (size_t i = 0; i < count; i++) {
        double supply_v, volts[2];
        failure_t ignored;
        recordings_range(&recordings[i], 1, COLUMN_DRIVE, volts);
        if (recording_stage_supply(&recordings[i], &supply_v, &ignored) && supply_v < volts[1] &&
            (s->short_supply_v <= 0.0 || supply_v < s->short_supply_v)) {
            s->short_supply_v = supply_v;
        }
    }
}

void question_setting(const recording_t *recordings, size_t count, probe_setting_t *s) {
    double volts[2], micrometres[2], first_preload_n = 0.0, preload_n;
    failure_t ignored;
    recordings_range(recordings, count, COLUMN_DRIVE, volts);
    recordings_range(recordings, count, COLUMN_DISPLACEMENT, micrometres);
    *s = (probe_setting_t){.drive_low_v = volts[0],
                           .drive_high_v = volts[1],
                           .displacement_low_um = micrometres[0],
                           .displacement_high_um = micrometres[1],
                           .sample_rate_hz = recordings_fastest_hz(recordings, count),
                           .held_s = recordings_held_s(recordings, count),
                           .held_since_s = recordings[0].held_since * recording_held_s(&recordings[0])};
    set_short_supply(recordings, count, s);
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

question_t *question_open(bool model_given, const probe_seen_t *seen) {
    question_t *question = allocate(1, sizeof *question);
    question->seen = seen != NULL ? *seen : (probe_seen_t){0};
    question->model_given = model_given;
    return question;
}

void question_free(const question_t *question) {
    if (question != NULL) {
        question_t *own = (question_t *)question;
        samples_close(&own->samples);
        free(own->recordings);
        free(own);
    }
}

question_t *question_share_ends(const question_t *question) {
    question_t *shared = allocate(1, sizeof *shared);
    *shared = *question;
    shared->samples = samples_share_ends(&question->samples);
    shared->setting.line_hz = shared->line_hz;
    return shared;
}

void question_free_shared(const question_t *shared) {
    free(shared->samples.part);
    free((question_t *)shared);
}

/* What rings is found only where both parts have some of it. */
static void share_rings(question_t *question) {
    const probe_seen_t *seen = &question->seen;
    if (seen->rings > 0) {
        const double rate_hz = question->recordings[seen->ring_recording].sample_rate_hz;
        const double per_sample = 2.0 * M_PI * seen->ring_hz * seen->ring_damping / rate_hz;
        samples_share_decays(&question->samples, seen->ring_recording, seen->ring_step, seen->rings, per_sample);
    }
}

bool question_begin(question_t *question, const model_t *model, const recording_t *recordings, size_t count,
                    failure_t *failure) {
    double ignored_v;
    for (size_t i = 0; i < count; i++) {
        if (!recording_stage_supply(&recordings[i], &ignored_v, failure)) {
            return false;
        }
    }
    question_setting(recordings, count, &question->setting);
    question->setting.line_hz = question->line_hz;
    question->setting.seen = question->seen;
    question->step_um = lattice_step_um(recordings, count, &question->step_sigma_um);
    question->recordings = allocate(count, sizeof *recordings);
    memcpy(question->recordings, recordings, count * sizeof *recordings);
    if (!samples_open(&question->samples, model, question->recordings, count, failure)) {
        return false;
    }
    share_rings(question);
    return true;
}

/* Readings that rest on a step of the converter do not move, and yet are wrong by the steps' error: nothing smaller is
 * seen. */
static void count_steps_as_noise(question_t *question, noise_t *noise) {
    const double error_um = question->step_um / sqrt(12.0);
    if (error_um > noise->sigma_um) {
        noise->filter = (noise_filter_t){0};
        noise->sigma_um = error_um;
        noise->rms_um = fmax(noise->rms_um, error_um);
        question->coarse = true;
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

bool question_noise(question_t *question, const model_t *model, failure_t *failure) {
    double *simulated = samples_column(&question->samples), *residual = samples_column(&question->samples);
    bool good = samples_simulate(&question->samples, model, simulated, failure);
    if (good) {
        samples_residual(&question->samples, simulated, residual);
        question->setting.lines = baseline_lines(&question->samples, residual, question->line_hz);
        if (!has_own_clock(model)) {
            line_clock_set(question->recordings, &question->samples, residual, question->line_hz,
                           question->setting.lines);
        }
        if (question->heard_noise.samples > 0) {
            question->noise = question->heard_noise;
        } else {
            good = baseline_noise(&question->samples, model, &question->setting, &question->noise, failure);
        }
        count_steps_as_noise(question, &question->noise);
    }
    free(simulated);
    free(residual);
    return good;
}

bool question_rests_quieter(const question_t *question, const model_t *model, noise_t *noise) {
    failure_t refusal;
    double *left = samples_column(&question->samples);
    bool quieter =
        question->noise.at_rest && !question->coarse && samples_simulate(&question->samples, model, left, &refusal);
    if (quieter) {
        samples_residual(&question->samples, left, left);
        quieter = noise_at_rest(&question->samples, left, question->line_hz, question->setting.lines, noise) &&
                  threshold.quieter * noise->rms_um < question->noise.rms_um;
    }
    free(left);
    return quieter;
}

/* Where the drive never rests, the operator says better what noise is. */
static noise_t noise_beside(const question_t *question, const fitted_chain_t *beside) {
    noise_t noise;
    double *left = samples_column(&question->samples);
    for (size_t k = 0; k < question->samples.all; k++) {
        left[k] = beside->position_um[k] - beside->imitation.simulated_um[k];
    }
    noise_of(&question->samples, NULL, left, &noise);
    free(left);
    return noise;
}

/* Nothing is missing only if held-out samples leave not far more than the noise. The operator's noise is as strong in
 * slow changes as it takes: a drift may pass for it. */
void question_imitate(question_t *question, fitted_chain_t *beside) {
    shape_t *shape = &question->shape;
    if (beside->samples == NULL) {
        return;
    }
    shape_of(beside, question->step_um, shape);
    if (!shape->whole) {
        return;
    }
    noise_t noise = question->noise.at_rest ? question->noise : noise_beside(question, beside);
    const double least_um = fmin(noise.rms_um, question->noise.rms_um);
    if (!shape_within_noise(shape, &question->samples, question->step_um, least_um)) {
        shape->whole = false;
    } else if (noise.rms_um < question->noise.rms_um) {
        question->coarse = false;
        count_steps_as_noise(question, &noise);
        question->noise = noise;
    }
}

void question_listen(question_t *question, fitted_chain_t *beside) {
    if (beside->samples != NULL) {
        shape_scan(beside, &question->setting, &question->shape);
    }
}
