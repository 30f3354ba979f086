/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef JSON_OUTPUT_H
#define JSON_OUTPUT_H

#include "base/failure.h"
#include <jansson.h>

/** A number, or null where there is none (JSON has no NaN). */
json_t *json_number_or_null(double value);

/** Any text, whatever bytes it has: what is no character of UTF-8, or only the beginning of one, becomes U+FFFD. NULL
 * is null. jansson itself makes nothing of such a text, nor of an object with one. */
json_t *json_text(const char *text);

/** Writes the value to a file, with numbers to the last digit, and drops the reference. */
bool json_write(json_t *value, const char *path, failure_t *failure);

#endif
