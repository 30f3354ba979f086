/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What the caller of an import says about a file. */
#ifndef IMPORT_OPTIONS_H
#define IMPORT_OPTIONS_H

#include "recording/recording.h"

typedef struct {
    const char *time;                 /**< name or number (from 1) of a column, or NULL; "none": no time column */
    const char *column[COLUMN_COUNT]; /**< the same for the columns of a recording */
    double scale[COLUMN_COUNT]; /**< factor on top of the file's unit; 0: 1. For a displacement in volts: um per V */
    double sample_rate_hz;      /**< 0: from the file */
    const char *others[COLUMN_COUNT]; /**< with '*': columns of several actuators, not kept with another one; or NULL */
    bool fill_missing;                /**< rows without a number are put on straight lines between their neighbours */
} import_options_t;

#endif
