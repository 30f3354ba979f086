/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/phaser.h"
#include <gsl/gsl_math.h>

phaser_row_t phaser_row(double frequency_hz, const ellipse_t *ellipse, double drive_range_v,
                        double displacement_range_um) {
    const ellipse_sines_t sines = ellipse_sines(ellipse);
    return (phaser_row_t){
        {[PHASER_LOG_FREQUENCY] = log(frequency_hz),
         [PHASER_LOG_GAIN] = log(sines.y_radius * displacement_range_um / (sines.x_radius * drive_range_v)),
         [PHASER_LAG] = sines.lag,
         [PHASER_X_CENTER] = drive_range_v * ellipse->x_center,
         [PHASER_Y_CENTER] = displacement_range_um * ellipse->y_center}};
}

/* Slope at point i: the parabola's through its neighbours, limited so that nothing overshoots. */
static double steffen_slope(const double x[4], const double y[4], int i) {
    const double left = (y[i] - y[i - 1]) / (x[i] - x[i - 1]), right = (y[i + 1] - y[i]) / (x[i + 1] - x[i]);
    const double parabola = (left * (x[i + 1] - x[i]) + right * (x[i] - x[i - 1])) / (x[i + 1] - x[i - 1]);
    const double limit = fmin(fabs(left), fabs(right));
    return left * right <= 0.0 ? 0.0 : copysign(fmin(2.0 * limit, fabs(parabola)), left);
}

/* One column at `at`, between rows `below` and below + 1. */
static double between(const phaser_row_t *row, size_t rows, size_t below, size_t column, double at) {
    double x[4], y[4], slope[2];
    for (size_t i = 0; i < 4; i++) { /* rows below - 1 .. below + 2, the ends repeated */
        const size_t index = below + i < 1 ? 0 : below + i - 1 < rows ? below + i - 1 : rows - 1;
        x[i] = row[index].column[PHASER_LOG_FREQUENCY];
        y[i] = row[index].column[column];
    }
    const double width = x[2] - x[1], chord = (y[2] - y[1]) / width, t = (at - x[1]) / width;
    slope[0] = below > 0 ? steffen_slope(x, y, 1) : chord;
    slope[1] = below + 2 < rows ? steffen_slope(x, y, 2) : chord;
    return y[1] +
           width * t *
               (slope[0] + t * (3.0 * chord - 2.0 * slope[0] - slope[1] + t * (slope[0] + slope[1] - 2.0 * chord)));
}

phaser_t phaser_at(const phaser_row_t *row, size_t rows, double frequency_hz) {
    const double low = row[0].column[PHASER_LOG_FREQUENCY], high = row[rows - 1].column[PHASER_LOG_FREQUENCY];
    const double at = fmin(high, fmax(low, log(frequency_hz)));
    double value[PHASER_COLUMNS];
    size_t below = 0;
    while (below + 2 < rows && row[below + 1].column[PHASER_LOG_FREQUENCY] <= at) {
        below++;
    }
    for (size_t column = 0; column < PHASER_COLUMNS; column++) {
        value[column] = rows == 1 ? row[0].column[column] : between(row, rows, below, column, at);
    }
    return (phaser_t){.frequency_hz = exp(at),
                      .gain = exp(value[PHASER_LOG_GAIN]),
                      .lag_s = value[PHASER_LAG] / (2.0 * M_PI * exp(at)),
                      .x_center_v = value[PHASER_X_CENTER],
                      .y_center_um = value[PHASER_Y_CENTER]};
}
