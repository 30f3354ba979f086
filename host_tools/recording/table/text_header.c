/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/table/text_header.h"
#include "recording/table/decimal.h"
#include "recording/table/units.h"
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { HEADER = 200 /* lines in which facts are looked for */ };

static bool is_bracketed(const char *text) {
    const size_t length = strlen(text);
    return length >= 2 && ((text[0] == '(' && text[length - 1] == ')') || (text[0] == '[' && text[length - 1] == ']'));
}

void text_bare_unit(char *unit) {
    if (strncasecmp(unit, "in ", 3) == 0) {
        memmove(unit, unit + 3, strlen(unit + 3) + 1);
    }
    if (is_bracketed(unit)) {
        const char *begin = unit + 1 + strspn(unit + 1, " ");
        size_t length = strlen(begin) - 1;
        while (length > 0 && strchr(" .", begin[length - 1]) != NULL) {
            length--;
        }
        memmove(unit, begin, length);
        unit[length] = '\0';
    }
}

bool text_is_unit(const char *text) {
    char unit[TEXT_FIELD];
    double scale;
    snprintf(unit, sizeof unit, "%s", text);
    text_bare_unit(unit);
    return unit[0] == '\0' || is_bracketed(text) || unit_of(unit, &scale) != QUANTITY_UNKNOWN;
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

static bool is_one_of(const char *field, const char *const *keys, size_t count) {
    char key[60];
    bare_key(field, strlen(field), key, sizeof key);
    for (size_t i = 0; i < count; i++) {
        if (strcmp(key, keys[i]) == 0) {
            return true;
        }
    }
    return false;
}

bool text_is_unit_key(const char *field) {
    static const char *const keys[] = {"verticalunits", "verticalunit", "yunitlabel", "yunit",     "yunits", "units",
                                       "unit",          "vunit",        "vunits",     "einheiten", "einheit"};
    return is_one_of(field, keys, sizeof keys / sizeof keys[0]);
}

bool text_is_scale_key(const char *field) {
    static const char *const keys[] = {"scale",      "scalefactor", "scaling",    "factor",
                                       "multiplier", "gain",        "skalierung", "faktor"};
    return is_one_of(field, keys, sizeof keys / sizeof keys[0]);
}

bool text_is_name_key(const char *field) {
    static const char *const keys[] = {"tracename",   "tracenames", "channelname", "channelnames", "signalname",
                                       "signalnames", "symbolname", "path",        "waves",        "wavesd"};
    return is_one_of(field, keys, sizeof keys / sizeof keys[0]);
}

/* "units: s V nm": what comes behind the key, where that is units and nothing else; or NULL. */
static const char *behind_unit_key(const char *line) {
    static const char between[] = " \t,;";
    const size_t length = strcspn(line, ":=");
    char key[60];
    snprintf(key, sizeof key, "%.*s", (int)length, line);
    if (line[length] == '\0' || !text_is_unit_key(key)) {
        return NULL;
    }
    const char *const units = line + length + 1 + strspn(line + length + 1, between);
    size_t count = 0;
    for (const char *at = units; *at != '\0'; at += strspn(at, between), count++) {
        char unit[TEXT_FIELD];
        const size_t size = strcspn(at, between);
        snprintf(unit, sizeof unit, "%.*s", (int)size, at);
        if (!text_is_unit(unit)) {
            return NULL;
        }
        at += size;
    }
    return count > 1 ? units : NULL;
}

const char *text_behind_list_key(const char *line) {
    static const char *const keys[] = {
        "columns:", "column names:", "fields:", "data columns:", "names:", "fancynames:", "spalten:"};
    const char *const units = behind_unit_key(line);
    if (units != NULL) {
        return units;
    }
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        const size_t length = strlen(keys[i]);
        if (strncasecmp(line, keys[i], length) == 0) {
            return line + length + strspn(line + length, " \t");
        }
    }
    return line;
}

bool text_is_label_key(const char *field) {
    static const char *const keys[] = {"xlabel", "ylabel"};
    return is_one_of(field, keys, sizeof keys / sizeof keys[0]);
}

bool text_is_source_key(const char *field) {
    static const char *const keys[] = {"source"};
    return is_one_of(field, keys, sizeof keys / sizeof keys[0]);
}

