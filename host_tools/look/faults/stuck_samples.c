/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A reading that stays for a while in readings that otherwise have noise. Runs at the ends of the readings are a
 * converter's (clipped_converter). */
#include "look/fault.h"
#include "look/runs.h"
#include <math.h>
#include <stdlib.h>

static void find_in(const look_t *look, size_t index, const fault_kind_t *kind, fault_list_t *faults) {
    const double *y = look->recording->column[COLUMN_DISPLACEMENT];
    size_t count, longest = 0;
    equal_run_t *runs = equal_runs(look, &count);
    double worst = 0.0;
    fault_t found = {0};
    for (size_t i = 0; i < count; i++) {
        const double value = y[runs[i].span.from];
        const bool at_end = value == look->map.stroke_um[0] || value == look->map.stroke_um[1];
        if (!at_end && runs[i].log_chance < look_log_chance_limit()) {
            fault_span(&found, runs[i].span.from + 1, runs[i].span.to); /* its first reading was a good one */
            longest = span_length(runs[i].span) > longest ? span_length(runs[i].span) : longest;
            worst = fmin(worst, runs[i].log_chance);
        }
    }
    fault_t *fault = fault_add(faults, kind, index, (double)longest, worst);
    if (fault != NULL) {
        fault->span = found.span;
        fault->spans = found.spans;
        fault_number(fault, "runs", "1", (double)found.spans, 0.0);
        fault_number(fault, "longest_s", "s", (double)longest / look->recording->sample_rate_hz, 0.0);
    } else {
        free(found.span);
    }
    free(runs);
}

static void find(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    for (size_t i = 0; i < count; i++) {
        if (fault_found(faults, &fault_missing_codes, i)) {
            continue; /* readings gather at the ends of a range that has none */
        }
        find_in(&looks[i], i, kind, faults);
    }
}

const fault_kind_t fault_stuck_samples = {
    .name = "stuck_samples",
    .order = 70,
    .text = "The reading stays exactly the same for a while, in readings that otherwise have noise.",
    .statistic = "samples of the longest run of equal readings",
    .change =
        "The sensor was read less often than the file was written, or its driver returned the last value: read it "
        "with each sample, and check its ready flag. Leave these samples out.",
    .handling = FAULT_MASKABLE,
    .find = find};
