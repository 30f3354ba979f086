/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nuisance.h"
#include "drive_period.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { OPERATORS = 24, SHAPES = 6, BRANCH_NODES = 11, TRENDS = 12, HARMONICS = 40 };
/* A period is one loop when the drive goes up once and down once in it: not further than this, in parts of twice its
 * range. */
static const double one_loop = 1.02;

typedef struct {
    const signals_t *signals;
    const samples_t *samples;
    nuisance_take_t *take;
    void *context;
    double center_v, half_v;
    double **drive; /* behind the electronics, as a part of half the range; one a recording */
    double ***play; /* [operator][recording][sample], likewise */
    double *column;
} job_t;

static void find_range(job_t *job) {
    double range[2];
    recordings_range(job->samples->recordings, job->samples->count, COLUMN_DRIVE, range);
    job->center_v = 0.5 * (range[0] + range[1]);
    job->half_v = 0.5 * (range[1] - range[0]);
}

static void find_operators(job_t *job) {
    const samples_t *s = job->samples;
    const size_t stage = hysteresis_stage(job->signals->model);
    job->drive = recordings_room(s->recordings, s->count);
    job->play = allocate(OPERATORS, sizeof *job->play);
    for (size_t i = 0; i < s->count; i++) {
        const signal_t *seen = job->signals->before[stage] + s->begin[i] + i + 1;
        for (size_t k = 0; k < s->recordings[i].samples; k++) {
            job->drive[i][k] = (seen[k].value - job->center_v) / job->half_v;
        }
    }
    for (size_t j = 0; j < OPERATORS; j++) {
        const double r = (double)(j + 1) / (OPERATORS + 1);
        job->play[j] = recordings_room(s->recordings, s->count);
        for (size_t i = 0; i < s->count; i++) {
            double z = 0.0;
            for (size_t k = 0; k < s->recordings[i].samples; k++) {
                const double low = job->drive[i][k] - r, high = job->drive[i][k] + r;
                z = z < low ? low : z > high ? high : z;
                job->play[j][i][k] = z;
            }
        }
    }
}

/* Runs a column of one recording through the model's blocks behind the hysteresis, except those that add what is not a
 * response (steps, a sensor's curve, hum). */
static void pass_through(const model_t *model, const recording_t *recording, double *x) {
    const stage_setup_t setup = {.sample_rate_hz = recording->sample_rate_hz};
    for (size_t b = 0; b < model->blocks; b++) {
        const model_block_t *block = &model->block[b];
        signal_t signal = {.value = x[0]};
        if (block->block->place <= PLACE_HYSTERESIS || block->block->adds) {
            continue;
        }
        void *state = block_open(block->block, block->parameter, &setup);
        block->block->settle(state, &signal);
        for (size_t k = 0; k < recording->samples; k++) {
            signal = (signal_t){.value = x[k]};
            block->block->step(state, &signal);
            x[k] = signal.value;
        }
        free(state);
    }
}

/* x^a z^b, z: the drive itself or one of the operators. */
static void take_product(job_t *job, double **z, int drive_power, int power, nuisance_layer_t layer) {
    const samples_t *s = job->samples;
    for (size_t i = 0; i < s->count; i++) {
        double *x = job->column + s->begin[i];
        for (size_t k = 0; k < s->recordings[i].samples; k++) {
            x[k] = gsl_pow_int(job->drive[i][k], drive_power) * gsl_pow_int(z[i][k], power);
        }
        pass_through(job->signals->model, &s->recordings[i], x);
    }
    job->take(job->context, job->column, layer);
}

/* A function of the drive, a hat about one of evenly spread nodes, with the sign of its last motion: what tells the
 * branches of a loop apart, whatever its shape. Without the sign (`sided` false): what they have in common. */
static void take_hat(job_t *job, int node, bool sided) {
    const samples_t *s = job->samples;
    for (size_t i = 0; i < s->count; i++) {
        double *x = job->column + s->begin[i], direction = 1.0;
        for (size_t k = 0; k < s->recordings[i].samples; k++) {
            const double u = job->drive[i][k], last = k > 0 ? job->drive[i][k - 1] : u;
            const double away = fabs(u - (2.0 * node / (BRANCH_NODES - 1.0) - 1.0)) * 0.5 * (BRANCH_NODES - 1.0);
            direction = u > last ? 1.0 : u < last ? -1.0 : direction;
            x[k] = (away < 1.0 ? 1.0 - away : 0.0) * (sided ? direction : 1.0);
        }
        pass_through(job->signals->model, &s->recordings[i], x);
    }
    job->take(job->context, job->column, NUISANCE_SHAPES);
}

static void take_offsets(job_t *job) {
    const samples_t *s = job->samples;
    for (size_t i = 0; i < s->count; i++) {
        memset(job->column, 0, s->all * sizeof(double));
        for (size_t k = s->begin[i]; k < s->begin[i + 1]; k++) {
            job->column[k] = 1.0;
        }
        job->take(job->context, job->column, NUISANCE_OWN);
    }
}

