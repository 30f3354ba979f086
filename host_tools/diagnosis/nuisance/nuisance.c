/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/nuisance/nuisance.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "diagnosis/nuisance/past.h"
#include "diagnosis/where/drive_period.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { OPERATORS = 24, SHAPES = 6, BRANCH_NODES = 11, TRENDS = 12, HARMONICS = 40, AT_ONCE = 16 };

typedef struct job job_t;

/* A column that is wanted, and what its function makes it from. */
typedef struct wanted {
    void (*fill)(const job_t *job, const struct wanted *wanted, double *column);
    nuisance_layer_t layer;
    size_t index; /* of a recording, a number, a node */
    double **z;   /* drive^drive_power z^power */
    int drive_power, power;
    double waves, hz, phase; /* half waves over the part that counts, or a line */
    bool sided;
} wanted_t;

struct job {
    const signals_t *signals;
    const samples_t *samples;
    double center_v, half_v;
    double **drive; /* behind the electronics, as a part of half the range; one a recording */
    double ***play; /* [operator][recording][sample], likewise */
    hysteresis_numbers_t numbers;
    size_t count;
    wanted_t *wanted;
    size_t first;    /* of those that are made together */
    double **column; /* room for them */
};

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
    for (size_t b = 0; b < model->blocks; b++) {
        const block_t *block = model->block[b].block;
        if (block->place > PLACE_HYSTERESIS && !block->adds) {
            chain_pass(model, b, recording, x);
        }
    }
}

/* x^a z^b, z: the drive itself or one of the operators. */
static void fill_product(const job_t *job, const wanted_t *wanted, double *column) {
    const samples_t *s = job->samples;
    for (size_t i = 0; i < s->count; i++) {
        double *x = column + s->begin[i];
        for (size_t k = 0; k < s->recordings[i].samples; k++) {
            x[k] = gsl_pow_int(job->drive[i][k], wanted->drive_power) * gsl_pow_int(wanted->z[i][k], wanted->power);
        }
        pass_through(job->signals->model, &s->recordings[i], x);
    }
}

/* A function of the drive, a hat about one of evenly spread nodes, with the sign of its last motion: what tells the
 * branches of a loop apart, whatever its shape. Without the sign (`sided` false): what they have in common. */
static void fill_hat(const job_t *job, const wanted_t *wanted, double *column) {
    const samples_t *s = job->samples;
    for (size_t i = 0; i < s->count; i++) {
        double *x = column + s->begin[i], direction = 1.0;
        for (size_t k = 0; k < s->recordings[i].samples; k++) {
            const double u = job->drive[i][k], last = k > 0 ? job->drive[i][k - 1] : u;
            const double node = 2.0 * (double)wanted->index / (BRANCH_NODES - 1.0) - 1.0;
            const double away = fabs(u - node) * 0.5 * (BRANCH_NODES - 1.0);
            direction = u > last ? 1.0 : u < last ? -1.0 : direction;
            x[k] = (away < 1.0 ? 1.0 - away : 0.0) * (wanted->sided ? direction : 1.0);
        }
        pass_through(job->signals->model, &s->recordings[i], x);
    }
}

static void fill_past(const job_t *job, const wanted_t *wanted, double *column) {
    const samples_t *s = job->samples;
    const size_t recording = wanted->index / PAST_COLUMNS;
    past_column(s, recording, wanted->index % PAST_COLUMNS, column);
    pass_through(job->signals->model, &s->recordings[recording], column + s->begin[recording]);
}

static void fill_offset(const job_t *job, const wanted_t *wanted, double *column) {
    past_zero_column(job->samples, wanted->index, column);
}

static void fill_derivative(const job_t *job, const wanted_t *wanted, double *column) {
    if (!signals_derivative(job->signals, &job->numbers, wanted->index, column)) {
        memset(column, 0, job->samples->all * sizeof(double));
    }
}

/* cos(radians_per_sample (k + 1/2) - phase) in each recording. */
static void fill_wave(const job_t *job, const wanted_t *wanted, double *column) {
    const samples_t *s = job->samples;
    for (size_t i = 0; i < s->count; i++) {
        const size_t from = s->from[i], length = s->recordings[i].samples;
        const double turn = wanted->waves > 0.0 ? M_PI * wanted->waves / (double)(length - from)
                                                : 2.0 * M_PI * wanted->hz / s->recordings[i].sample_rate_hz;
        for (size_t k = 0; k < length; k++) {
            column[s->begin[i] + k] = cos(turn * ((double)k - (double)from + 0.5) - wanted->phase);
        }
    }
}

double nuisance_loop_hz(const samples_t *s) {
    const recording_t *recording = &s->recordings[0];
    const size_t from = s->from[0], length = recording->samples - from;
    const double *drive = recording->column[COLUMN_DRIVE] + from;
    const double period = s->count == 1 ? drive_period(drive, length) : 0.0;
    double range[2], way = 0.0;
    values_range(drive, length, range);
    for (size_t k = 1; k < length; k++) {
        way += fabs(drive[k] - drive[k - 1]);
    }
    return period > 0.0 && way * period < threshold.one_loop * 2.0 * (range[1] - range[0]) * (double)length
               ? recording->sample_rate_hz / period
               : 0.0;
}

static void want(job_t *job, wanted_t wanted) {
    job->wanted[job->count++] = wanted;
}

static void want_line(job_t *job, double hz, nuisance_layer_t layer) {
    want(job, (wanted_t){.fill = fill_wave, .layer = layer, .hz = hz});
    want(job, (wanted_t){.fill = fill_wave, .layer = layer, .hz = hz, .phase = 0.5 * M_PI});
}

