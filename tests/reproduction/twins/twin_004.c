/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "twin_004.h"
#include "random.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>

enum { SUBSTEPS = 16, PLAYS = 200 };

/*
 * Elastic, plastic and viscous elements: a play operator behind a damper follows the classical one with a time
 * constant, viscous_s dz/dt = max(u - r - z, 0) + min(u + r - z, 0), so that while it slides it stays r + viscous_s
 * |dz/dt| behind.
 */
static const double viscous_s = 0.3925e-3;
static const double slope = 1.03;            /* um/V, of the drive itself */
static const double density = 0.4643;        /* um/V^2, of the play operators, at threshold 0 */
static const double density_decay_v = 2.905; /* falls to 1/e */
/* 0.1615 h / l^2 sqrt(E / rho) with h = 2 mm, l = 15 mm as reported, E = 60 GPa and rho = 7800 kg/m^3 as usual for PZT.
 */
static const double mode_hz = 3980.0, mode_damping = 0.02;
static const double sensor_hz = 5000.0;
static const double noise_um = 0.03, resolution_um = 0.01;

struct twin_004 {
    random_t noise;
    double play_v[PLAYS], weight[PLAYS];
    double follow; /* part of the way that a viscous play goes in a substep */
    double position_um, speed, sensed_um;
};

static double threshold(size_t i) {
    return TWIN_004_DRIVE_V * ((double)i + 0.5) / PLAYS;
}

twin_004_t *twin_004_open(uint64_t seed) {
    twin_004_t *twin = allocate(1, sizeof *twin);
    twin->noise.state = seed;
    twin->follow = -expm1(-1.0 / (viscous_s * SUBSTEPS * TWIN_004_RATE_HZ));
    for (size_t i = 0; i < PLAYS; i++) {
        twin->weight[i] = TWIN_004_DRIVE_V / PLAYS * density * exp(-threshold(i) / density_decay_v);
    }
    return twin;
}

double twin_004_sample(twin_004_t *twin, double drive_v) {
    const double dt = 1.0 / (SUBSTEPS * TWIN_004_RATE_HZ), omega = 2.0 * M_PI * mode_hz;
    const double measured =
        resolution_um * floor((twin->sensed_um + noise_um * random_normal(&twin->noise)) / resolution_um + 0.5);
    for (int step = 0; step < SUBSTEPS; step++) {
        double force = slope * drive_v;
        for (size_t i = 0; i < PLAYS; i++) {
            const double ahead = drive_v - twin->play_v[i], r = threshold(i);
            twin->play_v[i] += twin->follow * (fmax(ahead - r, 0.0) + fmin(ahead + r, 0.0));
            force += twin->weight[i] * twin->play_v[i];
        }
        twin->speed += dt * omega * (omega * (force - twin->position_um) - 2.0 * mode_damping * twin->speed);
        twin->position_um += dt * twin->speed;
        twin->sensed_um += -expm1(-2.0 * M_PI * sensor_hz * dt) * (twin->position_um - twin->sensed_um);
    }
    return measured;
}

void twin_004_record(recording_t *recording, double frequency_hz, double amplitude_v, unsigned periods, uint64_t seed) {
    const size_t samples = (size_t)(periods * TWIN_004_RATE_HZ / frequency_hz);
    twin_004_t *twin = twin_004_open(seed);
    char name[40];
    snprintf(name, sizeof name, "twin of 004, %g Hz", frequency_hz);
    recording_create(recording, name, TWIN_004_RATE_HZ, samples);
    for (size_t k = 0; k < samples; k++) {
        const double drive = amplitude_v * sin(2.0 * M_PI * frequency_hz * (double)k / TWIN_004_RATE_HZ);
        recording->column[COLUMN_DRIVE][k] = drive;
        recording->column[COLUMN_DISPLACEMENT][k] = twin_004_sample(twin, drive);
    }
    free(twin);
}
