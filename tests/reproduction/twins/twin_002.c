/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "twin_002.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

enum { SUBSTEPS = 8 }; /* a sample */
static const double most_v = 100.0;

const twin_002_numbers_t twin_002_actuator = {.cutoff_hz = 422.0,
                                              .linear_um_per_v = 0.28,
                                              .quadratic_um_per_v2 = -0.00066,
                                              .density_um_per_v2 = 0.00421,
                                              .scale_v = 33.2,
                                              .part = {0.0142, 0.0173, 0.0285},
                                              .tau_s = {1.6, 0.16, 0.016},
                                              .noise_um = 1e-4,
                                              .step_um = 1e-4};

/* G of the header, in closed form. */
static double half_branch(const twin_002_numbers_t *numbers, double x) {
    const double s = numbers->scale_v;
    return numbers->density_um_per_v2 * s * (x * atan(x / s) - 0.5 * s * log1p(x * x / (s * s)));
}

/* The branches leave turning points upwards (from even ones) and downwards (from odd ones) in turn. */
static void follow(twin_002_t *twin, double v) {
    for (;;) {
        const size_t last = twin->turns - 1;
        const bool upwards = last % 2 == 0;
        const bool turns_round = upwards ? v < twin->followed_v : v > twin->followed_v;
        if (turns_round) {
            if (twin->turns == TWIN_002_TURNING_POINTS) {
                fputs("twin_002: more unforgotten turning points than there is room for\n", stderr);
                exit(EXIT_FAILURE);
            }
            twin->turn_v[twin->turns] = twin->followed_v;
            twin->turn_h[twin->turns++] = twin->h;
        } else if (twin->turns > 2 && (upwards ? v >= twin->turn_v[last - 1] : v <= twin->turn_v[last - 1])) {
            twin->followed_v = twin->turn_v[last - 1];
            twin->h = twin->turn_h[last - 1];
            twin->turns -= 2;
        } else {
            const double change = 2.0 * half_branch(&twin->numbers, 0.5 * fabs(v - twin->turn_v[last]));
            twin->followed_v = v;
            twin->h = twin->turn_h[last] + (upwards ? change : -change);
            return;
        }
    }
}

void twin_002_open(twin_002_t *twin, const twin_002_numbers_t *numbers, double sample_rate_hz, uint64_t seed) {
    *twin = (twin_002_t){.numbers = *numbers, .sample_s = 1.0 / sample_rate_hz, .random = {.state = seed}, .turns = 1};
}

/* Where a first-order lag is after step_s, while its input goes in a straight line. Exact. */
static double lag(double output, double from, double to, double tau_s, double step_s) {
    const double behind = tau_s * (to - from) / step_s; /* of a ramp that lasts */
    return to - behind + (output - from + behind) * exp(-step_s / tau_s);
}

double twin_002_step(twin_002_t *twin, double drive_v) {
    const twin_002_numbers_t *n = &twin->numbers;
    const double step_s = twin->sample_s / SUBSTEPS, start_v = twin->drive_v;
    for (int i = 1; i <= SUBSTEPS; i++) {
        const double next_v = start_v + (drive_v - start_v) * i / SUBSTEPS, before_um = twin->instant_um;
        twin->voltage_v = lag(twin->voltage_v, fmax(0.0, fmin(most_v, twin->drive_v)), fmax(0.0, fmin(most_v, next_v)),
                              1.0 / (2.0 * M_PI * n->cutoff_hz), step_s);
        twin->drive_v = next_v;
        follow(twin, twin->voltage_v);
        twin->instant_um = (n->linear_um_per_v + n->quadratic_um_per_v2 * twin->voltage_v) * twin->voltage_v + twin->h;
        for (size_t j = 0; j < TWIN_002_RELAXATIONS; j++) {
            twin->relaxed_um[j] = lag(twin->relaxed_um[j], before_um, twin->instant_um, n->tau_s[j], step_s);
        }
    }
    double position_um = twin->instant_um;
    for (size_t j = 0; j < TWIN_002_RELAXATIONS; j++) {
        position_um += n->part[j] * (twin->relaxed_um[j] - twin->instant_um);
    }
    return position_um;
}

double twin_002_measure(twin_002_t *twin, double position_um) {
    const double step = twin->numbers.step_um;
    return step * floor((position_um + twin->numbers.noise_um * random_normal(&twin->random)) / step + 0.5);
}

static void run_period(twin_002_t *twin, const double *drive_v, size_t samples) {
    for (size_t k = 0; k < samples; k++) {
        twin_002_step(twin, drive_v[k]);
    }
}

void twin_002_repeat(twin_002_t *twin, const double *drive_v, size_t samples) {
    const double period_s = (double)samples * twin->sample_s;
    run_period(twin, drive_v, samples); /* amplifier and turning points */
    run_period(twin, drive_v, samples);
    for (size_t j = 0; j < TWIN_002_RELAXATIONS; j++) {
        twin->relaxed_um[j] = 0.0;
    }
    run_period(twin, drive_v, samples);
    /* A period takes r to r exp(-T / tau) + what is there now, and must take it to itself. */
    for (size_t j = 0; j < TWIN_002_RELAXATIONS; j++) {
        twin->relaxed_um[j] /= -expm1(-period_s / twin->numbers.tau_s[j]);
    }
}
