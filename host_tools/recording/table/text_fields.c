/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/table/text_fields.h"
#include "recording/table/decimal.h"
#include "recording/table/units.h"
#include <ctype.h>
#include <math.h>
#include <string.h>

const char *text_next_field(const char *line, char separator, const char **field, size_t *length) {
    const char *begin = line + strspn(line, separator == '\t' ? " " : " \t"), *end;
    if (*begin == '"') {
        const char *quote = strchr(begin + 1, '"');
        while (quote != NULL && quote[1] == '"') { /* two stand for one */
            quote = strchr(quote + 2, '"');
        }
        if (quote != NULL) {
            *field = begin + 1;
            *length = (size_t)(quote - begin - 1);
            while (*length > 0 && **field == ' ') {
                ++*field;
                --*length;
            }
            while (*length > 0 && (*field)[*length - 1] == ' ') {
                --*length;
            }
            end = quote + 1 + strspn(quote + 1, " ");
            if (separator == ' ') {
                end += strspn(end, " \t");
                return *end == '\0' ? NULL : end;
            }
            return *end == separator ? end + 1 : NULL;
        }
    }
    if (separator == ' ') {
        *field = begin;
        *length = strcspn(begin, " \t");
        end = begin + *length;
        end += strspn(end, " \t");
        return *end == '\0' ? NULL : end;
    }
    end = strchr(begin, separator);
    *field = begin;
    *length = end != NULL ? (size_t)(end - begin) : strlen(begin);
    while (*length > 0 && ((*field)[*length - 1] == ' ' || (*field)[*length - 1] == '\t')) {
        --*length;
    }
    return end != NULL ? end + 1 : NULL;
}

/* What instruments send for overload; 9.91e37 is their "not a number" (SCPI 1999). */
static const double scpi_infinity = 9.9e37, scpi_beyond = 9.92e37;

/* Letters, digits and blanks that begin with a letter, before the last ':' or '=' of a field that ends with a number.
 */
static size_t label_before(const char *field, size_t length) {
    size_t sign = length;
    while (sign > 0 && field[sign - 1] != ':' && field[sign - 1] != '=') {
        sign--;
    }
    size_t end = sign > 0 && isalpha((unsigned char)field[0]) ? sign - 1 : 0;
    for (size_t i = 0; i < end; i++) {
        end = isalnum((unsigned char)field[i]) || strchr("_ ()[]", field[i]) != NULL ? end : 0;
    }
    return end;
}

/* A unit that is known, or percent. */
static bool is_unit(const char *text, size_t length) {
    char unit[sizeof((around_text_t *)NULL)->unit];
    double scale;
    if (length == 0 || length >= sizeof unit) {
        return false;
    }
    memcpy(unit, text, length);
    unit[length] = '\0';
    return unit_of(unit, &scale) != QUANTITY_UNKNOWN;
}

/* Behind a number: nothing, or blanks and its unit. */
static bool ends_with_unit(const char *at, const char *end, around_t *around) {
    while (at < end && *at == ' ') {
        at++;
    }
    around->unit = at;
    around->unit_length = (size_t)(end - at);
    return at == end || is_unit(at, around->unit_length);
}

/* "+ 5", as data loggers write: the number begins behind the blanks. Returns the sign's factor. */
static double take_sign(const char **field, size_t *length) {
    const size_t blanks = *length > 2 && strchr("+-", **field) != NULL ? strspn(*field + 1, " ") : 0;
    const double sign = blanks > 0 && **field == '-' ? -1.0 : 1.0;
    if (blanks > 0 && blanks + 1 < *length && strchr("+-", (*field)[blanks + 1]) == NULL) {
        *field += blanks + 1;
        *length -= blanks + 1;
        return sign;
    }
    return 1.0;
}

/* A number, perhaps with its name before it and its unit behind it. */
static field_kind_t number_kind(const char *field, size_t length, char point, double *number, around_t *around) {
    const double sign = take_sign(&field, &length);
    const char *end, *const last = field + length;
    if (decimal_read(field, point, number, &end) && end <= last && ends_with_unit(end, last, around)) {
        *number *= sign;
        const bool none = fabs(*number) >= scpi_infinity && fabs(*number) < scpi_beyond;
        return none ? FIELD_TEXT : FIELD_NUMBER;
    }
    around->label_length = label_before(field, length);
    if (around->label_length > 0) {
        const char *at = field + around->label_length + 1;
        at += strspn(at, " ");
        around->label = field;
        if (at < last && decimal_read(at, point, number, &end) && end <= last && ends_with_unit(end, last, around)) {
            return FIELD_NUMBER;
        }
    }
    return FIELD_TEXT;
}

field_kind_t text_field_kind(const char *field, size_t length, char point, double *number, around_t *around) {
    const char *end, *const last = field + length;
    around_t nothing = {0}, *const found = around != NULL ? around : &nothing;
    memset(found, 0, sizeof *found);
    if (length == 0) {
        return FIELD_EMPTY;
    }
    if (number_kind(field, length, point, number, found) == FIELD_NUMBER) {
        return FIELD_NUMBER;
    }
    memset(found, 0, sizeof *found);
    if (!clock_read(field, length, number, &end) || end > last) {
        return FIELD_TEXT;
    }
    found->clock = end == last;
    if (found->clock) {
        return FIELD_NUMBER;
    }
    end += strspn(end, " ");
    if (end + 3 > last || strncmp(end, "-> ", 3) != 0) {
        return FIELD_TEXT;
    }
    end += 3 + strspn(end + 3, " ");
    return end < last ? number_kind(end, (size_t)(last - end), point, number, found) : FIELD_TEXT;
}

size_t text_line_shape(const char *line, dialect_t dialect, field_kind_t kind[MOST_COLUMNS]) {
    size_t count = 0;
    const char *at = line;
    while (at != NULL && count < MOST_COLUMNS) {
        const char *field;
        size_t length;
        double number;
        at = text_next_field(at, dialect.separator, &field, &length);
        kind[count++] = text_field_kind(field, length, dialect.point, &number, NULL);
    }
    return count;
}

bool text_around_keep(around_text_t *keep, const around_t *around) {
    memset(keep, 0, sizeof *keep);
    keep->clock = around->clock;
    if (around->label_length >= sizeof keep->label || around->unit_length >= sizeof keep->unit) {
        return false;
    }
    if (around->label_length > 0) {
        memcpy(keep->label, around->label, around->label_length);
    }
    if (around->unit_length > 0) {
        memcpy(keep->unit, around->unit, around->unit_length);
    }
    return true;
}

static bool is_text(const char *keep, const char *text, size_t length) {
    return strlen(keep) == length && (length == 0 || memcmp(keep, text, length) == 0);
}

double text_around_factor(const around_text_t *keep, const around_t *around) {
    double scale, of_others;
    if (!is_text(keep->label, around->label, around->label_length)) {
        return 0.0;
    }
    if (is_text(keep->unit, around->unit, around->unit_length)) {
        return 1.0;
    }
    around_text_t text;
    const quantity_t quantity = unit_of(keep->unit, &of_others);
    const bool same = text_around_keep(&text, around) && unit_of(text.unit, &scale) == quantity;
    return same && quantity != QUANTITY_UNKNOWN && quantity != QUANTITY_DIGITS ? scale / of_others : 0.0;
}

bool text_is_blank(const char *line) {
    return line[strspn(line, " \t")] == '\0';
}
