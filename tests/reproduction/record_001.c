/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "record_001.h"
#include "twins/twin_001.h"
#include <gsl/gsl_math.h>
#include <stdio.h>

void seed_001_record(recording_t *recording, double frequency_hz, double amplitude_v, double seconds, uint64_t seed) {
    const size_t samples = (size_t)(seconds * TWIN_001_RATE_HZ);
    /* About one and a half seconds; the recording begins at phase 0. */
    const size_t before = (size_t)(ceil(1.5 * frequency_hz) / frequency_hz * TWIN_001_RATE_HZ);
    char name[40];
    twin_001_t twin;
    double position_um = 0.0;
    snprintf(name, sizeof name, "%g Hz, +-%.3g V", frequency_hz, amplitude_v);
    recording_create(recording, name, TWIN_001_RATE_HZ, samples);
    twin_001_open(&twin, seed);
    for (size_t i = 0; i < before + samples; i++) {
        const double k = (double)i - (double)before;
        const double drive_v = amplitude_v * sin(2.0 * M_PI * frequency_hz * k / TWIN_001_RATE_HZ);
        if (i >= before) {
            recording->column[COLUMN_DRIVE][i - before] = drive_v;
            recording->column[COLUMN_DISPLACEMENT][i - before] = position_um;
        }
        position_um = twin_001_step(&twin, drive_v);
    }
}
