/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Readings that never fall into a range that the position crosses again and again. A crossing in which the position
 * moves by d per sample (the largest of six steps around it) would leave gap / d readings inside, so the chance of none
 * in all crossings is exp(-sum gap / d), at most. Crossings that a jump or the speed of the drive explains do not
 * count. Where the position is slow, it also shows that it stays at the edges: readings that should be inside are
 * there, equal to each other. A sensor that sticks leaves such a range once; to stick twice at its edges is no chance.
 * Where most readings are so far from the next one, a coarse converter has few codes, and misses none. */
#include "look/fault.h"
#include "look/runs.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_sort.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { AROUND = 3, MOST_GAPS = 32 };

/* Readings that are expected inside the gap. */
static double expected_inside(const look_t *look, double low, double high) {
    const double *y = look->recording->column[COLUMN_DISPLACEMENT], *u = look->recording->column[COLUMN_DRIVE];
    const double gap = high - low, gain = fabs(look->map.gain_um_per_v);
    double expected = 0.0;
    for (size_t k = AROUND + 1; k + AROUND < look->recording->samples; k++) {
        const bool crosses = (y[k - 1] <= low && y[k] >= high) || (y[k - 1] >= high && y[k] <= low);
        if (!crosses || look->prediction.quiet[k] == 0 || threshold.drive_makes * gain * fabs(u[k] - u[k - 1]) > gap) {
            continue;
        }
        double way = fmax(fabs(y[k] - y[k - 1]) - gap, 0.0);
        for (size_t j = 1; j <= AROUND; j++) {
            way = fmax(way, fmax(fabs(y[k + j] - y[k + j - 1]), fabs(y[k - j] - y[k - j - 1])));
        }
        expected += gap > threshold.gap_in_ways * way ? gap / fmax(way, 1e-3 * gap) : 0.0;
    }
    return expected;
}

static bool is_edge(double reading, double low, double gap) {
    return reading == low || fabs(reading - low - gap) <= 1e-9 * gap;
}

/* log10 of the chance of the second run of equal readings at the edges of the gap; 0: there is none. */
static double stays_at_edges(const look_t *look, const equal_run_t *runs, size_t count, double low, double gap) {
    double first = 0.0, second = 0.0;
    for (size_t i = 0; i < count; i++) {
        if (is_edge(look->recording->column[COLUMN_DISPLACEMENT][runs[i].span.from], low, gap)) {
            second = fmin(second, fmax(first, runs[i].log_chance));
            first = fmin(first, runs[i].log_chance);
        }
    }
    return second;
}

/* Readings at the edges of the gaps: those that should be inside are among them. */
static void mark_edges(const look_t *look, const double *low, const double *gap, size_t gaps, fault_t *fault) {
    const double *y = look->recording->column[COLUMN_DISPLACEMENT];
    for (size_t k = 0; k < look->recording->samples; k++) {
        bool at_edge = false;
        for (size_t g = 0; g < gaps; g++) {
            at_edge = at_edge || is_edge(y[k], low[g], gap[g]);
        }
        if (at_edge && fault->spans > 0 && fault->span[fault->spans - 1].to == k) {
            fault->span[fault->spans - 1].to = k + 1;
        } else if (at_edge) {
            fault_span(fault, k, k + 1);
        }
    }
}

/* The width that a range without readings has to exceed, so that at most MOST_GAPS do; HUGE_VAL: a coarse converter's.
 * sorted: the readings, without the outermost ones. */
static double least_width(const look_t *look, const double *sorted, size_t count) {
    const double stroke = look->map.stroke_um[1] - look->map.stroke_um[0];
    double least = fmax(threshold.gap_of_stroke * stroke, fmax(threshold.edge_of_noise * look->prediction.noise_um,
                                                               threshold.gap_in_steps * look->noise.step_um));
    double *wide = allocate(count, sizeof *wide);
    size_t candidates = 0, apart = 0;
    for (size_t i = 0; i + 1 < count; i++) {
        wide[candidates] = sorted[i + 1] - sorted[i];
        apart += wide[candidates] > 0.0 ? 1 : 0;
        candidates += wide[candidates] > least ? 1 : 0;
    }
    if (2 * candidates >= apart) {
        least = HUGE_VAL;
    } else if (candidates > MOST_GAPS) { /* the widest of them */
        gsl_sort(wide, 1, candidates);
        least = wide[candidates - 1 - MOST_GAPS];
    }
    free(wide);
    return least;
}

static void find_in(const look_t *look, size_t index, const fault_kind_t *kind, fault_list_t *faults) {
    const size_t samples = look->recording->samples, skipped = (size_t)(threshold.gap_inside * (double)samples);
    double *sorted = allocate(samples, sizeof *sorted), expected = 0.0, log_chance = 0.0;
    double low[MOST_GAPS], gap[MOST_GAPS];
    size_t gaps = 0, count = 0;
    memcpy(sorted, look->recording->column[COLUMN_DISPLACEMENT], samples * sizeof *sorted);
    gsl_sort(sorted, 1, samples);
    const double least = least_width(look, sorted + skipped, samples - 2 * skipped);
    equal_run_t *runs = isfinite(least) ? equal_runs(look, &count) : NULL;
    for (size_t i = skipped; i + 1 + skipped < samples; i++) {
        const double width = sorted[i + 1] - sorted[i];
        if (width > least) {
            const double here = expected_inside(look, sorted[i], sorted[i + 1]);
            /* Each place between two readings could have been one. */
            const double chance =
                fmin(log10((double)samples) - here / log(10.0), stays_at_edges(look, runs, count, sorted[i], width));
            if (chance < look_log_chance_limit()) {
                low[gaps] = sorted[i];
                gap[gaps++] = width;
                expected = fmax(expected, here);
                log_chance = fmin(log_chance, chance);
            }
        }
    }
    fault_t *fault = gaps == 0 ? NULL : fault_add(faults, kind, index, expected, log_chance);
    if (fault != NULL) {
        mark_edges(look, low, gap, gaps, fault);
        fault_number(fault, "gaps", "1", (double)gaps, 0.0);
        fault_number(fault, "gap_um", "um", look_quantile(gap, gaps, 0.5), fmax(look->prediction.noise_um, 0.0));
    }
    free(sorted);
    free(runs);
}

static void find(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    for (size_t i = 0; i < count; i++) {
        find_in(&looks[i], i, kind, faults);
    }
}

const fault_kind_t fault_missing_codes = {
    .name = "missing_codes",
    .order = 50,
    .text = "The position crosses some ranges again and again, but no reading ever falls into them.",
    .statistic = "readings expected in the emptiest range",
    .change =
        "The converter misses codes (or a digit is lost on the way): use another one, or a part of its range without "
        "gaps. What is missing adds steps to the reading; readings at the edges of what is missing are left out.",
    .handling = FAULT_MASKABLE,
    .find = find};
