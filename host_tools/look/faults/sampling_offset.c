/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The position ahead of the drive. A position that lags may be physics (a delay, a low pass, hysteresis itself), so
 * only a lead is a fault. Its size is the lead against the reference's columns. The reference has to follow the
 * readings nearly to the noise, and the lead has to be a part of a sample and several standard errors. The drive
 * needs more than one tone: with one, lag and hysteresis are one number. Of a drive that is held the lag is not known
 * to half a sample. */
#include "look/fault.h"
#include "look/signal/drive_before.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool is_tone(const look_t *look) {
    return look->drive.kind == DRIVE_SINE || look->drive.kind == DRIVE_RESTS;
}

static void set_lag(fault_t *fault, const look_t *look, double samples, double sigma) {
    const double rate_hz = look->recording->sample_rate_hz;
    fault->numbers = 0;
    fault_number(fault, "late_s", "s", samples / rate_hz, sigma / rate_hz);
    fault_number(fault, "late_samples", "1", samples, sigma);
}

static void find(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    for (size_t i = 0; i < count; i++) {
        const look_t *look = &looks[i];
        const reference_t *r = &look->reference;
        const bool held = look->drive.between == BETWEEN_HELD || look->drive.between == BETWEEN_UNKNOWN;
        const double noise = fmax(look->prediction.noise_um, noise_known_um(&look->noise));
        if (is_tone(look) || look->changes.shifts > 0 || look->changes.clocks.size != 0.0 ||
            !(r->lag < -(held ? threshold.lead_held : threshold.lead)) ||
            !(r->lag < -threshold.lead_errors * r->lag_sigma) ||
            !(r->plays_left_um < threshold.lead_near_noise * noise)) {
            continue;
        }
        fault_t *fault =
            fault_add(faults, kind, i, r->lag / r->lag_sigma, look_log_chance_normal(r->lag / r->lag_sigma, 1.0));
        if (fault != NULL) {
            set_lag(fault, look, r->lag, r->lag_sigma);
        }
    }
}

/* The drive of the instants at which the position was read. What has no drive any more is masked. */
static double undo(const fault_t *fault, const look_t *look, recording_t *recording) {
    const double lead = -fault->number[1].value;
    const size_t n = recording->samples, gone = (size_t)fmin(ceil(fmax(lead, 0.0)), 0.5 * (double)n);
    double *u = recording->column[COLUMN_DRIVE], *old = allocate(n, sizeof *old);
    memcpy(old, u, n * sizeof *old);
    for (size_t k = 0; k < n; k++) {
        u[k] = drive_before(old, n, look->drive.between, k, -lead);
    }
    if (gone > 0) {
        recording_mask(recording, n - gone, n);
    }
    free(old);
    return 0.0;
}

/* The ruler's lag may be off by several times where it does not follow the loops: whether there is a lead, and how
 * large, is then a matter of how likely it makes the readings. */
static bool suspect(const look_t *look, double *size) {
    *size = look->reference.lag;
    return !is_tone(look) && look->changes.shifts == 0 && look->reference.lag < -threshold.lead_suspected;
}

static void resize(fault_t *fault, const look_t *look, double size) {
    set_lag(fault, look, size, HUGE_VAL);
}

const fault_kind_t fault_sampling_offset = {
    .name = "sampling_offset",
    .order = 120,
    .text = "The position is ahead of the drive, which no actuator is: the columns were not sampled at the same time.",
    .statistic = "lag behind the drive over its standard error",
    .change =
        "Sample both columns with one trigger, and write the drive value that was out at that time. Converters that "
        "are read in turn are a part of a sample apart: header key displacement_sampled_after_s, -late_s, says it.",
    .handling = FAULT_MODELLABLE,
    .find = find,
    .undo = undo,
    .suspect = suspect,
    .resize = resize};
