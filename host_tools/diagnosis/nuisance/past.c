/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/nuisance/past.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NODES = PAST_COLUMNS / 2 };

/* Of the way from one end of the range to the other, how much of the part from one node to the next lies behind the
 * furthest drive until now. */
static void fill_recording(const recording_t *recording, size_t node, double sign, const double range[2], double *x) {
    const double *drive = recording->column[COLUMN_DRIVE], end = sign > 0.0 ? range[0] : range[1];
    double furthest = 0.0;
    for (size_t k = 0; k < recording->samples; k++) {
        furthest = fmax(furthest, sign * (drive[k] - end));
        x[k] = fmax(0.0, fmin(1.0, furthest * NODES / (range[1] - range[0]) - (double)node));
    }
    for (size_t k = 0; k < recording->samples; k++) {
        x[k] -= x[recording->samples - 1];
    }
}

void past_column(const samples_t *samples, size_t index, double *column) {
    double range[2];
    recordings_range(samples->recordings, samples->count, COLUMN_DRIVE, range);
    for (size_t i = 0; i < samples->count; i++) {
        fill_recording(&samples->recordings[i], index / 2, index % 2 == 0 ? 1.0 : -1.0, range,
                       column + samples->begin[i]);
    }
}

/* Less what the columns before explain of it, and of unit length over the samples that are fitted. Not if these have
 * hardly any of it: a ramp in a held-out block, of which a filter's last trace is in the next. */
static bool make_orthonormal(const past_t *past, double *of_fitted, double *of_held, double *raw) {
    const int fitted = (int)past->fitted;
    const double before = hypot(cblas_dnrm2(fitted, of_fitted, 1), cblas_dnrm2((int)past->held, of_held, 1));
    for (size_t i = 0; i < past->columns; i++) {
        const double *unit = past->of_fitted + i * past->fitted;
        const double share = cblas_ddot(fitted, unit, 1, of_fitted, 1);
        cblas_daxpy(fitted, -share, unit, 1, of_fitted, 1);
        cblas_daxpy((int)past->held, -share, past->of_held + i * past->held, 1, of_held, 1);
        cblas_daxpy((int)past->all, -share, past->raw + i * past->all, 1, raw, 1);
    }
    const double length = cblas_dnrm2(fitted, of_fitted, 1);
    if (!(length > threshold.past_dependent * before)) {
        return false;
    }
    cblas_dscal(fitted, 1.0 / length, of_fitted, 1);
    cblas_dscal((int)past->held, 1.0 / length, of_held, 1);
    cblas_dscal((int)past->all, 1.0 / length, raw, 1);
    return true;
}

void past_open(past_t *past, const samples_t *samples, const noise_t *noise) {
    *past = (past_t){.all = samples->all, .fitted = samples->fitted, .held = samples->held};
    if (!samples->past_matters) {
        return;
    }
    double *white = samples_column(samples);
    past->of_fitted = allocate(PAST_COLUMNS * past->fitted, sizeof(double));
    past->of_held = allocate(PAST_COLUMNS * past->held, sizeof(double));
    past->raw = allocate(PAST_COLUMNS * past->all, sizeof(double));
    for (size_t index = 0; index < PAST_COLUMNS; index++) {
        double *of_fitted = past->of_fitted + past->columns * past->fitted;
        double *of_held = past->of_held + past->columns * past->held, *raw = past->raw + past->columns * past->all;
        past_column(samples, index, raw);
        noise_whiten(noise, samples, raw, white);
        samples_pick(samples, SAMPLE_FITTED, white, of_fitted);
        samples_pick(samples, SAMPLE_HELD_OUT, white, of_held);
        past->columns += make_orthonormal(past, of_fitted, of_held, raw) ? 1 : 0;
    }
    free(white);
}

void past_close(past_t *past) {
    free(past->of_fitted);
    free(past->of_held);
    free(past->raw);
    *past = (past_t){0};
}

void past_take_out(const past_t *past, double *fitted, double *held) {
    for (size_t i = 0; i < past->columns; i++) {
        const double *unit = past->of_fitted + i * past->fitted;
        const double share = cblas_ddot((int)past->fitted, unit, 1, fitted, 1);
        cblas_daxpy((int)past->fitted, -share, unit, 1, fitted, 1);
        if (held != NULL) {
            cblas_daxpy((int)past->held, -share, past->of_held + i * past->held, 1, held, 1);
        }
    }
}

/* What explains most of the residual that the simulation leaves. */
static void add(const past_t *past, const samples_t *samples, const noise_t *noise, double *simulated) {
    if (past->columns == 0) {
        return;
    }
    double *residual = samples_column(samples), *fitted = allocate(past->fitted, sizeof(double));
    samples_residual(samples, simulated, residual);
    noise_whiten_fitted(noise, samples, residual, fitted);
    for (size_t i = 0; i < past->columns; i++) {
        const double share = cblas_ddot((int)past->fitted, past->of_fitted + i * past->fitted, 1, fitted, 1);
        cblas_daxpy((int)past->all, share, past->raw + i * past->all, 1, simulated, 1);
    }
    free(residual);
    free(fitted);
}

bool past_simulate(const samples_t *samples, const noise_t *noise, const model_t *model, double *column,
                   failure_t *failure) {
    past_t past;
    if (!samples_simulate(samples, model, column, failure)) {
        return false;
    }
    past_open(&past, samples, noise);
    add(&past, samples, noise, column);
    past_close(&past);
    return true;
}
