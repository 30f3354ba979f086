/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "compile/compile_preisach.h"
#include "compile/compile.h"
#include <math.h>
#include <stdlib.h>

typedef struct {
    const preisach_grid_t *grid;
    const double *everett_um;
} source_t;

typedef struct {
    double level_v[HYST_PREISACH_MAX_INTERVALS + 1];
    double everett_um[HYST_PREISACH_MAX_ELEMENTS];
    preisach_grid_t grid;
} amplifier_table_t;

/* A level as a mean of two drives inside the model's levels, with weights that may lie outside 0 to 1. */
typedef struct {
    double drive_v[2], weight[2];
} mean_t;

static bool is_inside(const preisach_grid_t *model, double drive_v) {
    return drive_v >= model->level_v[0] && drive_v <= model->level_v[model->levels - 1];
}

/* beside: the next level of the amplifier, on the side of the model's levels. If it lies beyond them too, the whole
 * model falls between two levels of the amplifier and counts as one interval. */
static mean_t mean_of(const preisach_grid_t *model, double level_v, double beside_v) {
    const double low_v = model->level_v[0], high_v = model->level_v[model->levels - 1];
    const double end_v = level_v < low_v ? low_v : high_v, other_v = level_v < low_v ? high_v : low_v;
    double part;
    if (is_inside(model, level_v)) {
        return (mean_t){.drive_v = {level_v, level_v}, .weight = {1.0, 0.0}};
    }
    if (!is_inside(model, beside_v) || beside_v == end_v) {
        beside_v = other_v;
    }
    part = (level_v - end_v) / (beside_v - end_v); /* negative */
    return (mean_t){.drive_v = {end_v, beside_v}, .weight = {1.0 - part, part}};
}

static double continued(const source_t *model, const mean_t *to, const mean_t *from) {
    double sum = 0.0;
    for (size_t a = 0; a < 2; a++) {
        for (size_t b = 0; b < 2; b++) {
            sum += to->weight[a] * from->weight[b] *
                   preisach_everett(model->grid, model->everett_um, to->drive_v[a], from->drive_v[b]);
        }
    }
    return sum;
}

/* Extrapolated slopes may cross. The validator accepts rising branches only. */
static double kept_rising(const compile_job_t *job, size_t intervals, double value_um, double below_um,
                          double beside_um) {
    const double interval = 2.0 * job->elastic_half_um / (double)intervals / HYST_Q28_ONE;
    const hyst_q28_t least = HYST_PREISACH_MIN_SLOPE;
    const double least_um = 1.01 * least * interval; /* 1 %: well beyond rounding */
    const double most_um = 0.99 * (double)HYST_PREISACH_MAX_SLOPE * interval;
    return fmax(fmax(below_um, beside_um) + least_um, fmin(fmin(below_um, beside_um) + most_um, value_um));
}

/* The table for levels first .. first + piece->levels - 1: those inside the model's range and one more on either side.
 */
static void resample_piece(const compile_job_t *job, const source_t *model, size_t intervals,
                           const preisach_grid_t *piece, double *everett_um) {
    const size_t last = piece->levels - 1;
    mean_t mean[HYST_PREISACH_MAX_INTERVALS + 1];
    for (size_t i = 0; i <= last; i++) {
        const bool below = piece->level_v[i] < model->grid->level_v[0];
        const size_t beside = below ? (i < last ? i + 1 : last) : (i > 0 ? i - 1 : 0);
        mean[i] = mean_of(model->grid, piece->level_v[i], piece->level_v[beside]);
    }
    for (size_t i = 1; i <= last; i++) {
        for (size_t j = i; j-- > 0;) {
            double *here = &everett_um[preisach_element(i, j)];
            *here = continued(model, &mean[i], &mean[j]);
            if (!is_inside(model->grid, piece->level_v[i]) || !is_inside(model->grid, piece->level_v[j])) {
                const bool diagonal = i == j + 1;
                *here = kept_rising(job, intervals, *here, diagonal ? 0.0 : everett_um[preisach_element(i - 1, j)],
                                    diagonal ? 0.0 : everett_um[preisach_element(i, j + 1)]);
            }
        }
    }
}

/* Beyond these levels the table is extrapolated linearly, as the model is. */
static void resample(const compile_job_t *job, const source_t *model, size_t intervals, amplifier_table_t *amplifier) {
    const double lowest_v = job->drive_center_v - job->drive_half_v;
    double everett_um[HYST_PREISACH_MAX_ELEMENTS];
    size_t first = 0, last = intervals;
    preisach_grid_t piece;
    amplifier->grid = (preisach_grid_t){.levels = intervals + 1, .level_v = amplifier->level_v};
    for (size_t i = 0; i <= intervals; i++) {
        amplifier->level_v[i] = lowest_v + 2.0 * job->drive_half_v * (double)i / (double)intervals;
    }
    while (first + 1 < last && amplifier->level_v[first + 1] < model->grid->level_v[0]) {
        first++;
    }
    while (last > first + 1 && amplifier->level_v[last - 1] > model->grid->level_v[model->grid->levels - 1]) {
        last--;
    }
    piece = (preisach_grid_t){.levels = last - first + 1, .level_v = amplifier->level_v + first};
    resample_piece(job, model, intervals, &piece, everett_um);
    for (size_t i = 1; i <= intervals; i++) {
        for (size_t j = 0; j < i; j++) {
            amplifier->everett_um[preisach_element(i, j)] =
                preisach_everett(&piece, everett_um, amplifier->level_v[i], amplifier->level_v[j]);
        }
    }
}

