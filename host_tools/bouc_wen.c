/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "bouc_wen.h"
#include <math.h>

void bouc_wen_open(bouc_wen_t *model, double beta, double gamma, double exponent) {
    const double sum = beta + gamma;
    *model = (bouc_wen_t){
        .beta = beta, .gamma = gamma, .exponent = exponent, .limit = sum > 0.0 ? pow(sum, -1.0 / exponent) : HUGE_VAL};
}

double bouc_wen_step(bouc_wen_t *model, double u) {
    const double du = u - model->input, sign = du * model->h > 0.0 ? 1.0 : -1.0;
    const double size = model->exponent == 1.0 ? fabs(model->h) : pow(fabs(model->h), model->exponent);
    model->h += du * (1.0 - (model->gamma + model->beta * sign) * size);
    model->h = fmax(-model->limit, fmin(model->limit, model->h));
    model->input = u;
    return model->h;
}

double bouc_wen_settle(bouc_wen_t *model, double u) {
    enum { STEPS = 1000 };
    model->h = 0.0;
    model->input = 0.0;
    for (int i = 1; i <= STEPS; i++) {
        bouc_wen_step(model, u * i / STEPS);
    }
    return model->h;
}
