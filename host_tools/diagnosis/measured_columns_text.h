/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What the measured columns say of a diagnosis, for all forms in which it is told. */
#ifndef MEASURED_COLUMNS_TEXT_H
#define MEASURED_COLUMNS_TEXT_H

#include "measured_columns.h"
#include "text_line.h"

/** Whether what the model leaves, before and after the findings, goes with a column. */
void measured_column_text(const diagnosis_t *diagnosis, const measured_column_t *column, char text[DIAGNOSIS_LINE]);

/** On which side of the point where voltage and current are measured a finding is, and whether the temperature explains
 * it. false: the columns do not say. */
bool finding_columns_text(const finding_t *finding, const finding_columns_t *columns, char text[DIAGNOSIS_LINE]);

/** Adds to the verdict, which says that no block explains what remains, the columns that it goes with. */
void measured_columns_verdict(const diagnosis_t *diagnosis, const measured_columns_t *measured,
                              char text[DIAGNOSIS_LINE]);

/** docs/FORMATS.md: "measured_columns" of a diagnosis. A new reference. */
json_t *measured_columns_to_json(const measured_columns_t *measured);
/** "measured" of a finding; NULL: the columns do not say. */
json_t *finding_columns_to_json(const finding_columns_t *columns);

#endif
