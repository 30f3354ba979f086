/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/noise/noise.h"
#include "diagnosis/noise/noise_filter.h"
#include "numerics/between.h"
#include "numerics/simplex.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_math.h>
#include <gsl/gsl_sort.h>
#include <gsl/gsl_statistics_double.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_SAMPLES = 1000, LEAST_RUN = 40, MOST_RUNS = 1024 };
/* Deviation of the noise, in parts of the displacement's range, where a recording shows none: the last digit. */
static const double least_noise = 1e-7;

typedef struct {
    size_t runs, length[MOST_RUNS];
    double *begin[MOST_RUNS];
    bool left_out[MOST_RUNS];
    basis_t trends[MOST_RUNS]; /* that were taken out */
} runs_t;

static double predicted_power(const double *x, size_t length, const noise_filter_t *filter, size_t skipped) {
    double e = 0.0, sum = 0.0;
    for (size_t k = 1; k < length; k++) {
        e = x[k] - filter->memory * x[k - 1] + filter->mix * e;
        sum += k >= skipped ? e * e : 0.0;
    }
    return sum;
}

static double mean_power_of(const runs_t *runs, const noise_filter_t *filter) {
    double sum = 0.0;
    size_t count = 0;
    for (size_t i = 0; i < runs->runs; i++) {
        if (!runs->left_out[i]) {
            sum += predicted_power(runs->begin[i], runs->length[i], filter, SAMPLES_SKIPPED);
            count += runs->length[i] - SAMPLES_SKIPPED;
        }
    }
    return sum / (double)count;
}

static double mean_power(const double *p, void *context) {
    const noise_filter_t filter = noise_filter_at(p);
    return mean_power_of(context, &filter);
}

static void fit_filter(runs_t *runs, noise_t *noise) {
    static const double start[][NOISE_FILTER_NUMBERS] = {{0.0, -2.0}, {1.0, -2.0}, {2.5, -3.0}, {2.5, 1.0}};
    double least = HUGE_VAL;
    for (size_t s = 0; s < sizeof start / sizeof start[0]; s++) {
        double p[NOISE_FILTER_NUMBERS] = {start[s][0], start[s][1]};
        const simplex_job_t job = {.function = mean_power,
                                   .context = runs,
                                   .dimensions = NOISE_FILTER_NUMBERS,
                                   .step = 0.5,
                                   .size = 1e-3,
                                   .most_iterations = 60};
        const double power = simplex_minimise(&job, p);
        if (power < least) {
            least = power;
            noise->filter = noise_filter_at(p);
        }
    }
    noise->sigma_um = sqrt(least);
}

