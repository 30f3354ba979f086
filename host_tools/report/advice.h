/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What to do now: sentences for the reader of a diagnosis. The words are those of docs/READING_A_DIAGNOSIS.md. */
#ifndef ADVICE_H
#define ADVICE_H

#include "diagnosis/answer/answer.h"
#include "report/text_line.h"

/** What the verdict asks for. */
void advice_on_verdict(const answer_t *answer, char text[DIAGNOSIS_LINE]);

/** Whether the amplifier undoes the block, or why it cannot. */
void advice_on_block(const answer_t *answer, const block_t *block, char text[DIAGNOSIS_LINE]);

/** What to record for a finding that is not named, and what it would tell. false: it is named, nothing is open. */
bool advice_on_recording(const finding_t *finding, char text[DIAGNOSIS_LINE]);

#endif
