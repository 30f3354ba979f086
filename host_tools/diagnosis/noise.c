/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "noise.h"
#include "simplex.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_linalg.h>
#include <gsl/gsl_math.h>
#include <gsl/gsl_sort.h>
#include <gsl/gsl_statistics_double.h>
#include <stdlib.h>
#include <string.h>

/* The drive rests while it stays within this part of its range. */
static const double still = 1e-3;
static const double shortest_s = 0.05, settling_s = 0.1, settling_part = 1.0 / 3.0;
enum { LEAST_SAMPLES = 1000, LEAST_RUN = 40, MOST_RUNS = 1024 };
/* A run whose noise is larger than that of the others by this factor (its variance) has something else in it. */
static const double disturbed = 1.6;
/* Deviation of the noise, in parts of the displacement's range, where a recording shows none: the last digit. */
static const double least_noise = 1e-7;

/* Nothing slower is noise: its neighbours would be equal, and its size would have no end. */
static const double longest_memory = 0.9995;

typedef struct {
    size_t runs, length[MOST_RUNS];
    double *begin[MOST_RUNS];
    bool left_out[MOST_RUNS];
} runs_t;

static double predicted_power(const double *x, size_t length, double memory, double mix, size_t skipped) {
    double e = 0.0, sum = 0.0;
    for (size_t k = 1; k < length; k++) {
        e = x[k] - memory * x[k - 1] + mix * e;
        sum += k >= skipped ? e * e : 0.0;
    }
    return sum;
}

/* memory in (-1, 1) and mix between 0 and memory (white noise on top makes no other), from two numbers without bounds.
 */
static void numbers_of(const double *p, double *memory, double *mix) {
    *memory = longest_memory * tanh(p[0]);
    *mix = *memory / (1.0 + exp(-p[1]));
}

static double mean_power(const double *p, void *context) {
    const runs_t *runs = context;
    double memory, mix, sum = 0.0;
    size_t count = 0;
    numbers_of(p, &memory, &mix);
    for (size_t i = 0; i < runs->runs; i++) {
        if (!runs->left_out[i]) {
            sum += predicted_power(runs->begin[i], runs->length[i], memory, mix, SAMPLES_SKIPPED);
            count += runs->length[i] - SAMPLES_SKIPPED;
        }
    }
    return sum / (double)count;
}

static void fit_filter(runs_t *runs, noise_t *noise) {
    static const double start[][2] = {{0.0, -2.0}, {1.0, -2.0}, {2.5, -3.0}, {2.5, 1.0}};
    double least = HUGE_VAL;
    for (size_t s = 0; s < sizeof start / sizeof start[0]; s++) {
        double p[2] = {start[s][0], start[s][1]};
        const simplex_job_t job = {
            .function = mean_power, .context = runs, .dimensions = 2, .step = 0.5, .size = 1e-3, .most_iterations = 60};
        const double power = simplex_minimise(&job, p);
        if (power < least) {
            least = power;
            numbers_of(p, &noise->memory, &noise->mix);
        }
    }
    noise->sigma_um = sqrt(least);
}

/* Leaves out the runs that are noisier than the others. */
static bool leave_out_disturbed(runs_t *runs, const noise_t *noise) {
    double power[MOST_RUNS], sorted[MOST_RUNS];
    bool any = false;
    for (size_t i = 0; i < runs->runs; i++) {
        power[i] = predicted_power(runs->begin[i], runs->length[i], noise->memory, noise->mix, SAMPLES_SKIPPED) /
                   (double)(runs->length[i] - SAMPLES_SKIPPED);
        sorted[i] = power[i];
    }
    const double median = gsl_stats_median(sorted, 1, runs->runs);
    for (size_t i = 0; i < runs->runs; i++) {
        runs->left_out[i] = power[i] > disturbed * median;
        any = any || runs->left_out[i];
    }
    return any;
}

static void find(runs_t *runs, const samples_t *samples, noise_t *noise) {
    double range[2];
    recordings_range(samples->recordings, samples->count, COLUMN_DISPLACEMENT, range);
    fit_filter(runs, noise);
    if (leave_out_disturbed(runs, noise)) {
        fit_filter(runs, noise);
    }
    noise->sigma_um = fmax(noise->sigma_um, least_noise * (range[1] - range[0]));
    noise->rms_um =
        noise->sigma_um * sqrt(1.0 + gsl_pow_2(noise->memory - noise->mix) / (1.0 - gsl_pow_2(noise->memory)));
    noise->samples = 0;
    double squares = 0.0;
    for (size_t i = 0; i < runs->runs; i++) {
        if (!runs->left_out[i]) {
            noise->samples += runs->length[i];
            squares += gsl_pow_2(cblas_dnrm2((int)runs->length[i], runs->begin[i], 1));
        }
    }
    if (!noise->at_rest) { /* runs over the whole recording, trends included: no need to conclude from the filter */
        noise->rms_um = fmin(noise->rms_um, sqrt(squares / (double)noise->samples));
    }
}

