/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Candidates are the maxima of the drive's autocovariance; each is refined to the least difference of two passes, and
 * counts where passes follow each other. */
#include "look/signal/period.h"
#include "base/failure.h"
#include "numerics/between.h"
#include "recording/recording.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_PERIOD = 8, MOST_CANDIDATES = 24, REFINEMENTS = 32, WIDER = 8 };

/* The place of the least difference between the passes near a period. */
static double refined(const double *u, size_t samples, look_span_t span, double period) {
    for (size_t i = 0; i < REFINEMENTS; i++) {
        double product = 0.0, square = 0.0;
        for (size_t k = span.from; (double)k + period + 1.0 < (double)span.to; k++) {
            const double at = (double)k + period;
            const double slope = 0.5 * (value_between(u, samples, fmin(at + 1.0, (double)samples - 1.0)) -
                                        value_between(u, samples, at - 1.0));
            const double difference = u[k] - value_between(u, samples, at);
            if (fabs(difference) < fabs(slope) * 2.0 + 1e-300) { /* elsewhere it is another path */
                product += difference * slope;
                square += slope * slope;
            }
        }
        if (!(square > 0.0) || fabs(product) < 1e-9 * square) {
            break;
        }
        period += fmax(-0.5, fmin(0.5, product / square));
    }
    return fabs(period - round(period)) < threshold.whole_period ? round(period) : period;
}

/* So much may two passes differ. */
static double same_within(const drive_look_t *drive) {
    return threshold.same_path * (drive->range_v[1] - drive->range_v[0]) + threshold.noise_of_two * drive->noise_v +
           drive->step_v;
}

/* The longest stretch in which each value comes again after a period: [from, to) with the last pass. */
static look_span_t longest_run(const double *u, const drive_look_t *drive, look_span_t all, double period,
                               double place_error) {
    const double range_v = drive->range_v[1] - drive->range_v[0], within = same_within(drive);
    const bool between = period != round(period) || place_error > threshold.refined_place;
    look_span_t best = {all.from, all.from};
    size_t from = all.from;
    for (size_t k = all.from;; k++) {
        const double at = (double)k + period;
        const bool over = at > (double)all.to - 1.0;
        bool same = false;
        if (!over) {
            const double way = k > all.from && between ? fmax(fabs(u[k] - u[k - 1]), fabs(u[k + 1] - u[k])) : 0.0;
            same = fabs(u[k] - value_between(u, all.to, at)) <=
                   within + place_error * way + (way > threshold.path_jumps * range_v ? way : 0.0);
        }
        if (!same) {
            if (k > from && k - from > span_length(best)) {
                best = (look_span_t){from, k};
            }
            from = k + 1;
        }
        if (over) {
            break;
        }
    }
    if (span_length(best) > 0) {
        best.to = (size_t)fmin((double)all.to, (double)best.to + period);
    }
    return best;
}

static bool reach_as_far(const double *u, const drive_look_t *drive, size_t one, size_t other, double period) {
    const size_t pass = (size_t)ceil(period);
    double ends[2], others[2];
    values_range(u + one, pass, ends);
    values_range(u + other, pass, others);
    return fabs(ends[0] - others[0]) <= same_within(drive) && fabs(ends[1] - others[1]) <= same_within(drive);
}

/* A drive that swells or dies away slowly is in each pass almost what it was in the one before. Its passes are one path
 * from the first one on that reaches as far as the last; if most of them do not, none are. */
static look_span_t passes_that_reach_as_far(const double *u, const drive_look_t *drive, look_span_t span,
                                            double period) {
    const size_t passes = (size_t)((double)span_length(span) / period), last = span.to - (size_t)ceil(period);
    for (size_t pass = 0; (double)(passes - pass) > threshold.most_of_recording * (double)passes; pass++) {
        const size_t from = span.from + (size_t)((double)pass * period);
        if (reach_as_far(u, drive, from, last, period)) {
            return (look_span_t){from, span.to};
        }
    }
    return (look_span_t){span.from, span.from};
}

/* Whether a shorter stretch than a period holds all of the range in it would be a rest that is taken for a path: the
 * drive moves by a good part of its range in each pass. */
static bool moves(const double *u, const drive_look_t *drive, look_span_t span) {
    double range[2];
    values_range(u + span.from, span_length(span), range);
    return range[1] - range[0] > threshold.path_moves * (drive->range_v[1] - drive->range_v[0]);
}

