/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What a recording that was written has beside its known columns, or has lost. */
#ifndef RECORDING_OUTPUT_H
#define RECORDING_OUTPUT_H

#include "recording/recording.h"
#include <jansson.h>
#include <stdio.h>

/** A line with the extra columns, and one that says if a CSV has not taken all of them. Nothing without such columns.
 */
void extras_print(FILE *stream, const recording_t *recording, const char *path);

/** The extra columns that a file of this name keeps: "name", "long_name", "unit" each. */
json_t *extras_to_json(const recording_t *recording, const char *path);

#endif
