/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/pink.h"
#include "base/failure.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_math.h>
#include <math.h>
#include <string.h>

/* Sections a decade of frequency: the slope ripples by 3 %. */
static const double per_decade = 2.0;

/* Partial fractions of the product of all sections. */
static void take_shares(pink_t *pink) {
    for (size_t i = 0; i < pink->sections; i++) {
        double share = pink->pole[i] - pink->zero[i];
        for (size_t j = 0; j < pink->sections; j++) {
            share *= j != i ? (pink->pole[i] - pink->zero[j]) / (pink->pole[i] - pink->pole[j]) : 1.0;
        }
        pink->share[i] = share;
    }
}

void pink_create(pink_t *pink, double rho, size_t samples) {
    *pink = (pink_t){.rho = rho};
    const double step = pow(10.0, 1.0 / per_decade), slowest = 0.5 / (double)samples;
    double f = rho;
    while (f > slowest && pink->sections < PINK_SECTIONS) {
        pink->pole[pink->sections] = exp(-2.0 * M_PI * f);
        pink->zero[pink->sections++] = exp(-2.0 * M_PI * f / sqrt(step));
        f /= step;
    }
    take_shares(pink);
}

double *pink_memory(const pink_t *pink, size_t columns) {
    return pink->sections > 0 ? allocate(2 * pink->sections * columns, sizeof(double)) : NULL;
}

void pink_row(const pink_t *pink, double *memory, size_t columns, double *row, int first) {
    for (size_t i = 0; i < pink->sections; i++) {
        const double zero = pink->zero[i], pole = pink->pole[i], steady = (1.0 - zero) / (1.0 - pole);
        double *restrict in = memory + 2 * i * columns, *restrict out = in + columns;
        if (first != 0) {
            for (size_t j = 0; j < columns; j++) {
                in[j] = row[j];
                out[j] = row[j] *= steady;
            }
            continue;
        }
        for (size_t j = 0; j < columns; j++) {
            const double now = row[j];
            out[j] = row[j] = now - zero * in[j] + pole * out[j];
            in[j] = now;
        }
    }
}

/* What the memory holds of the rows before. */
static void begin_memory(const pink_t *pink, double *memory, size_t columns, const double *row) {
    for (size_t i = 0; i < pink->sections; i++) {
        for (size_t j = 0; j < columns; j++) {
            memory[i * columns + j] = row[j] / (1.0 - pink->pole[i]);
        }
    }
}

void pink_rows(const pink_t *pink, double *memory, size_t columns, const double *row, size_t rows, int first,
               const size_t *taken, size_t count, double *white) {
    double by_row[PINK_ROWS * PINK_ROWS], by_memory[PINK_ROWS * PINK_SECTIONS], fed[PINK_SECTIONS * PINK_ROWS],
        response[PINK_ROWS + 1] = {1.0}, power[PINK_SECTIONS][PINK_ROWS + 1];
    const size_t m = pink->sections;
    if (m == 0) {
        for (size_t t = 0; t < count; t++) {
            memcpy(white + t * columns, row + taken[t] * columns, columns * sizeof(double));
        }
        return;
    }
    if (first != 0) {
        begin_memory(pink, memory, columns, row);
    }
    for (size_t i = 0; i < m; i++) {
        power[i][0] = 1.0;
        for (size_t k = 1; k <= rows; k++) {
            response[k] += pink->share[i] * power[i][k - 1];
            power[i][k] = pink->pole[i] * power[i][k - 1];
        }
    }
    for (size_t t = 0; t < count; t++) {
        for (size_t k = 0; k < rows; k++) {
            by_row[t * rows + k] = k <= taken[t] ? response[taken[t] - k] : 0.0;
        }
        for (size_t i = 0; i < m; i++) {
            by_memory[t * m + i] = pink->share[i] * power[i][taken[t]];
        }
    }
    const int n = (int)columns, r = (int)rows, s = (int)m, c = (int)count;
    if (count > 0) {
        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, c, n, r, 1.0, by_row, r, row, n, 0.0, white, n);
        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, c, n, s, 1.0, by_memory, s, memory, n, 1.0, white, n);
    }
    for (size_t i = 0; i < m; i++) {
        for (size_t k = 0; k < rows; k++) {
            fed[i * rows + k] = power[i][rows - 1 - k];
        }
        cblas_dscal(n, power[i][rows], memory + i * columns, 1);
    }
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, s, n, r, 1.0, fed, r, row, n, 1.0, memory, n);
}
