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

enum { COLUMN_ONE, COLUMN_LOG, LINE_COLUMNS };

/* What a hold is fitted with beside a straight line over logarithmic time: what rings or settles, a bend. */
typedef struct {
    settling_pick_t pick;
    bool bent;
    size_t without_first; /* samples that have no say */
} shape_t;

enum { MOST_COLUMNS = LINE_COLUMNS + 1 + SETTLING_COLUMNS };

typedef struct {
    size_t count, columns;
    double *left; /* by the fit of each sample; to be freed */
    look_regression_t fit;
    bool good;
} hold_fit_t;

/* Columns over logarithmic time, and of what rings or settles. Returns how many. */
static size_t fill_columns(const shape_t *shape, const manner_t *manner, size_t skipped, double rate_hz, size_t count,
                           double *columns) {
    size_t made = LINE_COLUMNS;
    for (size_t k = 0; k < count; k++) {
        columns[COLUMN_ONE * count + k] = 1.0;
        columns[COLUMN_LOG * count + k] = log10((double)(k + skipped) / rate_hz);
    }
    if (shape->bent) {
        const double middle = look_mean(columns + COLUMN_LOG * count, count);
        for (size_t k = 0; k < count; k++) {
            columns[made * count + k] = pow(columns[COLUMN_LOG * count + k] - middle, 2.0);
        }
        made++;
    }
    return made + settling_columns(&manner->settling, shape->pick, count, columns + made * count);
}

static hold_fit_t fit_hold(const recording_t *recording, look_span_t rest, const manner_t *manner,
                           const shape_t *shape) {
    const size_t skipped = skipped_of(recording, rest, manner), count = span_length(rest) - skipped;
    const double *y = recording->column[COLUMN_DISPLACEMENT] + rest.from + skipped, *column[MOST_COLUMNS];
    double *columns = allocate(MOST_COLUMNS * count, sizeof *columns), *weight = allocate(count, sizeof *weight);
    hold_fit_t fit = {.count = count, .left = allocate(count, sizeof *fit.left)};
    fit.columns = fill_columns(shape, manner, skipped, recording->sample_rate_hz, count, columns);
    for (size_t i = 0; i < MOST_COLUMNS; i++) {
        column[i] = columns + i * count;
    }
    for (size_t k = 0; k < count; k++) {
        weight[k] = k < shape->without_first ? 0.0 : 1.0;
    }
    fit.good = look_regress(column, fit.columns, y, weight, count, &fit.fit);
    memcpy(fit.left, y, count * sizeof *fit.left);
    if (fit.good) {
        columns_add(column, fit.columns, fit.fit.coefficient, -1.0, count, fit.left);
    }
    free(columns);
    free(weight);
    return fit;
}

static bool look_at_hold(const recording_t *recording, look_span_t rest, const manner_t *manner, hold_t *hold) {
    hold_fit_t line = fit_hold(recording, rest, manner, &(shape_t){.pick = SETTLING_RINGS});
    hold_fit_t bent = fit_hold(recording, rest, manner, &(shape_t){.pick = SETTLING_RINGS, .bent = true});
    const residual_run_t run = {line.left, line.count};
    const double widen = line.good ? sqrt(autocorrelation_time(&run, 1)) : 1.0;
    hold->span = rest;
    hold->decades = log10((double)span_length(rest) / (double)skipped_of(recording, rest, manner));
    hold->slope_um = line.fit.coefficient[COLUMN_LOG];
    hold->slope_sigma_um = line.fit.sigma[COLUMN_LOG] * widen;
    hold->begins_um = line.fit.coefficient[COLUMN_ONE] - hold->slope_um * log10(recording->sample_rate_hz);
    hold->bend_um = bent.fit.coefficient[LINE_COLUMNS];
    hold->bend_sigma_um = bent.fit.sigma[LINE_COLUMNS] * widen;
    free(line.left);
    free(bent.left);
    return line.good && bent.good;
}

/* What a shape leaves of all holds together. */
typedef struct {
    double squares, freedom;
    double first_squares; /* of the first samples */
    size_t holds;
} left_t;

static left_t left_of_holds(const recording_t *recording, const drive_look_t *drive, const manner_t *manner,
                            const shape_t *shape) {
    left_t left = {0};
    for (size_t i = 0; i < drive->rests; i++) {
        if (hold_counts(recording, drive, i, manner)) {
            hold_fit_t fit = fit_hold(recording, drive->rest[i], manner, shape);
            if (fit.good) {
                const double freedom = (double)(fit.count - shape->without_first - fit.columns);
                left.squares += pow(fit.fit.rms, 2.0) * freedom;
                left.freedom += freedom;
                left.first_squares += fit.left[0] * fit.left[0];
                left.holds++;
            }
            free(fit.left);
        }
    }
    return left;
}

/* Whether the holds are straight lines over logarithmic time: exponentials beside explain less than most of what is
 * left. */
static bool are_straight(const recording_t *recording, const drive_look_t *drive, const manner_t *manner) {
    const left_t lines = left_of_holds(recording, drive, manner, &(shape_t){.pick = SETTLING_RINGS});
    const left_t all = left_of_holds(recording, drive, manner, &(shape_t){.pick = SETTLING_ALL});
    return !(lines.freedom > all.freedom && all.freedom > 0.0) ||
           all.squares * lines.freedom > threshold.lag_leaves * lines.squares * all.freedom;
}

/* Whether the first samples that are looked at are as near to their lines, as the others say them, as these are: behind
 * a dead time they are not. */
static bool begin_straight(const recording_t *recording, const drive_look_t *drive, const manner_t *manner) {
    const left_t left = left_of_holds(recording, drive, manner, &(shape_t){.pick = SETTLING_RINGS, .without_first = 1});
    return left.holds == 0 ||
           left.first_squares * left.freedom <= pow(threshold.edge_of_noise, 2.0) * left.squares * (double)left.holds;
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

/* Whether most of the way comes within the hold, as behind a lag that is no shorter: creep is a small part of it. */
static bool settles_within(const hold_t *hold, double before) {
    const double way_um = hold->begins_um + hold->slope_um * log10((double)span_length(hold->span)) - before;
    return hold->slope_um * hold->decades * way_um > threshold.lag_of_way * way_um * way_um;
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
            const double before = before_the_way(recording, drive, &turns, i);
            hold->before_um = hold->begins_um - before;
            holds->count += settles_within(hold, before) ? 0 : 1;
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
