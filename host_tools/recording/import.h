/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Converts a table of any kind (table.h) to a recording: identifies its columns, units and sample times.
 *
 * What the caller leaves open is inferred in this order: names of columns ("time", "drive", "position", ..; units in
 * brackets or after a slash), then units (a length is a displacement), then order (time, drive, displacement). The
 * interpretation can be printed; all faults are reported in one line.
 *
 * Units become s, V, um, A and degC. A displacement in volts needs its sensor's um per V. The rate is that of the time
 * column, or what the file or the caller states. If time stamps jitter by more than a quarter of a sample, the data are
 * resampled uniformly with Akima splines (GSL), and a line reports it. Gaps and time stamps that go back are refused.
 */
#ifndef IMPORT_H
#define IMPORT_H

#include "recording/recording.h"
#include "recording/table.h"

typedef struct {
    const char *time;                 /**< name or number (from 1) of a column, or NULL; "none": no time column */
    const char *column[COLUMN_COUNT]; /**< the same for the columns of a recording */
    double scale[COLUMN_COUNT]; /**< factor on top of the file's unit; 0: 1. For a displacement in volts: um per V */
    double sample_rate_hz;      /**< 0: from the file */
} import_options_t;

/** Options with everything left open. */
import_options_t import_nothing_said(void);

/** The interpretation, one line per fact; free with import_account_free. */
typedef struct {
    size_t lines;
    char **line;
} import_account_t;

#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
/** Adds a line; account may be NULL. */
void import_account_add(import_account_t *account, const char *format, ...);

/** All lines as one text; to be freed. */
char *import_account_text(const import_account_t *account);

void import_account_free(import_account_t *account);

/** On success the caller frees *recording; *account (may be NULL) is filled either way. */
bool import_table(recording_t *recording, const table_t *table, const import_options_t *options,
                  import_account_t *account, failure_t *failure);

/** Reads a file and imports it. recording->understood says how. On success the caller frees *recording. */
bool import_file(recording_t *recording, const char *path, const import_options_t *options, failure_t *failure);

#endif
