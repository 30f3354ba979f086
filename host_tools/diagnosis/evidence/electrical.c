/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/evidence/electrical.h"
#include "numerics/least_squares.h"
#include "numerics/regression.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

const double electrical_least_sigma = 1e-3;
/* Of the simulated signal: a change that is smaller is none. */
static const double no_change = 1e-9;
enum { VOLTAGE_PREDICTORS = 1, CURRENT_PREDICTORS = 4, MOST_PREDICTORS = CURRENT_PREDICTORS };

bool column_measured(const samples_t *samples, column_t column) {
    for (size_t i = 0; i < samples->count; i++) {
        if (samples->recordings[i].column[column] != NULL) {
            return true;
        }
    }
    return false;
}

/* Where a chain's pure delay is: before the voltage or behind it, which is not known. */
typedef enum { DELAY_BEFORE, DELAY_BEHIND } side_t;

static bool has_delay(const model_t *model) {
    for (size_t b = 0; b < model->blocks; b++) {
        if (model->block[b].block->lag == LAG_DELAY) {
            return true;
        }
    }
    return false;
}

/* The drive behind the model's electronics: a column. */
static void simulate_voltage(const samples_t *samples, const model_t *model, side_t delay, double *voltage) {
    for (size_t i = 0; i < samples->count; i++) {
        const recording_t *recording = &samples->recordings[i];
        double *v = voltage + samples->begin[i];
        memcpy(v, recording->column[COLUMN_DRIVE], recording->samples * sizeof(double));
        for (size_t b = 0; b < model->blocks; b++) {
            const block_t *block = model->block[b].block;
            if (block->place == PLACE_ELECTRONICS && (delay == DELAY_BEFORE || block->lag != LAG_DELAY)) {
                chain_pass(model, b, recording, v);
            }
        }
    }
}

/* First differences over the two samples about each, so that they are not late, and second ones; by the time between
 * two samples. */
static void differ(const samples_t *samples, const double *voltage, double *first, double *second) {
    for (size_t i = 0; i < samples->count; i++) {
        const recording_t *recording = &samples->recordings[i];
        const double *v = voltage + samples->begin[i];
        for (size_t k = 0; k < recording->samples; k++) {
            const double before = k > 0 ? v[k] - v[k - 1] : 0.0;
            const double after = k + 1 < recording->samples ? v[k + 1] - v[k] : 0.0;
            first[samples->begin[i] + k] = 0.5 * (after + before) * recording->sample_rate_hz;
            second[samples->begin[i] + k] = (after - before) * recording->sample_rate_hz;
        }
    }
}

/* What the electronics predict of a column: offsets and predictors, the one with the factor that is requested last;
 * 0 in samples that do not speak, of recordings without the column or left out. */
typedef struct {
    size_t unknowns;
    double *column; /* one after the other */
    double *main;   /* the last one */
} prediction_t;

static void silence(const samples_t *samples, column_t column, double *x) {
    for (size_t i = 0; i < samples->count; i++) {
        for (size_t k = samples->begin[i]; k < samples->begin[i + 1]; k++) {
            if (samples->part[k] == SAMPLE_LEFT_OUT || samples->recordings[i].column[column] == NULL) {
                x[k] = 0.0;
            }
        }
    }
}

static void predict(const samples_t *samples, column_t column, const model_t *model, side_t delay, prediction_t *p) {
    const size_t predictors = column == COLUMN_CURRENT ? CURRENT_PREDICTORS : VOLTAGE_PREDICTORS;
    p->unknowns = samples->count + predictors;
    p->column = allocate(p->unknowns * samples->all, sizeof(double));
    p->main = p->column + (p->unknowns - 1) * samples->all;
    double *voltage = p->column + samples->count * samples->all;
    for (size_t i = 0; i < samples->count; i++) {
        for (size_t k = samples->begin[i]; k < samples->begin[i + 1]; k++) {
            p->column[i * samples->all + k] = 1.0;
        }
    }
    simulate_voltage(samples, model, delay, voltage);
    if (column == COLUMN_CURRENT) {
        double *product = voltage + samples->all, *second = product + samples->all, range[2];
        recordings_range(samples->recordings, samples->count, COLUMN_DRIVE, range);
        differ(samples, voltage, p->main, second);
        for (size_t k = 0; k < samples->all; k++) { /* about the middle, so that C belongs to it */
            product[k] = (voltage[k] - 0.5 * (range[0] + range[1])) * p->main[k];
        }
    }
    for (size_t u = 0; u < p->unknowns; u++) {
        silence(samples, column, p->column + u * samples->all);
    }
}

