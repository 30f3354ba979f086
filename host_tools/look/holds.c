/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/holds.h"
#include "look/signal/settling.h"
#include "numerics/autocorrelation.h"
#include "numerics/column_factor.h"
#include "numerics/reversals.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* FIRST_SAMPLES: of a hold, in which the step itself may be. MOST_DEAD: samples of a dead time that are waited for. */
enum { LEAST_SAMPLES = 32, FIRST_SAMPLES = 2, MOST_DEAD = 32 };

/* The position when the drive last turned round or stopped before the hold: a few readings around it. */
static double before_the_way(const recording_t *recording, const drive_look_t *drive, const reversals_t *turns,
                             size_t which) {
    const double *y = recording->column[COLUMN_DISPLACEMENT];
    const size_t hold = drive->rest[which].from;
    size_t at = which > 0 ? drive->rest[which - 1].to - 1 : 0;
    for (size_t i = 0; i < turns->count && turns->at[i] + 2 < hold; i++) {
        at = turns->at[i] > at ? turns->at[i] : at;
    }
    const size_t from = at > 2 ? at - 2 : 0;
    return look_quantile(y + from, at - from + 1, 0.5);
}

/* How all holds are looked at: what rings, what settles, and how many samples are left out for what settles. */
typedef struct {
    settling_t settling;
    size_t settled;
} manner_t;

static size_t skipped_of(const recording_t *recording, look_span_t rest, const manner_t *manner) {
    const double rate_hz = recording->sample_rate_hz, all_s = (double)span_length(rest) / rate_hz;
    const double skipped_s = fmin(threshold.settling_s, threshold.settling_part_of_hold * all_s);
    const size_t skipped = (size_t)fmax(2.0, ceil(skipped_s * rate_hz));
    return skipped > manner->settled ? skipped : manner->settled;
}

static bool long_enough(look_span_t rest, size_t skipped) {
    return span_length(rest) >= skipped + LEAST_SAMPLES &&
           log10((double)span_length(rest) / (double)skipped) >= threshold.least_decades;
}

static bool hold_counts(const recording_t *recording, const drive_look_t *drive, size_t which, const manner_t *manner) {
    return drive->rest[which].from > 0 &&
           long_enough(drive->rest[which], skipped_of(recording, drive->rest[which], manner));
}

enum { COLUMN_ONE, COLUMN_LOG, LINE_COLUMNS, MOST_COLUMNS = LINE_COLUMNS + 1 + SETTLING_COLUMNS };

/* Columns over logarithmic time, and of what rings or settles; behind the first `before` of them others have room. */
static size_t fill_columns(const recording_t *recording, look_span_t rest, const manner_t *manner, settling_pick_t pick,
                           size_t before, double *columns) {
    const size_t skipped = skipped_of(recording, rest, manner), count = span_length(rest) - skipped;
    for (size_t k = 0; k < count; k++) {
        columns[COLUMN_ONE * count + k] = 1.0;
        columns[COLUMN_LOG * count + k] = log10((double)(k + skipped) / recording->sample_rate_hz);
    }
    return before + settling_columns(&manner->settling, pick, count, columns + before * count);
}

static void point_at(const double *columns, size_t count, const double *column[MOST_COLUMNS]) {
    for (size_t i = 0; i < MOST_COLUMNS; i++) {
        column[i] = columns + i * count;
    }
}

/* Fits one hold. */
static bool look_at_hold(const recording_t *recording, look_span_t rest, const manner_t *manner, hold_t *hold) {
    const size_t skipped = skipped_of(recording, rest, manner), count = span_length(rest) - skipped;
    const double *y = recording->column[COLUMN_DISPLACEMENT] + rest.from + skipped, *column[MOST_COLUMNS];
    double *columns = allocate(MOST_COLUMNS * count, sizeof *columns), *left = allocate(count, sizeof *left);
    look_regression_t fit = {0}, bent = {0};
    point_at(columns, count, column);
    const size_t all = fill_columns(recording, rest, manner, SETTLING_RINGS, LINE_COLUMNS, columns);
    const bool good = look_regress(column, all, y, NULL, count, &fit);
    memcpy(left, y, count * sizeof *left);
    columns_add(column, all, fit.coefficient, -1.0, count, left);
    const size_t more = fill_columns(recording, rest, manner, SETTLING_RINGS, LINE_COLUMNS + 1, columns);
    const double middle = look_mean(columns + COLUMN_LOG * count, count);
    for (size_t k = 0; k < count; k++) {
        columns[LINE_COLUMNS * count + k] = pow(columns[COLUMN_LOG * count + k] - middle, 2.0);
    }
    const bool bends = look_regress(column, more, y, NULL, count, &bent);
    const residual_run_t run = {left, count};
    const double widen = good ? sqrt(autocorrelation_time(&run, 1)) : 1.0;
    hold->span = rest;
    hold->decades = log10((double)span_length(rest) / (double)skipped);
    hold->slope_um = fit.coefficient[COLUMN_LOG];
    hold->slope_sigma_um = fit.sigma[COLUMN_LOG] * widen;
    hold->begins_um = fit.coefficient[COLUMN_ONE] - hold->slope_um * log10(recording->sample_rate_hz);
    hold->bend_um = bent.coefficient[LINE_COLUMNS];
    hold->bend_sigma_um = bent.sigma[LINE_COLUMNS] * widen;
    free(columns);
    free(left);
    return good && bends;
}

