/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Fields of a line of text. A number may have its name before it ("u:5.0", "x = 3") and its unit behind it ("5.0 V");
 * both are then the same in all lines of that column. "10:11:12.345 -> " of a serial monitor is no part of a field.
 */
#ifndef TEXT_FIELDS_H
#define TEXT_FIELDS_H

#include <stdbool.h>
#include <stddef.h>

enum { MOST_COLUMNS = 256 };

typedef struct {
    char separator; /**< ' ': any blanks */
    char point;
} dialect_t;

typedef enum { FIELD_EMPTY, FIELD_NUMBER, FIELD_TEXT } field_kind_t;

/** What a number has around it. */
typedef struct {
    const char *label, *unit; /**< within the line */
    size_t label_length, unit_length;
    bool clock; /**< it is a time of day */
} around_t;

typedef struct {
    char label[40], unit[20];
    bool clock;
} around_text_t;

/** The next field of a line, without blanks and quotes around it; two quotes inside of quotes are left as two. Returns
 * what comes behind the separator, NULL at the end. */
const char *text_next_field(const char *line, char separator, const char **field, size_t *length);

/** around: NULL, or what stands around the number. */
field_kind_t text_field_kind(const char *field, size_t length, char point, double *number, around_t *around);

/** What the fields of a line are. Returns how many there are. */
size_t text_line_shape(const char *line, dialect_t dialect, field_kind_t kind[MOST_COLUMNS]);

/** What a number with another unit of the same quantity has to be multiplied by ("975 nm" among um, as instruments
 * write that choose their range); 0: another quantity, or another label. */
double text_around_factor(const around_text_t *keep, const around_t *around);

/** To keep; false: longer than a label or a unit is. */
bool text_around_keep(around_text_t *keep, const around_t *around);

/** A line of nothing but spaces and tabs. */
bool text_is_blank(const char *line);

#endif
