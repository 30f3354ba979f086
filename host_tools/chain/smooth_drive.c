/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "chain/smooth_drive.h"
#include <math.h>

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

/* bend: second differences, the newest first; like: how alike each is to the next. */
static double smoothness(const double bend[4], const double like[3], size_t known_ahead) {
    const double smooth = like[1] * (like[2] > like[0] ? like[2] : like[0]);
    const double inflection = known_ahead > 1 && smooth < 1.0 ? steady(bend[0], bend[1], bend[2], bend[3]) : 0.0;
    return smooth > inflection ? smooth : inflection;
}

/* The first one takes two samples ahead. */
static void take_bends(const double x[6], size_t known_ahead, double bend[4], double like[3]) {
    for (size_t i = 1; i < 4; i++) {
        bend[i] = second_difference(x + 1 + i);
    }
    bend[0] = known_ahead > 1 ? second_difference(x + 1) : 0.0;
    for (size_t i = 0; i < 3; i++) {
        like[i] = alike(bend[i], bend[i + 1]);
    }
}

double smooth_drive(const double x[6], size_t known_ahead) {
    double bend[4], like[3];
    if (known_ahead == 0) {
        return 0.0;
    }
    take_bends(x, known_ahead, bend, like);
    return smoothness(bend, like, known_ahead);
}

void smooth_drive_weights(double fraction, double weight[4]) {
    for (int i = 0; i < 4; i++) {
        weight[i] = 1.0;
        for (int j = 0; j < 4; j++) {
            weight[i] *= j == i ? 1.0 : (fraction + 1.0 - j) / (double)(i - j);
        }
    }
}

double smooth_drive_value(const double x[6], size_t known_ahead, double fraction, const double weight[4]) {
    const double line = x[2] + fraction * (x[3] - x[2]);
    const double cubic = weight[0] * x[1] + weight[1] * x[2] + weight[2] * x[3] + weight[3] * x[4];
    return line + smooth_drive(x, known_ahead) * (cubic - line);
}

double held_later(double held_since, double delay, double *whole) {
    *whole = fmax(0.0, ceil(delay - held_since));
    return held_since - delay + *whole;
}

void drive_window_settle(drive_window_t *window, double value) {
    for (int i = 0; i < 6; i++) {
        window->x[i] = value;
    }
    window->known_ahead = 0;
    window->smooth = 0.0;
}

/* All but the newest were there a sample ago. */
static void next_bend(drive_window_t *window) {
    double *bend = window->bend, *like = window->like;
    bend[3] = bend[2];
    bend[2] = bend[1];
    bend[1] = bend[0];
    bend[0] = second_difference(window->x + 1);
    like[2] = like[1];
    like[1] = like[0];
    like[0] = alike(bend[0], bend[1]);
}

void drive_window_shift(drive_window_t *window, const signal_t *signal) {
    double *x = window->x;
    x[5] = x[4];
    x[4] = x[3];
    x[3] = x[2];
    x[2] = signal->value;
    x[1] = signal->ahead[0];
    x[0] = signal->ahead[1];
    window->known_ahead = signal->known_ahead;
}

void drive_window_next(drive_window_t *window, const signal_t *signal) {
    const bool foretold = window->known_ahead > 1 && signal->known_ahead > 1;
    drive_window_shift(window, signal);
    if (foretold) {
        next_bend(window);
    } else if (signal->known_ahead > 0) {
        take_bends(window->x, signal->known_ahead, window->bend, window->like);
    }
    window->smooth = signal->known_ahead > 0 ? smoothness(window->bend, window->like, signal->known_ahead) : 0.0;
}

bool drive_window_turns(const drive_window_t *window, double *turn) {
    const double *x = window->x;
    if ((x[3] - x[4]) * (x[1] - x[2]) >= 0.0) { /* how smooth it is costs more to find out */
        return false;
    }
    const double smooth = smooth_drive(x, window->known_ahead);
    if (smooth <= 0.0) {
        return false;
    }
    /* x[3] + a1 t + a2 t^2 + a3 t^3, t from 0 to 1. */
    const double a2 = smooth * (x[2] - 2.0 * x[3] + x[4]) / 2.0,
                 a3 = smooth * (x[1] - 3.0 * x[2] + 3.0 * x[3] - x[4]) / 6.0, a1 = x[2] - x[3] - a2 - a3;
    const double discriminant = a2 * a2 - 3.0 * a3 * a1;
    const double t = discriminant > 0.0 ? -a1 / (a2 + copysign(sqrt(discriminant), a2)) : 0.0;
    *turn = x[3] + t * (a1 + t * (a2 + t * a3));
    return t > 0.0 && t < 1.0 && (*turn > fmax(x[2], x[3]) || *turn < fmin(x[2], x[3]));
}
