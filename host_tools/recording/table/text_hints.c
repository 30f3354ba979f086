/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/table/text_hints.h"
#include <ctype.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { LOOKED_AT = 200 /* lines of a header, or of what stands below the data */ };

/* The next word of a line, of letters of any kind; NULL: the line has ended. */
static const char *next_word(const char *at, size_t *length) {
    while (*at != '\0' && isalpha((unsigned char)*at) == 0 && ((unsigned char)*at & 0x80) == 0) {
        at++;
    }
    for (*length = 0; isalpha((unsigned char)at[*length]) != 0 || ((unsigned char)at[*length] & 0x80) != 0;) {
        ++*length;
    }
    return *length > 0 ? at : NULL;
}

/* Whether a line speaks of units, and not of those of one column that it names ("temperature_unit: K"). */
static bool speaks_of_units(const char *line) {
    static const char *const words[] = {"unit", "units", "einheit", "einheiten"};
    size_t length;
    for (const char *at = line; (at = next_word(at, &length)) != NULL; at += length) {
        for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
            if (strlen(words[i]) == length && strncasecmp(at, words[i], length) == 0 && (at == line || at[-1] != '_')) {
                return true;
            }
        }
    }
    return false;
}

/* Of a line that speaks of units all that are in it; of another one those behind "in": "all positions in nm". */
static void take_hints(table_t *table, const char *line, size_t number) {
    const bool of_units = speaks_of_units(line);
    bool behind_in = false;
    size_t length;
    for (const char *at = line; (at = next_word(at, &length)) != NULL; at += length) {
        char word[UNIT_FIELD];
        double scale;
        (void)snprintf(word, sizeof word, "%.*s", (int)length, at);
        const bool counts = of_units || behind_in;
        const quantity_t quantity = unit_of(word, &scale);
        behind_in = strcasecmp(word, "in") == 0;
        const bool wanted = quantity == QUANTITY_TIME || quantity == QUANTITY_VOLTAGE || quantity == QUANTITY_LENGTH;
        if (counts && wanted && scale != 1.0 && length > 1 && strcmp(word, "min") != 0 &&
            table->unit_hint[quantity].line == 0) {
            table->unit_hint[quantity].line = number;
            table->unit_hint[quantity].scale = scale;
        }
    }
}

static void look_through(table_t *table, const char *const *line, size_t from, size_t to) {
    for (size_t i = from; i < to; i++) {
        take_hints(table, line[i], i + 1);
    }
}

void text_find_unit_hints(table_t *table, const char *const *line, size_t begin, size_t end, size_t lines) {
    look_through(table, line, begin > LOOKED_AT ? begin - LOOKED_AT : 0, begin);
    look_through(table, line, end, lines < end + LOOKED_AT ? lines : end + LOOKED_AT);
}
