/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/import_several.h"
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { MOST_NAME = 100 };

bool import_is_several(const import_options_t *options) {
    for (int c = 0; c < (int)COLUMN_COUNT; c++) {
        if (options->column[c] != NULL && strchr(options->column[c], '*') != NULL) {
            return true;
        }
    }
    return false;
}

/* What '*' stands for in this name: *part has `length` characters, at least one. */
static bool matches(const char *pattern, const char *name, const char **part, size_t *length) {
    const size_t before = strcspn(pattern, "*");
    const char *after = pattern + before + 1;
    if (strlen(name) <= before + strlen(after)) {
        return false;
    }
    *part = name + before;
    *length = strlen(name) - before - strlen(after);
    return strncasecmp(name, pattern, before) == 0 && strcasecmp(*part + *length, after) == 0;
}

static char *put_in(const char *pattern, const char *which) {
    const char *star = strchr(pattern, '*');
    const size_t room = strlen(pattern) + strlen(which) + 1;
    char *name = allocate(room, 1);
    (void)snprintf(name, room, "%.*s%s%s", (int)(star - pattern), pattern, which, star + 1);
    return name;
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
            actuator->name[c] = put_in(said, actuator->which);
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
        if (matches(drive, table->column[i].name, &part, &length)) {
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

/* '*' in place of the last number of a name, or of its group. */
static bool generalise(const char *name, bool group, char pattern[MOST_NAME]) {
    size_t from = 0, to = 0;
    if (group) {
        const char *slash = strrchr(name, '/');
        to = slash != NULL ? (size_t)(slash - name) : 0;
    } else {
        for (to = strlen(name); to > 0 && !isdigit((unsigned char)name[to - 1]); to--) {
        }
        for (from = to; from > 0 && isdigit((unsigned char)name[from - 1]); from--) {
        }
    }
    return to > from && snprintf(pattern, MOST_NAME, "%.*s*%s", (int)from, name, name + to) < MOST_NAME;
}

static bool has_column(const table_t *table, const char *name) {
    for (size_t i = 0; i < table->columns; i++) {
        if (strcasecmp(table->column[i].name, name) == 0) {
            return true;
        }
    }
    return false;
}

size_t import_siblings(const table_t *table, const char *drive, const char *displacement, char pattern[2][100]) {
    for (int group = 0; group < 2; group++) {
        size_t pairs = 0;
        if (!generalise(drive, group != 0, pattern[0]) || !generalise(displacement, group != 0, pattern[1])) {
            continue;
        }
        for (size_t i = 0; i < table->columns; i++) {
            const char *part;
            size_t length;
            if (!matches(pattern[0], table->column[i].name, &part, &length) ||
                (group == 0 && strspn(part, "0123456789") < length)) {
                continue;
            }
            char which[MOST_NAME];
            (void)snprintf(which, sizeof which, "%.*s", (int)length, part);
            char *other = put_in(pattern[1], which);
            pairs += has_column(table, other) ? 1 : 0;
            free(other);
        }
        if (pairs > 1) {
            return pairs;
        }
    }
    return 0;
}
