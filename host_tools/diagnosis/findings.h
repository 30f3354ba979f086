/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The findings' numbers, and how well the recordings determine them. */
#ifndef FINDINGS_H
#define FINDINGS_H

#include "diagnosis/diagnose.h"

/** Whether it only describes what no physical effect explains (empirical.h). */
bool finding_is_empirical(const finding_t *finding);
/** How many findings name a physical effect: these come first. */
size_t findings_named(const diagnosis_t *diagnosis);
/** Error of the held-out samples with these alone. */
double findings_named_held_out_percent(const diagnosis_t *diagnosis);
/** Whether a parameter of a finding was searched. */
bool finding_searched(const finding_t *finding, size_t parameter);
/** Whether the outputs tell it: searched, or what the searched ones refer to (the middle or half of a range, the
 * duration of a trend). */
bool finding_tells(const finding_t *finding, size_t parameter);
/** The finding that put this block in the chain, or NULL. */
const finding_t *finding_of(const diagnosis_t *diagnosis, const block_t *block);
/** Whether a block was found, or a finding can be confused with it. */
bool finding_may_be(const diagnosis_t *diagnosis, const block_t *block);
/** Index of a finding's block in diagnosis->model. */
size_t finding_index(const diagnosis_t *diagnosis, const finding_t *finding);
/** The diagnosis' model without the finding's block; to be freed. */
void finding_left_out(const diagnosis_t *diagnosis, const finding_t *finding, model_t *without);

/* The only functions that change which findings there are, what they are and how sure. */

void findings_add(diagnosis_t *diagnosis, const finding_t *finding);
void findings_insert(diagnosis_t *diagnosis, size_t index, const finding_t *finding);
void findings_remove(diagnosis_t *diagnosis, size_t index);
/** The finding is of the other block, and says why it is not of the one it had. */
void finding_rename(diagnosis_t *diagnosis, finding_t *finding, const block_t *block, outcome_t why);
/** What it can be confused with, one more: each once, and no more than there is room for. Returns whether it is new. */
bool finding_add_rival(finding_t *finding, const block_t *rival);
bool finding_has_rival(const finding_t *finding, const block_t *rival);
/** It is no more certain than that. */
void finding_at_most(finding_t *finding, certainty_t certainty);

/** In the list of what was considered: blocks of this kind that were taken no longer are, and why; and one is, in the
 * last round in which it was considered. */
void finding_considered_gone(diagnosis_t *diagnosis, const block_t *block, outcome_t why);
void finding_considered_taken(diagnosis_t *diagnosis, const block_t *block);

/**
 * Writes the standard errors of the hysteresis and of the findings into diagnosis->model (refine.h, no iterations):
 * jointly, with as many samples as count by the residuals' autocorrelation. Widened by sqrt(3/2), because refine counts
 * all samples and a third was held out of the fit.
 */
bool findings_errors(diagnosis_t *diagnosis, failure_t *failure);
/** Of a relaxation (probe_t.times): the times in s in which it acts and the recordings show it. false: it is none. */
bool finding_times(const diagnosis_t *diagnosis, const finding_t *finding, double time_s[2]);
/** Whether any number of a block that was searched, with its standard errors, is three of these away from nothing. */
bool block_determined(const model_block_t *block);
/** After findings_errors: the finding's. */
bool finding_determined(const diagnosis_t *diagnosis, const finding_t *finding);

#endif
