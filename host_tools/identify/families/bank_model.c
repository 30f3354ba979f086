/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Output of a finished bank: the chain, facts for programs, notes for the user. */
#include "chain/catalogue.h"
#include "identify/creep_search.h"
#include "identify/families/bank_job.h"
#include <math.h>

static json_t *facts(const bank_job_t *job, const linear_fit_t *fit) {
    json_t *candidates = json_array();
    json_t *facts = json_pack("{s:I, s:f, s:f, s:o}", "operators", (json_int_t)job->operators, "residual_rms_um",
                              fit->rms_um, "offset_drift_um_per_decade", fit->drift_um, "candidates", candidates);
    for (size_t i = 0; i < job->candidates; i++) {
        const bank_candidate_t *candidate = &job->candidate[i];
        json_array_append_new(candidates, json_pack("{s:I, s:b, s:f}", "operators", (json_int_t)candidate->operators,
                                                    "offset_drift", (int)candidate->drift, "validation_nrmse_percent",
                                                    candidate->validation_nrmse_percent));
    }
    if (job->linear.smoothing > 0.0) {
        json_object_set_new(facts, "smoothing", json_real(job->linear.smoothing));
    } else {
        json_object_set_new(facts, "residual_autocorrelation_samples", json_real(job->autocorrelation_samples));
    }
    return facts;
}

static void take_notes(const bank_job_t *job, const linear_fit_t *fit, family_notes_t *notes) {
    if (job->job->operators > 0) {
        family_note(notes, "play operators %zu: as requested", job->operators);
    } else {
        family_note(notes,
                    "play operators %zu: the fewest within 1 %% of the best validation error, fitted and judged inside "
                    "the training data:",
                    job->operators);
        for (size_t i = 0; i < job->candidates; i++) {
            if (job->candidate[i].drift == job->linear.drift) {
                family_note(notes, "  %3zu operators: %.4f %%", job->candidate[i].operators,
                            job->candidate[i].validation_nrmse_percent);
            }
        }
    }
    if (job->job->creep && !job->creep) {
        family_note(notes, "creep: no minimum between -2 and 8 %% a decade, so these recordings do not determine it; "
                           "left out");
    }
    if (job->linear.drift) {
        family_note(notes,
                    "offset drift %.4g um per decade of time, taken out of the fit: without that it predicts worse",
                    fit->drift_um);
    }
    if (job->linear.smoothing > 0.0) {
        family_note(notes, "density smoothed with weight %.0e, which costs less than 0.2 %% of the training error",
                    job->linear.smoothing);
    } else {
        family_note(notes, "standard errors (+-) allow for a residual that is correlated over %.0f samples",
                    job->autocorrelation_samples);
    }
    if (job->job->count == 1) {
        family_note(notes, "initial memory estimated from the samples that depend on it");
    }
    if (job->from_demagnetised) {
        family_note(notes, "the drive never erases the initial memory: estimated along with the weights, starting from "
                           "demagnetised at 0 V");
    }
}

void bank_append_creep(const bank_job_t *job, model_t *model) {
    const recording_t *recordings = job->job->recordings;
    model_block_t *block = model_append(model, &block_creep);
    const double sigma = job->gamma_sigma * sqrt(job->autocorrelation_samples);
    model_set_array(block, "gamma_per_decade", 1, &job->gamma_per_decade, sigma > 0.0 ? &sigma : NULL);
    if (job->job->count == 1) {
        const creep_cells_t cells = creep_default_cells(job->gamma_per_decade, recordings[0].sample_rate_hz);
        const double initial = creep_initial(&cells, &recordings[0]);
        model_set_array(block, "initial_um", 1, &initial, NULL);
    }
}

void bank_make_model(const bank_job_t *job, const play_basis_t *basis, const linear_fit_t *fit, model_t *model,
                     family_notes_t *notes) {
    model_block_t *block;
    model_create(model, recordings_fastest_hz(job->job->recordings, job->job->count));
    if (job->find_rate) {
        block = model_append(model, &block_rate_dependent_hysteresis);
        model_set(block, "beta_s", basis->beta_s); /* its error depends on the filter: fit_errors.h */
        model_set(block, "rate_filter_s", basis->rate_filter_s);
        model_set(block, "limit_v", basis->limit_v);
    }
    block = model_append(model, &block_prandtl_ishlinskii);
    model_set_array(block, "offset_um", 1, &fit->offset_um, fit->weight_sigma != NULL ? &fit->offset_sigma_um : NULL);
    model_set_array(block, "weights", fit->operators + 1, fit->weight, fit->weight_sigma);
    model_set_array(block, "thresholds_v", basis->operators, basis->threshold_v, NULL);
    if (job->job->count == 1) {
        model_set_array(block, "initial_memory_v", basis->operators, job->initial_v[0], NULL);
    }
    if (job->creep) {
        bank_append_creep(job, model);
    }
    model->fit = facts(job, fit);
    take_notes(job, fit, notes);
}
