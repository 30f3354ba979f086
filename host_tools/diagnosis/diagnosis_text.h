/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A diagnosis in words: on the terminal, and the sentences that JSON and page share with it. */
#ifndef DIAGNOSIS_TEXT_H
#define DIAGNOSIS_TEXT_H

#include "account.h"
#include <stdio.h>

enum { DIAGNOSIS_LINE = 1000 };

/** "nothing missing", "explained", "partly explained", "unknown physics". */
const char *verdict_name(verdict_t verdict);
/** "detected", "isolated", "named". */
const char *certainty_name(certainty_t certainty);

/** The verdict as a sentence or two. */
void verdict_sentence(const diagnosis_t *diagnosis, char text[DIAGNOSIS_LINE]);

/** What a finding is, in plain sentences: the block's explanation; before it, "One of .., these recordings cannot tell
 * which" unless it is named. */
void finding_explanation(const finding_t *finding, char text[DIAGNOSIS_LINE]);

/** "12 .. 14 s and 30 .. 31 s; 190 .. 210 Hz; everywhere in the loop; drive 80 .. 100 V". `recordings`, count: those of
 * the diagnosis. */
void location_text(const location_t *location, const recording_t *recordings, size_t count, char text[DIAGNOSIS_LINE]);

/** Why a block that was considered was not taken, or that it was. index < diagnosis->considered. */
const char *outcome_text(const diagnosis_t *diagnosis, size_t index);

/** "frequency_hz = 212.3 +- 0.4 Hz". element 0 of a parameter of the final model. */
void parameter_text(const model_block_t *block, size_t parameter, char text[DIAGNOSIS_LINE]);

/** On stdout, at most a screen. */
void diagnosis_print(const diagnosis_t *diagnosis, const account_t *account, const recording_t *recordings,
                     size_t count);

#endif
