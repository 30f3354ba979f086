/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "smooth_drive.h"
#include <string.h>

/* Likeness of two second differences at which the cubic begins to count, and at which it is all. It is 0.47 if one is a
 * quarter of the other, 0.8 if it is half, as at the end of a rounded step. */
static const double begins = 0.2, all = 0.7;

static double second_difference(const double *x) {
    return x[-1] - 2.0 * x[0] + x[1];
}

/* 0 to 1. */
static double alike(double one, double other) {
    const double squares = one * one + other * other;
    const double likeness = squares > 0.0 ? 2.0 * one * other / squares : 0.0,
                 part = (likeness - begins) / (all - begins);
    return part <= 0.0 ? 0.0 : part >= 1.0 ? 1.0 : part * part * (3.0 - 2.0 * part);
}

double smooth_drive(const double x[6], size_t known_ahead) {
    if (known_ahead == 0) {
        return 0.0;
    }
    const double newer = second_difference(x + 2), older = second_difference(x + 3);
    if (newer * older <= 0.0) {
        return 0.0;
    }
    const double behind = alike(older, second_difference(x + 4));
    const double before = known_ahead > 1 ? alike(newer, second_difference(x + 1)) : 0.0;
    return alike(newer, older) * (behind > before ? behind : before);
}

void drive_window_settle(drive_window_t *window, double value) {
    for (int i = 0; i < 6; i++) {
        window->x[i] = value;
    }
    window->smooth = 0.0;
}

void drive_window_next(drive_window_t *window, const signal_t *signal) {
    double *x = window->x;
    memmove(x + 3, x + 2, 3 * sizeof *x);
    x[2] = signal->value;
    x[1] = signal->ahead[0];
    x[0] = signal->ahead[1];
    window->smooth = smooth_drive(x, signal->known_ahead);
}
