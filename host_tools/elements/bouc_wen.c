/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/bouc_wen.h"
#include <math.h>
#include <stdbool.h>

/* Part of the way in which the curve bends. For n = 1 and any steps this leaves 1e-6 of the largest h
 * (tests/host/test_bouc_wen.c). */
static const double longest_step = 0.05;

/* |h| beyond which there is no table; and the part of the limit of h that it goes further, h being rounded. */
static const double longest_table = 4.0, beyond_limit = 0.01;

/* Cubics that have the power's value and slope at both ends of each cell. */
static void make_table(bouc_wen_t *model) {
    const double n = model->exponent,
                 limit = pow(model->beta + model->gamma, -1.0 / n); /* infinite for gamma = -beta */
    const double cell = fmin(longest_table, (1.0 + beyond_limit) * limit) / BOUC_WEN_CELLS;
    double value = 0.0, slope = n == 1.0 ? cell : 0.0;
    model->cells_per_h = 1.0 / cell;
    for (int i = 0; i < BOUC_WEN_CELLS; i++) {
        const double end_value = pow((i + 1) * cell, n), end_slope = n * end_value / (i + 1);
        const double rise = end_value - value;
        model->power[i][0] = value;
        model->power[i][1] = slope;
        model->power[i][2] = 3.0 * rise - 2.0 * slope - end_slope;
        model->power[i][3] = slope + end_slope - 2.0 * rise;
        value = end_value;
        slope = end_slope;
    }
}

void bouc_wen_open(bouc_wen_t *model, double beta, double gamma, double exponent) {
    *model = (bouc_wen_t){
        .beta = beta, .gamma = gamma, .exponent = exponent, .bend = exponent * pow(2.0 * beta, 1.0 / exponent)};
    make_table(model);
}

/* Where the power begins it has no cubic, for exponents near 1. */
static bool in_table(double place) {
    return place >= 1.0 && place < BOUC_WEN_CELLS;
}

static double power_of(const bouc_wen_t *model, double size) {
    const double place = size * model->cells_per_h;
    if (!in_table(place)) {
        return pow(size, model->exponent);
    }
    const int i = (int)place;
    const double x = place - i, *c = model->power[i];
    return c[0] + x * (c[1] + x * (c[2] + x * c[3]));
}

/* gamma + beta sgn(u' h) */
static double pull(const bouc_wen_t *model, double direction, double h) {
    return model->gamma + (direction * h > 0.0 ? model->beta : -model->beta);
}

/* dh/du while the drive goes in this direction. */
static double slope_of(const bouc_wen_t *model, double direction, double h) {
    return 1.0 - pull(model, direction, h) * power_of(model, fabs(h));
}

static double runge_kutta(const bouc_wen_t *model, double direction, double h, double d) {
    const double s1 = slope_of(model, direction, h), s2 = slope_of(model, direction, h + 0.5 * d * s1);
    const double s3 = slope_of(model, direction, h + 0.5 * d * s2), s4 = slope_of(model, direction, h + d * s3);
    return h + d / 6.0 * (s1 + 2.0 * (s2 + s3) + s4);
}

/* Taylor's series of the same order, from one place in the table. With q = |h| in cells, w the way in cells away from
 * 0, and dq/dw = f = 1 - pull q^n:
 *
 *     q + w f (1 + f1 / 2 + (f2 + f1^2) / 6 + (f3 + 4 f2 f1 + f1^3) / 24),   f1 = f' w, f2 = f'' f w^2, f3 = f''' f^2
 * w^3
 *
 * Over several cells, or half of the way to 0, that is not the power any more; Runge and Kutta look where they go. */
static double one_step(const bouc_wen_t *model, double direction, double h, double d) {
    static const double furthest = 4.0; /* cells */
    const double q = fabs(h) * model->cells_per_h, w = copysign(d * model->cells_per_h, direction * h);
    if (!in_table(q)) {
        return runge_kutta(model, direction, h, d);
    }
    const int i = (int)q;
    const double x = q - i, *c = model->power[i], part = -pull(model, direction, h) * w;
    const double f = 1.0 - pull(model, direction, h) * (c[0] + x * (c[1] + x * (c[2] + x * c[3])));
    if (!(fabs(w * f) <= fmin(furthest, 0.5 * q))) {
        return runge_kutta(model, direction, h, d);
    }
    const double f1 = part * (c[1] + x * (2.0 * c[2] + x * 3.0 * c[3]));
    const double f2 = part * w * f * (2.0 * c[2] + x * 6.0 * c[3]), f3 = part * w * w * f * f * 6.0 * c[3];
    return h + d * f * (1.0 + f1 / 2.0 + (f2 + f1 * f1) / 6.0 + (f3 + (4.0 * f2 + f1 * f1) * f1) / 24.0);
}

/* The slope has a kink at h = 0: a step across it stops there. Newton from where the secant says, the slope being 1. */
static double advance(const bouc_wen_t *model, double direction, double h, double d) {
    const double after = one_step(model, direction, h, d);
    if (h * after >= 0.0) {
        return after;
    }
    double to_zero = d * h / (h - after);
    to_zero -= runge_kutta(model, direction, h, to_zero);
    return runge_kutta(model, direction, 0.0, d - to_zero);
}

double bouc_wen_step(bouc_wen_t *model, double u) {
    const double way = u - model->input, direction = way < 0.0 ? -1.0 : 1.0;
    if (way == 0.0) {
        return model->h;
    }
    const int steps = 1 + (int)fmin(fabs(way) * model->bend / longest_step, 1e4);
    for (int i = 0; i < steps; i++) {
        model->h = advance(model, direction, model->h, way / steps);
    }
    model->input = u;
    return model->h;
}

double bouc_wen_settle(bouc_wen_t *model, double u) {
    model->h = 0.0;
    model->input = 0.0;
    return bouc_wen_step(model, u);
}
