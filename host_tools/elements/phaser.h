/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The phaser of paper 003: gain and time lag as functions of frequency, from a family of ellipses.
 *
 *     y(t) = y_center + gain (u(t - lag) - x_center)
 *
 * Gain (its logarithm), phase and centre follow a monotone cubic over log f (Steffen 1990: no overshoot); outside of
 * the table the nearest frequency's gain and time lag hold.
 */
#ifndef PHASER_H
#define PHASER_H

#include "numerics/ellipse_fit.h"

/** The columns that one ellipse gives. */
enum {
    PHASER_LOG_FREQUENCY,
    PHASER_LOG_GAIN, /**< of um/V */
    PHASER_LAG,      /**< rad */
    PHASER_X_CENTER, /**< V */
    PHASER_Y_CENTER, /**< um */
    PHASER_COLUMNS
};

typedef struct {
    double column[PHASER_COLUMNS];
} phaser_row_t;

/** The row of an ellipse whose plane is drive / drive_range_v and displacement / displacement_range_um. */
phaser_row_t phaser_row(double frequency_hz, const ellipse_t *ellipse, double drive_range_v,
                        double displacement_range_um);

/** The phaser at one frequency. */
typedef struct {
    double frequency_hz; /**< limited to the range of the table */
    double gain;         /**< um/V */
    double lag_s, x_center_v, y_center_um;
} phaser_t;

/** rows >= 1, in rising order of frequency. */
phaser_t phaser_at(const phaser_row_t *row, size_t rows, double frequency_hz);

#endif
