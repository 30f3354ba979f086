/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "smooth_drive.h"
#include <math.h>
#include <string.h>

/* Likeness of two second differences at which the cubic begins to count, and at which it is all. It is 0.47 if one is a
 * quarter of the other, 0.8 if it is half, as at the end of a rounded step. */
static const double begins = 0.2, all = 0.7;
/* How far second differences may be from a line, in parts of their size, for the cubic to count, and to be all. Corners
 * and short ramps have 1 and more, the end of a step that is rounded over eight samples has 0.4, its middle 0.07. */
static const double too_bent = 0.3, straight = 0.15;

static double second_difference(const double *x) {
    return x[-1] - 2.0 * x[0] + x[1];
}

/* From 0 below one value to 1 above the other one. */
static double rise(double value, double from, double to) {
    const double part = (value - from) / (to - from);
    return part <= 0.0 ? 0.0 : part >= 1.0 ? 1.0 : part * part * (3.0 - 2.0 * part);
}

/* 0 to 1. */
static double alike(double one, double other) {
    return one * other > 0.0 ? rise(2.0 * one * other / (one * one + other * other), begins, all) : 0.0;
}

/* Second differences that go through 0 are not alike, but change steadily. */
static double steady(double a, double b, double c, double d) {
    const double size = fabs(a) + fabs(b) + fabs(c) + fabs(d), bent = fabs(a - 2.0 * b + c) + fabs(b - 2.0 * c + d);
    return bent < too_bent * size ? rise(-bent / size, -too_bent, -straight) : 0.0;
}

double smooth_drive(const double x[6], size_t known_ahead) {
    if (known_ahead == 0) {
        return 0.0;
    }
    const double newer = second_difference(x + 2), older = second_difference(x + 3);
    const double oldest = second_difference(x + 4), newest = known_ahead > 1 ? second_difference(x + 1) : 0.0;
    const double behind = alike(older, oldest), before = known_ahead > 1 ? alike(newer, newest) : 0.0;
    const double bend = alike(newer, older) * (behind > before ? behind : before);
    const double inflection = known_ahead > 1 && bend < 1.0 ? steady(newest, newer, older, oldest) : 0.0;
    return bend > inflection ? bend : inflection;
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