/* Takes out of y what the prediction explains. Returns the factor of the main predictor; 0, and y as it was, if there
 * is none. */
static double take_out(const samples_t *samples, const prediction_t *p, double *y, double *factor) {
    failure_t ignored;
    const bool good = fit_columns(p->column, y, samples->all, p->unknowns, NULL, factor, &ignored);
    for (size_t u = 0; u < p->unknowns; u++) {
        factor[u] = good ? factor[u] : 0.0;
        cblas_daxpy((int)samples->all, -factor[u], p->column + u * samples->all, 1, y, 1);
    }
    return factor[p->unknowns - 1];
}

/* What was measured, 0 in samples that do not speak. */
static double *measured_in(const samples_t *samples, column_t column) {
    double *y = samples_column(samples);
    for (size_t i = 0; i < samples->count; i++) {
        const recording_t *recording = &samples->recordings[i];
        if (recording->column[column] != NULL) {
            memcpy(y + samples->begin[i], recording->column[column], recording->samples * sizeof(double));
        }
    }
    silence(samples, column, y);
    return y;
}

/* Moves the samples that speak to the front. Returns how many. */
static size_t pick(const samples_t *samples, column_t column, double *x) {
    size_t rows = 0;
    for (size_t i = 0; i < samples->count; i++) {
        for (size_t k = samples->begin[i]; k < samples->begin[i + 1]; k++) {
            if (samples->part[k] != SAMPLE_LEFT_OUT && samples->recordings[i].column[column] != NULL) {
                x[rows++] = x[k];
            }
        }
    }
    return rows;
}

/* Returns what is left of the column's square; HUGE_VAL, and no change, where the chains do not differ in it. */
static double change_at(const samples_t *samples, column_t column, const model_t *without, const model_t *with,
                        side_t delay, electrical_change_t *change) {
    prediction_t one, other;
    double left = HUGE_VAL;
    predict(samples, column, without, delay, &one);
    predict(samples, column, with, delay, &other);
    double *x = other.main, *y = measured_in(samples, column), *factor = allocate(one.unknowns, sizeof(double));
    const double whole = cblas_dnrm2((int)samples->all, x, 1);
    cblas_daxpy((int)samples->all, -1.0, one.main, 1, x, 1);
    if (cblas_dnrm2((int)samples->all, x, 1) > no_change * whole) {
        /* x and y less what the rest explains of both (Frisch, Waugh and Lovell) */
        const double of_x = take_out(samples, &one, x, factor), of_y = take_out(samples, &one, y, factor);
        pick(samples, column, x);
        const size_t rows = pick(samples, column, y);
        const regression_t found = regression_of(x, y, rows);
        const double scale = of_y - found.amplitude * of_x;
        if (isfinite(found.sigma) && scale != 0.0) {
            *change = (electrical_change_t){true, found.amplitude / scale, found.sigma / fabs(scale)};
            left = cblas_ddot((int)rows, y, 1, y, 1) - found.amplitude * found.amplitude * found.square;
        }
    }
    free(factor);
    free(y);
    free(one.column);
    free(other.column);
    return left;
}

electrical_change_t electrical_change(const samples_t *samples, column_t column, const model_t *without,
                                      const model_t *with) {
    electrical_change_t change = {0}, other = {0};
    if (column_measured(samples, column)) {
        const double left = change_at(samples, column, without, with, DELAY_BEFORE, &change);
        if (has_delay(without) && change_at(samples, column, without, with, DELAY_BEHIND, &other) < left) {
            change = other;
        }
    }
    return change;
}

static double sigma_of(const electrical_change_t *change) {
    return fmax(change->sigma, electrical_least_sigma);
}

