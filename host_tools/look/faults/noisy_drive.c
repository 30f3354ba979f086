/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A drive column that is itself measured: its noise is not what the actuator got, and a model takes it for motion. It
 * counts from a third of the position's noise on, times the gain; and only if the position does not follow it: then it
 * is no noise. */
#include "look/fault.h"
#include "thresholds/thresholds.h"
#include <math.h>

/* Slope of the position's second differences on the drive's where the drive rests. */
static double follows_by(const look_t *look, size_t *used) {
    const double *y = look->recording->column[COLUMN_DISPLACEMENT], *u = look->recording->column[COLUMN_DRIVE];
    double product = 0.0, square = 0.0;
    *used = 0;
    for (size_t r = 0; r < look->drive.rests; r++) {
        for (size_t k = look->drive.rest[r].from + 1; k + 1 < look->drive.rest[r].to; k++) {
            const double du = u[k - 1] - 2.0 * u[k] + u[k + 1], dy = y[k - 1] - 2.0 * y[k] + y[k + 1];
            product += du * dy;
            square += du * du;
            (*used)++;
        }
    }
    return square > 0.0 ? product / square : 0.0;
}

static void find(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    for (size_t i = 0; i < count; i++) {
        const look_t *look = &looks[i];
        const double noise_v = look->drive.noise_v, gain = fabs(look->map.gain_um_per_v);
        size_t used;
        const double slope = follows_by(look, &used);
        if (!(noise_v > 0.0) || used < LOOK_LEAST_SAMPLES || slope > threshold.followed_noise * gain ||
            gain * noise_v < threshold.noise_of_noisy_drive * look->prediction.noise_um) {
            continue;
        }
        /* Noise beyond the resolution: the ratio of variances has a relative error of sqrt(2 / n). */
        const double expected = 0.29 * look->drive.step_v;
        const double z =
            (noise_v * noise_v / fmax(expected * expected, 1e-4 * noise_v * noise_v) - 1.0) / sqrt(2.0 / (double)used);
        fault_t *fault = fault_add(faults, kind, i, z, look_log_chance_normal(fmax(0.0, z), 1.0));
        if (fault != NULL) {
            fault_number(fault, "noise_v", "V", noise_v, noise_v / sqrt(2.0 * (double)used));
            fault_number(fault, "makes_um", "um", gain * noise_v, HUGE_VAL);
        }
    }
}

const fault_kind_t fault_noisy_drive = {
    .name = "noisy_drive",
    .order = 160,
    .text = "The drive column is a measurement with noise that the position does not follow.",
    .statistic = "variance of the drive's noise at rest beyond that of its resolution, in standard errors",
    .change =
        "Write the command into the column drive, and the measurement into the column voltage; or average the drive "
        "over passes.",
    .handling = FAULT_MODELLABLE,
    .find = find};
