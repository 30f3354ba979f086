/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/text_header.h"
#include "recording/decimal.h"
#include "recording/units.h"
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

void text_bare_unit(char *unit) {
    const size_t length = strlen(unit);
    if (length >= 2 && ((unit[0] == '(' && unit[length - 1] == ')') || (unit[0] == '[' && unit[length - 1] == ']'))) {
        memmove(unit, unit + 1, length - 2);
        unit[length - 2] = '\0';
    }
}

bool text_is_unit(const char *text) {
    char unit[TEXT_FIELD];
    double scale;
    snprintf(unit, sizeof unit, "%s", text);
    text_bare_unit(unit);
    return unit[0] == '\0' || unit_of(unit, &scale) != QUANTITY_UNKNOWN;
}

/* Letters and digits of a key, in lower case. */
static void bare_key(const char *text, size_t length, char *key, size_t room) {
    size_t count = 0;
    for (size_t i = 0; i < length && count + 1 < room; i++) {
        if (isalnum((unsigned char)text[i])) {
            key[count++] = (char)tolower((unsigned char)text[i]);
        }
    }
    key[count] = '\0';
}

bool text_is_unit_key(const char *field) {
    static const char *const keys[] = {"verticalunits", "verticalunit", "yunitlabel", "yunit",
                                       "yunits",        "units",        "unit"};
    char key[60];
    bare_key(field, strlen(field), key, sizeof key);
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        if (strcmp(key, keys[i]) == 0) {
            return true;
        }
    }
    return false;
}

typedef enum { IS_INTERVAL, IS_RATE, IS_START } interval_kind_t;

typedef struct {
    const char *key;
    interval_kind_t kind;
    double scale;
} interval_key_t;

static const interval_key_t interval_keys[] = {
    {"sampleinterval", IS_INTERVAL, 1.0},
    {"samplinginterval", IS_INTERVAL, 1.0},
    {"samplingperiod", IS_INTERVAL, 1.0},
    {"sampleperiod", IS_INTERVAL, 1.0},
    {"sampletime", IS_INTERVAL, 1.0},
    {"increment", IS_INTERVAL, 1.0},
    {"xincrement", IS_INTERVAL, 1.0},
    {"xincr", IS_INTERVAL, 1.0},
    {"tinc", IS_INTERVAL, 1.0},
    {"deltax", IS_INTERVAL, 1.0},
    {"dt", IS_INTERVAL, 1.0},
    {"timeincrement", IS_INTERVAL, 1.0},
    {"horizinterval", IS_INTERVAL, 1.0},
    {"samplerate", IS_RATE, 1.0},
    {"sampleratehz", IS_RATE, 1.0},
    {"samplingrate", IS_RATE, 1.0},
    {"samplingratehz", IS_RATE, 1.0},
    {"samplingfrequency", IS_RATE, 1.0},
    {"samplefrequency", IS_RATE, 1.0},
    {"samplingfrequencyhz", IS_RATE, 1.0},
    {"fs", IS_RATE, 1.0},
    {"fshz", IS_RATE, 1.0},
    {"sampleratekhz", IS_RATE, 1e3},
    {"samplingratekhz", IS_RATE, 1e3},
    {"samplingfrequencykhz", IS_RATE, 1e3},
    {"abtastrate", IS_RATE, 1.0},
    {"start", IS_START, 1.0},
    {"x0", IS_START, 1.0},
};

static const interval_key_t *find_key(const char *text, size_t length) {
    char key[60];
    bare_key(text, length, key, sizeof key);
    for (size_t i = 0; i < sizeof interval_keys / sizeof interval_keys[0]; i++) {
        if (strcmp(key, interval_keys[i].key) == 0) {
            return &interval_keys[i];
        }
    }
    return NULL;
}

/* The number behind a key: blanks, quotes and separators first, perhaps a unit behind it. */
static bool take_value(table_t *table, const interval_key_t *key, const char *at, char point, size_t line) {
    char unit[TEXT_FIELD], text[TEXT_FIELD];
    double number, scale = key->scale;
    size_t length;
    at += strspn(at, " \t\":=;,");
    if (!decimal_read(at, point, &number, &at) || (key->kind != IS_START && !(number > 0.0))) {
        return false;
    }
    if (key->kind == IS_START) { /* alone in its field, or it is a date */
        at += strspn(at, " \t\"");
        if (*at == '\0' || strchr(",;", *at) != NULL || at[-1] == '\t') {
            table->start_s = number;
            return true;
        }
        return false;
    }
    at += strspn(at, " \t");
    length = strcspn(at, " \t\",;");
    snprintf(unit, sizeof unit, "%.*s", (int)(length < sizeof unit ? length : sizeof unit - 1), at);
    if (unit[0] != '\0') {
        double of_unit;
        const quantity_t quantity = unit_of(unit, &of_unit);
        if (quantity == QUANTITY_TIME || quantity == QUANTITY_FREQUENCY) {
            scale = of_unit;
        }
    }
    snprintf(text, sizeof text, "line %zu: %s", line, key->key);
    table_set_interval(table, key->kind == IS_RATE ? 1.0 / (number * scale) : number * scale, text);
    return true;
}

/* Start of field `index` of a line, or NULL. */
static const char *field_at(const char *line, char separator, size_t index) {
    const char *at = line;
    while (index-- > 0) {
        at = strchr(at, separator);
        if (at == NULL) {
            return NULL;
        }
        at++;
    }
    return at;
}

void text_find_interval(table_t *table, const char *const *line, size_t lines, char separator, char point) {
    for (size_t i = 0; i < lines && i < 200 && line[i] != NULL; i++) {
        const char *at = line[i] + strspn(line[i], "#%/! \t\"");
        size_t index = 0;
        while (at != NULL && *at != '\0') {
            const size_t length = strcspn(at, ":=,;\t\"");
            const interval_key_t *key = find_key(at, length);
            const bool beside = key != NULL && at[length] != '\0' && take_value(table, key, at + length, point, i + 1);
            if (key != NULL && !beside && i + 1 < lines && line[i + 1] != NULL) { /* keys over a row of values */
                const char *below = field_at(line[i + 1], separator, index);
                if (below != NULL && take_value(table, key, below, point, i + 2) && key->kind != IS_START) {
                    return;
                }
            }
            if (beside && key->kind != IS_START) {
                return;
            }
            at = strchr(at, separator);
            at = at != NULL ? at + 1 : NULL;
            index++;
            if (at != NULL) {
                at += strspn(at, " \"");
            }
        }
    }
}
