/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A diagnosis as one HTML page: verdict and what to do now, before and after, what the residual is made of, frequency
 * response, the chain with the findings in place. Folded away are other blocks that were considered, and blocks that
 * were not looked for. The same diagnosis gives the same bytes but for the date (base/provenance.h).
 */
#ifndef DIAGNOSIS_REPORT_H
#define DIAGNOSIS_REPORT_H

#include "diagnosis/account/account.h"
#include "look/look.h"

/** looks: those at the recordings, for the frequency response; NULL: none was possible. */
bool diagnosis_write_report(const answer_t *answer, const account_t *account, const recording_t *recordings,
                            size_t count, const look_t *looks, const char *path, failure_t *failure);

#endif