/* Sum of squares that a straight line and what rings (or also what settles) leave of all holds; degrees of freedom. */
static double squares_left(const recording_t *recording, const drive_look_t *drive, const manner_t *manner,
                           settling_pick_t pick, double *freedom) {
    double sum = 0.0;
    *freedom = 0.0;
    for (size_t i = 0; i < drive->rests; i++) {
        if (hold_counts(recording, drive, i, manner)) {
            const look_span_t rest = drive->rest[i];
            const size_t skipped = skipped_of(recording, rest, manner), count = span_length(rest) - skipped;
            const double *y = recording->column[COLUMN_DISPLACEMENT] + rest.from + skipped, *column[MOST_COLUMNS];
            double *columns = allocate(MOST_COLUMNS * count, sizeof *columns);
            look_regression_t fit = {0};
            point_at(columns, count, column);
            const size_t all = fill_columns(recording, rest, manner, pick, LINE_COLUMNS, columns);
            if (look_regress(column, all, y, NULL, count, &fit)) {
                sum += pow(fit.rms, 2.0) * (double)(count - all);
                *freedom += (double)(count - all);
            }
            free(columns);
        }
    }
    return sum;
}

/* Whether the holds are straight lines over logarithmic time: exponentials beside explain less than most of what is
 * left. */
static bool are_straight(const recording_t *recording, const drive_look_t *drive, const manner_t *manner) {
    double of_lines, of_all;
    const double lines = squares_left(recording, drive, manner, SETTLING_RINGS, &of_lines);
    const double all = squares_left(recording, drive, manner, SETTLING_ALL, &of_all);
    return !(of_lines > of_all && of_all > 0.0) || all * of_lines > threshold.lag_leaves * lines * of_all;
}

/* Whether the first samples that are looked at are as near to their lines as the others: behind a dead time they are
 * not. */
static bool begin_straight(const recording_t *recording, const drive_look_t *drive, const manner_t *manner) {
    double first = 0.0, others = 0.0;
    size_t holds = 0, samples = 0;
    for (size_t i = 0; i < drive->rests; i++) {
        if (hold_counts(recording, drive, i, manner)) {
            const look_span_t rest = drive->rest[i];
            const size_t skipped = skipped_of(recording, rest, manner), count = span_length(rest) - skipped;
            const double *y = recording->column[COLUMN_DISPLACEMENT] + rest.from + skipped, *column[MOST_COLUMNS];
            double *columns = allocate(MOST_COLUMNS * count, sizeof *columns), *left = allocate(count, sizeof *left);
            double *later = allocate(count, sizeof *later);
            look_regression_t fit = {0};
            point_at(columns, count, column);
            const size_t all = fill_columns(recording, rest, manner, SETTLING_RINGS, LINE_COLUMNS, columns);
            for (size_t k = 1; k < count; k++) { /* the first one is to be said by the others */
                later[k] = 1.0;
            }
            if (look_regress(column, all, y, later, count, &fit)) {
                memcpy(left, y, count * sizeof *left);
                columns_add(column, all, fit.coefficient, -1.0, count, left);
                first += left[0] * left[0];
                others += pow(fit.rms, 2.0) * (double)count;
                holds++;
                samples += count;
            }
            free(columns);
            free(left);
            free(later);
        }
    }
    return holds == 0 || first * (double)samples <= pow(threshold.edge_of_noise, 2.0) * others * (double)holds;
}

static size_t samples_until_settled(const settling_term_t *term) {
    return FIRST_SAMPLES + (size_t)ceil(threshold.settled_after / term->decay);
}

