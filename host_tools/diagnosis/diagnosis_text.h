/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A diagnosis in words: on the terminal, and the sentences that JSON and page share with it. */
#ifndef DIAGNOSIS_TEXT_H
#define DIAGNOSIS_TEXT_H

#include "account.h"
#include "text_line.h"
#include <stdio.h>

/** "nothing missing", "explained", "partly explained", "unknown physics". */
const char *verdict_name(verdict_t verdict);
/** "detected", "isolated", "named". */
const char *certainty_name(certainty_t certainty);

/** The hysteresis that took the place of the given model's own, or NULL. */
const block_t *diagnosis_other_shape(const diagnosis_t *diagnosis);

/** What makes any verdict on these recordings a guess, a sentence; false: nothing does. */
bool verdict_caveat(const diagnosis_t *diagnosis, char text[DIAGNOSIS_LINE]);
/** The verdict as a sentence or two, behind its caveat. */
void verdict_sentence(const diagnosis_t *diagnosis, char text[DIAGNOSIS_LINE]);

/** What a finding is, in plain sentences: the block's explanation; before it, "One of .., these recordings cannot tell
 * which" unless it is named. */
void finding_explanation(const finding_t *finding, char text[DIAGNOSIS_LINE]);

/** "in all parts of the loop; 80 .. 100 V; where the drive rests and at 20 .. 500 V/s; 190 .. 210 Hz (harmonics 2 and
 * 3); 12 .. 14 and 30 .. 31 s of a.csv". At most three ranges each: the smallest gaps between more are bridged.
 * `recordings`, count: those of the diagnosis. */
void location_text(const location_t *location, const recording_t *recordings, size_t count, char text[DIAGNOSIS_LINE]);

/** Why a block that was considered was not taken, or that it was. index < diagnosis->considered. */
const char *outcome_text(const diagnosis_t *diagnosis, size_t index);

/** The indices of what was considered, round by round, what was taken in a round before the others. Returns how many.
 */
size_t considered_in_order(const diagnosis_t *diagnosis, size_t order[DIAGNOSIS_MOST_CONSIDERED]);

/** What the chain says below a block that was found: whether it is the reason, or may be, or only comes near. */
const char *finding_standing(const diagnosis_t *diagnosis, const finding_t *finding);
/** What stands before the excitation of a finding: "To tell them apart, record" only where there is something to tell
 * it from. */
const char *excitation_heading(const finding_t *finding);

/** "frequency_hz = 212.3 +- 0.4 Hz". element 0 of a parameter of the final model. */
void parameter_text(const model_block_t *block, size_t parameter, char text[DIAGNOSIS_LINE]);

/** "transport_delay in the given chain: delay_s = 0.0009 +- 2e-05 s, it was 0.0005", of a block that was fitted again
 * (refitted.h). false, and empty, where the number has not moved. */
bool refitted_text(const diagnosis_t *diagnosis, const block_t *block, size_t parameter, char text[DIAGNOSIS_LINE]);

/** What the model with everything that was found leaves: how much, at which frequencies, single samples; that it is
 * noise, when it is. */
void remainder_text(const diagnosis_t *diagnosis, char text[DIAGNOSIS_LINE]);

/**
 * The blocks that were not found, in the order of the catalogue, and of these the testable ones first. Neither what
 * was found nor what these recordings cannot tell from it: that may be there. Returns how many; *testable of them are.
 */
size_t unseen_in_order(const diagnosis_t *diagnosis, const unseen_t *unseen[DIAGNOSIS_MOST_UNSEEN], size_t *testable);
/** Whether the size of a testable block can also be given as a number of its own. */
bool unseen_has_parameter(const unseen_t *unseen);
/** "0.0021 um rms (gamma_per_decade = 0.0004)", of a testable block. */
void unseen_text(const unseen_t *unseen, char text[DIAGNOSIS_LINE]);
/** What these sizes do not allow for, a sentence; NULL: nothing. */
const char *unseen_caveat(const diagnosis_t *diagnosis);

/** Why errors are smaller than a simulation from the first sample on has them, a sentence; NULL: they are not. */
const char *errors_caveat(const diagnosis_t *diagnosis);

/** What `hyst record --probe` is to play next: the first finding that is not named, or "all". */
const char *next_probe(const diagnosis_t *diagnosis);

/** On stdout, at most two screens. */
void diagnosis_print(const diagnosis_t *diagnosis, const account_t *account, const recording_t *recordings,
                     size_t count);

#endif
