/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Identification: from recordings to a model with a Prandtl-Ishlinskii hysteresis, with fixed or with rate-dependent
 * thresholds.
 *
 * Time is cut in blocks, never sampled at random: the first two thirds of every recording are the training data, the
 * last third is held out and only looked at for the final figure. The number of operators (and whether a drift of the
 * offset is taken out) is chosen inside the training data: fitted on its first two thirds, judged on its last third;
 * the smallest number within 1 % of the best wins.
 *
 * With creep, gamma_per_decade is searched first; then the bank is fitted to the displacement without creep, and every
 * error is again that of the whole chain. Creep takes the recording's first sample for rest.
 *
 * Samples whose play memory still depends on what happened before the recording do not take part in the fit of the
 * weights; the initial memory is then estimated from them. If they are most of the training data, the actuator is first
 * taken as demagnetised at 0 V, and weights and initial memory are estimated in turn.
 */
#ifndef FIT_H
#define FIT_H

#include "linear_fit.h"
#include "model.h"
#include "progress.h"

/** Most operators that are chosen by themselves, and fitted without smoothing. */
#define FIT_MAX_PLAIN_OPERATORS 64
/** Most operators that `operators` may ask for. */
#define FIT_MAX_OPERATORS 1000

typedef struct {
    bool rate_dependent;
    bool creep;       /**< find a block creep too */
    size_t operators; /**< 0: chosen from the data; above FIT_MAX_PLAIN_OPERATORS: a dense, smoothed density */
    bool use_all;     /**< after the held-out error is known, fit the same structure to the whole recordings */
} fit_options_t;

typedef struct {
    size_t operators;
    bool drift;
    double validation_nrmse_percent;
} fit_candidate_t;

#define FIT_MAX_CANDIDATES 32

typedef struct {
    double train_nrmse_percent;    /**< over the training samples whose memory is determined */
    double held_out_nrmse_percent; /**< over the last third, relative to the peak-to-peak displacement there */
    double held_out_max_um;
    double determined_s; /**< time from which the memory is determined */
    double held_out_s;   /**< time at which the held-out part begins */
    /** Mean absolute error of the samples before determined_s, with the estimated memory. */
    double initial_mean_error_um;
} fit_recording_report_t;

typedef struct {
    size_t candidates;
    fit_candidate_t candidate[FIT_MAX_CANDIDATES]; /**< two when the number was given: without and with drift */
    size_t operators;
    bool drift;
    bool creep; /**< found, and part of the model */
    double gamma_per_decade,
        gamma_sigma;        /**< what the search found; sigma, for white residuals, HUGE_VAL: undetermined */
    double drift_um;        /**< per decade of time; taken out, not in the model */
    bool from_demagnetised; /**< too little of the training data had a determined memory */
    double smoothing;
    double rms_um;
    double autocorrelation_samples;
    double static_held_out_nrmse_percent;         /**< rate-dependent family: of the same bank with fixed thresholds */
    double nrmse_percent, held_out_nrmse_percent; /**< worst recording */
    size_t recordings;
    fit_recording_report_t *recording;
} fit_report_t;

/** Fits. On success the caller frees *model and *report. All recordings must have the same sample rate. */
bool fit_recordings(const recording_t *recordings, size_t count, const fit_options_t *options, model_t *model,
                    fit_report_t *report, failure_t *failure);

void fit_report_free(fit_report_t *report);

#endif