/* Appends the levels within the drive limits of the amplifier. */
static size_t add_levels(const hyst_parameters_t *p, const preisach_grid_t *grid, double *drive_v, size_t count) {
    for (size_t i = 0; i < grid->levels; i++) {
        if (grid->level_v[i] > drive_to_volts(p, p->drive_low) && grid->level_v[i] < drive_to_volts(p, p->drive_high)) {
            drive_v[count++] = grid->level_v[i];
        }
    }
    return count;
}

/* Largest difference on a branch, over the drives within the amplifier's limits. Both tables are bilinear between the
 * union of their levels, so the maximum is at a pair of these levels. */
static double difference(const compile_job_t *job, const source_t *model, const amplifier_table_t *amplifier) {
    const hyst_parameters_t *p = job->parameters;
    double *drive_v = allocate(model->grid->levels + amplifier->grid.levels + 2, sizeof(double)), largest_um = 0.0;
    size_t count = 0;
    drive_v[count++] = drive_to_volts(p, p->drive_low);
    drive_v[count++] = drive_to_volts(p, p->drive_high);
    count = add_levels(p, model->grid, drive_v, count);
    count = add_levels(p, &amplifier->grid, drive_v, count);
    for (size_t i = 1; i < count; i++) {
        for (size_t j = 0; j < i; j++) {
            largest_um = fmax(largest_um,
                              fabs(preisach_everett(&amplifier->grid, amplifier->everett_um, drive_v[i], drive_v[j]) -
                                   preisach_everett(model->grid, model->everett_um, drive_v[i], drive_v[j])));
        }
    }
    free(drive_v);
    return largest_um;
}

static double conditioned(const preisach_grid_t *grid, const double *everett_um, double offset_um, double low_v,
                          double high_v) {
    preisach_memory_t memory;
    preisach_memory_begin(&memory, grid);
    preisach_memory_move(&memory, grid, grid->level_v[grid->levels - 1]);
    preisach_memory_move(&memory, grid, low_v);
    preisach_memory_move(&memory, grid, high_v);
    return preisach_output(grid, everett_um, offset_um, &memory);
}

/*
 * Mean of the positions at the amplifier's outermost levels, chosen so that both models agree after a sweep over the
 * range that they share. Outside of that range no relay switches: the reset took the amplifier's memory to its upper
 * end once, and nothing takes it to the lower end.
 */
static double middle(const source_t *model, double offset_um, const amplifier_table_t *amplifier) {
    const size_t last = amplifier->grid.levels - 1;
    const double low_v = fmax(model->grid->level_v[0], amplifier->level_v[0]);
    const double high_v = fmin(model->grid->level_v[model->grid->levels - 1], amplifier->level_v[last]);
    return conditioned(model->grid, model->everett_um, offset_um, low_v, high_v) -
           conditioned(&amplifier->grid, amplifier->everett_um, 0.0, low_v, high_v);
}

bool compile_preisach(compile_job_t *job, const preisach_grid_t *grid, const double *everett_um, double offset_um) {
    const source_t model = {grid, everett_um};
    hyst_parameters_t *p = job->parameters;
    amplifier_table_t amplifier;
    double least_um = HUGE_VAL, middle_part;
    bool good = true;
    for (uint32_t intervals = 1; intervals <= HYST_PREISACH_MAX_INTERVALS; intervals++) {
        double change_um;
        resample(job, &model, intervals, &amplifier);
        change_um = difference(job, &model, &amplifier);
        if (change_um < least_um) {
            least_um = change_um;
            p->preisach_intervals = intervals;
        }
    }
    resample(job, &model, p->preisach_intervals, &amplifier);
    p->family = HYST_FAMILY_PREISACH;
    for (size_t k = 0; good && k < HYST_PREISACH_ELEMENTS(p->preisach_intervals); k++) {
        good = compile_to_fixed(job, amplifier.everett_um[k] / job->elastic_half_um, 28,
                                "an element of everett_um (in half position ranges)", &p->preisach_everett[k]);
    }
    job->report->model_operators = grid->levels - 1;
    job->report->merge_error_um = least_um;
    middle_part = (middle(&model, offset_um, &amplifier) - job->elastic_center_um) / job->elastic_half_um;
    if (good && !(fabs(middle_part) < 1.0)) {
        return fail(job->failure,
                    "over the drive range %g:%g V the position would run far out of its own range: give a "
                    "--drive-range nearer to the model's %g:%g V",
                    amplifier.level_v[0], amplifier.level_v[p->preisach_intervals], grid->level_v[0],
                    grid->level_v[grid->levels - 1]);
    }
    return good && compile_to_fixed(job, middle_part, 31, "offset", &p->hysteresis_offset);
}
