/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Identification: the part that all families (family.h) share.
 *
 * The data are split in time, never at random. The first two thirds of every recording are the training data; the last
 * third is held out and used only for the held-out error. Both errors come from a simulation of the finished chain from
 * the first sample on. The training error excludes samples whose memory depends on the drive before the recording,
 * unless less than a quarter of the training data would remain.
 */
#ifndef FIT_H
#define FIT_H

#include "identify/family.h"

typedef struct {
    bool creep;       /**< find a block creep too */
    size_t operators; /**< 0: chosen by the family; at most FAMILY_MAX_OPERATORS */
    bool use_all;     /**< refit to the whole recordings with as many operators, once the held-out error is known */
} fit_options_t;

typedef struct {
    double train_nrmse_percent;    /**< relative to the peak-to-peak displacement of the same samples */
    double held_out_nrmse_percent; /**< likewise; not finite if the held-out displacement is constant */
    double held_out_max_um;        /**< largest error held out */
    double held_out_max_s;         /**< when */
    double held_out_s;             /**< time at which the held-out part begins */
    double train_s;                /**< time from which the training error counts */
    double determined_s;           /**< time from which the memory is determined */
    double initial_mean_error_um;  /**< mean absolute error of the samples before determined_s, 0 without any */
} fit_recording_report_t;

typedef struct {
    const family_t *family;
    family_notes_t notes;
    size_t parameters;                                             /**< fitted parameters */
    double nrmse_percent, held_out_nrmse_percent, held_out_max_um; /**< worst recording */
    double without_held_out_nrmse_percent;                         /**< of family->without; NAN when there is none */
    size_t recordings;
    fit_recording_report_t *recording;
} fit_report_t;

/**
 * Fits one family. On success the caller frees *model and *report. Each recording has its own sample rate; the model
 * says the highest one. model->fit holds the keys of model.h, the family's facts, and those of the report.
 */
bool fit_recordings(const family_t *family, const recording_t *recordings, size_t count, const fit_options_t *options,
                    model_t *model, fit_report_t *report, failure_t *failure);

void fit_report_free(fit_report_t *report);

#endif
