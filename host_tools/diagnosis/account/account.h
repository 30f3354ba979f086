/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What is worked out of a diagnosis once it is made, for all forms in which it is reported. */
#ifndef ACCOUNT_H
#define ACCOUNT_H

#include "diagnosis/answer/answer.h"
#include "diagnosis/columns/measured_columns.h"
#include "diagnosis/review/taken_out.h"
#include "diagnosis/where/locate.h"

typedef struct {
    /**
     * Where each finding acts: the simulation of the final model less that of the same chain without the block, its
     * hysteresis fitted again, because what a hysteresis can imitate tells nothing about the block.
     */
    location_t where[DIAGNOSIS_MOST_FINDINGS];
    /** How sure a finding is: finding_confidence. */
    double confidence[DIAGNOSIS_MOST_FINDINGS];
    /** Simulations of every recording by the baseline and by the final model, which do not round to the converter's
     * steps (as errors are counted), and the first samples that count (those whose memory is determined, or all). */
    double **before, **after;
    /** Of each finding, what the final model loses without it (see where), of every recording; NULL behind the last. */
    double **share[DIAGNOSIS_MOST_FINDINGS];
    size_t *from;
    taken_out_t *taken_out; /**< of every recording */
    size_t recordings;
    measured_columns_t measured; /**< what was measured beside drive and displacement */
    location_t remaining;        /**< of the residual above the noise floor; nowhere where it is neither structured nor
                                    the shape of the hysteresis */
} account_t;

/** Whether its only doubt is that more than noise remains beside it: isolated, without a rival. */
bool finding_has_reservation(const finding_t *finding);

/**
 * How often such findings are right: that there is an effect, and that the finding's block, or one that it can be
 * confused with, is it.
 *
 *     confidence = (1 - exp(-support / 5)) times how often findings of this certainty were right
 *
 * The first factor is the held-out samples' word (the least that is accepted, 12, gives 0.91). The second was counted
 * on recordings that this was calibrated with (thresholds.def: named_are_right and following). On laws that were not
 * among them a name was right less often; PROOF counts it.
 */
double finding_confidence(const finding_t *finding);

/** Whether more than noise remains. */
bool something_remains(const answer_t *answer);

/**
 * Besides filling *account, completes the diagnosis, so that it can be reported, and its model written and compiled:
 *
 * - findings that the measured columns contradict (measured_columns.h) are no more than detected;
 * - "fit": the ranges and names of these recordings, the errors, and what was found. Of what the baseline's own fit
 *   said, the family stays.
 *
 * On success the caller frees *account.
 */
bool account_for(answer_t *answer, const recording_t *recordings, size_t count, account_t *account, failure_t *failure);

void account_free(account_t *account);

#endif
