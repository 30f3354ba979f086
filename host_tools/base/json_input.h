/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef JSON_INPUT_H
#define JSON_INPUT_H

#include "base/failure.h"
#include <jansson.h>

/** The JSON document in a file, a new reference, or NULL and a line that names the file. what: "a model", for a file
 * that is something else. */
json_t *json_read(const char *path, const char *what, failure_t *failure);

#endif
