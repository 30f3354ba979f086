/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/text_igor.h"
#include "recording/units.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* SetScale/P x 0,0.001,"s", drive: `at` is behind the command's name. */
static void take_scale(table_t *table, const char *at, size_t line) {
    char axis = 0, unit[20] = "", wave[40] = "", origin[40];
    double first = 0.0, step = 0.0, scale;
    const bool per_point = strncmp(at, "/P ", 3) == 0;
    at += per_point ? 3 : 0;
    if (sscanf(at, " %c %lf , %lf , \"%19[^\"]\" , %39[A-Za-z0-9_]", &axis, &first, &step, unit, wave) != 5) {
        return;
    }
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