static double lines_of_period(const double *u, look_span_t span, double period, size_t samples) {
    const size_t length = look_smooth_length((size_t)fmin(4096.0, fmax(64.0, ceil(period))));
    double *value = allocate(length, sizeof *value), *spectrum = allocate(length + 2, sizeof *spectrum);
    double sum = 0.0, squares = 0.0;
    for (size_t k = 0; k < length; k++) {
        value[k] = value_between(u, samples, (double)span.from + period * (double)k / (double)length);
    }
    look_transform(value, length, spectrum);
    for (size_t h = 1; h <= length / 2; h++) {
        const double power = spectrum[2 * h] * spectrum[2 * h] + spectrum[2 * h + 1] * spectrum[2 * h + 1];
        sum += power;
        squares += power * power;
    }
    free(value);
    free(spectrum);
    return squares > 0.0 ? sum * sum / squares : 0.0;
}

static void take_if_better(const double *u, size_t samples, look_span_t all, double period, drive_look_t *drive) {
    look_span_t first = longest_run(u, drive, all, period, threshold.first_place), span;
    /* Where the drive swells, the autocovariance is largest some samples beside the period. */
    if ((double)span_length(first) < threshold.two_passes_first * period) {
        first = longest_run(u, drive, all, period, WIDER * threshold.first_place);
    }
    if ((double)span_length(first) < threshold.two_passes_first * period || !moves(u, drive, first)) {
        return;
    }
    period = refined(u, samples, first, period);
    span = longest_run(u, drive, all, period, threshold.refined_place);
    if ((double)span_length(span) >= threshold.two_passes * period) {
        span = passes_that_reach_as_far(u, drive, span, period);
    }
    /* A longer period has to repeat more than the shorter one: multiples of a period are periods, too. */
    if ((double)span_length(span) >= threshold.two_passes * period && moves(u, drive, span) &&
        (double)span_length(span) > threshold.repeats_more * (double)span_length(drive->repeat)) {
        drive->period = period;
        drive->repeat = span;
    }
}

/* Each sum over the power of the two stretches that it multiplies: at a period it is what it is at lag 0, wherever the
 * recording ends (McLeod and Wyvill 2005). Over the number of products alone, a part of a period at the end would move
 * the maximum. */
static void normalise(const double *centred, size_t count, double *sums) {
    double all = 0.0;
    for (size_t k = 0; k < count; k++) {
        all += centred[k] * centred[k];
    }
    double without_end = all, without_begin = all;
    for (size_t lag = 1; lag < count; lag++) {
        without_end -= centred[count - lag] * centred[count - lag];
        without_begin -= centred[lag - 1] * centred[lag - 1];
        const double both = without_end + without_begin;
        sums[lag] = both > 1e-9 * all ? sums[lag] * 2.0 * all / both : 0.0;
    }
}

void period_find(const double *u, size_t samples, drive_look_t *drive) {
    look_span_t all = {0, samples};
    double *centred, *sums, mean;
    size_t tried = 0;
    if (drive->rests > 0 && drive->rest[0].from == 0) {
        all.from = drive->rest[0].to;
    }
    if (drive->rests > 0 && drive->rest[drive->rests - 1].to == samples) {
        all.to = drive->rest[drive->rests - 1].from;
    }
    drive->period = drive->harmonics = 0.0;
    drive->repeat = (look_span_t){0, 0};
    if (all.to <= all.from + 4 * LEAST_PERIOD) {
        return;
    }
    const size_t count = all.to - all.from;
    centred = allocate(count, sizeof *centred);
    sums = allocate(count, sizeof *sums);
    mean = look_mean(u + all.from, count);
    for (size_t k = 0; k < count; k++) {
        centred[k] = u[all.from + k] - mean;
    }
    look_autocovariance(centred, count, sums);
    normalise(centred, count, sums);
    for (size_t lag = LEAST_PERIOD; 2 * lag <= count + count / 20 && lag + 1 < count && tried < MOST_CANDIDATES;
         lag++) {
        if (sums[lag] >= sums[lag - 1] && sums[lag] > sums[lag + 1] &&
            sums[lag] > threshold.period_correlation * sums[0]) {
            const double curve = sums[lag - 1] - 2.0 * sums[lag] + sums[lag + 1];
            const double shift = curve < 0.0 ? 0.5 * (sums[lag - 1] - sums[lag + 1]) / curve : 0.0;
            tried++;
            if (drive->period == 0.0 || (double)lag > threshold.longer_period * drive->period) {
                take_if_better(u, samples, all, (double)lag + shift, drive);
            }
        }
    }
    if (drive->period > 0.0) {
        drive->harmonics = lines_of_period(u, drive->repeat, drive->period, samples);
    }
    free(centred);
    free(sums);
}
