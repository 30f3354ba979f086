/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/where/drive_period.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdbool.h>

enum { LOOKED_AT = 4096 };

/* Mean square of x[k + lag] - x[k], for every step-th k, or HUGE_VAL once it must exceed `most`. */
static double difference_at(const double *x, size_t samples, size_t step, size_t lag, double most) {
    const size_t terms = (samples - lag + step - 1) / step;
    double sum = 0.0;
    for (size_t k = 0; k + lag < samples; k += step) {
        const double d = x[k + lag] - x[k];
        sum += d * d;
        if (sum > most * (double)terms) {
            return HUGE_VAL;
        }
    }
    return sum / (double)terms;
}

/* The lag in [low, high] at which x resembles itself most, 0 if the mean square of the difference exceeds `most`
 * everywhere. */
static size_t best_lag(const double *x, size_t samples, size_t step, size_t low, size_t high, double most) {
    size_t best = 0;
    for (size_t lag = low; lag <= high && lag < samples; lag += step) {
        const double d = difference_at(x, samples, step, lag, most);
        if (d < most) {
            most = d;
            best = lag;
        }
    }
    return best;
}

/* The first lag but 0 around which x resembles itself, in steps of `step`; 0: none. */
static size_t first_return(const double *x, size_t samples, size_t step, double variance) {
    const size_t longest = samples / 3 + samples / 20 + step; /* a little more, to see it pass */
    size_t lag = step, begin;
    while (lag <= longest && difference_at(x, samples, step, lag, threshold.similar_loop * variance) < HUGE_VAL) {
        lag += step; /* still the neighbourhood of 0 */
    }
    while (lag <= longest && difference_at(x, samples, step, lag, threshold.similar_loop * variance) == HUGE_VAL) {
        lag += step;
    }
    begin = lag;
    while (lag <= longest && difference_at(x, samples, step, lag, threshold.similar_loop * variance) < HUGE_VAL) {
        lag += step;
    }
    return begin < lag && lag <= longest ? best_lag(x, samples, step, begin, lag, threshold.similar_loop * variance)
                                         : 0;
}

/* A coarse look at ever longer beginnings of the drive; what is found there has to hold for the whole. Then the period
 * is read from as many of them as half of the samples hold. */
double drive_period(const double *drive, size_t samples) {
    double mean = 0.0, variance = 0.0;
    for (size_t k = 0; k < samples; k++) {
        mean += drive[k] / (double)samples;
    }
    for (size_t k = 0; k < samples; k++) {
        variance += gsl_pow_2(drive[k] - mean) / (double)samples;
    }
    /* A shift by half a sample changes the drive by half a step, and is unavoidable. */
    const double most =
        variance > 0.0 ? threshold.same_loop * variance + 0.3 * difference_at(drive, samples, 1, 1, HUGE_VAL) : 0.0;
    bool whole = false;
    for (size_t step = 1; variance > 0.0 && !whole; step *= 2) {
        whole = samples / step <= LOOKED_AT;
        const size_t length = whole ? samples : LOOKED_AT * step;
        const size_t coarse = first_return(drive, length, step, variance);
        const size_t lag = coarse > 0 ? best_lag(drive, samples, 1, coarse > step ? coarse - step : 1, coarse + step,
                                                 fmin(most, threshold.similar_loop * variance))
                                      : 0;
        if (lag > 0 && 3 * lag <= samples) {
            double period = (double)lag;
            for (size_t times = 2; (double)times * period < 0.5 * (double)samples; times *= 2) {
                const size_t around = (size_t)((double)times * period);
                period = (double)best_lag(drive, samples, 1, around - 2, around + 3, HUGE_VAL) / (double)times;
            }
            return period;
        }
    }
    return 0.0;
}
