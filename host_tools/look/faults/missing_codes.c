/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Readings that never fall into a range that the position crosses again and again. A crossing in which the position
 * moves by d per sample (the largest of six steps around it) would leave gap / d readings inside, so the chance of none
 * in all crossings is exp(-sum gap / d), at most. Crossings that a jump or the speed of the drive explains do not
 * count. Where most readings are so far from the next one, a coarse converter has few codes, and misses none. */
#include "look/fault.h"
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

/* Readings at the edges of the gaps: those that should be inside are among them. */
static void mark_edges(const look_t *look, const double *low, const double *gap, size_t gaps, fault_t *fault) {
    const double *y = look->recording->column[COLUMN_DISPLACEMENT];
    for (size_t k = 0; k < look->recording->samples; k++) {
        bool at_edge = false;
        for (size_t g = 0; g < gaps; g++) {
            at_edge = at_edge || y[k] == low[g] || fabs(y[k] - low[g] - gap[g]) <= 1e-9 * gap[g];
        }
        if (at_edge && fault->spans > 0 && fault->span[fault->spans - 1].to == k) {
            fault->span[fault->spans - 1].to = k + 1;
        } else if (at_edge) {
            fault_span(fault, k, k + 1);
        }
    }
}

static void find_in(const look_t *look, size_t index, const fault_kind_t *kind, fault_list_t *faults) {
    const size_t samples = look->recording->samples, skipped = (size_t)(threshold.gap_inside * (double)samples);
    const double stroke = look->map.stroke_um[1] - look->map.stroke_um[0];
    const double least =
        fmax(threshold.gap_of_stroke * stroke,
             fmax(threshold.edge_of_noise * look->prediction.noise_um, threshold.gap_in_steps * look->noise.step_um));
    double *sorted = allocate(samples, sizeof *sorted), *gap = allocate(MOST_GAPS, sizeof *gap), expected = 0.0;
    double low[MOST_GAPS];
    size_t gaps = 0, candidates = 0, apart = 0;
    memcpy(sorted, look->recording->column[COLUMN_DISPLACEMENT], samples * sizeof *sorted);
    gsl_sort(sorted, 1, samples);
    for (size_t i = skipped; i + 1 + skipped < samples; i++) {
        candidates += sorted[i + 1] - sorted[i] > least ? 1 : 0;
        apart += sorted[i + 1] > sorted[i] ? 1 : 0;
    }
    for (size_t i = skipped; candidates <= MOST_GAPS && 2 * candidates < apart && i + 1 + skipped < samples; i++) {
        if (sorted[i + 1] - sorted[i] > least) {
            const double here = expected_inside(look, sorted[i], sorted[i + 1]);
            /* Each place between two readings could have been one. */
            if (log10((double)samples) - here / log(10.0) < look_log_chance_limit()) {
                low[gaps] = sorted[i];
                gap[gaps++] = sorted[i + 1] - sorted[i];
                expected = fmax(expected, here);
            }
        }
    }
    fault_t *fault =
        gaps == 0 ? NULL : fault_add(faults, kind, index, expected, log10((double)samples) - expected / log(10.0));
    if (fault != NULL) {
        mark_edges(look, low, gap, gaps, fault);
        fault_number(fault, "gaps", "1", (double)gaps, 0.0);
        fault_number(fault, "gap_um", "um", look_quantile(gap, gaps, 0.5), fmax(look->prediction.noise_um, 0.0));
    }
    free(sorted);
    free(gap);
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
