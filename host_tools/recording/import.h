/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Converts a table of any kind (table/table.h) to a recording: identifies its columns, units and sample times.
 *
 * What the caller leaves open is inferred from names and units of the columns, then from their order; what is not clear
 * is refused (column_choice.h). The interpretation can be printed; all faults are reported in one line.
 *
 * Columns that are not used are kept beside the others (recording_t.extra), as the file has them.
 *
 * Units become s, V, um, A and degC. A displacement in volts needs its sensor's um per V. The rate is that of the time
 * column, or what the file or the caller states. If time stamps jitter by more than a quarter of a sample, the data are
 * resampled uniformly with Akima splines (GSL), and a line reports it. Gaps and time stamps that go back are refused.
 */
#ifndef IMPORT_H
#define IMPORT_H

#include "recording/import_account.h"
#include "recording/import_options.h"
#include "recording/table/table.h"

/** Options with everything left open. */
import_options_t import_nothing_said(void);

/** On success the caller frees *recording; *account (may be NULL) is filled either way. */
bool import_table(recording_t *recording, const table_t *table, const import_options_t *options,
                  import_account_t *account, failure_t *failure);

/** Reads a file and imports it. recording->understood says how. On success the caller frees *recording. */
bool import_file(recording_t *recording, const char *path, const import_options_t *options, failure_t *failure);

#endif
