/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier.h"
#include "compile/compile.h"
#include <gsl/gsl_math.h>

static double reference(const sine_track_t *track, double rate_hz, double sample) {
    return track->offset_um + track->amplitude_um * sin(2.0 * M_PI * track->frequency_hz * sample / rate_hz);
}

bool amplifier_track(const hyst_parameters_t *image, const actuator_t *actuator, const sine_track_t *track,
                     recording_t *recording, failure_t *failure) {
    const double rate_hz = 1e-3 * image->sample_rate_mhz;
    const size_t settle = (size_t)(track->settle_s * rate_hz);
    hyst_compensator_t compensator;
    hyst_compensator_state_t state;
    size_t limited = 0;
    if (hyst_parameters_build(image, &compensator).error != HYST_PARAMETERS_OK) {
        return parameters_check(image, "image", failure);
    }
    hyst_compensator_reset(&compensator, &state);
    recording_create(recording, "track", rate_hz, track->samples);
    double *wanted = recording_add_column(recording, COLUMN_REFERENCE);
    for (size_t k = 0; k < settle + track->samples; k++) {
        const double ahead = reference(track, rate_hz, (double)(k + image->lookahead_samples));
        unsigned events;
        const hyst_q31_t drive =
            hyst_compensator_step(&compensator, &state, track->mode, position_from_micrometres(image, ahead), &events);
        const double drive_v = drive_to_volts(image, drive), displacement = actuator->sample(actuator->state, drive_v);
        if (k >= settle) {
            recording->column[COLUMN_DRIVE][k - settle] = drive_v;
            recording->column[COLUMN_DISPLACEMENT][k - settle] = displacement;
            wanted[k - settle] = reference(track, rate_hz, (double)k);
            limited += (events & (HYST_STEP_DRIVE_LIMITED | HYST_STEP_UNREACHABLE)) != 0 ? 1 : 0;
        }
    }
    if (limited > 0) {
        recording_free(recording);
        return fail(failure, "%zu of %zu samples of a %g um sine of %g Hz were beyond the drive", limited,
                    track->samples, track->amplitude_um, track->frequency_hz);
    }
    return true;
}

tracking_error_t tracking_error(const recording_t *recording, double range_um) {
    const double *displacement = recording->column[COLUMN_DISPLACEMENT], *wanted = recording->column[COLUMN_REFERENCE];
    const double n = (double)recording->samples;
    double mean = 0.0, squares = 0.0, largest = 0.0;
    for (size_t k = 0; k < recording->samples; k++) {
        mean += (displacement[k] - wanted[k]) / n;
    }
    for (size_t k = 0; k < recording->samples; k++) {
        const double error = displacement[k] - wanted[k] - mean;
        squares += error * error / n;
        largest = fmax(largest, fabs(error));
    }
    return (tracking_error_t){100.0 * largest / range_um, 100.0 * sqrt(squares) / range_um};
}
