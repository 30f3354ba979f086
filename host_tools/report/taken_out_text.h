/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What was taken out of the errors that a diagnosis tells, in words and as JSON. */
#ifndef TAKEN_OUT_TEXT_H
#define TAKEN_OUT_TEXT_H

#include "diagnosis/account/account.h"
#include "report/text_line.h"

/** "of a.csv: 0.12 um rms (0.5 um from end to end) that drives before the recording may have left; ..": a recording's,
 * a line. false, and empty: nothing was. */
bool taken_out_text(const account_t *account, const recording_t *recordings, size_t recording,
                    char text[DIAGNOSIS_LINE]);

/** "b.csv is 0.45 +- 0.02 ms later than the model of all these recordings: .." false, and empty: it is not. */
bool lag_of_one_text(const account_t *account, const recording_t *recordings, size_t recording,
                     char text[DIAGNOSIS_LINE]);

/** Key `taken_out` of hyst-diagnosis-1: a list. A new reference. */
json_t *taken_out_to_json(const account_t *account, const recording_t *recordings);
/** Key `each`: the lag and the zero of each of several recordings. A new reference; NULL: of one there are none. */
json_t *each_to_json(const account_t *account, const recording_t *recordings);

#endif
