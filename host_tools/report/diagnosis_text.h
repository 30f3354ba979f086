/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A diagnosis in words: the sentences that terminal, JSON and page share. */
#ifndef DIAGNOSIS_TEXT_H
#define DIAGNOSIS_TEXT_H

#include "diagnosis/account/account.h"
#include "report/text_line.h"

/** "nothing missing", "explained", "partly explained", "unknown physics". */
const char *verdict_name(verdict_t verdict);
/** "detected", "isolated", "named". */
const char *certainty_name(certainty_t certainty);

/** The hysteresis that replaced that of the given model, or NULL. */
const block_t *diagnosis_other_shape(const answer_t *answer);

/** Why any verdict on these recordings is a guess, or what a given chain has without a cause; false: neither. */
bool verdict_caveat(const answer_t *answer, char text[DIAGNOSIS_LINE]);
/** The verdict as a sentence or two, after its caveat. */
void verdict_sentence(const answer_t *answer, char text[DIAGNOSIS_LINE]);

/** Explains a finding: the block's explanation, preceded by "One of .., these recordings cannot tell which" unless it
 * is named. */
void finding_explanation(const finding_t *finding, char text[DIAGNOSIS_LINE]);
/** Over what times the numbers of a relaxation are valid (finding_times). false: it is none. */
bool finding_times_text(const answer_t *answer, const finding_t *finding, char text[DIAGNOSIS_LINE]);

/** "in all parts of the loop; 80 .. 100 V; where the drive rests and at 20 .. 500 V/s; 190 .. 210 Hz (harmonics 2 and
 * 3); 12 .. 14 and 30 .. 31 s of a.csv". At most three ranges each: the smallest gaps between more are bridged.
 * `recordings`, count: those of the diagnosis. */
void location_text(const location_t *location, const recording_t *recordings, size_t count, char text[DIAGNOSIS_LINE]);

/** Why a block that was considered was rejected, or that it was accepted. index < diagnosis->considered. */
const char *outcome_text(const answer_t *answer, size_t index);

/** Indices of the blocks considered, round by round, the accepted one of a round first. Returns how many. */
size_t considered_in_order(const answer_t *answer, size_t order[DIAGNOSIS_MOST_CONSIDERED]);

/** The word below a found block in the chain: it is the cause, may be, or comes near. */
const char *finding_standing(const answer_t *answer, const finding_t *finding);
/** The words before the excitation of a finding: "To tell them apart, record" where it has rivals. */
const char *excitation_heading(const finding_t *finding);

/** "frequency 212.3 +- 0.4 Hz" (quantity.h). element 0 of a parameter of the final model. */
void parameter_text(const model_block_t *block, size_t parameter, char text[DIAGNOSIS_LINE]);

/** "transport_delay in the given chain: delay 900 +- 20 us, it was 500 us", of a block that was fitted again
 * (refitted.h). false, and empty, where the number did not change. */
bool refitted_text(const answer_t *answer, const block_t *block, size_t parameter, char text[DIAGNOSIS_LINE]);

/** The residual of the model with all findings: its size, its frequencies, single samples, or that it is noise. */
void remainder_text(const answer_t *answer, char text[DIAGNOSIS_LINE]);

/**
 * The blocks that were not found, in the order of the catalogue, testable ones first. Without those that these
 * recordings cannot distinguish from a finding, since these may be present. Returns how many; *testable of them are.
 */
size_t unseen_in_order(const answer_t *answer, const unseen_t *unseen[DIAGNOSIS_MOST_UNSEEN], size_t *testable);
/** Whether the size of a testable block can also be given as one of its parameters. */
bool unseen_has_parameter(const unseen_t *unseen);
/** "0.0021 um rms (gamma_per_decade = 0.0004)", of a testable block. */
void unseen_text(const unseen_t *unseen, char text[DIAGNOSIS_LINE]);
/** Whether these sizes mean anything: they follow from the noise alone, and where more remains it may hide as much. */
bool unseen_has_limits(const answer_t *answer);

/** Why errors are smaller than those of a simulation from the first sample on, a sentence; NULL: they are not. */
const char *errors_caveat(const answer_t *answer);

/** What `hyst record --probe` is to play for a finding: its block, or "all" where that is no physical effect. */
const char *finding_probe(const finding_t *finding);
/** What `hyst record --probe` is to play next: the first finding that is not named, or "all". */
const char *next_probe(const answer_t *answer);

#endif
