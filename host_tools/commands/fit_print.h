/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What `hyst fit` prints. */
#ifndef FIT_PRINT_H
#define FIT_PRINT_H

#include "identify/fit.h"

/** One line of the table of all families. */
typedef struct {
    const family_t *family;
    bool fitted;
    model_t model;       /**< when fitted */
    fit_report_t report; /**< when fitted */
    failure_t failure;   /**< when not: the reason */
} fit_entry_t;

/** The parameters with their standard errors, the notes of the family, and the errors of every recording. */
void fit_print(const model_t *model, const recording_t *recordings, const fit_report_t *report, bool used_all);

void fit_print_table(const fit_entry_t *entry, size_t count);
/** A new reference. */
json_t *fit_table_to_json(const fit_entry_t *entry, size_t count);

#endif
