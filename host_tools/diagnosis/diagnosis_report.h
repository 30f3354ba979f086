/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A diagnosis as one HTML page: verdict, before and after, the chain with what was found in its place, what else was
 * considered, and what was not looked for. The same diagnosis gives the same bytes.
 */
#ifndef DIAGNOSIS_REPORT_H
#define DIAGNOSIS_REPORT_H

#include "account.h"

bool diagnosis_write_report(const diagnosis_t *diagnosis, const account_t *account, const recording_t *recordings,
                            size_t count, const char *path, failure_t *failure);

#endif