/* Leaves out the runs that are noisier than the others. */
static bool leave_out_disturbed(runs_t *runs, const noise_t *noise) {
    double power[MOST_RUNS], sorted[MOST_RUNS];
    bool any = false;
    for (size_t i = 0; i < runs->runs; i++) {
        power[i] = predicted_power(runs->begin[i], runs->length[i], &noise->filter, SAMPLES_SKIPPED) /
                   (double)(runs->length[i] - SAMPLES_SKIPPED);
        sorted[i] = power[i];
    }
    const double median = gsl_stats_median(sorted, 1, runs->runs);
    for (size_t i = 0; i < runs->runs; i++) {
        runs->left_out[i] = power[i] > threshold.disturbed * median;
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
    noise->rms_um = noise->sigma_um * sqrt(noise_filter_gain(&noise->filter));
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

/* A parabola and the lines; and room for so many more columns. */
static void trends(size_t length, double rate_hz, double start_s, const double *line_hz, size_t lines, size_t more,
                   basis_t *basis) {
    double *column = allocate(length, sizeof(double));
    basis_open(basis, length, 3 + 2 * lines + more);
    for (size_t j = 0; j < 3 + 2 * lines; j++) {
        for (size_t k = 0; k < length; k++) {
            const double s = 2.0 * (double)k / (double)length - 1.0, t = start_s + (double)k / rate_hz;
            column[k] = j < 3 ? gsl_pow_int(s, (int)j)
                              : cos(2.0 * M_PI * line_hz[(j - 3) / 2] * t - (j % 2 == 0 ? 0.5 * M_PI : 0.0));
        }
        basis_add(basis, column, 1);
    }
    free(column);
}

static void take_restricted(const explained_noise_t *explained, size_t count, noise_t *noise) {
    noise_filter_t filter = noise->filter;
    const double variance = noise_filter_restricted(explained, count, &filter);
    if (variance > 0.0) {
        noise->filter = filter;
        noise->sigma_um = sqrt(variance);
        noise->rms_um = noise->sigma_um * sqrt(noise_filter_gain(&filter));
    }
}

/* Rests that are hardly longer than the noise's memory: their parabolas took much of it. */
static void restrict_rests(const runs_t *runs, noise_t *noise) {
    explained_noise_t *explained = allocate(runs->runs, sizeof *explained);
    const size_t begin = 0;
    size_t count = 0;
    for (size_t i = 0; i < runs->runs; i++) {
        if (!runs->left_out[i]) {
            explained[count++] = (explained_noise_t){.pieces = 1,
                                                     .begin = &begin,
                                                     .end = &runs->length[i],
                                                     .explained = runs->trends[i],
                                                     .left = runs->begin[i]};
        }
    }
    take_restricted(explained, count, noise);
    free(explained);
}

static void add_run(runs_t *runs, const double *readings, double rate_hz, size_t from, size_t to, const double *line_hz,
                    size_t lines) {
    const double length = (double)(to - from);
    const size_t settled = from + (size_t)fmin(threshold.settling_s * rate_hz, threshold.settling_part * length);
    if (length < threshold.least_rest_s * rate_hz || to - settled < LEAST_RUN + 4 * lines || runs->runs == MOST_RUNS) {
        return;
    }
    double *x = allocate(to - settled, sizeof(double));
    memcpy(x, readings + settled, (to - settled) * sizeof(double));
    trends(to - settled, rate_hz, (double)settled / rate_hz, line_hz, lines, 0, &runs->trends[runs->runs]);
    basis_project(&runs->trends[runs->runs], x, 1);
    runs->begin[runs->runs] = x;
    runs->length[runs->runs++] = to - settled;
}

/* Takes the runs. Returns whether they are enough. */
static bool find_in_runs(runs_t *runs, const samples_t *samples, noise_t *noise) {
    size_t total = 0;
    for (size_t i = 0; i < runs->runs; i++) {
        total += runs->length[i];
    }
    if (total >= LEAST_SAMPLES) {
        find(runs, samples, noise);
        if (noise->filter.memory > threshold.slow_noise) {
            restrict_rests(runs, noise);
        }
    }
    for (size_t i = 0; i < runs->runs; i++) {
        free(runs->begin[i]);
        basis_close(&runs->trends[i]);
    }
    free(runs);
    return total >= LEAST_SAMPLES;
}

bool noise_at_rest(const samples_t *samples, const double *left, const double *line_hz, size_t lines, noise_t *noise) {
    runs_t *runs = allocate(1, sizeof *runs);
    *noise = (noise_t){.at_rest = true};
    for (size_t i = 0; i < samples->count; i++) {
        const recording_t *recording = &samples->recordings[i];
        const double *drive = recording->column[COLUMN_DRIVE];
        const double *readings = left != NULL ? left + samples->begin[i] : recording->column[COLUMN_DISPLACEMENT];
        double range[2];
        size_t from = samples->from[i];
        values_range(drive, recording->samples, range);
        for (size_t k = from + 1; k <= recording->samples; k++) {
            if (k == recording->samples || fabs(drive[k] - drive[from]) > threshold.still * (range[1] - range[0])) {
                add_run(runs, readings, recording->sample_rate_hz, from, k, line_hz, lines);
                from = k;
            }
        }
    }
    return find_in_runs(runs, samples, noise);
}

/* How far apart passes are compared, in samples. As many passes as are not more than half of those that have settled:
 * a number of whole samples if any is, else what comes nearest, since noise between samples is smoother. 0: there is
 * one pass. */
static double lag_of(const probe_passes_t *passes) {
    const double whole_within = 0.05; /* of a sample: the drive's rate takes out what is left */
    const double count = passes->period > 0.0 ? (double)(passes->to - passes->from) / passes->period : 0.0;
    double best = 0.0, least = HUGE_VAL;
    for (size_t times = count < 2.0 ? 0 : (size_t)fmax(1.0, 0.5 * (count - 1.0)); times > 0; times--) {
        const double lag = (double)times * passes->period, off = fabs(lag - round(lag));
        if (off < whole_within) {
            return round(lag);
        }
        if (off < least) {
            least = off;
            best = lag;
        }
    }
    return best;
}

/* The first pass may not have settled. Of two, what is left of it where the hysteresis has forgotten what was before.
 */
static size_t first_of(const samples_t *samples, size_t recording, const probe_passes_t *passes) {
    const size_t known = samples->from[recording];
    if ((double)(passes->to - passes->from) < 3.0 * passes->period) {
        return known > passes->from ? known : passes->from;
    }
    return passes->from + (size_t)ceil(passes->period);
}

/* Two passes of one path: in a recording, or in two. */
typedef struct {
    const recording_t *one, *other;
    size_t first, samples; /* of the one, and how many */
    double lag;            /* how many samples later the other one has the same drive */
} twice_t;

static void add_difference(runs_t *runs, const twice_t *twice, size_t from, size_t length, const double *line_hz,
                           size_t lines) {
    const recording_t *recording = twice->one;
    const double *drive = recording->column[COLUMN_DRIVE] + from, lag = twice->lag;
    const double *readings = recording->column[COLUMN_DISPLACEMENT] + from;
    const double *later = twice->other->column[COLUMN_DISPLACEMENT] + from;
    basis_t *trend = &runs->trends[runs->runs];
    double *x = allocate(length, sizeof(double)), *column = allocate(length, sizeof(double));
    const double spread = sqrt(1.0 + value_between_variance(lag - floor(lag)));
    trends(length, recording->sample_rate_hz, (double)from / recording->sample_rate_hz, line_hz, lines, 2, trend);
    for (size_t of_rate = 0; of_rate < 2; of_rate++) {
        for (size_t k = 0; k < length; k++) {
            column[k] = of_rate != 0 ? drive[k + 1] - drive[k] : drive[k];
        }
        basis_add(trend, column, 1);
    }
    for (size_t k = 0; k < length; k++) {
        x[k] = (value_between(later, twice->other->samples - from, (double)k + lag) - readings[k]) / spread;
    }
    basis_project(trend, x, 1);
    free(column);
    runs->begin[runs->runs] = x;
    runs->length[runs->runs++] = length;
}

static void add_differences(runs_t *runs, const twice_t *twice, const double *line_hz, size_t lines) {
    enum { PIECE = 2000 }; /* long enough for slow noise, and some are left out */
    const size_t pieces = 1 + twice->samples / PIECE;
    for (size_t piece = 0; piece < pieces; piece++) {
        const size_t from = piece * twice->samples / pieces, to = (piece + 1) * twice->samples / pieces;
        if (to - from >= LEAST_RUN + 4 * lines && runs->runs < MOST_RUNS) {
            add_difference(runs, twice, twice->first + from, to - from, line_hz, lines);
        }
    }
}

static twice_t twice_in_one(const samples_t *samples, size_t recording, const probe_passes_t *passes) {
    const recording_t *one = &samples->recordings[recording];
    const double lag = passes->to <= one->samples ? lag_of(passes) : 0.0;
    const size_t first = first_of(samples, recording, passes), needed = first + (size_t)ceil(lag);
    return (twice_t){one, one, first, lag > 0.0 && passes->to > needed ? passes->to - needed : 0, lag};
}

static bool same_drive(const recording_t *one, const recording_t *other) {
    const double *drive = one->column[COLUMN_DRIVE], *again = other->column[COLUMN_DRIVE];
    double range[2];
    if (one->samples != other->samples || one->sample_rate_hz != other->sample_rate_hz) {
        return false;
    }
    values_range(drive, one->samples, range);
    for (size_t k = 0; k < one->samples; k++) {
        if (fabs(again[k] - drive[k]) > threshold.still * (range[1] - range[0])) {
            return false;
        }
    }
    return true;
}

/* The next one with the same drive; none: no samples. The last reading has no rate of the drive behind it. */
static twice_t twice_in_two(const samples_t *samples, size_t recording) {
    const recording_t *one = &samples->recordings[recording];
    for (size_t i = recording + 1; i < samples->count; i++) {
        if (same_drive(one, &samples->recordings[i])) {
            const size_t first = GSL_MAX(samples->from[recording], samples->from[i]);
            return (twice_t){one, &samples->recordings[i], first, one->samples - 1 - first, 0.0};
        }
    }
    return (twice_t){one, one, 0, 0, 0.0};
}

bool noise_between_passes(const samples_t *samples, const probe_passes_t *passes, const double *line_hz, size_t lines,
                          noise_t *noise) {
    runs_t *runs = allocate(1, sizeof *runs);
    *noise = (noise_t){.between_passes = true};
    for (size_t i = 0; i < samples->count; i++) {
        const twice_t in_one = twice_in_one(samples, i, &passes[i]), in_two = twice_in_two(samples, i);
        add_differences(runs, &in_one, line_hz, lines);
        add_differences(runs, &in_two, line_hz, lines);
    }
    return find_in_runs(runs, samples, noise);
}

/* Cuts a column into pieces, of which some may turn out to be threshold.disturbed. */
static void cut(const samples_t *samples, double *column, runs_t *runs) {
    enum { PIECES = 36 };
    *runs = (runs_t){0};
    for (size_t i = 0; i < samples->count; i++) {
        const size_t length = (samples->recordings[i].samples - samples->from[i]) / PIECES;
        for (size_t piece = 0; piece < PIECES && length > LEAST_RUN && runs->runs < MOST_RUNS; piece++) {
            runs->begin[runs->runs] = column + samples->begin[i] + samples->from[i] + piece * length;
            runs->length[runs->runs++] = length;
        }
    }
    if (runs->runs == 0) { /* hardly any samples: one run */
        runs->begin[0] = column + samples->from[0];
        runs->length[0] = samples->begin[1] - samples->from[0];
        runs->runs = 1;
    }
}

/* Runs of a column that are not threshold.disturbed; neighbours make one piece. */
static void restrict_column(const basis_t *basis, double *left, const runs_t *runs, noise_t *noise) {
    size_t *begin = allocate(runs->runs, sizeof *begin), *end = allocate(runs->runs, sizeof *end), pieces = 0;
    for (size_t i = 0; i < runs->runs; i++) {
        const size_t from = (size_t)(runs->begin[i] - left);
        if (!runs->left_out[i] && pieces > 0 && end[pieces - 1] == from) {
            end[pieces - 1] += runs->length[i];
        } else if (!runs->left_out[i]) {
            begin[pieces] = from;
            end[pieces++] = from + runs->length[i];
        }
    }
    const explained_noise_t explained = {
        .pieces = pieces, .begin = begin, .end = end, .explained = *basis, .left = left};
    take_restricted(&explained, 1, noise);
    free(begin);
    free(end);
}

void noise_of(const samples_t *samples, const basis_t *explained, const double *left, noise_t *noise) {
    runs_t *runs = allocate(1, sizeof *runs);
    double *copy = samples_column(samples);
    *noise = (noise_t){0};
    memcpy(copy, left, samples->all * sizeof(double));
    cut(samples, copy, runs);
    find(runs, samples, noise);
    if (explained != NULL && noise->filter.memory > threshold.slow_noise &&
        (double)noise->samples > threshold.least_undisturbed * (double)(samples->fitted + samples->held)) {
        restrict_column(explained, copy, runs, noise);
    }
    free(copy);
    free(runs);
}

void noise_whiten(const noise_t *noise, const samples_t *samples, const double *column, double *white) {
    for (size_t i = 0; i < samples->count; i++) {
        const size_t begin = samples->begin[i], from = samples->from[i];
        memset(white + begin, 0, from * sizeof(double));
        noise_filter_whiten(&noise->filter, column + begin + from, samples->recordings[i].samples - from,
                            white + begin + from);
        white[begin + from] = 0.0;
    }
}

void noise_whiten_fitted(const noise_t *noise, const samples_t *samples, const double *column, double *rows) {
    double *white = samples_column(samples);
    noise_whiten(noise, samples, column, white);
    samples_pick(samples, SAMPLE_FITTED, white, rows);
    free(white);
}
