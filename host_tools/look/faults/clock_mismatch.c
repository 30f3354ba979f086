/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Two clocks: the lag of the position grows steadily and jumps back, over and over. A saw tooth of one sample beside
 * the columns of the reference (look/path/clocks.h) is that. Of one against the path alone (look/path/lags.h): what the
 * actuator does with a slow motion of the drive could look like that. So a tooth has to be longer than the drive's
 * slowest motion. Or the saw tooth explains most of the lag's changes and jumps by one sample, which no physics does.
 * In all cases it explains more than a wave does: the lag of a filter goes up and down with the frequency of a chirp.
 */
#include "look/fault.h"
#include "look/signal/drive_before.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static double changes_of_lag(const lags_t *lags) {
    double a = 0.0, b = 0.0, squares = 0.0;
    for (size_t j = 0; j < lags->count; j++) {
        a += lags->product[j];
        b += lags->square[j];
        squares += lags->square[j] > 0.0 ? lags->product[j] * lags->product[j] / lags->square[j] : 0.0;
    }
    return b > 0.0 ? squares - a * a / b : 0.0;
}

static bool is_one(const lag_course_t *saw) {
    return fabs(fabs(saw->size) - 1.0) < threshold.one_sample + threshold.deviations * saw->sigma;
}

/* Against the path alone, where the columns of the reference do not show it. */
static bool saw_against_path(const look_t *look, lag_course_t *saw) {
    const double rate_hz = look->recording->sample_rate_hz, changes = changes_of_lag(&look->lags);
    lags_saw(&look->lags, saw);
    if (!(saw->sigma > 0.0) || look->changes.shifts > 0 || !(changes > 0.0)) {
        return false;
    }
    const double slowest_hz = look->drive.period > 0.0 ? rate_hz / look->drive.period : look->drive.frequency_hz[0];
    const bool slow = threshold.slower_than_drive * saw->teeth_per_s < slowest_hz &&
                      saw->left < (1.0 - threshold.change_explains) * changes;
    const bool whole = saw->left < (1.0 - threshold.saw_explains) * changes && is_one(saw);
    /* One or two samples that were lost for good make a step, not a saw tooth. */
    lag_steps_t steps;
    lags_steps(&look->lags, look_log_chance_limit(), &steps);
    const bool stepped = steps.steps > 0 && steps.steps <= 2 && steps.left < saw->left;
    const double teeth = saw->teeth_per_s * (double)look->recording->samples / rate_hz;
    return (slow || whole) && !stepped && teeth >= threshold.least_teeth && saw->by_wave < 1.0;
}

static bool find_saw(const look_t *look, lag_course_t *saw) {
    *saw = look->changes.clocks;
    return saw->size != 0.0 || saw_against_path(look, saw);
}

static void find_in(const look_t *look, size_t index, const fault_kind_t *kind, fault_list_t *faults) {
    const double rate_hz = look->recording->sample_rate_hz;
    lag_course_t saw;
    if (!find_saw(look, &saw)) {
        return;
    }
    const bool one = is_one(&saw);
    fault_t *fault = fault_add(faults, kind, index, saw.size / saw.sigma, saw.log_chance);
    if (fault != NULL) {
        /* Between two jumps the lag grows by what the jump takes back. */
        const double jump = one ? copysign(1.0, saw.size) : saw.size, jump_sigma = one ? 0.0 : saw.sigma;
        const double duration = (double)look->recording->samples / rate_hz;
        const double rate_sigma = 2.0 * saw.sigma / fabs(saw.size) / duration; /* of the phase, at either end */
        fault_number(fault, "parts_per_million", "1", 1e6 * jump * saw.teeth_per_s / rate_hz,
                     1e6 * hypot(jump_sigma * saw.teeth_per_s, jump * rate_sigma) / rate_hz);
        fault_number(fault, "jump_samples", "1", -jump, jump_sigma);
        fault_number(fault, "jump_s", "s", -jump / rate_hz, jump_sigma / rate_hz);
        fault_number(fault, "between_jumps_s", "s", 1.0 / saw.teeth_per_s,
                     rate_sigma / saw.teeth_per_s / saw.teeth_per_s);
        for (size_t j = 1; j < look->lags.count; j++) {
            const double before = saw.teeth_per_s * look->lags.at_s[j - 1] + saw.phase;
            const double here = saw.teeth_per_s * look->lags.at_s[j] + saw.phase;
            if (round(here) > round(before)) {
                fault_span(fault, look->lags.from[j - 1], look->lags.from[j]);
            }
        }
    }
}

static void find(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    for (size_t i = 0; i < count; i++) {
        find_in(&looks[i], i, kind, faults);
    }
}

/* The drive of the instants at which the position was read. The readings stay: interpolation would take some of their
 * noise away, and so would look like a gain. */
static double undo(const fault_t *fault, const look_t *look, recording_t *recording) {
    lag_course_t saw;
    find_saw(look, &saw);
    (void)fault;
    const size_t n = recording->samples;
    double *u = recording->column[COLUMN_DRIVE], *old = allocate(n, sizeof *old);
    memcpy(old, u, n * sizeof *old);
    for (size_t k = 0; k < n; k++) {
        const double x = saw.teeth_per_s * (double)k / recording->sample_rate_hz + saw.phase;
        u[k] = drive_before(old, n, look->drive.between, k, saw.size * (x - round(x)));
    }
    free(old);
    return 0.0;
}

const fault_kind_t fault_clock_mismatch = {
    .name = "clock_mismatch",
    .order = 110,
    .text = "Drive and position run on two clocks: the lag grows steadily and jumps back, over and over.",
    .statistic = "size of the saw tooth in the lag over its standard error",
    .change =
        "Let one clock (one converter board, one trigger) sample both columns; or record the other clock's stamps "
        "and resample by them.",
    .handling = FAULT_MODELLABLE,
    .find = find,
    .undo = undo};
