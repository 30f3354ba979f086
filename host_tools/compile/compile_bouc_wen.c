/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "compile/compile_bouc_wen.h"
#include <math.h>

enum { POINTS = 4000 };
/* Changes of slope between two points that are rounding, not bending. */
static const double straight = 1e-9;

typedef struct {
    double travel, h, bend; /**< bend: integral of sqrt(|h''|) over the travelled drive, and some of the drive itself */
} point_t;

static double after(const bouc_wen_t *model, double h, double travel) {
    bouc_wen_t walker = *model;
    bouc_wen_put(&walker, h);
    return bouc_wen_step(&walker, travel);
}

/* Drive that takes h from -end to end. */
static double whole_branch(const bouc_wen_t *model, double end, double reach) {
    double low = 0.0, high = reach;
    while (after(model, -end, high) < end) {
        high *= 2.0;
    }
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (low + high);
        *(after(model, -end, middle) < end ? &low : &high) = middle;
    }
    return high;
}

/* A chord of length L is off by L^2 |h''| / 8: cells that share the bend share the error. */
static void walk_branch(const bouc_wen_t *model, double end, double whole, point_t point[POINTS + 1]) {
    const double travel = whole / POINTS;
    point[0] = (point_t){.h = -end};
    for (size_t i = 1; i <= POINTS; i++) {
        const point_t *last = &point[i - 1];
        const double h = after(model, last->h, travel);
        const double second = i > 1 ? fabs(h - 2.0 * last->h + point[i - 2].h) : 0.0;
        const double bend = second > straight * travel ? sqrt(second) : 0.0;
        point[i] = (point_t){.travel = last->travel + travel, .h = h, .bend = last->bend + bend};
    }
    /* A tenth goes by the drive alone, so that a straight piece is cut as well. */
    const double even = point[POINTS].bend > 0.0 ? 0.1 * point[POINTS].bend / whole : 1.0;
    for (size_t i = 0; i <= POINTS; i++) {
        point[i].bend += even * point[i].travel;
    }
}

/* The largest distance of the points between two ends of cells from the chord. */
static double chord_error(const point_t *point, size_t from, size_t to) {
    const double slope = (point[to].h - point[from].h) / (point[to].travel - point[from].travel);
    double worst = 0.0;
    for (size_t i = from + 1; i < to; i++) {
        worst = fmax(worst, fabs(point[i].h - point[from].h - slope * (point[i].travel - point[from].travel)));
    }
    return worst;
}

double bouc_wen_cells(const bouc_wen_t *model, double reach, size_t cells, double *length, double *rise) {
    const double limit = pow(model->beta + model->gamma, -1.0 / model->exponent); /* infinite for beta + gamma = 0 */
    const double resolved = 1.0 - 0.5 / ((double)cells * (double)cells);
    const double end = fmin(after(model, 0.0, reach), resolved * limit);
    point_t point[POINTS + 1];
    walk_branch(model, end, whole_branch(model, end, reach), point);
    size_t at = 0;
    double worst = fmin(after(model, 0.0, reach), limit) - end;
    for (size_t cell = 0; cell < cells; cell++) {
        const size_t begin = at;
        while (at < POINTS && point[at].bend < point[POINTS].bend * (double)(cell + 1) / (double)cells) {
            at++;
        }
        if (cell + 1 == cells) {
            at = POINTS;
        }
        length[cell] = point[at].travel - point[begin].travel;
        rise[cell] = point[at].h - point[begin].h;
        worst = fmax(worst, chord_error(point, begin, at));
    }
    return worst;
}

bool compile_bouc_wen(compile_job_t *job, const bouc_wen_t *model, double offset_um, double direct_um,
                      double hysteretic_um, double center_v, double half_range_v) {
    hyst_parameters_t *p = job->parameters;
    const double scale = job->drive_half_v / half_range_v; /* u = bias + scale * amplifier's drive */
    const double bias = (job->drive_center_v - center_v) / half_range_v;
    const double offset = (offset_um + direct_um * bias - job->elastic_center_um) / job->elastic_half_um;
    double length[HYST_BOUC_WEN_MAX_CELLS], rise[HYST_BOUC_WEN_MAX_CELLS];
    p->family = HYST_FAMILY_BOUC_WEN;
    p->bouc_wen_cells = hysteretic_um == 0.0 ? 0 : HYST_BOUC_WEN_MAX_CELLS;
    bool good = compile_to_fixed(job, offset, 31, "offset", &p->hysteresis_offset) &&
                compile_to_fixed(job, direct_um * scale / job->elastic_half_um, 28, "slope", &p->bouc_wen_direct);
    job->report->merge_error_um =
        fabs(hysteretic_um) * bouc_wen_cells(model, 2.0 * scale, HYST_BOUC_WEN_MAX_CELLS, length, rise);
    for (size_t i = 0; i < p->bouc_wen_cells && good; i++) {
        const double share = hysteretic_um * rise[i] / length[i] * scale / job->elastic_half_um;
        good = compile_to_fixed(job, length[i] / scale, 31, "cell length", &p->bouc_wen_length[i]) &&
               compile_to_fixed(job, share, 28, "cell slope", &p->bouc_wen_slope[i]);
    }
    return good;
}