change_verdict_t electrical_verdict(const electrical_change_t *change) {
    const double margin = threshold.deviations * sigma_of(change);
    return !change->measured                                    ? CHANGE_NOT_SEEN
           : change->part - margin > threshold.present_too_much ? CHANGE_TOO_LARGE
           : change->part - margin > threshold.present          ? CHANGE_PRESENT
           : change->part + margin < threshold.present          ? CHANGE_ABSENT
                                                                : CHANGE_UNDECIDED;
}

/* Squares of (part - 0) less (part - 1), in standard errors. */
static double likelihood_of(const electrical_change_t *change) {
    const change_verdict_t verdict = electrical_verdict(change);
    return verdict == CHANGE_NOT_SEEN || verdict == CHANGE_TOO_LARGE
               ? 0.0
               : (2.0 * change->part - 1.0) / gsl_pow_2(sigma_of(change));
}

double electrical_preference(const samples_t *samples, const model_t *without, const model_t *with) {
    const electrical_change_t voltage = electrical_change(samples, COLUMN_VOLTAGE, without, with),
                              current = electrical_change(samples, COLUMN_CURRENT, without, with);
    return likelihood_of(&voltage) + likelihood_of(&current);
}

double electrical_likelihood(const samples_t *samples, const model_t *without, const model_t *with,
                             const block_t *block) {
    if (block->place != PLACE_ELECTRONICS) {
        return 0.0;
    }
    const double likelihood = electrical_preference(samples, without, with);
    return block->lag == LAG_DELAY ? fmax(0.0, likelihood) : likelihood;
}

/* The factors of the equation; what they leave, a column. */
static double *explain(const samples_t *samples, column_t column, const model_t *model, side_t delay, double *factor) {
    prediction_t p;
    predict(samples, column, model, delay, &p);
    double *rest = measured_in(samples, column);
    take_out(samples, &p, rest, factor);
    free(p.column);
    return rest;
}

/* The same: the square of what they leave. */
static double left_at(const samples_t *samples, column_t column, const model_t *model, side_t delay, double *factor) {
    double *rest = explain(samples, column, model, delay, factor);
    const double left = cblas_ddot((int)samples->all, rest, 1, rest, 1);
    free(rest);
    return left;
}

static double *room_for_factors(const samples_t *samples) {
    return allocate(samples->count + MOST_PREDICTORS, sizeof(double));
}

double electrical_left(const samples_t *samples, column_t column, const model_t *model) {
    double *factor = room_for_factors(samples);
    double left = left_at(samples, column, model, DELAY_BEFORE, factor);
    if (has_delay(model)) {
        left = fmin(left, left_at(samples, column, model, DELAY_BEHIND, factor));
    }
    free(factor);
    return left;
}

void electrical_measured_voltage(const samples_t *samples, const model_t *model, double *voltage) {
    double *factor = room_for_factors(samples), *other = room_for_factors(samples);
    const double before = left_at(samples, COLUMN_VOLTAGE, model, DELAY_BEFORE, factor);
    const bool behind = has_delay(model) && left_at(samples, COLUMN_VOLTAGE, model, DELAY_BEHIND, other) < before;
    const double *used = behind ? other : factor, gain = used[samples->count];
    simulate_voltage(samples, model, DELAY_BEFORE, voltage);
    for (size_t i = 0; i < samples->count; i++) {
        const recording_t *recording = &samples->recordings[i];
        const bool measured = recording->column[COLUMN_VOLTAGE] != NULL && gain != 0.0;
        double *v = voltage + samples->begin[i];
        for (size_t k = 0; measured && k < recording->samples; k++) {
            v[k] = (recording->column[COLUMN_VOLTAGE][k] - used[i]) / gain;
        }
        for (size_t b = 0; behind && measured && b < model->blocks; b++) {
            if (model->block[b].block->lag == LAG_DELAY) {
                chain_pass(model, b, recording, v);
            }
        }
    }
    free(factor);
    free(other);
}

void electrical_unexplained_current(const samples_t *samples, const model_t *model, double *current) {
    double *factor = room_for_factors(samples);
    double *rest = explain(samples, COLUMN_CURRENT, model, DELAY_BEFORE, factor);
    memcpy(current, rest, samples->all * sizeof(double));
    free(factor);
    free(rest);
}

bool electrical_only_part(const electrical_change_t *change) {
    return change->part + threshold.deviations * change->sigma < threshold.nearly_all;
}
