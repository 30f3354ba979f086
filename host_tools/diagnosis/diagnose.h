/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Diagnosis: which physics a model of the recordings leaves out. docs/DIAGNOSIS.md.
 *
 * From the baseline on, the block that explains most of what is left of the residual is taken into the chain, the chain
 * is fitted again, and so on, until nothing is significant any more. A block is a finding only if it is significant
 * after the correction for all signatures that were tried, by two standard errors, one of which does not assume white
 * residuals. And it has to lower the error of the held-out samples. In the end each finding is taken out again, and
 * stays out if the others make it superfluous.
 */
#ifndef DIAGNOSE_H
#define DIAGNOSE_H

#include "diagnosis/answer/answer.h"

/**
 * The stages of stages.h, one after another. The recordings must outlive the answer, which is to be freed
 * (answer_free).
 *
 * given: a chain. It is fitted again, as far as the recordings determine it (refitted.h). Where that is not the whole
 * answer, the search is made also with hystereses of other shapes in the given one's place. Such an answer stands if it
 * is better by naming_margin: a wrong shape of the user's is no missing physics either.
 *
 * NULL: the search begins with the shape of hysteresis (play bank, Bouc-Wen, Preisach) that fits best beside the
 * signatures of all blocks. Where that leaves more than noise, or finds something, also with the others that come near.
 * The answer that leaves the least error of the held-out samples stands: a wrong shape is no missing physics, and
 * physics is no shape.
 *
 * seen: what a look at the recordings has measured, where blocks begin their search; NULL: they were not looked at.
 * What rings there and in nothing of the answer is unexplained (seen.h).
 */
bool diagnose_seen(const model_t *given, const probe_seen_t *seen, const recording_t *recordings, size_t count,
                   answer_t *answer, failure_t *failure);
/** The same without a look. */
bool diagnose(const model_t *given, const recording_t *recordings, size_t count, answer_t *answer, failure_t *failure);

#endif
