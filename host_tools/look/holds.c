/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/holds.h"
#include "numerics/autocorrelation.h"
#include "numerics/reversals.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_SAMPLES = 32 };

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

/* Fits one hold. false: too short. */
static bool look_at_hold(const recording_t *recording, look_span_t rest, hold_t *hold) {
    const double rate_hz = recording->sample_rate_hz, all_s = (double)span_length(rest) / rate_hz;
    const double skipped_s = fmin(threshold.settling_s, threshold.settling_part_of_hold * all_s);
    const size_t skipped = (size_t)fmax(2.0, ceil(skipped_s * rate_hz)), count = span_length(rest) - skipped;
    const double *y = recording->column[COLUMN_DISPLACEMENT] + rest.from + skipped;
    if (span_length(rest) < skipped + LEAST_SAMPLES) {
        return false;
    }
    double *columns = allocate(3 * count, sizeof *columns), *left = allocate(count, sizeof *left);
    double *weight = allocate(count, sizeof *weight);
    const double *const column[] = {columns, columns + count, columns + 2 * count};
    look_regression_t fit = {0}, bent = {0};
    for (size_t k = 0; k < count; k++) {
        columns[k] = 1.0;
        columns[count + k] = log10((double)(k + skipped) / rate_hz);
    }
    const double middle = look_mean(columns + count, count);
    for (size_t k = 0; k < count; k++) {
        columns[2 * count + k] = pow(columns[count + k] - middle, 2.0);
        weight[k] = 1.0;
    }
    bool good = look_regress(column, 3, y, NULL, count, &bent) && look_regress(column, 2, y, weight, count, &fit);
    for (size_t k = 0; good && k < count; k++) {
        left[k] = y[k] - fit.coefficient[0] - fit.coefficient[1] * columns[count + k];
    }
    const residual_run_t run = {left, count};
    const double widen = good ? sqrt(autocorrelation_time(&run, 1)) : 1.0;
    hold->span = rest;
    hold->decades = log10((double)span_length(rest) / (double)skipped);
    hold->slope_um = fit.coefficient[1];
    hold->slope_sigma_um = fit.sigma[1] * widen;
    hold->bend_um = bent.coefficient[2];
    hold->bend_sigma_um = bent.sigma[2] * widen;
    free(columns);
    free(left);
    free(weight);
    return good && hold->decades >= threshold.least_decades;
}

void holds_look(const recording_t *recording, const drive_look_t *drive, holds_t *holds) {
    const double *u = recording->column[COLUMN_DRIVE], *y = recording->column[COLUMN_DISPLACEMENT];
    reversals_t turns;
    double stroke[2], weights = 0.0, sum = 0.0, scatter = 0.0;
    size_t used = 0;
    memset(holds, 0, sizeof *holds);
    values_range(y, recording->samples, stroke);
    reversals_find(u, recording->samples,
                   threshold.reversal * (drive->range_v[1] - drive->range_v[0]) +
                       2.0 * threshold.edge_of_noise * drive->noise_v,
                   &turns);
    holds->hold = allocate(drive->rests, sizeof *holds->hold);
    for (size_t i = 0; i < drive->rests; i++) {
        hold_t *hold = &holds->hold[holds->count];
        if (drive->rest[i].from == 0 || !look_at_hold(recording, drive->rest[i], hold)) {
            continue;
        }
        const size_t start = drive->rest[i].from;
        hold->before_um =
            y[start + (start + 1 < drive->rest[i].to ? 1 : 0)] - before_the_way(recording, drive, &turns, i);
        holds->count++;
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