/* "# key: value" or "key = value". false: it is no such line. */
static bool split_fact(const char *line, char key[60], text_field_t *value) {
    const char *at = line + strspn(line, "#%/! \t\"");
    const size_t length = strcspn(at, ":=");
    if (at[length] == '\0') {
        return false;
    }
    bare_key(at, length, key, 60);
    at += length + 1;
    at += strspn(at, " \t\"'");
    snprintf(value->text, sizeof value->text, "%s", at);
    size_t end = strlen(value->text);
    while (end > 0 && strchr(" \t\"',;", value->text[end - 1]) != NULL) {
        value->text[--end] = '\0';
    }
    return key[0] != '\0';
}

size_t text_numbered(const char *const *line, size_t lines, const char *key, size_t first, text_field_t *field,
                     size_t most) {
    const size_t size = strlen(key);
    size_t count = 0;
    for (size_t i = 0; i < most; i++) {
        field[i].text[0] = '\0';
    }
    for (size_t i = 0; i < lines; i++) {
        char found[60];
        text_field_t value;
        if (split_fact(line[i], found, &value) && strncmp(found, key, size) == 0 &&
            isdigit((unsigned char)found[size])) {
            char *end;
            const unsigned long number = strtoul(found + size, &end, 10);
            if (*end == '\0' && number >= first && number - first < most) {
                field[number - first] = value;
            }
        }
    }
    while (count < most && field[count].text[0] != '\0') {
        count++;
    }
    return count;
}

bool text_find_common_unit(const char *const *line, size_t lines, char *unit) {
    unit[0] = '\0';
    for (size_t i = 0; i < lines; i++) {
        char key[60];
        text_field_t value;
        double scale;
        if (!split_fact(line[i], key, &value) ||
            (strcmp(key, "unit") != 0 && strcmp(key, "units") != 0 && strcmp(key, "baseunit") != 0)) {
            continue;
        }
        value.text[strcspn(value.text, ":")] = '\0'; /* of R&S's first channel; others are in V, too */
        text_bare_unit(value.text);
        const quantity_t quantity = unit_of(value.text, &scale);
        if ((quantity != QUANTITY_VOLTAGE && quantity != QUANTITY_LENGTH) ||
            (unit[0] != '\0' && strcmp(unit, value.text) != 0)) {
            return false;
        }
        snprintf(unit, TEXT_FIELD, "%s", value.text);
    }
    return unit[0] != '\0';
}

void text_find_role_units(table_t *table, const char *const *line, size_t lines) {
    for (size_t i = 0; i < lines; i++) {
        char key[60], wanted[60];
        text_field_t value;
        if (!split_fact(line[i], key, &value) || value.text[0] == '\0') {
            continue;
        }
        for (column_t role = COLUMN_DRIVE; role < COLUMN_COUNT; role++) {
            snprintf(wanted, sizeof wanted, "%sunit", column_name(role));
            if (strcmp(key, wanted) == 0) {
                text_bare_unit(value.text);
                free(table->role_unit[role]);
                table->role_unit[role] = copy_text(value.text);
            }
        }
    }
}

/* The value of "# NAME..WHAT: value", or NULL. */
static char *further_key(const char *line, const char *name, const char *what) {
    const size_t length = strlen(name), more = strlen(what);
    const char *at = line + 1;
    if (line[0] != '#') {
        return NULL;
    }
    at += strspn(at, " \t");
    if (strncmp(at, name, length) != 0 || strncmp(at + length, what, more) != 0 || at[length + more] != ':') {
        return NULL;
    }
    at += length + more + 1;
    char *value = copy_text(at + strspn(at, " \t"));
    for (size_t end = strlen(value); end > 0 && strchr(" \t\r", value[end - 1]) != NULL;) {
        value[--end] = '\0';
    }
    return value;
}

static void take_over(char **text, char *other) {
    free(*text);
    *text = other;
}

void text_find_further(table_t *table, const char *const *line, size_t lines) {
    for (size_t j = 0; j < table->columns; j++) {
        table_column_t *column = &table->column[j];
        bool known = false;
        for (column_t role = COLUMN_DRIVE; role < COLUMN_COUNT; role++) {
            known = known || strcmp(column->written, column_name(role)) == 0; /* text_find_role_units */
        }
        for (size_t i = 0; i < lines && !known; i++) {
            char *unit = further_key(line[i], column->written, COLUMN_UNIT_KEY);
            char *origin = unit == NULL ? further_key(line[i], column->written, COLUMN_LONG_NAME_KEY) : NULL;
            if (unit != NULL || origin != NULL) {
                take_over(&column->name, copy_text(column->written));
                take_over(unit != NULL ? &column->unit : &column->origin, unit != NULL ? unit : origin);
            }
        }
    }
}