/* Leaves out exponentials that go on for most of a hold over logarithmic time: they are how it creeps, or not. */
static void keep_lags(size_t typical, settling_t *settling) {
    size_t kept = 0;
    for (size_t i = 0; i < settling->count; i++) {
        const settling_term_t *t = &settling->term[i];
        if (t->turn > 0.0 || t->decay * (double)typical > threshold.lags_in_hold) {
            settling->term[kept++] = *t;
        }
    }
    settling->count = kept;
}

/* What rings is fitted with each hold. A dead time, and what settles, is waited for, the fastest first, until the rest
 * is straight; what does not leave enough of a hold then says nothing of creep. */
static void find_manner(const recording_t *recording, const drive_look_t *drive, manner_t *manner) {
    look_span_t *spans = allocate(drive->rests + 1, sizeof *spans);
    double *lengths = allocate(drive->rests + 1, sizeof *lengths);
    size_t count = 0;
    memset(manner, 0, sizeof *manner);
    for (size_t i = 0; i < drive->rests; i++) {
        if (hold_counts(recording, drive, i, manner)) {
            spans[count] = drive->rest[i];
            lengths[count] = (double)span_length(drive->rest[i]);
            spans[count++].from += FIRST_SAMPLES;
        }
    }
    settling_find(recording->column[COLUMN_DISPLACEMENT], spans, count, &manner->settling);
    if (count > 0) {
        keep_lags((size_t)look_quantile(lengths, count, 0.5), &manner->settling);
    }
    free(spans);
    free(lengths);
    for (size_t i = 0; i < manner->settling.count && !are_straight(recording, drive, manner); i++) {
        size_t next = 0;
        for (size_t l = 0; l < manner->settling.count; l++) {
            const size_t until = samples_until_settled(&manner->settling.term[l]);
            const bool later = !(manner->settling.term[l].turn > 0.0) && until > manner->settled;
            next = later && (next == 0 || until < next) ? until : next;
        }
        manner->settled = next > 0 ? next : recording->samples;
    }
    for (size_t i = 0; i < MOST_DEAD && !begin_straight(recording, drive, manner); i++) {
        manner->settled = (manner->settled > FIRST_SAMPLES ? manner->settled : FIRST_SAMPLES) + 1;
    }
}

void holds_look(const recording_t *recording, const drive_look_t *drive, holds_t *holds) {
    const double *u = recording->column[COLUMN_DRIVE], *y = recording->column[COLUMN_DISPLACEMENT];
    reversals_t turns;
    double stroke[2], weights = 0.0, sum = 0.0, scatter = 0.0;
    size_t used = 0;
    manner_t manner;
    memset(holds, 0, sizeof *holds);
    find_manner(recording, drive, &manner);
    values_range(y, recording->samples, stroke);
    reversals_find(u, recording->samples,
                   threshold.reversal * (drive->range_v[1] - drive->range_v[0]) +
                       2.0 * threshold.edge_of_noise * drive->noise_v,
                   &turns);
    holds->hold = allocate(drive->rests, sizeof *holds->hold);
    for (size_t i = 0; i < drive->rests; i++) {
        hold_t *hold = &holds->hold[holds->count];
        if (hold_counts(recording, drive, i, &manner) && look_at_hold(recording, drive->rest[i], &manner, hold)) {
            /* Where the line begins, and not the first reading: with a mode or a lag, that has hardly moved yet. */
            hold->before_um = hold->begins_um - before_the_way(recording, drive, &turns, i);
            holds->count++;
        }
    }
    for (size_t i = 0; i < holds->count; i++) {
        const hold_t *hold = &holds->hold[i];
        if (fabs(hold->before_um) > threshold.least_way_of_hold * (stroke[1] - stroke[0]) &&
            hold->slope_sigma_um > 0.0) {
            const double weight = pow(hold->before_um / hold->slope_sigma_um, 2.0);
            weights += weight;
            sum += weight * hold->slope_um / hold->before_um;
            used++;
        }
    }
    if (used > 0) {
        holds->creep = sum / weights;
        for (size_t i = 0; i < holds->count; i++) {
            const hold_t *hold = &holds->hold[i];
            if (fabs(hold->before_um) > threshold.least_way_of_hold * (stroke[1] - stroke[0]) &&
                hold->slope_sigma_um > 0.0) {
                scatter += pow((hold->slope_um - holds->creep * hold->before_um) / hold->slope_sigma_um, 2.0);
            }
        }
        holds->creep_sigma = sqrt(1.0 / weights * fmax(1.0, used > 1 ? scatter / (double)(used - 1) : 1.0));
    }
    reversals_free(&turns);
}

void holds_free(holds_t *holds) {
    free(holds->hold);
    memset(holds, 0, sizeof *holds);
}
