/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/bouc_wen.h"
#include <math.h>
#include <stdbool.h>

enum { MIDDLE = BOUC_WEN_CELLS / 2, TAIL = BOUC_WEN_CELLS - 2 };

/* What h comes to where the drive stays in its range, which is two half ranges. */
static const double first_reach = 2.0;

static bool reaches_limit(const bouc_wen_t *model) {
    return model->reach == model->limit;
}

/* The last node: behind it the curve goes on in closed form if it ends at its limit. */
static size_t last_node(const bouc_wen_t *model) {
    return reaches_limit(model) ? TAIL : BOUC_WEN_CELLS;
}

static double value_at(const bouc_wen_t *model, size_t node) {
    return model->reach * ((double)node - MIDDLE) / MIDDLE;
}

/* dh/du where |h|^n is this: while h grows, and while it comes back to 0. */
static double growing(const bouc_wen_t *model, double power) {
    return 1.0 - (model->beta + model->gamma) * power;
}
static double returning(const bouc_wen_t *model, double power) {
    return 1.0 + (model->beta - model->gamma) * power;
}

/* The way through a cell is the integral of du/dh: two points of Gauss. */
static void make_curve(bouc_wen_t *model, double reach) {
    static const double gauss = 0.28867513459481287; /* 1 / (2 sqrt 3) */
    const double cell = reach / MIDDLE;
    model->reach = reach;
    model->way[0] = 0.0;
    for (size_t i = 0; i < MIDDLE; i++) {
        const double here = pow((double)i * cell, model->exponent), middle = (double)i + 0.5;
        const double before = pow((middle - gauss) * cell, model->exponent);
        const double behind = pow((middle + gauss) * cell, model->exponent);
        model->slope[MIDDLE - i] = returning(model, here);
        model->slope[MIDDLE + i] = growing(model, here); /* h = 0: 1 of both */
        /* Of the cells on either side of h = 0, at their ends. */
        model->way[MIDDLE - i] = 0.5 * cell * (1.0 / returning(model, before) + 1.0 / returning(model, behind));
        model->way[MIDDLE + i + 1] = 0.5 * cell * (1.0 / growing(model, before) + 1.0 / growing(model, behind));
    }
    const double end = pow(reach, model->exponent);
    model->slope[0] = returning(model, end);
    model->slope[BOUC_WEN_CELLS] = growing(model, end);
    for (size_t i = 0; i < BOUC_WEN_CELLS; i++) {
        model->way[i + 1] += model->way[i];
    }
}

/* Where |h| comes to beyond the curve's end. */
static void reach_for(bouc_wen_t *model, double h) {
    double reach = fmax(first_reach, model->reach);
    while (reach < h) {
        reach *= 2.0;
    }
    make_curve(model, 2.0 * reach > model->limit ? model->limit : reach);
}

void bouc_wen_open(bouc_wen_t *model, double beta, double gamma, double exponent) {
    *model =
        (bouc_wen_t){.beta = beta, .gamma = gamma, .exponent = exponent, .limit = pow(beta + gamma, -1.0 / exponent)};
    reach_for(model, 0.0);
}

void bouc_wen_put(bouc_wen_t *model, double h) {
    model->input = 0.0;
    model->h = h;
    model->direction = 0.0;
}

/*
 * Near the limit, with e the distance to it and r = (n - 1) / 2, both in units of the limit, and w the way likewise,
 *
 *     de/dw = 1 - (1 - e)^n = n e (1 - r e + ...)   has the solution   e = e0 x / (1 - r e0 (1 - x)),  x = exp(-n w)
 *
 * The next term is (n - 1) (n - 2) e^2 / 6: 9e-4 of e for n = 20, and e is a 256th at most.
 */
static const double tail_begins = (double)(BOUC_WEN_CELLS - TAIL) / MIDDLE;

