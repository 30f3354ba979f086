/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/runs.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>

enum { AROUND = 256 };

/* Whether the pair (k - 1, k) is at rest, as far as the drive says. */
static bool at_rest(const double *u, size_t k, double still) {
    return fabs(u[k] - u[k - 1]) <= still;
}

/* Share of equal pairs around a run where the drive does the same. Returns how many pairs there were. */
static size_t share_around(const look_t *look, const equal_run_t *runs, size_t count, size_t which, double *share) {
    const double *y = look->recording->column[COLUMN_DISPLACEMENT], *u = look->recording->column[COLUMN_DRIVE];
    const look_span_t run = runs[which].span;
    const size_t samples = look->recording->samples, from = run.from > AROUND ? run.from - AROUND : 0;
    const size_t to = run.to + AROUND < samples ? run.to + AROUND : samples;
    const double still = threshold.edge_of_noise * look->drive.noise_v;
    const bool rests = at_rest(u, run.from + 1, still) && at_rest(u, run.to - 1, still);
    size_t equal = 0, pairs = 0, other = which;
    while (other > 0 && runs[other - 1].span.to > from) {
        other--;
    }
    for (size_t k = from + 1; k < to; k++) {
        while (other < count && runs[other].span.to <= k) {
            other++;
        }
        if (other < count && k > runs[other].span.from) { /* inside a long run: one pair */
            equal += other != which && k == runs[other].span.from + 1 ? 1 : 0;
            pairs += other != which && k == runs[other].span.from + 1 ? 1 : 0;
            continue;
        }
        if (at_rest(u, k, still) == rests) {
            equal += y[k] == y[k - 1] ? 1 : 0;
            pairs++;
        }
    }
    *share = ((double)equal + 1.0) / ((double)pairs + 2.0);
    return pairs;
}

equal_run_t *equal_runs(const look_t *look, size_t *count) {
    const double *y = look->recording->column[COLUMN_DISPLACEMENT];
    const size_t samples = look->recording->samples;
    const double unit = fmax(look->noise.step_um, look->noise.digit_um), noise = look->prediction.noise_um;
    equal_run_t *runs = NULL;
    size_t from = 0, found = 0;
    for (size_t k = 1; k <= samples; k++) {
        if (k == samples || y[k] != y[k - 1]) {
            if ((double)(k - from) >= threshold.shortest_run) {
                runs = reallocate(runs, found + 1, sizeof *runs);
                runs[found++].span = (look_span_t){from, k};
            }
            from = k;
        }
    }
    for (size_t i = 0; i < found; i++) {
        double share;
        const size_t pairs = share_around(look, runs, found, i, &share);
        runs[i].log_chance = 0.0;
        if ((double)pairs >= threshold.pairs_beside_run && noise > threshold.noise_of_runs * unit) {
            /* The difference of two normal values has the density 1 / (2 sigma sqrt pi) at 0. */
            const double p = fmax(share, fmin(1.0, unit / (2.0 * noise * sqrt(M_PI))));
            runs[i].log_chance = fmin(0.0, (double)(span_length(runs[i].span) - 1) * log10(p) + log10((double)samples));
        }
    }
    *count = found;
    return runs;
}