static void want_product(job_t *job, double **z, int drive_power, int power, nuisance_layer_t layer) {
    want(job, (wanted_t){.fill = fill_product, .layer = layer, .z = z, .drive_power = drive_power, .power = power});
}

static void want_own(job_t *job, const nuisance_options_t *options) {
    const samples_t *samples = job->samples;
    for (size_t i = 0; i < samples->count; i++) {
        want(job, (wanted_t){.fill = fill_offset, .layer = NUISANCE_OWN, .index = i});
    }
    for (size_t n = 0; n < job->numbers.count; n++) {
        want(job, (wanted_t){.fill = fill_derivative, .layer = NUISANCE_OWN, .index = n});
    }
    for (size_t i = 0; options->past && i < PAST_COLUMNS * samples->count; i++) {
        if (past_shows(samples, i / PAST_COLUMNS)) {
            want(job, (wanted_t){.fill = fill_past, .layer = NUISANCE_OWN, .index = i});
        }
    }
    const double hz = options->plays ? nuisance_loop_hz(samples) : 0.0;
    for (int harmonic = 1; harmonic <= HARMONICS && hz > 0.0 && harmonic * hz < 0.2 * samples_fastest_hz(samples);
         harmonic++) {
        want_line(job, harmonic * hz, NUISANCE_OWN);
    }
}

static void want_shapes(job_t *job) {
    want_product(job, job->drive, 0, 2, NUISANCE_SHAPES);
    want_product(job, job->drive, 0, 3, NUISANCE_SHAPES);
    for (size_t j = 0; j < OPERATORS; j += OPERATORS / SHAPES) {
        want_product(job, job->play[j], 0, 2, NUISANCE_SHAPES);
        want_product(job, job->play[j], 0, 3, NUISANCE_SHAPES);
        want_product(job, job->play[j], 1, 1, NUISANCE_SHAPES);
    }
    for (size_t node = 0; node < BRANCH_NODES; node++) {
        want(job, (wanted_t){.fill = fill_hat, .layer = NUISANCE_SHAPES, .index = node, .sided = true});
        want(job, (wanted_t){.fill = fill_hat, .layer = NUISANCE_SHAPES, .index = node});
    }
}

static void want_all(job_t *job, const nuisance_options_t *options) {
    want_own(job, options);
    if (options->plays) {
        want_product(job, job->drive, 0, 1, NUISANCE_PLAYS);
        for (size_t j = 0; j < OPERATORS; j++) {
            want_product(job, job->play[j], 0, 1, NUISANCE_PLAYS);
        }
    }
    if (options->shapes) {
        want_shapes(job);
    }
    for (int waves = 1; options->trends && waves <= TRENDS; waves++) {
        want(job, (wanted_t){.fill = fill_wave, .layer = NUISANCE_TRENDS, .waves = waves});
    }
    for (size_t line = 0; line < options->lines; line++) {
        want_line(job, options->line_hz[line], NUISANCE_TRENDS);
    }
}

static void fill(void *context, size_t index) {
    const job_t *job = context;
    const wanted_t *wanted = &job->wanted[job->first + index];
    wanted->fill(job, wanted, job->column[index]);
}

/* Some of the columns at a time on all processors. */
static void take_all(job_t *job, nuisance_take_t *take, void *context) {
    double *column[AT_ONCE];
    for (size_t i = 0; i < AT_ONCE; i++) {
        column[i] = samples_column(job->samples);
    }
    job->column = column;
    for (job->first = 0; job->first < job->count && !progress_cancelled(); job->first += AT_ONCE) {
        const size_t left = job->count - job->first, some = left < AT_ONCE ? left : AT_ONCE;
        parallel(some, fill, job);
        for (size_t i = 0; i < some; i++) {
            take(context, column[i], job->wanted[job->first + i].layer);
        }
    }
    for (size_t i = 0; i < AT_ONCE; i++) {
        free(column[i]);
    }
}

void nuisance(const signals_t *signals, const nuisance_options_t *options, nuisance_take_t *take, void *context) {
    const samples_t *samples = signals->samples;
    signals_t own = *signals;
    job_t job = {.signals = &own, .samples = samples};
    model_t copy; /* the numbers point into it; it stays as it is */
    model_copy(&copy, signals->model);
    hysteresis_numbers_open(&copy, &job.numbers);
    signals_differentiate(&own, &job.numbers);
    job.wanted = allocate(nuisance_most(signals, options), sizeof *job.wanted);
    find_range(&job);
    find_operators(&job);
    want_all(&job, options);
    take_all(&job, take, context);
    for (size_t j = 0; j < OPERATORS; j++) {
        recordings_room_free(job.play[j], samples->count);
    }
    free(job.play);
    recordings_room_free(job.drive, samples->count);
    free(job.wanted);
    signals_forget(&own);
    hysteresis_numbers_close(&job.numbers);
    model_free(&copy);
}

size_t nuisance_most(const signals_t *signals, const nuisance_options_t *options) {
    size_t pasts = 0;
    for (size_t i = 0; options->past && i < signals->samples->count; i++) {
        pasts += past_shows(signals->samples, i) ? 1 : 0;
    }
    return signals->samples->count + hysteresis_numbers_count(signals->model) + PAST_COLUMNS * pasts +
           (options->plays ? 1 + OPERATORS + 2 * HARMONICS : 0) +
           (options->shapes ? 2 + 3 * SHAPES + 2 * BRANCH_NODES : 0) + (options->trends ? TRENDS : 0) +
           2 * options->lines;
}
