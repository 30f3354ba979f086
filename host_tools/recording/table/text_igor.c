/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/table/text_igor.h"
#include "recording/table/decimal.h"
#include "recording/table/units.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What stands before a sign, or before the end of a name, without blanks around it. Returns what comes behind it. */
static const char *take_word(const char *at, const char *ends, char *word, size_t room) {
    at += strspn(at, " ,");
    const size_t length = strcspn(at, ends);
    (void)snprintf(word, room, "%.*s", (int)length, at);
    return at + length + (at[length] == '"' ? 1 : 0);
}

/* SetScale/P x 0,0.001,"s", drive: `at` is behind the command's name. */
static void take_scale(table_t *table, const char *at, size_t line) {
    char unit[20], wave[40], origin[40];
    double first, step, scale;
    const bool per_point = strncmp(at, "/P", 2) == 0;
    at += per_point ? 2 : 0;
    at += strspn(at, " ");
    const char axis = *at;
    at += axis != '\0' ? 1 : 0;
    at += strspn(at, " ");
    if (!decimal_read(at, '.', &first, &at) || *at++ != ',' || !decimal_read(at, '.', &step, &at) ||
        strncmp(at, ",\"", 2) != 0) {
        return;
    }
    at = take_word(at + 2, "\"", unit, sizeof unit);
    (void)take_word(at, " ;,", wave, sizeof wave);
    const quantity_t quantity = unit_of(unit, &scale);
    if (axis == 'x' && per_point && step > 0.0 && quantity == QUANTITY_TIME) {
        (void)snprintf(origin, sizeof origin, "line %zu: SetScale", line);
        table_set_interval(table, scale * step, origin);
        table->start_s = scale * first;
    }
    for (size_t i = 0; (axis == 'y' || axis == 'd') && i < table->columns; i++) {
        if (strcmp(table->column[i].name, wave) == 0 && table->column[i].unit[0] == '\0') {
            free(table->column[i].unit);
            table->column[i].unit = copy_text(unit);
        }
    }
}

void text_find_igor_scales(table_t *table, const char *const *line, size_t from, size_t lines) {
    static const char command[] = "SetScale";
    for (size_t i = from; i < lines; i++) {
        for (const char *at = line[i]; (at = strstr(at, command)) != NULL;) {
            at += strlen(command);
            take_scale(table, at, i + 1);
        }
    }
}
