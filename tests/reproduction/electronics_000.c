/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "electronics_000.h"
#include "chain/catalogue.h"
#include "identify/linear_fit.h"
#include <gsl/gsl_multimin.h>
#include <math.h>
#include <stdlib.h>

enum { PLAYS = 10 };

typedef struct {
    const campaign_t *campaign;
    size_t runs;
    double threshold_v[PLAYS];
    model_t model;
    failure_t *failure;
} chain_search_t;

/* Rms error of electronics and plays, one set for all runs; leaves the model in search->model. */
static double try_electronics(chain_search_t *search, double cutoff_hz, double limit_v_per_s) {
    const linear_options_t linear = {.least_direct = 0.01};
    const play_basis_t basis = {.operators = PLAYS, .threshold_v = search->threshold_v};
    const double one = 1.0;
    recording_t recording[CAMPAIGN_RUNS] = {{0}};
    fit_span_t span[CAMPAIGN_RUNS];
    linear_fit_t fit = {0};
    model_t electronics;
    bool good = true;
    model_create(&electronics, CAMPAIGN_000_RATE_HZ);
    model_set(model_append(&electronics, &block_amplifier_bandwidth), "cutoff_hz", cutoff_hz);
    model_set(model_append(&electronics, &block_amplifier_slew_limit), "limit_v_per_s", limit_v_per_s);
    model_set_array(model_append(&electronics, &block_prandtl_ishlinskii), "weights", 1, &one, NULL);
    for (size_t i = 0; i < search->runs; i++) {
        recording[i] = search->campaign->run[i].recording;
        recording[i].column[COLUMN_DRIVE] = allocate(recording[i].samples, sizeof(double));
        good = good && chain_simulate(&electronics, &search->campaign->run[i].recording, 1,
                                      recording[i].column[COLUMN_DRIVE], search->failure);
        span[i] = (fit_span_t){.recording = &recording[i], .to = recording[i].samples};
    }
    good = good && linear_fit(&basis, span, search->runs, &linear, &fit, search->failure);
    if (good) {
        model_free(&search->model);
        search->model = electronics;
        model_block_t *plays = &search->model.block[2];
        model_set(plays, "offset_um", fit.offset_um);
        model_set_array(plays, "weights", PLAYS + 1, fit.weight, NULL);
        model_set_array(plays, "thresholds_v", PLAYS, search->threshold_v, NULL);
    } else {
        model_free(&electronics);
    }
    for (size_t i = 0; i < search->runs; i++) {
        free(recording[i].column[COLUMN_DRIVE]);
    }
    const double rms = good ? fit.rms_um : HUGE_VAL;
    linear_fit_free(&fit);
    return rms;
}

static double electronics_of_logs(const gsl_vector *logs, void *search) {
    const double rms = try_electronics(search, exp(gsl_vector_get(logs, 0)), exp(gsl_vector_get(logs, 1)));
    return isfinite(rms) ? rms : 1e300;
}

bool fit_electronics_and_plays(const campaign_t *campaign, size_t runs, model_t *model, failure_t *failure) {
    const double half_range_v = 40.0;
    double least = HUGE_VAL;
    chain_search_t search = {.campaign = campaign, .runs = runs, .failure = failure};
    gsl_multimin_fminimizer *minimiser = gsl_multimin_fminimizer_alloc(gsl_multimin_fminimizer_nmsimplex2, 2);
    gsl_multimin_function function = {.f = electronics_of_logs, .n = 2, .params = &search};
    gsl_vector *start = gsl_vector_alloc(2), *step = gsl_vector_alloc(2);
    for (size_t i = 0; i < PLAYS; i++) {
        search.threshold_v[i] = half_range_v * (double)(i + 1) / (PLAYS + 1);
    }
    for (int c = 0; c < 4; c++) { /* coarse: 200 to 1600 Hz, 10 to 80 kV/s */
        for (int l = 0; l < 4; l++) {
            const double rms = try_electronics(&search, ldexp(200.0, c), ldexp(1e4, l));
            if (rms < least) {
                least = rms;
                gsl_vector_set(start, 0, log(ldexp(200.0, c)));
                gsl_vector_set(start, 1, log(ldexp(1e4, l)));
            }
        }
    }
    gsl_vector_set_all(step, 0.3);
    gsl_multimin_fminimizer_set(minimiser, &function, start, step);
    for (int i = 0; i < 50 && gsl_multimin_fminimizer_size(minimiser) > 1e-3; i++) {
        if (gsl_multimin_fminimizer_iterate(minimiser) != 0) {
            break;
        }
    }
    const bool good =
        isfinite(try_electronics(&search, exp(gsl_vector_get(minimiser->x, 0)), exp(gsl_vector_get(minimiser->x, 1))));
    gsl_multimin_fminimizer_free(minimiser);
    gsl_vector_free(start);
    gsl_vector_free(step);
    *model = search.model;
    return good;
}