typedef enum {
    IS_INTERVAL,
    IS_RATE,
    IS_START,
    IS_NAMED_BY_UNIT, /* one of both, as its unit says */
    IS_BESIDE_START   /* an interval where the header has the start of times, too: R&S RTO */
} interval_kind_t;

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
    {"hresolution", IS_INTERVAL, 1.0},
    {"timeinterval", IS_INTERVAL, 1.0},
    {"timestep", IS_INTERVAL, 1.0},
    {"scaninterval", IS_INTERVAL, 1.0},
    {"scanperiod", IS_INTERVAL, 1.0},
    {"samplingcycle", IS_INTERVAL, 1.0},
    {"samplingtime", IS_INTERVAL, 1.0},
    {"loginterval", IS_INTERVAL, 1.0},
    {"logginginterval", IS_INTERVAL, 1.0},
    {"samplingclock", IS_RATE, 1.0},
    {"sampleclock", IS_RATE, 1.0},
    {"acquisitionrate", IS_RATE, 1.0},
    {"framerate", IS_RATE, 1.0},
    {"loggingrate", IS_RATE, 1.0},
    {"resolution", IS_BESIDE_START, 1.0},
    {"xstart", IS_START, 1.0},
    {"clock", IS_NAMED_BY_UNIT, 1.0},
    {"sampling", IS_NAMED_BY_UNIT, 1.0},
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
    {"abtastfrequenz", IS_RATE, 1.0},
    {"abtastintervall", IS_INTERVAL, 1.0},
    {"abtastzeit", IS_INTERVAL, 1.0},
    {"start", IS_START, 1.0},
    {"x0", IS_START, 1.0},
};

/* start: whether the header has the start of times. */
static const interval_key_t *find_key(const char *text, size_t length, bool start) {
    char key[60];
    bare_key(text, length, key, sizeof key);
    for (size_t i = 0; i < sizeof interval_keys / sizeof interval_keys[0]; i++) {
        if (strcmp(key, interval_keys[i].key) == 0 && (interval_keys[i].kind != IS_BESIDE_START || start)) {
            return &interval_keys[i];
        }
    }
    return NULL;
}

static bool has_start(const char *const *line, size_t lines) {
    for (size_t i = 0; i < lines && line[i] != NULL; i++) {
        const interval_key_t *const key = find_key(line[i], strcspn(line[i], ":"), false);
        if (key != NULL && key->kind == IS_START) {
            return true;
        }
    }
    return false;
}

/* The unit in brackets behind a key of that length, "SampleTime[ms]": in seconds or hertz; 1: there is none. */
static double scale_in_key(const char *key, size_t length) {
    char name[TEXT_FIELD], unit[TEXT_FIELD];
    double scale = 1.0;
    snprintf(name, sizeof name, "%.*s", (int)(length < sizeof name ? length : sizeof name - 1), key);
    unit_split(name, unit, "");
    const quantity_t quantity = unit_of(unit, &scale);
    return quantity == QUANTITY_TIME || quantity == QUANTITY_FREQUENCY ? scale : 1.0;
}

/* The unit behind a number: a word, in brackets perhaps; "mS" for ms. Returns whether one stands there. */
static bool take_unit(const char *at, quantity_t *quantity, double *scale) {
    char unit[TEXT_FIELD];
    at += strspn(at, " \t([");
    size_t length = strcspn(at, " \t\",;)]");
    while (length > 0 && at[length - 1] == '.') {
        length--;
    }
    snprintf(unit, sizeof unit, "%.*s", (int)(length < sizeof unit ? length : sizeof unit - 1), at);
    *quantity = unit_of(unit, scale);
    if (*quantity == QUANTITY_UNKNOWN && length == 2 && unit[1] == 'S' && strchr("mun", unit[0]) != NULL) {
        unit[1] = 's';
        *quantity = unit_of(unit, scale);
    }
    return isalpha((unsigned char)unit[0]) || (unit[0] & 0x80) != 0 || strncmp(unit, "1/", 2) == 0;
}

/* The time of row number 0, alone in its field, or it is a date. */
static bool take_start(table_t *table, double number, const char *at) {
    at += strspn(at, " \t\"");
    if (*at == '\0' || strchr(",;:", *at) != NULL || at[-1] == '\t') {
        table->start_s = number;
        return true;
    }
    return false;
}

/* Whether digits go on behind a sign that separates no fields: "1,000 Hz". */
static bool is_grouped(const char *begin, const char *end, char separator) {
    return end > begin && strchr(",.'", *end) != NULL && *end != '\0' && *end != separator &&
           isdigit((unsigned char)end[1]) != 0;
}

/* The number behind a key: blanks, quotes and separators first, perhaps a unit behind it. A unit that is none of times
 * and rates, or a number that goes on, is not understood. */