/* Takes a parabola and the lines out of a run. */
static void detrend(double *x, size_t length, double rate_hz, double start_s, const double *line_hz, size_t lines) {
    const size_t columns = 3 + 2 * lines;
    gsl_matrix *a = gsl_matrix_alloc(length, columns);
    gsl_vector *tau = gsl_vector_alloc(columns), *solution = gsl_vector_alloc(columns),
               *left = gsl_vector_alloc(length);
    gsl_vector_view b = gsl_vector_view_array(x, length);
    for (size_t k = 0; k < length; k++) {
        const double s = 2.0 * (double)k / (double)length - 1.0, t = start_s + (double)k / rate_hz;
        gsl_matrix_set(a, k, 0, 1.0);
        gsl_matrix_set(a, k, 1, s);
        gsl_matrix_set(a, k, 2, s * s);
        for (size_t line = 0; line < lines; line++) {
            gsl_matrix_set(a, k, 3 + 2 * line, cos(2.0 * M_PI * line_hz[line] * t));
            gsl_matrix_set(a, k, 4 + 2 * line, sin(2.0 * M_PI * line_hz[line] * t));
        }
    }
    gsl_linalg_QR_decomp(a, tau);
    gsl_linalg_QR_lssolve(a, tau, &b.vector, solution, left);
    memcpy(x, left->data, length * sizeof(double));
    gsl_matrix_free(a);
    gsl_vector_free(tau);
    gsl_vector_free(solution);
    gsl_vector_free(left);
}

static void add_run(runs_t *runs, const recording_t *recording, size_t from, size_t to, const double *line_hz,
                    size_t lines) {
    const double rate_hz = recording->sample_rate_hz, length = (double)(to - from);
    const size_t settled = from + (size_t)fmin(settling_s * rate_hz, settling_part * length);
    if (length < shortest_s * rate_hz || to - settled < LEAST_RUN + 4 * lines || runs->runs == MOST_RUNS) {
        return;
    }
    double *x = allocate(to - settled, sizeof(double));
    memcpy(x, recording->column[COLUMN_DISPLACEMENT] + settled, (to - settled) * sizeof(double));
    detrend(x, to - settled, rate_hz, (double)settled / rate_hz, line_hz, lines);
    runs->begin[runs->runs] = x;
    runs->length[runs->runs++] = to - settled;
}

bool noise_at_rest(const samples_t *samples, const double *line_hz, size_t lines, noise_t *noise) {
    runs_t *runs = allocate(1, sizeof *runs);
    size_t total = 0;
    *noise = (noise_t){.at_rest = true};
    for (size_t i = 0; i < samples->count; i++) {
        const recording_t *recording = &samples->recordings[i];
        const double *drive = recording->column[COLUMN_DRIVE];
        double range[2];
        size_t from = samples->from[i];
        values_range(drive, recording->samples, range);
        for (size_t k = from + 1; k <= recording->samples; k++) {
            if (k == recording->samples || fabs(drive[k] - drive[from]) > still * (range[1] - range[0])) {
                add_run(runs, recording, from, k, line_hz, lines);
                from = k;
            }
        }
    }
    for (size_t i = 0; i < runs->runs; i++) {
        total += runs->length[i];
    }
    if (total >= LEAST_SAMPLES) {
        find(runs, samples, noise);
    }
    for (size_t i = 0; i < runs->runs; i++) {
        free(runs->begin[i]);
    }
    free(runs);
    return total >= LEAST_SAMPLES;
}

void noise_of(const samples_t *samples, const double *left, noise_t *noise) {
    enum { PIECES = 36 };
    runs_t *runs = allocate(1, sizeof *runs);
    double *copy = samples_column(samples);
    *noise = (noise_t){0};
    memcpy(copy, left, samples->all * sizeof(double));
    for (size_t i = 0; i < samples->count; i++) {
        const size_t length = (samples->recordings[i].samples - samples->from[i]) / PIECES;
        for (size_t piece = 0; piece < PIECES && length > LEAST_RUN && runs->runs < MOST_RUNS; piece++) {
            runs->begin[runs->runs] = copy + samples->begin[i] + samples->from[i] + piece * length;
            runs->length[runs->runs++] = length;
        }
    }
    if (runs->runs == 0) { /* hardly any samples: one run */
        runs->begin[0] = copy + samples->from[0];
        runs->length[0] = samples->begin[1] - samples->from[0];
        runs->runs = 1;
    }
    find(runs, samples, noise);
    free(runs);
    free(copy);
}

void noise_whiten(const noise_t *noise, const samples_t *samples, const double *column, double *white) {
    for (size_t i = 0; i < samples->count; i++) {
        const double *x = column + samples->begin[i];
        double *y = white + samples->begin[i], e = 0.0;
        for (size_t k = 0; k <= samples->from[i]; k++) {
            y[k] = 0.0;
        }
        for (size_t k = samples->from[i] + 1; k < samples->recordings[i].samples; k++) {
            e = x[k] - noise->memory * x[k - 1] + noise->mix * e;
            y[k] = e;
        }
    }
}

void noise_whiten_fitted(const noise_t *noise, const samples_t *samples, const double *column, double *rows) {
    double *white = samples_column(samples);
    noise_whiten(noise, samples, column, white);
    samples_pick(samples, SAMPLE_FITTED, white, rows);
    free(white);
}