static void take_derivatives(job_t *job) {
    const signals_t *signals = job->signals;
    hysteresis_numbers_t numbers;
    model_t altered;
    model_copy(&altered, signals->model);
    hysteresis_numbers_open(&altered, &numbers);
    for (size_t n = 0; n < numbers.count; n++) {
        if (!signals_derivative(signals, &numbers, n, job->column)) {
            memset(job->column, 0, job->samples->all * sizeof(double));
        }
        job->take(job->context, job->column, NUISANCE_OWN);
    }
    hysteresis_numbers_close(&numbers);
    model_free(&altered);
}

/* cos(radians_per_sample (k + 1/2) - phase) in each recording; `waves` > 0: half waves over the part that counts. */
static void take_waves(job_t *job, int waves, double hz, double phase, nuisance_layer_t layer) {
    const samples_t *s = job->samples;
    for (size_t i = 0; i < s->count; i++) {
        const size_t from = s->from[i], length = s->recordings[i].samples;
        const double turn =
            waves > 0 ? M_PI * waves / (double)(length - from) : 2.0 * M_PI * hz / s->recordings[i].sample_rate_hz;
        for (size_t k = 0; k < length; k++) {
            job->column[s->begin[i] + k] = cos(turn * ((double)k - (double)from + 0.5) - phase);
        }
    }
    job->take(job->context, job->column, layer);
}

/* Hz of a drive that does nothing but one loop again and again, 0 otherwise: then a rate-independent hysteresis can
 * imitate whatever repeats itself with it. */
static double loop_hz(const samples_t *s) {
    const recording_t *recording = &s->recordings[0];
    const size_t from = s->from[0], length = recording->samples - from;
    const double *drive = recording->column[COLUMN_DRIVE] + from;
    const double period = s->count == 1 ? drive_period(drive, length) : 0.0;
    double range[2], way = 0.0;
    values_range(drive, length, range);
    for (size_t k = 1; k < length; k++) {
        way += fabs(drive[k] - drive[k - 1]);
    }
    return period > 0.0 && way * period < one_loop * 2.0 * (range[1] - range[0]) * (double)length
               ? recording->sample_rate_hz / period
               : 0.0;
}

void nuisance(const signals_t *signals, const nuisance_options_t *options, nuisance_take_t *take, void *context) {
    const samples_t *samples = signals->samples;
    job_t job = {
        .signals = signals, .samples = samples, .take = take, .context = context, .column = samples_column(samples)};
    find_range(&job);
    find_operators(&job);
    take_offsets(&job);
    take_derivatives(&job);
    const double hz = options->plays ? loop_hz(samples) : 0.0;
    for (int harmonic = 1;
         harmonic <= HARMONICS && hz > 0.0 && harmonic * hz < 0.2 * samples->recordings[0].sample_rate_hz; harmonic++) {
        take_waves(&job, 0, harmonic * hz, 0.0, NUISANCE_OWN);
        take_waves(&job, 0, harmonic * hz, 0.5 * M_PI, NUISANCE_OWN);
    }
    if (options->plays) {
        take_product(&job, job.drive, 0, 1, NUISANCE_PLAYS);
        for (size_t j = 0; j < OPERATORS; j++) {
            take_product(&job, job.play[j], 0, 1, NUISANCE_PLAYS);
        }
    }
    if (options->shapes) {
        take_product(&job, job.drive, 0, 2, NUISANCE_SHAPES);
        take_product(&job, job.drive, 0, 3, NUISANCE_SHAPES);
        for (size_t j = 0; j < OPERATORS; j += OPERATORS / SHAPES) {
            take_product(&job, job.play[j], 0, 2, NUISANCE_SHAPES);
            take_product(&job, job.play[j], 0, 3, NUISANCE_SHAPES);
            take_product(&job, job.play[j], 1, 1, NUISANCE_SHAPES);
        }
        for (int node = 0; node < BRANCH_NODES; node++) {
            take_hat(&job, node, true);
            take_hat(&job, node, false);
        }
    }
    for (int waves = 1; options->trends && waves <= TRENDS; waves++) {
        take_waves(&job, waves, 0.0, 0.0, NUISANCE_TRENDS);
    }
    for (size_t line = 0; line < 2 * options->lines; line++) {
        take_waves(&job, 0, options->line_hz[line / 2], line % 2 == 0 ? 0.0 : 0.5 * M_PI, NUISANCE_TRENDS);
    }
    for (size_t j = 0; j < OPERATORS; j++) {
        recordings_room_free(job.play[j], samples->count);
    }
    free(job.play);
    recordings_room_free(job.drive, samples->count);
    free(job.column);
}

size_t nuisance_most(const signals_t *signals, const nuisance_options_t *options) {
    return signals->samples->count + hysteresis_numbers_count(signals->model) +
           (options->plays ? 1 + OPERATORS + 2 * HARMONICS : 0) +
           (options->shapes ? 2 + 3 * SHAPES + 2 * BRANCH_NODES : 0) + (options->trends ? TRENDS : 0) +
           2 * options->lines;
}
