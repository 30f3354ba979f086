/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Two clocks: the lag of the position grows steadily and jumps back, over and over. A saw tooth of one sample beside
 * the columns of the reference (look/path/clocks.h) is that. Of one against the path alone (look/path/lags.h): what the
 * actuator does with a slow motion of the drive could look like that. So a tooth has to be longer than the drive's
 * slowest motion. Or the saw tooth explains most of the lag's changes and jumps by one sample, which no physics does.
 * In all cases it explains more than a wave does: the lag of a filter goes up and down with the frequency of a chirp.
 *
 * A row that takes the other clock's latest value has a lag from 0 to one jump; one that takes the nearest value, from
 * minus to plus half of that. In the mean these are lags that an amplifier could have: which it is say the readings.
 */
#include "look/fault.h"
#include "look/signal/drive_before.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Its numbers. */
enum { JUMP_SAMPLES = 1, NUMBERS_LOOKED_AT = 4, MEAN_LAG_SAMPLES = NUMBERS_LOOKED_AT };

static double changes_of_lag(const lags_t *lags) {
    double a = 0.0, b = 0.0, squares = 0.0;
    for (size_t j = 0; j < lags->count; j++) {
        a += lags->product[j];
        b += lags->square[j];
        squares += lags->square[j] > 0.0 ? lags->product[j] * lags->product[j] / lags->square[j] : 0.0;
    }
    return b > 0.0 ? squares - a * a / b : 0.0;
}

/* What is lost or repeated over and over is a whole number of samples; 0: it is no such number. */
static double whole_samples(const lag_course_t *saw) {
    const double whole = fmax(round(fabs(saw->size)), 1.0);
    return fabs(fabs(saw->size) - whole) < threshold.one_sample + threshold.deviations * saw->sigma ? whole : 0.0;
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
    const bool whole = saw->left < (1.0 - threshold.saw_explains) * changes && whole_samples(saw) == 1.0;
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
    const double whole = whole_samples(&saw);
    fault_t *fault = fault_add(faults, kind, index, saw.size / saw.sigma, saw.log_chance);
    if (fault != NULL) {
        /* Between two jumps the lag grows by what the jump takes back. */
        const double jump = whole > 0.0 ? copysign(whole, saw.size) : saw.size;
        const double jump_sigma = whole > 0.0 ? 0.0 : saw.sigma;
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

/* Which column has the latest value of the other clock: neither, the position, the drive. */
static size_t choices(const fault_t *fault, double size[FAULT_MOST_CHOICES]) {
    const double half_a_jump = 0.5 * fabs(fault->number[JUMP_SAMPLES].value);
    size[0] = 0.0;
    size[1] = half_a_jump;
    size[2] = -half_a_jump;
    return 3;
}

static void resize(fault_t *fault, const look_t *look, double size) {
    (void)look;
    fault->numbers = NUMBERS_LOOKED_AT;
    fault_number(fault, "mean_lag_samples", "1", size, HUGE_VAL);
}

/* The drive of the instants at which the position was read. The readings stay: interpolation would take some of their
 * noise away, and so would look like a gain. When the lag jumps is known to some samples, and these are left out. */
static double undo(const fault_t *fault, const look_t *look, recording_t *recording) {
    lag_course_t saw;
    find_saw(look, &saw);
    const double mean_lag = fault->numbers > MEAN_LAG_SAMPLES ? fault->number[MEAN_LAG_SAMPLES].value : 0.0;
    const size_t n = recording->samples;
    double *u = recording->column[COLUMN_DRIVE], *old = allocate(n, sizeof *old);
    memcpy(old, u, n * sizeof *old);
    for (size_t k = 0; k < n; k++) {
        const double x = saw.teeth_per_s * (double)k / recording->sample_rate_hz + saw.phase;
        u[k] =
            drive_before(old, n, look->drive.between, k, mean_lag - fault->number[JUMP_SAMPLES].value * (x - round(x)));
    }
    for (size_t i = 0; i < fault->spans; i++) {
        recording_mask(recording, fault->span[i].from, fault->span[i].to);
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
    .undo = undo,
    .resize = resize,
    .choices = choices};
