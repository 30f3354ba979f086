/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "campaign_000.h"
#include "chain/chain.h"
#include "numerics/moving_average.h"
#include "twins/twin_000.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>

static const double all_frequencies[CAMPAIGN_FREQUENCIES] = {10.0, 25.0, 50.0, 100.0, 125.0, 200.0};
static const double voltages[CAMPAIGN_VOLTAGES] = {40.0, 80.0};
static const double preloads[CAMPAIGN_PRELOADS] = {0.0, 4.0, 8.0, 12.0};

run_t *campaign_run(campaign_t *campaign, size_t preload, size_t voltage, size_t frequency) {
    return &campaign->run[(preload * CAMPAIGN_VOLTAGES + voltage) * campaign->frequencies + frequency];
}

static void measure_loop(run_t *run) {
    const size_t n = run->period;
    const double *y = run->recording.column[COLUMN_DISPLACEMENT] + run->recording.samples - n;
    double low = y[0], high = y[0], mean = 0.0, even = 0.0;
    for (size_t k = 0; k < n; k++) {
        low = fmin(low, y[k]);
        high = fmax(high, y[k]);
        mean += y[k] / (double)n;
    }
    for (size_t k = 0; k < n; k++) {
        even += pow(0.5 * (y[k] + y[(k + n / 2) % n]) - mean, 2.0) / (double)n;
        run->width_um = fmax(run->width_um, fabs(y[(n - k) % n] - y[k])); /* the drive is even about its first sample */
    }
    run->stroke_um = high - low;
    run->asymmetry_percent = 100.0 * sqrt(even) / run->stroke_um;
}

void campaign_record(run_t *run, uint64_t seed) {
    const size_t n = (size_t)(CAMPAIGN_000_RATE_HZ / run->frequency_hz + 0.5);
    const size_t periods = n >= 400 ? 5 : 2000 / n; /* a tenth of a second at least */
    char text[60];
    twin_000_t twin;
    run->period = n;
    snprintf(text, sizeof text, "%g V, %g Hz, %g N", run->volts, run->frequency_hz, run->preload_n);
    recording_create(&run->recording, text, CAMPAIGN_000_RATE_HZ, periods * n);
    snprintf(text, sizeof text, "%g", run->preload_n);
    recording_set_key(&run->recording, "preload_n", text);
    twin_000_open(&twin, &twin_000_actuator, CAMPAIGN_000_RATE_HZ, run->preload_n, seed);
    for (size_t k = 0; k < periods * n; k++) {
        const double drive = 0.5 * run->volts * (1.0 - cos(2.0 * M_PI * (double)(k % n) / (double)n));
        run->recording.column[COLUMN_DRIVE][k] = drive;
        run->recording.column[COLUMN_DISPLACEMENT][k] = twin_000_measure(&twin, twin_000_step(&twin, drive));
    }
    measure_loop(run);
}

void campaign_open(campaign_t *campaign, bool reduced) {
    *campaign = (campaign_t){0};
    for (size_t f = 0; f < CAMPAIGN_FREQUENCIES; f++) {
        if (!reduced || f == 0 || f == 3 || f == CAMPAIGN_FREQUENCIES - 1) {
            campaign->frequency_hz[campaign->frequencies++] = all_frequencies[f];
        }
    }
    for (size_t p = 0; p < CAMPAIGN_PRELOADS; p++) {
        for (size_t v = 0; v < CAMPAIGN_VOLTAGES; v++) {
            for (size_t f = 0; f < campaign->frequencies; f++) {
                run_t *run = campaign_run(campaign, p, v, f);
                *run =
                    (run_t){.volts = voltages[v], .frequency_hz = campaign->frequency_hz[f], .preload_n = preloads[p]};
                campaign_record(run, (uint64_t)(run - campaign->run) + 1);
            }
        }
    }
}

void campaign_free(campaign_t *campaign) {
    for (size_t i = 0; i < campaign->frequencies * CAMPAIGN_VOLTAGES * CAMPAIGN_PRELOADS; i++) {
        recording_free(&campaign->run[i].recording);
    }
}

/* From the errors of a whole recording; range is what 100 percent is. The last tenth of a period is left out. */
static loop_error_t loop_error(const run_t *run, const double *error, double range) {
    const size_t end = run->recording.samples - run->period / 10;
    double sum[2] = {0.0, 0.0};
    size_t count[2] = {0, 0};
    for (size_t k = run->recording.samples - 2 * run->period; k < end; k++) {
        const double phase = (double)(k % run->period) / (double)run->period; /* 0 and 0.5: turning points */
        const size_t where = fabs(remainder(phase, 0.5)) <= 0.05 ? 0 : 1;
        sum[where] += error[k] * error[k];
        count[where]++;
    }
    return (loop_error_t){.rms = 100.0 * sqrt((sum[0] + sum[1]) / (double)(count[0] + count[1])) / range,
                          .turning = 100.0 * sqrt(sum[0] / (double)count[0]) / range,
                          .between = 100.0 * sqrt(sum[1] / (double)count[1]) / range};
}

bool position_error(const model_t *model, const run_t *run, loop_error_t *error, failure_t *failure) {
    double *position = allocate(run->recording.samples, sizeof(double));
    const bool good = chain_simulate(model, &run->recording, 1, position, failure);
    for (size_t k = 0; good && k < run->recording.samples; k++) {
        position[k] -= run->recording.column[COLUMN_DISPLACEMENT][k];
    }
    if (good) {
        *error = loop_error(run, position, run->stroke_um);
    }
    free(position);
    return good;
}

/* Equations (1), (2) and (9) of the paper, with central differences; docs/MODELS.md, section 11, for the signs. Four
 * averages over a fiftieth of the period take the sensor noise out of the acceleration. */
loop_error_t drive_error(const model_t *model, const run_t *run) {
    enum { MOST_STOPS = 64 };
    const model_block_t *block = &model->block[0];
    const parameter_t *weight = model_parameter(block, "weights"), *threshold = model_parameter(block, "thresholds_um");
    const bool inertial = block->block->parameters > 4;
    const double c = inertial ? model_parameter(block, "damping_v_s_per_um")->value[0] : 0.0;
    const double m = inertial ? model_parameter(block, "mass_v_s2_per_um")->value[0] : 0.0;
    const double rate = run->recording.sample_rate_hz, *x = run->recording.column[COLUMN_DISPLACEMENT];
    double *drive = allocate(run->recording.samples, sizeof(double)), stop[MOST_STOPS] = {0};
    loop_error_t error;
    for (size_t k = 1; k + 1 < run->recording.samples; k++) {
        drive[k] = model_parameter(block, "offset_v")->value[0] + weight->value[0] * x[k] +
                   c * 0.5 * rate * (x[k + 1] - x[k - 1]) + m * rate * rate * (x[k + 1] - 2.0 * x[k] + x[k - 1]);
        for (size_t i = 0; i < threshold->count; i++) {
            const double r = threshold->value[i];
            stop[i] = fmax(-r, fmin(r, x[k] - x[k - 1] + stop[i]));
            drive[k] += weight->value[i + 1] * stop[i];
        }
    }
    for (size_t k = 0; k < run->recording.samples; k++) {
        drive[k] -= run->recording.column[COLUMN_DRIVE][k];
    }
    for (int i = 0; i < 4; i++) {
        moving_average(drive, run->recording.samples, run->period / 50);
    }
    error = loop_error(run, drive, run->volts);
    free(drive);
    return error;
}