static double tail_value(const bouc_wen_t *model, double way) {
    const double r = 0.5 * (model->exponent - 1.0), x = exp(-model->exponent * way / model->limit);
    return model->limit * (1.0 - tail_begins * x / (1.0 - r * tail_begins * (1.0 - x)));
}

static double tail_way(const bouc_wen_t *model, double h) {
    const double r = 0.5 * (model->exponent - 1.0), e = fmax(1.0 - h / model->limit, 0.0);
    const double x = e * (1.0 - r * tail_begins) / (tail_begins * (1.0 - r * e));
    return -log(fmin(x, 1.0)) * model->limit / model->exponent;
}

/* In a cell h is the cubic of the way that has its values and slopes at both ends. */
typedef struct {
    double length, c[4];
} cubic_t;

static cubic_t cubic_of(const bouc_wen_t *model, size_t cell) {
    const double length = model->way[cell + 1] - model->way[cell], rise = model->reach / MIDDLE;
    const double begin = model->slope[cell] * length, end = model->slope[cell + 1] * length;
    return (cubic_t){length, {value_at(model, cell), begin, 3.0 * rise - 2.0 * begin - end, begin + end - 2.0 * rise}};
}

static double cubic_value(const cubic_t *cubic, double x) {
    return cubic->c[0] + x * (cubic->c[1] + x * (cubic->c[2] + x * cubic->c[3]));
}

/* Newton, from where a straight line would be: of a curve that hardly bends in the cell. */
static double cubic_place(const cubic_t *cubic, double h, double rise) {
    double x = (h - cubic->c[0]) / rise;
    for (int i = 0; i < 4; i++) {
        x -= (cubic_value(cubic, x) - h) / (cubic->c[1] + x * (2.0 * cubic->c[2] + x * 3.0 * cubic->c[3]));
    }
    return fmax(0.0, fmin(1.0, x));
}

/* A branch begins where h is in the new direction: on the curve at this place. */
static void begin_branch(bouc_wen_t *model, double direction) {
    const double h = direction * model->h, rise = model->reach / MIDDLE;
    model->direction = direction;
    if (h >= value_at(model, last_node(model))) {
        model->cell = last_node(model);
        model->gone = model->way[model->cell] + (reaches_limit(model) ? tail_way(model, h) : 0.0);
        return;
    }
    model->cell = (size_t)fmax(0.0, floor((h + model->reach) / rise));
    const cubic_t cubic = cubic_of(model, model->cell);
    model->gone = model->way[model->cell] + cubic.length * cubic_place(&cubic, h, rise);
}

static double h_here(const bouc_wen_t *model) {
    if (model->cell >= last_node(model)) {
        return tail_value(model, model->gone - model->way[model->cell]);
    }
    const cubic_t cubic = cubic_of(model, model->cell);
    return cubic_value(&cubic, (model->gone - model->way[model->cell]) / cubic.length);
}

double bouc_wen_step(bouc_wen_t *model, double u) {
    double way = fabs(u - model->input);
    const double direction = u < model->input ? -1.0 : 1.0;
    if (way == 0.0) {
        return model->h;
    }
    if (fabs(model->h) > model->reach && !reaches_limit(model)) {
        reach_for(model, fabs(model->h));
        model->direction = 0.0;
    }
    if (direction != model->direction) {
        begin_branch(model, direction);
    }
    while (!reaches_limit(model) && model->gone + way > model->way[BOUC_WEN_CELLS]) {
        way -= model->way[BOUC_WEN_CELLS] - model->gone;
        model->h = direction * model->reach;
        reach_for(model, 2.0 * model->reach);
        begin_branch(model, direction);
    }
    model->gone += way;
    while (model->cell < last_node(model) && model->gone >= model->way[model->cell + 1]) {
        model->cell++;
    }
    model->input = u;
    model->h = direction * h_here(model);
    return model->h;
}

double bouc_wen_settle(bouc_wen_t *model, double u) {
    bouc_wen_put(model, 0.0);
    return bouc_wen_step(model, u);
}
