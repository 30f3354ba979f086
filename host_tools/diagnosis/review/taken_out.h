/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What stands between the error that a diagnosis tells and the one that its model delivers, and what each recording
 * would have otherwise: numbers of every recording of a question, beside one model for all of them. */
#ifndef TAKEN_OUT_H
#define TAKEN_OUT_H

#include "diagnosis/answer/answer.h"

typedef struct {
    double offset_um;                  /**< its zero above that of the first recording; 0 of that */
    double past_rms_um, past_range_um; /**< what an unknown past explains (past.h), of the samples that count */
    double left_out_s;                 /**< from its beginning on, samples that do not count */
    double left_out_rms_um;            /**< of the model's error there, beside its zero */
    /** How much later than the model it is, from what the model leaves: of several recordings the one that was made
     * with another filter, or is not what its name says. The standard error is that of 36 blocks of time. */
    double lag_s, lag_sigma_s;
} taken_out_t;

/** Of each recording of the question, beside the answer's model. To be freed; NULL: the model cannot be simulated. */
taken_out_t *taken_out_of(const answer_t *answer, failure_t *failure);

/** What the past explains, in parts of the recording's stroke: of the worst one. false: the model cannot be simulated.
 */
bool taken_out_past_percent(const answer_t *answer, double *percent, failure_t *failure);

/** Whether it is later, or earlier, than the model by more than chance and what the model leaves make: five standard
 * errors, of several recordings. */
bool taken_out_lags(const taken_out_t *taken_out, size_t count);

#endif
