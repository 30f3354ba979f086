/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "twin_003.h"
#include "random.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SUBSTEPS = 16, PLAYS = 300, CELLS = 12 };

/* The numbers that were chosen: a search (Nelder-Mead) for the smallest relative deviation of the nine ellipses. */
static const double threshold_step_v = 0.25; /* thresholds to 75 V */
static const double slope = 0.2964;          /* um/V, of the drive itself */
static const double density = 0.00876;       /* um/V^2, of the play operators, at threshold 0 */
static const double density_decay_v = 265.0; /* falls to 1/e */
static const double creep_per_decade = 0.044;
static const double fastest_cell_s = 1e-3; /* two cells a decade from here */
static const double lag_hz = 752.5, lag_damping = 0.6274;
static const double rest_um = 42.8; /* at the bias, coming from 0 V: table 1's y_c = 0.572 to 0.573 of 90 um */
static const double noise_um = 0.01;
static const double code = 1.0 / 65536.0;

struct twin_003 {
    random_t noise;
    double play_v[PLAYS], weight[PLAYS];
    double cell_um[CELLS], cell_rate[CELLS];
    double offset_um, position_um, speed;
};

static double hysteresis(twin_003_t *twin, double drive_v) {
    double sum = twin->offset_um + slope * drive_v;
    for (size_t i = 0; i < PLAYS; i++) {
        const double r = threshold_step_v * ((double)i + 0.5), low = drive_v - r, high = drive_v + r;
        const double play = twin->play_v[i] < low ? low : twin->play_v[i] > high ? high : twin->play_v[i];
        twin->play_v[i] = play;
        sum += twin->weight[i] * play;
    }
    return sum;
}

static double converted(double value, double range) {
    return range * code * fmin(65535.0, fmax(0.0, floor(value / (range * code) + 0.5)));
}

twin_003_t *twin_003_open(uint64_t seed) {
    twin_003_t *twin = allocate(1, sizeof *twin);
    twin->noise.state = seed;
    for (size_t i = 0; i < PLAYS; i++) {
        const double r = threshold_step_v * ((double)i + 0.5);
        twin->weight[i] = threshold_step_v * density * exp(-r / density_decay_v);
    }
    /* After long rest every cell has given its all: the offset brings that to rest_um. */
    twin->offset_um = rest_um / (1.0 + 0.5 * creep_per_decade * CELLS) - hysteresis(twin, TWIN_003_BIAS_V);
    for (size_t j = 0; j < CELLS; j++) {
        const double time_s = fastest_cell_s * pow(10.0, 0.5 * (double)j);
        twin->cell_rate[j] = 1.0 / (time_s * SUBSTEPS * TWIN_003_RATE_HZ);
        twin->cell_um[j] = hysteresis(twin, TWIN_003_BIAS_V);
    }
    twin->position_um = rest_um;
    return twin;
}

double twin_003_sample(twin_003_t *twin, double drive_v) {
    const double measured = converted(twin->position_um + noise_um * random_normal(&twin->noise), TWIN_003_RANGE_UM);
    const double omega = 2.0 * M_PI * lag_hz, dt = 1.0 / (SUBSTEPS * TWIN_003_RATE_HZ);
    const double elastic = hysteresis(twin, converted(drive_v, TWIN_003_DRIVE_V)); /* the drive is held */
    for (int step = 0; step < SUBSTEPS; step++) {
        double force = elastic;
        for (size_t j = 0; j < CELLS; j++) {
            force += 0.5 * creep_per_decade * twin->cell_um[j];
            twin->cell_um[j] += twin->cell_rate[j] * (elastic - twin->cell_um[j]);
        }
        twin->speed += dt * omega * (omega * (force - twin->position_um) - 2.0 * lag_damping * twin->speed);
        twin->position_um += dt * twin->speed;
    }
    return measured;
}

void twin_003_record(recording_t *recording, double frequency_hz, double amplitude_v, unsigned settle, unsigned periods,
                     uint64_t seed) {
    const size_t start = (size_t)(settle * TWIN_003_RATE_HZ / frequency_hz);
    const size_t samples = (size_t)(periods * TWIN_003_RATE_HZ / frequency_hz);
    twin_003_t *twin = twin_003_open(seed);
    char name[40];
    snprintf(name, sizeof name, "twin of 003, %g Hz", frequency_hz);
    recording_create(recording, name, TWIN_003_RATE_HZ, samples);
    for (size_t k = 0; k < start + samples; k++) {
        const double t = (double)k / TWIN_003_RATE_HZ;
        const double drive = TWIN_003_BIAS_V + amplitude_v * sin(2.0 * M_PI * frequency_hz * t);
        const double displacement = twin_003_sample(twin, drive);
        if (k >= start) {
            recording->column[COLUMN_DRIVE][k - start] = drive;
            recording->column[COLUMN_DISPLACEMENT][k - start] = displacement;
        }
    }
    free(twin);
}
