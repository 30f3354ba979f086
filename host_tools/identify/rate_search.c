/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/rate_search.h"
#include "numerics/simplex.h"
#include <math.h>

/* Rate dependence must lower the residual by this fraction: two additional parameters lower it by about 1 / samples by
 * chance. */
static const double worth_it = 0.999;

enum { GRID_BETA = 8, GRID_FILTER = 7, MOST_ITERATIONS = 60 };

typedef struct {
    play_basis_t basis; /* its thresholds belong to the caller */
    const fit_span_t *spans;
    size_t count;
    const linear_options_t *options;
    failure_t *failure;
    progress_t *progress;
    double tried;
} search_t;

/* Residual rms for one pair, or HUGE_VAL when the pair is not allowed. Keeps the fit if requested. */
static double try_pair(search_t *search, double beta_s, double filter_s, linear_fit_t *keep) {
    linear_fit_t fit;
    double sum = 0.0, rms;
    progress_update(search->progress, search->tried++ / (GRID_BETA * GRID_FILTER + 2 * MOST_ITERATIONS));
    search->basis.rate_dependent = beta_s > 0.0;
    search->basis.beta_s = beta_s;
    search->basis.rate_filter_s = filter_s;
    if (!linear_fit(&search->basis, search->spans, search->count, search->options, &fit, search->failure)) {
        return HUGE_VAL;
    }
    for (size_t i = 0; i <= fit.operators; i++) {
        sum += fit.weight[i];
    }
    rms = beta_s * (sum - fit.weight[0]) <= RATE_FEEDBACK_LIMIT * filter_s * sum ? fit.rms_um : HUGE_VAL;
    if (keep != NULL) {
        *keep = fit;
    } else {
        linear_fit_free(&fit);
    }
    return rms;
}

static double rms_of_logs(const double *logs, void *context) {
    return try_pair(context, exp(logs[0]), exp(logs[1]), NULL);
}

/* Largest drive rate in V/s, and the shortest sample period. */
static double largest_rate(const fit_span_t *spans, size_t count, double *period_s) {
    double largest = 0.0;
    *period_s = HUGE_VAL;
    for (size_t s = 0; s < count; s++) {
        const double *drive = spans[s].recording->column[COLUMN_DRIVE];
        *period_s = fmin(*period_s, 1.0 / spans[s].recording->sample_rate_hz);
        for (size_t k = 1; k < spans[s].to; k++) {
            largest = fmax(largest, fabs(drive[k] - drive[k - 1]) * spans[s].recording->sample_rate_hz);
        }
    }
    return largest;
}

/* Coarse: growth at the largest drive rate from 1/256 to 1/2 of the largest threshold; filters from half a sample to 32
 * samples. */
static double search_grid(search_t *search, double fastest, double period_s, double *beta_s, double *filter_s) {
    const double largest_v = search->basis.threshold_v[search->basis.operators - 1];
    double least = HUGE_VAL;
    for (int b = 0; b < GRID_BETA; b++) {
        for (int f = 0; f < GRID_FILTER; f++) {
            const double beta = 0.5 * largest_v / fastest * pow(2.0, b - GRID_BETA + 1);
            const double filter = ldexp(period_s, f - 1), rms = try_pair(search, beta, filter, NULL);
            if (rms < least) {
                least = rms;
                *beta_s = beta;
                *filter_s = filter;
            }
        }
    }
    return least;
}

static double descend(search_t *search, double *beta_s, double *filter_s) {
    const simplex_job_t job = {.function = rms_of_logs,
                               .context = search,
                               .dimensions = 2,
                               .step = 0.3,
                               .size = 1e-4,
                               .most_iterations = MOST_ITERATIONS};
    double logs[2] = {log(*beta_s), log(*filter_s)};
    const double least = simplex_minimise(&job, logs);
    *beta_s = exp(logs[0]);
    *filter_s = exp(logs[1]);
    return least;
}

bool rate_search(play_basis_t *basis, const fit_span_t *spans, size_t count, const linear_options_t *options,
                 linear_fit_t *fit, progress_t *progress, failure_t *failure) {
    search_t search = {
        .basis = *basis, .spans = spans, .count = count, .options = options, .failure = failure, .progress = progress};
    double period_s;
    const double fastest = largest_rate(spans, count, &period_s);
    const double rms = try_pair(&search, 0.0, 0.0, NULL);
    double beta_s = 0.0, filter_s = 0.0;
    if (!isfinite(rms)) {
        return false;
    }
    if (basis->operators > 0 && fastest > 0.0) {
        double trial_beta_s = 0.0, trial_filter_s = 0.0;
        double trial = search_grid(&search, fastest, period_s, &trial_beta_s, &trial_filter_s);
        if (isfinite(trial)) {
            trial = descend(&search, &trial_beta_s, &trial_filter_s);
        }
        if (trial < worth_it * rms) {
            beta_s = trial_beta_s;
            filter_s = trial_filter_s;
        }
    }
    if (!isfinite(try_pair(&search, beta_s, filter_s, fit))) {
        return fail(failure, "the rate-dependent fit left the stable region");
    }
    basis->beta_s = beta_s;
    basis->rate_filter_s = filter_s;
    return true;
}
