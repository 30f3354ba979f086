/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What the steps of fitting a bank of play operators hand to each other: prandtl_ishlinskii.c prepares the job and runs
 * it, bank_structure.c chooses the number of operators and the smoothing, bank_model.c makes the model of it.
 */
#ifndef BANK_JOB_H
#define BANK_JOB_H

#include "identify/creep_search.h"
#include "identify/family.h"
#include "identify/linear_fit.h"

/** Most operators that are chosen by themselves, and fitted without smoothing. */
#define BANK_MAX_PLAIN_OPERATORS 64
#define BANK_MAX_CANDIDATES      32

/** Of the training data: fitting inside it uses this part and judges on the rest. */
extern const double bank_training_part;

typedef struct {
    size_t operators;
    bool drift;
    double validation_nrmse_percent;
} bank_candidate_t;

typedef struct {
    const family_job_t *job;
    failure_t *failure;
    const recording_t *recordings; /**< what the bank is fitted to: without creep, once creep is found */
    recording_t *elastic;          /**< those without creep, or NULL */
    bool room_to_grow; /**< the largest threshold stays at 0.8 of half the range, as rate dependence needs it */
    bool find_rate;    /**< find beta_s and rate_filter_s */
    double half_range_v;
    linear_options_t linear;
    fit_span_t *train;  /**< one a recording */
    double **initial_v; /**< memory before the first sample, one a recording; NULL: demagnetised */

    size_t candidates;
    bank_candidate_t candidate[BANK_MAX_CANDIDATES]; /**< two when the number was given: without and with drift */
    size_t operators;
    bool creep;                           /**< found, and part of the model */
    double gamma_per_decade, gamma_sigma; /**< sigma for white residuals; HUGE_VAL: undetermined */
    bool from_demagnetised;               /**< too little of the training data has a determined memory */
    double autocorrelation_samples;
} bank_job_t;

/** Measures the range of the training data, and the least slope that every fit keeps. */
void bank_prepare(bank_job_t *job);

/** Finds job->gamma_per_decade around the fit (creep_search). If the data determine it, job->creep is set, and the job
 * goes on with the displacement without creep (job->recordings, job->elastic). */
bool bank_find_creep(bank_job_t *job, creep_fit_t *fit, void *context);

/** Appends the block creep that was found. */
void bank_append_creep(const bank_job_t *job, model_t *model);

/** Even thresholds. The caller frees basis.threshold_v. */
play_basis_t bank_basis(const bank_job_t *job, size_t operators);

/** Sets `from` of job->train to where the memory is determined. Returns false, with from = 0, when that leaves less
 * than a quarter of all samples. */
bool bank_skip_undetermined(bank_job_t *job, const play_basis_t *basis);

/** Chooses job->operators and whether the drift of the offset is taken out. All candidates see the same samples. */
bool bank_choose_structure(bank_job_t *job);

/** The smoothest dense bank that explains the training data within 0.2 % of what an unsmoothed one does. */
bool bank_choose_smoothing(bank_job_t *job, const play_basis_t *basis);

/** The model that a finished fit becomes, with facts and notes. */
void bank_make_model(const bank_job_t *job, const play_basis_t *basis, const linear_fit_t *fit, model_t *model,
                     family_notes_t *notes);

#endif
