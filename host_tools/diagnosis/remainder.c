/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "remainder.h"
#include "evidence_columns.h"
#include "least_squares.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>

enum { RATES = 11, AVERAGES = 8, WARMTHS = 3, WAVES = 12, COLUMNS = RATES + AVERAGES + WARMTHS + WAVES };
/* Chance gives as much as there are columns, 34 +- 8; noise whose colour the filter does not quite meet gives more. */
static const double least_likelihood = 150.0;
static const double outlier = 7.0;
static const size_t few_outliers = 3;
/* Columns have root mean square 1 before J is taken out of them, and amplitudes of half the noise are expected: what J
 * leaves next to nothing of does not count. */
static const double expected_size = 4.0;

/* The columns' values at one sample: u in parts of half the range, v and a scaled to a root mean square of about 1. */
static void rates(double u, double v, double a, double *column) {
    const double values[RATES] = {v, fabs(v), v * v, v * fabs(v), v * v * v, GSL_SIGN(v),
                                  a, fabs(a), u * v, u * fabs(v), u * u * v};
    for (size_t i = 0; i < RATES; i++) {
        column[i] = values[i];
    }
}

/* Fills the columns of one recording, `stride` apart, all samples. */
static void fill(const recording_t *recording, double **column) {
    const double *drive = recording->column[COLUMN_DRIVE];
    const size_t n = recording->samples;
    double low = HUGE_VAL, high = -HUGE_VAL, speed = 0.0, jerk = 0.0, average[AVERAGES], warmth[WARMTHS] = {0};
    for (size_t k = 0; k < n; k++) {
        low = fmin(low, drive[k]);
        high = fmax(high, drive[k]);
        if (k > 1) {
            const double v = drive[k] - drive[k - 1], a = v - drive[k - 1] + drive[k - 2];
            speed += v * v / (double)n;
            jerk += a * a / (double)n;
        }
    }
    for (size_t i = 0; i < AVERAGES; i++) {
        average[i] = drive[0];
    }
    for (size_t k = 0; k < n; k++) {
        const double v = k > 0 ? (drive[k] - drive[k - 1]) / sqrt(speed) : 0.0;
        const double a = k > 1 ? (drive[k] - 2.0 * drive[k - 1] + drive[k - 2]) / sqrt(jerk) : 0.0;
        double values[COLUMNS];
        rates((2.0 * drive[k] - low - high) / (high - low), v, a, values);
        for (size_t i = 0; i < AVERAGES; i++) { /* time constants from 2 samples to a third of the recording */
            const double samples = 2.0 * pow((double)n / 6.0, (double)i / (AVERAGES - 1));
            average[i] += (drive[k] - average[i]) / samples;
            values[RATES + i] = (average[i] - low) / (high - low);
        }
        for (size_t i = 0; i < WARMTHS; i++) {
            const double samples = (double)n / (3.0 * gsl_pow_int(6.0, (int)i));
            warmth[i] += (v * v - warmth[i]) / samples;
            values[RATES + AVERAGES + i] = warmth[i];
        }
        for (size_t i = 0; i < WAVES; i++) {
            values[RATES + AVERAGES + WARMTHS + i] = cos(M_PI * (double)(i + 1) * ((double)k + 0.5) / (double)n);
        }
        for (size_t i = 0; i < COLUMNS; i++) {
            column[i][k] = values[i];
        }
    }
}

/* Rows of the whitened columns beyond J, column after column. */
static double *columns_of(const evidence_t *evidence, size_t rows) {
    double *all = allocate(COLUMNS * rows, sizeof(double));
    double **whole[COLUMNS];
    for (size_t c = 0; c < COLUMNS; c++) {
        whole[c] = recordings_room(evidence_recordings(evidence), evidence_count(evidence));
    }
    for (size_t i = 0; i < evidence_count(evidence); i++) {
        double *column[COLUMNS];
        for (size_t c = 0; c < COLUMNS; c++) {
            column[c] = whole[c][i];
        }
        fill(&evidence_recordings(evidence)[i], column);
    }
    for (size_t c = 0; c < COLUMNS; c++) {
        evidence_beyond(evidence, whole[c], true, all + c * rows);
        recordings_room_free(whole[c], evidence_count(evidence));
    }
    return all;
}

/* What the columns together explain of the residual's square. */
static double explained_by(const double *columns, const double *residual, size_t rows) {
    double row[COLUMNS] = {0}, x[COLUMNS], lower[COLUMNS], before, after;
    normal_equations_t equations;
    failure_t ignored;
    normal_equations_create(&equations, COLUMNS);
    for (size_t k = 0; k < rows; k++) {
        for (size_t c = 0; c < COLUMNS; c++) {
            row[c] = columns[c * rows + k];
        }
        normal_equations_add(&equations, row, residual[k]);
    }
    normal_equations_finish(&equations);
    before = equations.power;
    for (size_t c = 0; c < COLUMNS; c++) {
        row[c] = 0.0;
        lower[c] = -HUGE_VAL;
    }
    for (size_t c = 0; c < COLUMNS; c++) {
        row[c] = 1.0;
        normal_equations_penalise(&equations, row, expected_size);
        row[c] = 0.0;
    }
    after = solve_bounded(&equations, lower, x, NULL, &ignored) ? squared_error(&equations, x) : before;
    normal_equations_free(&equations);
    return before - after;
}

remainder_t evidence_remainder(const evidence_t *evidence) {
    size_t rows;
    const double *residual = evidence_residual(evidence, &rows);
    const double noise = evidence_noise_um(evidence);
    double *columns = columns_of(evidence, rows);
    remainder_t found = {.likelihood = explained_by(columns, residual, rows) / (noise * noise)};
    for (size_t k = 0; k < rows; k++) {
        found.outliers += fabs(residual[k]) > outlier * noise ? 1 : 0;
    }
    found.structured = found.likelihood > least_likelihood || found.outliers > few_outliers;
    free(columns);
    return found;
}
