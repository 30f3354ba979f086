/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/nuisance/past.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NODES = PAST_COLUMNS / 2 };

/* Where it stood before the first sample that counts does not matter: it is what it is there. */
static void hold_before(const samples_t *samples, size_t recording, double *x) {
    const unsigned char *part = samples->part + samples->begin[recording];
    size_t first = 0;
    while (first + 1 < samples->recordings[recording].samples && part[first] == SAMPLE_LEFT_OUT) {
        first++;
    }
    for (size_t k = 0; k < first; k++) {
        x[k] = x[first];
    }
}

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

bool past_shows(const samples_t *samples, size_t recording) {
    const recording_t *r = &samples->recordings[recording];
    const double *drive = r->column[COLUMN_DRIVE];
    double until[2], whole[2];
    values_range(drive, samples->from[recording] + 1, until);
    values_range(drive, r->samples, whole);
    return samples->past_matters && (whole[0] < until[0] || whole[1] > until[1]);
}

void past_column(const samples_t *samples, size_t recording, size_t index, double *column) {
    double range[2];
    recordings_range(samples->recordings, samples->count, COLUMN_DRIVE, range);
    memset(column, 0, samples->all * sizeof *column);
    fill_recording(&samples->recordings[recording], index / 2, index % 2 == 0 ? 1.0 : -1.0, range,
                   column + samples->begin[recording]);
    hold_before(samples, recording, column + samples->begin[recording]);
}

void past_zero_column(const samples_t *samples, size_t recording, double *column) {
    memset(column, 0, samples->all * sizeof *column);
    for (size_t k = samples->begin[recording]; k < samples->begin[recording + 1]; k++) {
        column[k] = 1.0;
    }
}

/* Less what the columns before explain of it, and of unit length over the samples that are fitted. Not if these have
 * hardly any of it, whose length was `before` over all samples: of a ramp in a block that is held out, or in samples
 * that are left out, a filter's last trace is in the next. */
static bool make_orthonormal(const past_of_one_t *past, double before, double *of_fitted, double *of_held,
                             double *raw) {
    const int fitted = (int)past->fitted;
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

/* Scratch of one of these: a column; the same whitened; the rows of either part. */
typedef struct {
    double *column, *white, *fitted, *held;
} scratch_t;

static void add_column(past_of_one_t *past, const samples_t *samples, const noise_t *noise, const scratch_t *scratch) {
    double *of_fitted = past->of_fitted + past->columns * past->fitted;
    double *of_held = past->of_held + past->columns * past->held, *raw = past->raw + past->columns * past->all;
    noise_whiten(noise, samples, scratch->column, scratch->white);
    samples_pick(samples, SAMPLE_FITTED, scratch->white, scratch->fitted);
    samples_pick(samples, SAMPLE_HELD_OUT, scratch->white, scratch->held);
    memcpy(raw, scratch->column + past->begin, past->all * sizeof *raw);
    memcpy(of_fitted, scratch->fitted + past->fitted_begin, past->fitted * sizeof *of_fitted);
    memcpy(of_held, scratch->held + past->held_begin, past->held * sizeof *of_held);
    const double before = cblas_dnrm2((int)past->all, scratch->white + past->begin, 1);
    past->columns += make_orthonormal(past, before, of_fitted, of_held, raw) ? 1 : 0;
}

static void open_one(past_of_one_t *past, const samples_t *samples, size_t recording, const noise_t *noise,
                     const scratch_t *scratch) {
    const size_t zeros = recording > 0 ? 1 : 0, functions = past_shows(samples, recording) ? PAST_COLUMNS : 0;
    past->begin = samples->begin[recording];
    past->all = samples->begin[recording + 1] - past->begin;
    for (size_t k = 0; k < past->all; k++) {
        const unsigned char part = samples->part[past->begin + k];
        past->fitted += part == SAMPLE_FITTED ? 1 : 0;
        past->held += part == SAMPLE_HELD_OUT ? 1 : 0;
    }
    if (zeros + functions == 0) {
        return;
    }
    past->of_fitted = allocate((zeros + functions) * past->fitted, sizeof(double));
    past->of_held = allocate((zeros + functions) * past->held, sizeof(double));
    past->raw = allocate((zeros + functions) * past->all, sizeof(double));
    if (zeros > 0) {
        past_zero_column(samples, recording, scratch->column);
        add_column(past, samples, noise, scratch);
    }
    for (size_t index = 0; index < functions; index++) {
        past_column(samples, recording, index, scratch->column);
        add_column(past, samples, noise, scratch);
    }
}

void past_open(past_t *past, const samples_t *samples, const noise_t *noise) {
    *past = (past_t){.count = samples->count, .of = allocate(samples->count, sizeof *past->of)};
    const scratch_t scratch = {.column = samples_column(samples),
                               .white = samples_column(samples),
                               .fitted = samples_column(samples),
                               .held = samples_column(samples)};
    size_t fitted = 0, held = 0;
    for (size_t i = 0; i < past->count; i++) {
        past_of_one_t *one = &past->of[i];
        one->fitted_begin = fitted;
        one->held_begin = held;
        open_one(one, samples, i, noise, &scratch);
        fitted += one->fitted;
        held += one->held;
        past->columns += one->columns;
    }
    free(scratch.column);
    free(scratch.white);
    free(scratch.fitted);
    free(scratch.held);
}

void past_close(past_t *past) {
    for (size_t i = 0; i < past->count; i++) {
        free(past->of[i].of_fitted);
        free(past->of[i].of_held);
        free(past->of[i].raw);
    }
    free(past->of);
    *past = (past_t){0};
}

void past_take_out(const past_t *past, double *fitted, double *held) {
    for (size_t r = 0; r < past->count; r++) {
        const past_of_one_t *one = &past->of[r];
        double *rows = fitted + one->fitted_begin;
        for (size_t i = 0; i < one->columns; i++) {
            const double *unit = one->of_fitted + i * one->fitted;
            const double share = cblas_ddot((int)one->fitted, unit, 1, rows, 1);
            cblas_daxpy((int)one->fitted, -share, unit, 1, rows, 1);
            if (held != NULL) {
                cblas_daxpy((int)one->held, -share, one->of_held + i * one->held, 1, held + one->held_begin, 1);
            }
        }
    }
}

/* What explains most of the residual that the simulation leaves. */
static void add(const past_t *past, const samples_t *samples, const noise_t *noise, double *simulated) {
    if (past->columns == 0) {
        return;
    }
    double *residual = samples_column(samples), *fitted = allocate(samples->fitted, sizeof(double));
    samples_residual(samples, simulated, residual);
    noise_whiten_fitted(noise, samples, residual, fitted);
    for (size_t r = 0; r < past->count; r++) {
        const past_of_one_t *one = &past->of[r];
        for (size_t i = 0; i < one->columns; i++) {
            const double share =
                cblas_ddot((int)one->fitted, one->of_fitted + i * one->fitted, 1, fitted + one->fitted_begin, 1);
            cblas_daxpy((int)one->all, share, one->raw + i * one->all, 1, simulated + one->begin, 1);
        }
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
