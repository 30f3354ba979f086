/* SPDX-License-Identifier: MIT */
/**
 * Table 1 of G.-Y. Gu, L.-M. Zhu, "Modeling of rate-dependent hysteresis in piezoelectric actuators using a family of
 * ellipses", Sensors and Actuators A (2010), doi:10.1016/j.sna.2010.09.020, and loops rebuilt from it.
 *
 * An ellipse was fitted to each measured loop of a stack driven with 75 V + 15 V sin(2 pi f t), in the plane of drive /
 * 150 V and displacement / 90 um. Centre, radii and angle are printed to four decimals.
 */
#ifndef ELLIPSES_003_H
#define ELLIPSES_003_H

#define ELLIPSES_003 9

typedef struct {
    double frequency_hz, x_center, y_center, major, minor, angle;
} ellipse_003_t;

extern const ellipse_003_t ellipses_003[ELLIPSES_003];

/**
 * A point of the rebuilt loop, in V and um. theta runs evenly and forwards in time: the drive was a sine of constant
 * frequency, and the displacement lags.
 */
void ellipse_003_point(const ellipse_003_t *ellipse, double theta, double *drive_v, double *displacement_um);

#endif
