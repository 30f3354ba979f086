/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/small_signal.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PERIOD = 4096 /* samples */, PASSES = 2, SINES = 40 };
static const double highest = 0.4, usual_part = 0.01, usual_v = 1.0;

small_signal_t small_signal_unset(void) {
    return (small_signal_t){(double)NAN, (double)NAN, (double)NAN};
}

bool small_signal_set(const small_signal_t *wish) {
    return isfinite(wish->bias_v) || isfinite(wish->amplitude_v) || isfinite(wish->sample_rate_hz);
}

/* The sum of sines over one period, with a peak of 1. */
static void make_period(double *value) {
    double peak = 0.0;
    size_t before = 0;
    memset(value, 0, PERIOD * sizeof *value);
    for (size_t i = 0; i < SINES; i++) {
        const size_t line = (size_t)lround(pow(highest * PERIOD, (double)i / (SINES - 1)));
        if (line == before) {
            continue;
        }
        before = line;
        const double phase = -M_PI * (double)i * (double)i / SINES;
        for (size_t k = 0; k < PERIOD; k++) {
            value[k] += cos(2.0 * M_PI * (double)(line * k % PERIOD) / PERIOD + phase);
        }
    }
    for (size_t k = 0; k < PERIOD; k++) {
        peak = fmax(peak, fabs(value[k]));
    }
    for (size_t k = 0; k < PERIOD; k++) {
        value[k] /= peak;
    }
}

/* Of what a model says far outside of what it was fitted to, nothing is known. */
static bool inside_range(const char *name, double bias, double amplitude, double low, double high, failure_t *failure) {
    const double beyond = MODEL_RANGE_MARGIN * (high - low);
    if (!(bias >= low - beyond && bias <= high + beyond)) {
        return fail(failure, "%s: a bias of %g V is outside of what the model was fitted to, %g to %g V", name, bias,
                    low, high);
    }
    return amplitude <= 0.5 * (high - low) + beyond ||
           fail(failure, "%s: an amplitude of %g V is more than half of what the model was fitted to, %g to %g V", name,
                amplitude, low, high);
}

bool small_signal(const model_t *model, const char *name, const small_signal_t *wish, recording_t *recording,
                  failure_t *failure) {
    double low = 0.0, high = 0.0, period[PERIOD];
    const double rate = isfinite(wish->sample_rate_hz) ? wish->sample_rate_hz : model->sample_rate_hz;
    if (model->fit != NULL) {
        json_unpack(json_object_get(model->fit, "drive_range_v"), "[F, F]", &low, &high);
    }
    const bool known = high > low;
    const double bias = isfinite(wish->bias_v) ? wish->bias_v : known ? 0.5 * (low + high) : 0.0;
    const double amplitude = isfinite(wish->amplitude_v) ? wish->amplitude_v
                             : known                     ? usual_part * (high - low)
                                                         : usual_v;
    if (!(rate > 0.0) || !(amplitude > 0.0)) {
        return fail(failure, "%s: %s has to be above 0", name, rate > 0.0 ? "the amplitude" : "the sample rate");
    }
    if (known && !inside_range(name, bias, amplitude, low, high, failure)) {
        return false;
    }
    /* A pass before them: until a hysteresis has been at both ends it is on its way there. */
    recording_create(recording, name, rate, (size_t)PERIOD * (1 + PASSES));
    make_period(period);
    for (size_t k = 0; k < recording->samples; k++) {
        recording->column[COLUMN_DRIVE][k] = bias + amplitude * period[k % PERIOD];
    }
    if (!chain_simulate(model, recording, 1, recording->column[COLUMN_DISPLACEMENT], failure)) {
        recording_free(recording);
        return false;
    }
    recording_keep(recording, PERIOD, (size_t)PERIOD * PASSES);
    return true;
}
