/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "strength.h"
#include <math.h>

static void add_row(refit_t *refit, const double *row, double change) {
    refit->samples += 1.0;
    refit->square += change * change;
    for (size_t i = 0; i < refit->numbers; i++) {
        refit->with_change[i] += row[i] * change;
        for (size_t j = 0; j <= i; j++) {
            refit->products[i][j] += row[i] * row[j];
        }
    }
}

/* The first reading is taken off: sums of squares then lose no digits. */
void refit_add_gain(refit_t *refit, size_t samples, const double *without, const double *change) {
    refit->numbers = 2;
    for (size_t k = 0; k < samples; k++) {
        const double row[] = {1.0, without[k] - without[0]};
        add_row(refit, row, change[k]);
    }
}

void refit_add_bank(refit_t *refit, const excitation_t *excitation, bool from_above, const double *without,
                    const double *change) {
    const double half_v = 0.5 * (excitation->high_v - excitation->low_v);
    const double middle_v = 0.5 * (excitation->high_v + excitation->low_v);
    double row[REFIT_MOST_NUMBERS] = {1.0};
    refit->numbers = REFIT_MOST_NUMBERS;
    for (size_t i = 0; i < REFIT_PLAYS; i++) {
        const double end = 1.0 - ((double)i + 0.5) / REFIT_PLAYS;
        row[2 + i] = from_above ? end : -end;
    }
    for (size_t k = 0; k < excitation->samples; k++) {
        const double drive = (excitation->drive_v[k * OVERSAMPLING] - middle_v) / half_v;
        row[1] = without[k] - without[0];
        for (size_t i = 0; i < REFIT_PLAYS; i++) {
            const double width = ((double)i + 0.5) / REFIT_PLAYS;
            row[2 + i] = fmax(drive - width, fmin(drive + width, row[2 + i]));
        }
        add_row(refit, row, change[k]);
    }
}

/* Cholesky, of the correlations; a column that the ones before it explain to 1e-9 is left out. What the j-th column
 * explains of the change is the square of the j-th number of the forward solution. */
double refit_left(const refit_t *refit) {
    double factor[REFIT_MOST_NUMBERS][REFIT_MOST_NUMBERS] = {{0.0}}, explained[REFIT_MOST_NUMBERS] = {0.0};
    double left = refit->square;
    for (size_t i = 0; i < refit->numbers; i++) {
        double diagonal = refit->products[i][i], with_change = refit->with_change[i];
        for (size_t j = 0; j < i; j++) {
            double sum = refit->products[i][j];
            for (size_t m = 0; m < j; m++) {
                sum -= factor[i][m] * factor[j][m];
            }
            factor[i][j] = factor[j][j] > 0.0 ? sum / factor[j][j] : 0.0;
            diagonal -= factor[i][j] * factor[i][j];
            with_change -= factor[i][j] * explained[j];
        }
        if (diagonal > 1e-9 * refit->products[i][i]) {
            factor[i][i] = sqrt(diagonal);
            explained[i] = with_change / factor[i][i];
            left -= explained[i] * explained[i];
        }
    }
    return sqrt(fmax(0.0, left) / refit->samples);
}
