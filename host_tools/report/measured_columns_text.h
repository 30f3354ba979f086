/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What the measured columns say about a diagnosis, for text, JSON and page. */
#ifndef MEASURED_COLUMNS_TEXT_H
#define MEASURED_COLUMNS_TEXT_H

#include "diagnosis/columns/measured_columns.h"
#include "report/text_line.h"

/** Whether the residual, before and after the findings, correlates with a column. */
void measured_column_text(const answer_t *answer, const measured_column_t *column, char text[DIAGNOSIS_LINE]);

/** Whether a finding is before or behind the point where voltage and current are measured, and whether the temperature
 * explains it. false: the columns do not show it. */
bool finding_columns_text(const finding_t *finding, const finding_columns_t *columns, char text[DIAGNOSIS_LINE]);

/** Appends the columns that correlate with the residual to a verdict that no block explains it. */
void measured_columns_verdict(const answer_t *answer, const measured_columns_t *measured, char text[DIAGNOSIS_LINE]);

/** docs/FORMATS.md: "measured_columns" of a diagnosis. A new reference. */
json_t *measured_columns_to_json(const measured_columns_t *measured);
/** "measured" of a finding; NULL: the columns do not show it. */
json_t *finding_columns_to_json(const finding_columns_t *columns);

#endif
