/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/review/taken_out.h"
#include "diagnosis/noise/held_out.h"
#include "diagnosis/nuisance/past.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>

/* Columns of one recording: as the model is, and with what is taken out. */
typedef struct {
    const recording_t *recording;
    const double *simulated, *with;
    size_t from;
} sides_t;

static double past_at(const sides_t *sides, size_t k, double zero) {
    return sides->with[k] - sides->simulated[k] - zero;
}

static void measure_past(const sides_t *sides, taken_out_t *taken) {
    const size_t end = sides->recording->samples;
    double low = HUGE_VAL, high = -HUGE_VAL, squares = 0.0;
    for (size_t k = sides->from; k < end; k++) {
        const double past = past_at(sides, k, taken->offset_um);
        squares += past * past;
        low = fmin(low, past);
        high = fmax(high, past);
    }
    taken->past_rms_um = sqrt(squares / (double)(end - sides->from));
    taken->past_range_um = high - low;
}

static void measure_beginning(const sides_t *sides, taken_out_t *taken) {
    const double *measured = sides->recording->column[COLUMN_DISPLACEMENT];
    double squares = 0.0;
    for (size_t k = 0; k < sides->from; k++) {
        squares += gsl_pow_2(measured[k] - sides->simulated[k] - taken->offset_um);
    }
    taken->left_out_s = (double)sides->from / sides->recording->sample_rate_hz;
    taken->left_out_rms_um = sides->from > 0 ? sqrt(squares / (double)sides->from) : 0.0;
}

/* The shift in time that explains most of what is left, as a whole and without each block of time in turn. */
static void measure_lag(const sides_t *sides, taken_out_t *taken) {
    const double *measured = sides->recording->column[COLUMN_DISPLACEMENT], rate_hz = sides->recording->sample_rate_hz;
    const size_t first = GSL_MAX(sides->from, 1), end = sides->recording->samples - 1;
    double product[HELD_OUT_BLOCKS] = {0.0}, square[HELD_OUT_BLOCKS] = {0.0}, products = 0.0, squares = 0.0;
    double without[HELD_OUT_BLOCKS];
    for (size_t k = first; k < end; k++) {
        const size_t block = (k - first) * HELD_OUT_BLOCKS / (end - first);
        const double rate = 0.5 * rate_hz * (sides->with[k + 1] - sides->with[k - 1]);
        product[block] += rate * (sides->with[k] - measured[k]);
        square[block] += rate * rate;
    }
    for (size_t b = 0; b < HELD_OUT_BLOCKS; b++) {
        products += product[b];
        squares += square[b];
    }
    for (size_t b = 0; b < HELD_OUT_BLOCKS; b++) {
        without[b] = (products - product[b]) / (squares - square[b]);
    }
    taken->lag_s = products / squares;
    /* Tukey's jackknife */
    taken->lag_sigma_s =
        sqrt((HELD_OUT_BLOCKS - 1.0) * gsl_stats_variance_with_fixed_mean(without, 1, HELD_OUT_BLOCKS, taken->lag_s));
}

taken_out_t *taken_out_of(const answer_t *answer, failure_t *failure) {
    const samples_t *samples = &answer->question->samples;
    taken_out_t *taken_out = allocate(samples->count, sizeof *taken_out);
    double *simulated = samples_column(samples), *with = samples_column(samples);
    const bool good = samples_simulate(samples, &answer->model, simulated, failure) &&
                      past_simulate(samples, &answer->question->noise, &answer->model, with, failure);
    for (size_t i = 0; good && i < samples->count; i++) {
        const size_t begin = samples->begin[i], last = samples->begin[i + 1] - 1;
        const sides_t sides = {.recording = &samples->recordings[i],
                               .simulated = simulated + begin,
                               .with = with + begin,
                               .from = samples->from[i]};
        taken_out[i].offset_um = with[last] - simulated[last]; /* functions of the past are 0 there */
        if (past_shows(samples, i)) {
            measure_past(&sides, &taken_out[i]);
        }
        measure_beginning(&sides, &taken_out[i]);
        measure_lag(&sides, &taken_out[i]);
    }
    free(simulated);
    free(with);
    if (!good) {
        free(taken_out);
        taken_out = NULL;
    }
    return taken_out;
}

bool taken_out_past_percent(const answer_t *answer, double *percent, failure_t *failure) {
    const samples_t *samples = &answer->question->samples;
    taken_out_t *taken_out = taken_out_of(answer, failure);
    *percent = 0.0;
    for (size_t i = 0; taken_out != NULL && i < samples->count; i++) {
        double range[2];
        recordings_range(&samples->recordings[i], 1, COLUMN_DISPLACEMENT, range);
        *percent = fmax(*percent, 100.0 * taken_out[i].past_rms_um / (range[1] - range[0]));
    }
    free(taken_out);
    return taken_out != NULL;
}

bool taken_out_lags(const taken_out_t *taken_out, size_t count) {
    return count > 1 && fabs(taken_out->lag_s) > threshold.lag_of_one_file * taken_out->lag_sigma_s;
}
