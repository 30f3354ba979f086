/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Decimal numbers in text. */
#ifndef DECIMAL_H
#define DECIMAL_H

#include <stdbool.h>
#include <stddef.h>

/**
 * Reads a finite decimal number that `text` begins with: sign, digits with one `point` ('.' or ','), exponent behind e
 * or d (Fortran). No blanks, "nan", "inf" or hexadecimal. *end: the character after it. The result is the nearest
 * double, like that of strtod. False if there is none.
 */
bool decimal_read(const char *text, char point, double *number, const char **end);

/** Whether the text is such a number, with a point, and nothing else. */
bool decimal_is(const char *text, double *number);

/** Room for any number that the two below write, and its end. */
#define DECIMAL_ROOM 400

/**
 * Writes a finite number as printf's "%.*g" would: `digits` (9 or 17) significant digits, rounded to nearest, zeros at
 * the end left out. Returns the number of characters; `text` has DECIMAL_ROOM and is not ended. Some ten times as fast.
 */
size_t decimal_write(char *text, double number, int digits);

/** The shorter of 9 and 17 digits that decimal_read and strtod read back to the same number. */
size_t decimal_write_exactly(char *text, double number);

/** The same for "%.9f". */
size_t decimal_write_nano(char *text, double number);

/**
 * A time of day, with or without a date before it: "10:00:00.25", "2026-11-23 10:00:00,25", "23.11.2026 10:00:00",
 * "23-Nov-2026 10:00:00",
 * "2026-11-23T10:00:00Z", "9:00:00 PM", "10:00:00:250", "0 days 10:00:00"; or minutes and seconds with a fraction,
 * "12:30.5". In seconds since midnight, or since 1970 where there is a date. Of "11/12/2026" day and month are not told
 * apart: such a date is left out. So is a time zone. Point or comma before the fraction. Nothing behind `length`
 * characters is read: a comma there may be a separator.
 */
bool clock_read(const char *text, size_t length, double *seconds, const char **end);

#endif