static bool take_value(table_t *table, const interval_key_t *key, double of_key, const char *at, dialect_t dialect,
                       size_t line) {
    char text[TEXT_FIELD];
    double number, scale = key->scale * of_key, of_unit;
    quantity_t quantity;
    at += strspn(at, " \t\":=;,");
    const char *const begin = at;
    if (!decimal_read(at, dialect.point, &number, &at) || (key->kind != IS_START && !(number > 0.0))) {
        return false;
    }
    if (key->kind == IS_START) {
        return take_start(table, number, at);
    }
    const bool has_unit = take_unit(at, &quantity, &of_unit);
    const bool timed = quantity == QUANTITY_TIME || quantity == QUANTITY_FREQUENCY;
    if (is_grouped(begin, at, dialect.separator) || (!timed && key->kind == IS_NAMED_BY_UNIT) ||
        (!timed && has_unit && quantity != QUANTITY_INDEX)) {
        table->interval_unread = key->kind != IS_NAMED_BY_UNIT ? line : table->interval_unread;
        return false;
    }
    const bool rate = timed ? quantity == QUANTITY_FREQUENCY : key->kind == IS_RATE;
    scale = timed ? of_unit : scale;
    snprintf(text, sizeof text, "line %zu: %s", line, key->key);
    table_set_interval(table, rate ? 1.0 / (number * scale) : number * scale, text);
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

/* The key that a field is, of those that are still looked for: behind an interval the start of times alone. */
static const interval_key_t *wanted_key(const char *field, bool found, bool start) {
    const interval_key_t *const key = find_key(field, strcspn(field, ":=,;\t\"[("), start);
    return found && !(start && key != NULL && key->kind == IS_START) ? NULL : key;
}

/* What a key says, in its own field or the next one, or in the row of values below it. Returns whether that is an
 * interval. */
static bool take_fact(table_t *table, const interval_key_t *key, const char *const *line, size_t i, const char *at,
                      size_t index, dialect_t dialect) {
    const size_t length = strcspn(at, ":=,;\t\"");
    const double of_key = scale_in_key(at, length);
    bool taken = at[length] != '\0' && take_value(table, key, of_key, at + length, dialect, i + 1);
    const bool number = isdigit((unsigned char)at[length + strspn(at + length, " \t\":=;,")]) != 0;
    if (!taken && !number && line[i + 1] != NULL) {
        const char *const below = field_at(line[i + 1], dialect.separator, index);
        taken = below != NULL && take_value(table, key, of_key, below, dialect, i + 2);
    }
    return taken && key->kind != IS_START;
}

static void find_interval(table_t *table, const char *const *line, size_t lines, dialect_t dialect) {
    lines = lines < HEADER ? lines : HEADER;
    const bool start = has_start(line, lines);
    bool found = false;
    for (size_t i = 0; i + 1 < lines && line[i] != NULL; i++) {
        const char *at = line[i] + strspn(line[i], "#%/! \t\"");
        for (size_t index = 0; at != NULL && *at != '\0'; index++) {
            const interval_key_t *const key = wanted_key(at, found, start);
            found = (key != NULL && take_fact(table, key, line, i, at, index, dialect)) || found;
            at = strchr(at, dialect.separator);
            at = at != NULL ? at + 1 + strspn(at + 1, " \"") : NULL;
        }
    }
}

/* Yokogawa states the unit of its interval in another line: "HUnit","ms". */
static double scale_beside(const char *const *line, size_t lines) {
    for (size_t i = 0; i < lines && line[i] != NULL; i++) {
        const char *at = line[i] + strspn(line[i], "#%/! \t\"");
        size_t length = strcspn(at, ":=,;\t\"");
        char text[TEXT_FIELD];
        double scale;
        bare_key(at, length, text, sizeof text);
        if (strcmp(text, "hunit") != 0) {
            continue;
        }
        at += length + strspn(at + length, " \t\":=;,");
        length = strcspn(at, " \t\",;");
        snprintf(text, sizeof text, "%.*s", (int)(length < sizeof text ? length : sizeof text - 1), at);
        return unit_of(text, &scale) == QUANTITY_TIME ? scale : 1.0;
    }
    return 1.0;
}

void text_find_interval(table_t *table, const char *const *line, size_t lines, dialect_t dialect) {
    find_interval(table, line, lines, dialect);
    if (table->interval_s > 0.0 && strstr(table->interval_origin, "hresolution") != NULL) {
        table->interval_s *= scale_beside(line, lines < HEADER ? lines : HEADER);
    }
}
