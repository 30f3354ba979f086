/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "twin_000.h"
#include <gsl/gsl_math.h>
#include <math.h>

enum { SUBSTEPS = 16 };                  /* a sample */
static const double largest_play_v = 60; /* half of the 120 V that the stack is made for */

const twin_000_numbers_t twin_000_actuator = {.cutoff_hz = 565.0,
                                              .rise_v_per_s = 23640.0,
                                              .fall_v_per_s = 22460.0,
                                              .charge_per_n = 0.0210,
                                              .linear_um_per_v = 0.1909,
                                              .quadratic_um_per_v2 = -0.000121,
                                              .density_um_per_v2 = 0.0118,
                                              .scale_v = 9.9,
                                              .mode_hz = 6000.0,
                                              .damping_ratio = 0.05,
                                              .stiffness_per_n = 0.003,
                                              .noise_um = 7.5e-4};

void twin_000_open(twin_000_t *twin, const twin_000_numbers_t *numbers, double sample_rate_hz, double preload_n,
                   uint64_t seed) {
    const double width = largest_play_v / TWIN_000_PLAYS;
    *twin = (twin_000_t){
        .numbers = *numbers, .sample_s = 1.0 / sample_rate_hz, .preload_n = preload_n, .random = {.state = seed}};
    for (size_t i = 0; i < TWIN_000_PLAYS; i++) {
        twin->threshold_v[i] = ((double)i + 0.5) * width;
        twin->weight[i] = width * numbers->density_um_per_v2 * exp(-twin->threshold_v[i] / numbers->scale_v);
    }
}

static double ceramic(twin_000_t *twin) {
    const double v = twin->voltage_v;
    double sum = (twin->numbers.linear_um_per_v + twin->numbers.quadratic_um_per_v2 * v) * v;
    for (size_t i = 0; i < TWIN_000_PLAYS; i++) {
        if (twin->play_v[i] < v - twin->threshold_v[i]) {
            twin->play_v[i] = v - twin->threshold_v[i];
        } else if (twin->play_v[i] > v + twin->threshold_v[i]) {
            twin->play_v[i] = v + twin->threshold_v[i];
        }
        sum += twin->weight[i] * twin->play_v[i];
    }
    return sum;
}

double twin_000_step(twin_000_t *twin, double drive_v) {
    const twin_000_numbers_t *n = &twin->numbers;
    const double step_s = twin->sample_s / SUBSTEPS, omega = 2.0 * M_PI * n->mode_hz;
    const double charge = 1.0 + n->charge_per_n * twin->preload_n, spring = n->stiffness_per_n * twin->preload_n;
    for (int i = 0; i < SUBSTEPS; i++) {
        const double drive = twin->drive_v + (drive_v - twin->drive_v) * (i + 0.5) / SUBSTEPS;
        const double wanted = 2.0 * M_PI * n->cutoff_hz * (drive - twin->voltage_v);
        double force;
        twin->voltage_v += step_s / charge * fmin(fmax(wanted, -n->fall_v_per_s), n->rise_v_per_s);
        force = ceramic(twin) - (1.0 + spring) * twin->position_um;
        twin->rate_um_per_s += step_s * (omega * omega * force - 2.0 * n->damping_ratio * omega * twin->rate_um_per_s);
        twin->position_um += step_s * twin->rate_um_per_s;
    }
    twin->drive_v = drive_v;
    return twin->position_um;
}

double twin_000_measure(twin_000_t *twin, double position_um) {
    return position_um + twin->numbers.noise_um * random_normal(&twin->random);
}
