/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "fit_model.h"
#include "catalogue.h"
#include "creep_search.h"
#include "json_output.h"
#include <math.h>

double model_growth_limit(double half_range_v, double largest_threshold_v) {
    return 1.05 * half_range_v - largest_threshold_v;
}

static json_t *range_to_json(const recording_t *recordings, size_t count, column_t column) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (size_t i = 0; i < count; i++) {
        for (size_t k = 0; k < recordings[i].samples; k++) {
            low = fmin(low, recordings[i].column[column][k]);
            high = fmax(high, recordings[i].column[column][k]);
        }
    }
    return json_pack("[f, f]", low, high);
}

static json_t *recordings_to_json(const recording_t *recordings, const fit_report_t *report) {
    json_t *list = json_array();
    for (size_t i = 0; i < report->recordings; i++) {
        const fit_recording_report_t *r = &report->recording[i];
        json_array_append_new(list, json_pack("{s:s, s:I, s:o, s:o, s:f, s:f, s:f, s:f}", "name", recordings[i].name,
                                              "samples", (json_int_t)recordings[i].samples, "nrmse_percent",
                                              json_number_or_null(r->train_nrmse_percent), "held_out_nrmse_percent",
                                              json_number_or_null(r->held_out_nrmse_percent), "held_out_max_um",
                                              r->held_out_max_um, "held_out_from_s", r->held_out_s,
                                              "memory_determined_from_s", r->determined_s,
                                              "initial_memory_mean_error_um", r->initial_mean_error_um));
    }
    return list;
}

static json_t *candidates_to_json(const fit_report_t *report) {
    json_t *list = json_array();
    for (size_t i = 0; i < report->candidates; i++) {
        const fit_candidate_t *candidate = &report->candidate[i];
        json_array_append_new(list, json_pack("{s:I, s:b, s:f}", "operators", (json_int_t)candidate->operators,
                                              "offset_drift", (int)candidate->drift, "validation_nrmse_percent",
                                              candidate->validation_nrmse_percent));
    }
    return list;
}

static json_t *fit_to_json(const recording_t *recordings, size_t count, const fit_options_t *options,
                           const fit_report_t *report) {
    json_t *fit =
        json_pack("{s:s, s:o, s:o, s:o, s:o, s:I, s:b, s:f, s:f, s:b}", "family",
                  options->rate_dependent ? "rate_dependent_prandtl_ishlinskii" : "prandtl_ishlinskii", "nrmse_percent",
                  json_number_or_null(report->nrmse_percent), "held_out_nrmse_percent",
                  json_number_or_null(report->held_out_nrmse_percent), "drive_range_v",
                  range_to_json(recordings, count, COLUMN_DRIVE), "displacement_range_um",
                  range_to_json(recordings, count, COLUMN_DISPLACEMENT), "operators", (json_int_t)report->operators,
                  "operators_given", (int)(options->operators > 0), "residual_rms_um", report->rms_um,
                  "offset_drift_um_per_decade", report->drift_um, "fitted_to_all", (int)options->use_all);
    json_object_set_new(fit, "candidates", candidates_to_json(report));
    json_object_set_new(fit, "recordings", recordings_to_json(recordings, report));
    if (report->smoothing > 0.0) {
        json_object_set_new(fit, "smoothing", json_real(report->smoothing));
    } else {
        json_object_set_new(fit, "residual_autocorrelation_samples", json_real(report->autocorrelation_samples));
    }
    if (options->rate_dependent) {
        json_object_set_new(fit, "static_held_out_nrmse_percent",
                            json_number_or_null(report->static_held_out_nrmse_percent));
    }
    return fit;
}

void make_fitted_model(const recording_t *recordings, size_t count, const play_basis_t *basis, const linear_fit_t *fit,
                       double beta_sigma_s, const double *initial_v, const fit_options_t *options,
                       const fit_report_t *report, model_t *model) {
    model_block_t *block;
    model_create(model, recordings[0].sample_rate_hz);
    if (options->rate_dependent) {
        const double sigma = beta_sigma_s * sqrt(report->autocorrelation_samples);
        block = model_append(model, &block_rate_dependent_hysteresis);
        model_set_array(block, "beta_s", 1, &basis->beta_s, isfinite(sigma) && sigma > 0.0 ? &sigma : NULL);
        model_set(block, "rate_filter_s", basis->rate_filter_s);
        model_set(block, "limit_v", basis->limit_v);
    }
    block = model_append(model, &block_prandtl_ishlinskii);
    model_set_array(block, "offset_um", 1, &fit->offset_um, fit->weight_sigma != NULL ? &fit->offset_sigma_um : NULL);
    model_set_array(block, "weights", fit->operators + 1, fit->weight, fit->weight_sigma);
    model_set_array(block, "thresholds_v", basis->operators, basis->threshold_v, NULL);
    if (initial_v != NULL) {
        model_set_array(block, "initial_memory_v", basis->operators, initial_v, NULL);
    }
    if (report->creep) {
        const double sigma = report->gamma_sigma * sqrt(report->autocorrelation_samples);
        block = model_append(model, &block_creep);
        model_set_array(block, "gamma_per_decade", 1, &report->gamma_per_decade,
                        isfinite(sigma) && sigma > 0.0 ? &sigma : NULL);
        if (count == 1) {
            const creep_cells_t cells = creep_default_cells(report->gamma_per_decade, recordings[0].sample_rate_hz);
            const double initial = creep_initial(&cells, &recordings[0]);
            model_set_array(block, "initial_um", 1, &initial, NULL);
        }
    }
    model->fit = fit_to_json(recordings, count, options, report);
}
