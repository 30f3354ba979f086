/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/rest.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>

/* Samples until a rest counts; that it goes on then, and that all rests have together. */
enum { LEAST_SETTLED = 20, LEAST_STRETCH = 100, LEAST_RESTING = 200 };
/* The noise at rest is looked for white, and from 1e-4 to 1 in these steps: the likelihood is flat. */
static const double least_rho = 1e-4, rho_step = 2.0;

/* What is left in stretches of rest, each less its mean. */
typedef struct {
    double *left_um; /* one stretch after the other */
    size_t samples, stretches;
    size_t *end; /* of each stretch */
} rests_t;

static void take_stretch(const fitted_chain_t *fitted, size_t begin, size_t samples, rests_t *rests) {
    double *left = rests->left_um + rests->samples, mean = 0.0;
    for (size_t k = 0; k < samples; k++) {
        left[k] = fitted->position_um[begin + k] - fitted->imitation.simulated_um[begin + k];
        mean += left[k] / (double)samples;
    }
    for (size_t k = 0; k < samples; k++) {
        left[k] -= mean;
    }
    rests->samples += samples;
    rests->end[rests->stretches++] = rests->samples;
}

static void take_rests(const fitted_chain_t *fitted, size_t recording, rests_t *rests) {
    const recording_t *r = &fitted->samples->recordings[recording];
    const double *drive = r->column[COLUMN_DRIVE];
    const size_t settled = (size_t)fmax(LEAST_SETTLED, threshold.least_rest_s * r->sample_rate_hz);
    double range[2];
    values_range(drive, r->samples, range);
    for (size_t k = 0, since = 0; k <= r->samples; k++) {
        if (k < r->samples && fabs(drive[k] - drive[since]) <= threshold.still * (range[1] - range[0])) {
            continue;
        }
        if (k - since >= settled + LEAST_STRETCH) {
            take_stretch(fitted, fitted->samples->begin[recording] + since + settled, k - since - settled, rests);
        }
        since = k;
    }
}

/* Mean square, made white. What came before a stretch is taken for its mean, which costs it a sample. */
static double mean_square(const rests_t *rests, const pink_t *pink, double step_um) {
    double *memory = pink_memory(pink), sum = 0.0;
    for (size_t i = 0, k = 0; i < rests->stretches; i++) {
        double value = 0.0;
        pink_value(pink, memory, &value, 1);
        for (; k < rests->end[i]; k++) {
            value = rests->left_um[k];
            pink_value(pink, memory, &value, 0);
            sum += value * value;
        }
    }
    free(memory);
    return sum / (double)(rests->samples - rests->stretches) + step_um * step_um / 12.0;
}

/* Power of a noise at the frequencies that a stretch of so many samples shows: variance (1 + rho / f). */
static double power_within(double variance, double rho, double samples) {
    return variance * (1.0 + 2.0 * rho * log(0.5 * samples));
}

static bool speak_for_less(const fitted_chain_t *fitted, const rests_t *rests, double step_um, double floor_um) {
    const hysteresis_t *h = &fitted->hysteresis;
    const size_t longest = fitted->samples->recordings[samples_longest(fitted->samples)].samples;
    /* Beside blocks behind the operator its weights are nearly the likeliest only, and what that leaves is slow. */
    const bool alone = fitted->imitation.chain.blocks == 1;
    const double by_fit = mean_square(rests, &h->noise, step_um),
                 variance = fmax(by_fit, h->evidence.variance / threshold.most_moving_over_resting);
    double least = by_fit, least_at = h->noise.rho;
    double rho = 0.0;
    while (alone && rho < h->noise.rho) {
        pink_t pink;
        pink_create(&pink, rho, longest);
        const double here = mean_square(rests, &pink, step_um);
        least_at = here < least ? rho : least_at;
        least = fmin(least, here);
        rho = fmax(least_rho, rho_step * rho);
    }
    const double by_sample = 0.5 * (log(variance / least) + by_fit / variance - 1.0);
    const double length = (double)rests->samples / (double)rests->stretches,
                 resting = power_within(least, least_at, length),
                 excess = power_within(variance, h->noise.rho, length) - resting;
    return (double)(rests->samples - rests->stretches) * by_sample > threshold.evidence_margin &&
           excess > gsl_pow_2(threshold.worth_mentioning) * resting + gsl_pow_2(floor_um);
}

bool rest_is_quieter(const fitted_chain_t *fitted, double step_um, double floor_um) {
    rests_t rests = {.left_um = samples_column(fitted->samples),
                     .end = allocate(fitted->samples->all / LEAST_STRETCH + 1, sizeof(size_t))};
    for (size_t i = 0; i < fitted->samples->count; i++) {
        take_rests(fitted, i, &rests);
    }
    const bool quieter = rests.samples >= LEAST_RESTING && speak_for_less(fitted, &rests, step_um, floor_um);
    free(rests.left_um);
    free(rests.end);
    return quieter;
}
