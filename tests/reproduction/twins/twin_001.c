/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "twin_001.h"
#include <math.h>
#include <string.h>

#define STEPS 8
static const double driver_cutoff_hz = 595.0;
static const double reversible = 0.8;       /* part of the stroke that follows the voltage at once */
static const double density_scale_v = 60.0; /* the density of the plays falls as exp(-r / scale) */
static const double play_cubic = 0.12;      /* how the curve behind a play saturates */
static const double stroke_um = 100.0;      /* at 75 V, if no play stood still */
static const double frequency_hz = 75.1, damping = 0.0076;
/* At 1000 um from the position in which they are least: part of the stiffness that is lost, and of critical damping
 * that is added. */
static const double softening = 0.05, friction = 0.05;
static const double bend_um = 300.0; /* that position is this far on the negative side */
static const double tilt = 0.3;      /* part of the reading at 1000 um */
static const double noise_um = 0.020, resolution_um = 0.020;
static const double pi = 3.14159265358979323846;

void twin_001_open(twin_001_t *twin, uint64_t seed) {
    memset(twin, 0, sizeof *twin);
    twin->random.state = seed;
}

/* Strain of the ceramic as the deflection it would give the tip at rest. */
static double strain(twin_001_t *twin) {
    const double u = twin->voltage_v;
    double sum = 0.0, weights = 0.0;
    for (int i = 0; i < TWIN_001_PLAYS; i++) {
        const double r = TWIN_001_RANGE_V * (i + 0.5) / TWIN_001_PLAYS, weight = exp(-r / density_scale_v);
        twin->play_v[i] = fmax(u - r, fmin(u + r, twin->play_v[i]));
        const double z = twin->play_v[i] / TWIN_001_RANGE_V;
        sum += weight * z * (1.0 - play_cubic * z * z);
        weights += weight;
    }
    return stroke_um * (reversible * u / TWIN_001_RANGE_V + (1.0 - reversible) * sum / weights);
}

static double acceleration(double force_um, double position_um, double rate_um_s) {
    const double omega = 2.0 * pi * frequency_hz, bent = (position_um + bend_um) * 1e-3;
    return omega * omega * (force_um - position_um * (1.0 - softening * bent * bent)) -
           2.0 * (damping + friction * bent * bent) * omega * rate_um_s;
}

/* Runge-Kutta over h seconds, the force going from force_um to next_um in a straight line. */
static void move(twin_001_t *twin, double next_um, double h) {
    const double middle = 0.5 * (twin->force_um + next_um), x = twin->position_um, v = twin->rate_um_s;
    const double a1 = acceleration(twin->force_um, x, v), v2 = v + 0.5 * h * a1;
    const double a2 = acceleration(middle, x + 0.5 * h * v, v2), v3 = v + 0.5 * h * a2;
    const double a3 = acceleration(middle, x + 0.5 * h * v2, v3), v4 = v + h * a3;
    const double a4 = acceleration(next_um, x + h * v3, v4);
    twin->position_um = x + h / 6.0 * (v + 2.0 * (v2 + v3) + v4);
    twin->rate_um_s = v + h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4);
    twin->force_um = next_um;
}

double twin_001_step(twin_001_t *twin, double drive_v) {
    const double h = 1.0 / (STEPS * TWIN_001_RATE_HZ), decay = exp(-2.0 * pi * driver_cutoff_hz * h);
    for (int step = 0; step < STEPS; step++) {
        twin->voltage_v = drive_v + decay * (twin->voltage_v - drive_v);
        move(twin, strain(twin), h);
    }
    const double y = twin->position_um;
    const double reading = y * (1.0 + tilt * y * 1e-3) + noise_um * random_normal(&twin->random);
    return resolution_um * floor(reading / resolution_um + 0.5);
}
