/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/import_several.h"
#include "recording/column_pattern.h"
#include <stdlib.h>
#include <string.h>

bool import_is_several(const import_options_t *options) {
    for (int c = 0; c < (int)COLUMN_COUNT; c++) {
        if (options->column[c] != NULL && strchr(options->column[c], '*') != NULL) {
            return true;
        }
    }
    return false;
}

static void set_actuator(import_actuator_t *actuator, const import_options_t *options, const char *part,
                         size_t length) {
    actuator->options = *options;
    actuator->which = allocate(length + 1, 1);
    memcpy(actuator->which, part, length);
    for (int c = 0; c <= (int)COLUMN_COUNT; c++) {
        const bool time = c == (int)COLUMN_COUNT;
        const char *said = time ? options->time : options->column[c];
        if (said != NULL && strchr(said, '*') != NULL) {
            actuator->name[c] = column_pattern_put_in(said, actuator->which);
            if (!time) {
                actuator->options.others[c] = said;
            }
            *(time ? &actuator->options.time : &actuator->options.column[c]) = actuator->name[c];
        }
    }
}

bool import_actuators(const table_t *table, const import_options_t *options, import_actuator_t **list, size_t *count,
                      failure_t *failure) {
    const char *drive = options->column[COLUMN_DRIVE], *displacement = options->column[COLUMN_DISPLACEMENT];
    if (drive == NULL || displacement == NULL || strchr(drive, '*') == NULL || strchr(displacement, '*') == NULL) {
        return fail(failure, "%s: for several actuators --drive and --displacement both need a '*'", table->source);
    }
    *list = allocate(table->columns, sizeof **list);
    *count = 0;
    for (size_t i = 0; i < table->columns; i++) {
        const char *part;
        size_t length;
        if (column_pattern_matches(drive, table->column[i].name, &part, &length)) {
            set_actuator(&(*list)[(*count)++], options, part, length);
        }
    }
    if (*count == 0) {
        free(*list);
        return fail(failure, "%s: no column is called '%s': there are %zu, from '%s' to '%s'", table->source, drive,
                    table->columns, table->column[0].name, table->column[table->columns - 1].name);
    }
    return true;
}

void import_actuators_free(import_actuator_t *list, size_t count) {
    for (size_t i = 0; i < count; i++) {
        free(list[i].which);
        for (int c = 0; c <= (int)COLUMN_COUNT; c++) {
            free(list[i].name[c]);
        }
    }
    free(list);
}
