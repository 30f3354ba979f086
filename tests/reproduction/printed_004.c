/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "printed_004.h"
#include "chain/catalogue.h"
#include "random.h"
#include "twins/twin_004.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>

enum { SUBSTEPS = 64 };
static const double noise_um = 0.03, resolution_um = 0.01;

const double printed_004_weight[PRINTED_004_OPERATORS + 1] = {0.8515, 0.6893,  0.01442, 0.2657, 0.0111, 0.1761,
                                                              0.0001, -0.0573, 0.0007,  -0.5,   0.8895};
const double printed_004_spacing_v = 0.42067, printed_004_beta_s = 4.1317e-4;

void printed_004_model(model_t *model, double rate_filter_s) {
    double threshold[PRINTED_004_OPERATORS];
    for (size_t i = 0; i < PRINTED_004_OPERATORS; i++) {
        threshold[i] = printed_004_spacing_v * (double)(i + 1);
    }
    model_create(model, TWIN_004_RATE_HZ);
    model_block_t *rate = model_append(model, &block_rate_dependent_hysteresis);
    model_set(rate, "beta_s", printed_004_beta_s);
    model_set(rate, "rate_filter_s", rate_filter_s);
    model_block_t *bank = model_append(model, &block_prandtl_ishlinskii);
    model_set_array(bank, "weights", PRINTED_004_OPERATORS + 1, printed_004_weight, NULL);
    model_set_array(bank, "thresholds_v", PRINTED_004_OPERATORS, threshold, NULL);
}

static double bank(double play_v[PRINTED_004_OPERATORS], double drive_v, double widening_v) {
    double sum = printed_004_weight[0] * drive_v;
    for (int i = 0; i < PRINTED_004_OPERATORS; i++) {
        const double r = printed_004_spacing_v * (i + 1) + widening_v;
        play_v[i] = fmax(drive_v - r, fmin(drive_v + r, play_v[i]));
        sum += printed_004_weight[i + 1] * play_v[i];
    }
    return sum;
}

void printed_004_record(recording_t *recording, double frequency_hz, printed_004_rate_t rate, double seconds,
                        uint64_t seed) {
    const double omega = 2.0 * M_PI * frequency_hz, step_s = 1.0 / (TWIN_004_RATE_HZ * SUBSTEPS);
    const long samples = lround(seconds * TWIN_004_RATE_HZ);
    const long settle = lround(TWIN_004_RATE_HZ / frequency_hz) * SUBSTEPS; /* a period brings every play to its loop */
    double play_v[PRINTED_004_OPERATORS] = {0.0};
    random_t random = {seed};
    char name[40];
    snprintf(name, sizeof name, "printed model of 004, %g Hz", frequency_hz);
    recording_create(recording, name, TWIN_004_RATE_HZ, (size_t)samples);
    for (long k = -settle; k < samples * SUBSTEPS; k++) {
        const double t = (double)k * step_s - rate.delay_s;
        const double widening_v = rate.beta_s * fabs(TWIN_004_DRIVE_V * omega * cos(omega * t));
        const double y = bank(play_v, TWIN_004_DRIVE_V * sin(omega * t), widening_v);
        if (k >= 0 && k % SUBSTEPS == 0) {
            const long i = k / SUBSTEPS;
            const double sensed = y + noise_um * random_normal(&random);
            recording->column[COLUMN_DRIVE][i] = TWIN_004_DRIVE_V * sin(omega * (double)i / TWIN_004_RATE_HZ);
            recording->column[COLUMN_DISPLACEMENT][i] = resolution_um * floor(sensed / resolution_um + 0.5);
        }
    }
}

double printed_004_width(double frequency_hz, printed_004_rate_t rate) {
    enum { PERIOD = 20000 };
    static const double step = 2.0 * M_PI / PERIOD;
    double play_v[PRINTED_004_OPERATORS] = {0.0}, *y = allocate(PERIOD, sizeof *y), width = 0.0;
    const int late = (int)lround(rate.delay_s * frequency_hz * PERIOD);
    for (int k = 0; k < 2 * PERIOD; k++) { /* the first period brings every play to its loop */
        const double widening_v = rate.beta_s * fabs(TWIN_004_DRIVE_V * 2.0 * M_PI * frequency_hz * cos(step * k));
        y[(k + late) % PERIOD] = bank(play_v, TWIN_004_DRIVE_V * sin(step * k), widening_v);
    }
    for (int k = 0; k < PERIOD; k++) { /* the drive is the same here and half a period less this later */
        width = fmax(width, y[(PERIOD + PERIOD / 2 - k) % PERIOD] - y[k]);
    }
    free(y);
    return width;
}
