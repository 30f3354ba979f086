/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/path/jump.h"
#include "thresholds/thresholds.h"
#include <math.h>

static jump_t jumps_by(const problem_t *p, const double *series, size_t row, double expected) {
    static const size_t reaches[] = {6, 12, 25, 50, 100, 200};
    for (size_t i = 0; i < sizeof reaches / sizeof reaches[0]; i++) {
        const size_t reach = reaches[i], count = 2 * reach;
        double columns[4][400], *const step = columns[2], *const bend = columns[3];
        const double *const column[] = {columns[0], columns[1], step, bend};
        look_regression_t fit;
        if (row < reach || row + reach > p->n) {
            return CANNOT_SAY;
        }
        for (size_t k = 0; k < count; k++) {
            const double x = (double)k - (double)reach + 0.5;
            if (p->prediction->quiet[p->first + row + k - reach] == 0) {
                return CANNOT_SAY;
            }
            columns[0][k] = 1.0;
            columns[1][k] = x;
            step[k] = k >= reach ? 1.0 : 0.0;
            bend[k] = k >= reach ? x : 0.0;
        }
        look_regress(column, 4, series + row - reach, NULL, count, &fit);
        const double sigma = fmax(fit.sigma[2], 1e-12 * fabs(expected));
        if (fabs(expected) >= threshold.jump_shows * sigma) {
            return fabs(fit.coefficient[2] - expected) <
                           threshold.edge_of_noise * sigma + threshold.jump_agrees * fabs(expected)
                       ? JUMPS
                       : DOES_NOT_JUMP;
        }
    }
    return CANNOT_SAY;
}

jump_t jumps_around(const problem_t *p, const double *series, size_t row, size_t within, double expected) {
    enum { PLACES = 8 };
    jump_t jump = jumps_by(p, series, row, expected);
    for (size_t i = 0; i <= PLACES && within > 0 && jump == DOES_NOT_JUMP; i++) {
        const size_t place = row + 2 * within * i / PLACES;
        jump = place >= within && jumps_by(p, series, place - within, expected) == JUMPS ? JUMPS : jump;
    }
    return jump;
}
