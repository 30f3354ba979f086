/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "bouc_wen.h"
#include <math.h>

/* A step of this part of the way in which the curve bends leaves errors below 1e-6 of the largest h. */
static const double longest_step = 0.1;

void bouc_wen_open(bouc_wen_t *model, double beta, double gamma, double exponent) {
    *model = (bouc_wen_t){.beta = beta, .gamma = gamma, .exponent = exponent};
}

/* dh/du while the drive goes in this direction. */
static double slope(const bouc_wen_t *model, double direction, double h) {
    const double size = model->exponent == 1.0 ? fabs(h) : pow(fabs(h), model->exponent);
    return 1.0 - (model->gamma + (direction * h > 0.0 ? model->beta : -model->beta)) * size;
}

double bouc_wen_step(bouc_wen_t *model, double u) {
    const double way = u - model->input, direction = way < 0.0 ? -1.0 : 1.0;
    const double bend = model->exponent * pow(2.0 * model->beta, 1.0 / model->exponent);
    const int steps = 1 + (int)fmin(fabs(way) * bend / longest_step, 1e4);
    const double d = way / steps;
    for (int i = 0; i < steps; i++) {
        const double h = model->h, s1 = slope(model, direction, h), s2 = slope(model, direction, h + 0.5 * d * s1);
        const double s3 = slope(model, direction, h + 0.5 * d * s2), s4 = slope(model, direction, h + d * s3);
        model->h += d / 6.0 * (s1 + 2.0 * (s2 + s3) + s4);
    }
    model->input = u;
    return model->h;
}

double bouc_wen_settle(bouc_wen_t *model, double u) {
    model->h = 0.0;
    model->input = 0.0;
    return bouc_wen_step(model, u);
}
