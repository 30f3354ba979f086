/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "bouc_wen.h"
#include <math.h>

/* Part of the way in which the curve bends. For n = 1 and any steps this leaves 1e-6 of the largest h
 * (tests/host/test_bouc_wen.c). */
static const double longest_step = 0.05;

void bouc_wen_open(bouc_wen_t *model, double beta, double gamma, double exponent) {
    *model = (bouc_wen_t){
        .beta = beta, .gamma = gamma, .exponent = exponent, .bend = exponent * pow(2.0 * beta, 1.0 / exponent)};
}

/* dh/du while the drive goes in this direction. */
static double slope(const bouc_wen_t *model, double direction, double h) {
    const double size = model->exponent == 1.0 ? fabs(h) : pow(fabs(h), model->exponent);
    return 1.0 - (model->gamma + (direction * h > 0.0 ? model->beta : -model->beta)) * size;
}

static double runge_kutta(const bouc_wen_t *model, double direction, double h, double d) {
    const double s1 = slope(model, direction, h), s2 = slope(model, direction, h + 0.5 * d * s1);
    const double s3 = slope(model, direction, h + 0.5 * d * s2), s4 = slope(model, direction, h + d * s3);
    return h + d / 6.0 * (s1 + 2.0 * (s2 + s3) + s4);
}

/* The slope has a kink at h = 0: a step across it stops there. Newton from where the secant says, the slope being 1. */
static double advance(const bouc_wen_t *model, double direction, double h, double d) {
    const double after = runge_kutta(model, direction, h, d);
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
