/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/path/changes_find.h"
#include "look/path/clocks.h"
#include "look/path/shifts.h"
#include "look/path/switches.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_WINDOWS = 768, LEAST_WINDOW = 8, EDGE = PROBLEM_EDGE, DRIFTS = 2 };

/* Two clocks, or shifts: what leaves less. */
static void find_in_time(problem_t *p, double rate_hz, changes_t *changes) {
    double *residual = allocate(p->n, sizeof *residual), *as_read = problem_copy(p);
    const double all = problem_residual(p, residual);
    lag_course_t saw;
    clocks_find(p, rate_hz, all, residual, &saw);
    const bool one = fabs(fabs(saw.size) - 1.0) < threshold.one_sample + threshold.deviations * saw.sigma &&
                     threshold.deviations * saw.sigma < threshold.saw_known;
    const bool clocks = one && saw.by_wave < 1.0 && saw.log_chance < p->log_chance_limit &&
                        saw.left < (1.0 - threshold.change_explains) * all &&
                        problem_rms(p, saw.left) < threshold.shift_near_noise * p->prediction->noise_um &&
                        saw.teeth_per_s * (double)p->n / rate_hz >= threshold.least_teeth;
    shifts_find(p, all, changes);
    if (clocks && (changes->shifts == 0 || problem_rms(p, saw.left) < changes->left_um)) {
        problem_restore(p, as_read);
        memset(changes, 0, sizeof *changes);
        changes->before_um = problem_rms(p, all);
        changes->left_um = problem_rms(p, saw.left);
        changes->clocks = saw;
    }
    free(residual);
    free(as_read);
}

/* Readings with the wrong ones replaced by the mean of their neighbours, less the middle. */
static void fill_readings(const recording_t *recording, const wrong_t *wrong, double middle_um, double *y) {
    const double *reading = recording->column[COLUMN_DISPLACEMENT];
    for (size_t k = 0; k < recording->samples; k++) {
        y[k] = reading[k] - middle_um;
    }
    for (size_t i = 0; i < wrong->count; i++) {
        size_t next = i;
        while (next + 1 < wrong->count && wrong->at[next + 1] == wrong->at[next] + 1) {
            next++;
        }
        const size_t from = wrong->at[i] - 1, to = wrong->at[next] + 1;
        for (size_t k = from + 1; k < to; k++) {
            y[k] = y[from] + (y[to] - y[from]) * (double)(k - from) / (double)(to - from);
        }
        i = next;
    }
}

/* Gain and offset that drift are no switch: they are columns, too, beside the path that the columns make of the
 * readings that are set right. */
static void find_switches(problem_t *p, const recording_t *recording, const drive_look_t *drive, double middle_um,
                          changes_t *changes) {
    double *path = allocate(p->n, sizeof *path), *drift = allocate(DRIFTS * p->n, sizeof *drift);
    problem_residual(p, path);
    for (size_t k = 0; k < p->n; k++) {
        const double x = (double)k / (double)p->n;
        path[k] = p->y[k] - path[k];
        drift[k] = x * x;
        drift[p->n + k] = x * path[k];
    }
    for (size_t i = 0; i < DRIFTS; i++) {
        p->column[p->columns++] = drift + i * p->n;
    }
    problem_factorise(p);
    switches_find(p, recording, drive, path, middle_um, changes);
    free(path);
    free(drift);
}

void changes_find(const recording_t *recording, const drive_look_t *drive, const reference_t *reference,
                  const prediction_t *prediction, double noise_um, const wrong_t *wrong, double log_chance_limit,
                  changes_t *changes) {
    const size_t samples = recording->samples, from = reference->plays_from, span_from = reference->span.from;
    const size_t start = from > span_from ? (from > EDGE ? from : EDGE) : (span_from > EDGE ? span_from : EDGE);
    const size_t end = reference->span.to + EDGE < samples ? reference->span.to : samples - EDGE;
    memset(changes, 0, sizeof *changes);
    if (drive->kind == DRIVE_RESTS || (double)end < (double)start + threshold.least_for_changes) {
        return;
    }
    const double middle_um = look_mean(recording->column[COLUMN_DISPLACEMENT], samples);
    const double *column[LOOK_MOST_COLUMNS];
    double *y = allocate(samples, sizeof *y);
    problem_t p = {.n = end - start,
                   .first = start,
                   .prediction = prediction,
                   .noise_um = noise_um,
                   .log_chance_limit = log_chance_limit,
                   .column = column,
                   .columns = reference->column_count,
                   .y = y + start};
    fill_readings(recording, wrong, middle_um, y);
    p.windows = p.n / LEAST_WINDOW < MOST_WINDOWS ? p.n / LEAST_WINDOW : MOST_WINDOWS;
    p.from = allocate(p.windows + 1, sizeof *p.from);
    for (size_t w = 0; w <= p.windows; w++) {
        p.from[w] = w * p.n / p.windows;
    }
    for (size_t c = 0; c < p.columns; c++) {
        column[c] = reference->columns + c * samples + start;
    }
    problem_factorise(&p);
    size_t independent = 0; /* of a drive between few levels nearly none is */
    for (size_t c = 0; c < p.columns; c++) {
        if (column_factor_has(&p.factor, c)) {
            column[independent++] = column[c];
        }
    }
    p.columns = independent;
    problem_factorise(&p);
    find_in_time(&p, recording->sample_rate_hz, changes);
    if (changes->clocks.size == 0.0) {
        find_switches(&p, recording, drive, middle_um, changes);
    }
    column_factor_free(&p.factor);
    free(y);
    free(p.from);
}
