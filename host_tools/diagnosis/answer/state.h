/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The state of a diagnosis while its stages run, the only thing that they change: the chain, what it leaves, the
 * findings. Which findings there are, and the chain with its power, change by the functions here. Only rooms of
 * the diagnosis read it.
 */
#ifndef STATE_H
#define STATE_H

#include "base/progress.h"
#include "belief/kept_chains.h"
#include "diagnosis/answer/answer.h"
#include "diagnosis/evidence/joint_fit.h"

typedef struct state {
    answer_t answer;         /**< as it stands; its question does not change */
    joint_power_t power;     /**< of its model */
    double found_um;         /**< what all that was found changes, whitened, beyond the nuisance subspace */
    probe_setting_t setting; /**< the question's, with the lines of what is left now */
    double line_hz[LINES_MOST];
    const block_t *without; /**< not looked for */
    const block_t *richer;  /**< looked for although it is a richer form (probe_t.in_place_of); NULL: none */
    fitted_chain_t *beside; /**< the operator in the place of the hysteresis, nothing found; may be empty */
    kept_chains_t *kept;    /**< the same beside what was found */
    failure_t *failure;
    progress_t progress;
    double left; /**< of the work, by a guess: how many rounds it takes is unknown */
} state_t;

/** Nothing is found yet, and the setting is the question's. */
void state_begin(state_t *state, const question_t *question, const family_t *family);
/** Another chain in the model's place, with its power; takes the model. */
void state_take(state_t *state, const model_t *model, const joint_power_t *power);
/** Moves the progress on. */
void state_advance(state_t *state);

/** NRMSE of a model over the samples that are fitted, and held out; beyond what an unknown past left (past.h). */
bool state_measure(const state_t *state, const model_t *model, double *percent, double *held_out_percent);
/** The operator in the place of the chain's hysteresis. Of the chain that the question has asked about it is known. */
void state_ask_shape(const state_t *state, const model_t *chain, shape_t *shape);
/** The operator fitted in the place of the chain's hysteresis; NULL if it cannot be. */
fitted_chain_t *state_fitted(const state_t *state, const model_t *chain);
/** Fits the operator in the place of these chains' hystereses side by side, so that the functions above have them. */
void state_fit_beside(const state_t *state, const model_t *chain, size_t count);
/** What is left of the held-out samples (a sum of squares) beyond the noise, in parts of it. */
double excess(const answer_t *answer, double held);

/** Blocks of a model, as bits: those that the baseline does not have; those of a given chain that are fitted again; all
 * that a fit moves beside the hysteresis, which are both but for what was heard. */
unsigned blocks_found(const answer_t *answer, const model_t *model);
unsigned refitted_blocks(const answer_t *answer, const model_t *model);
unsigned blocks_fitted(const answer_t *answer, const model_t *model);
/** Of a fit of all that was found. One that settles ends by itself; one that was stopped before leaves what is then
 * taken for another effect. */
enum { FIT_ITERATIONS = 16 };

/* The only functions that change which findings there are, what they are and how sure. */

void findings_add(answer_t *answer, const finding_t *finding);
void findings_insert(answer_t *answer, size_t index, const finding_t *finding);
void findings_remove(answer_t *answer, size_t index);
/** The finding is of the other block, and says why it is not of the one it had. */
void finding_rename(answer_t *answer, finding_t *finding, const block_t *block, outcome_t why);
/** What it can be confused with, one more: each once, and no more than there is room for. Returns whether it is new. */
bool finding_add_rival(finding_t *finding, const block_t *rival);
/** It is no more certain than that. */
void finding_at_most(finding_t *finding, certainty_t certainty);

/** In the list of what was considered: blocks of this kind that were taken no longer are, and why; and one is, in the
 * last round in which it was considered. */
void finding_considered_gone(answer_t *answer, const block_t *block, outcome_t why);
void finding_considered_taken(answer_t *answer, const block_t *block);

/**
 * Writes the standard errors of the hysteresis and of the findings into answer->model (refine.h, no iterations):
 * jointly, with as many samples as count by the residuals' autocorrelation. Widened by sqrt(3/2), because refine counts
 * all samples and a third was held out of the fit. Those of what was heard stay (attempt.h).
 */
bool findings_errors(answer_t *answer, failure_t *failure);
/** A block is an approximation: the numbers of a finding are not better than it is. Adds that to their errors. */
void finding_widen(answer_t *answer, size_t finding);
/** Whether any number of a block that was searched, with its standard errors, is three of these away from nothing.
 * Where its effect is proportional to some numbers, one of these is: a frequency of something without a size is none.
 * And, of a richer form (probe_t.extends), the one by which it is more. */
bool block_determined(const model_block_t *block);
/** After findings_errors: the finding's. */
bool finding_determined(const answer_t *answer, const finding_t *finding);

#endif
