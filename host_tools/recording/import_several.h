/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Several actuators in one file. In the options of an import a '*' in the names of columns stands for what tells them
 * apart: drive "V*" and displacement "X*" are V1 and X1, V2 and X2, .. those of every group by a "*" before the slash.
 */
#ifndef IMPORT_SEVERAL_H
#define IMPORT_SEVERAL_H

#include "recording/import.h"

typedef struct {
    char *which;                  /**< what '*' stands for, "2" */
    import_options_t options;     /**< with that in its place */
    char *name[COLUMN_COUNT + 1]; /**< of columns, where they had a '*'; the last is that of time */
} import_actuator_t;

/** Whether a name has a '*' that is no column's name. */
bool import_is_several(const import_options_t *options);

/** The actuators in the order of their drives' columns. Drive and displacement both need a '*'. On success the list is
 * freed with import_actuators_free; it must not outlive the options. */
bool import_actuators(const table_t *table, const import_options_t *options, import_actuator_t **list, size_t *count,
                      failure_t *failure);
void import_actuators_free(import_actuator_t *list, size_t count);

#endif
