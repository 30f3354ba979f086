/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Members of a message from the page. A member that is missing leaves *value; one of another type is a failure. */
#ifndef MESSAGE_H
#define MESSAGE_H

#include "base/failure.h"
#include <jansson.h>

bool message_number(json_t *message, const char *key, double *value, failure_t *failure);
/** A whole number of 0 or more. */
bool message_count(json_t *message, const char *key, unsigned long *value, failure_t *failure);
bool message_flag(json_t *message, const char *key, bool *value, failure_t *failure);
/** [low, high], low < high. */
bool message_range(json_t *message, const char *key, double value[2], failure_t *failure);
/** Shorter than size. */
bool message_text(json_t *message, const char *key, char *value, size_t size, failure_t *failure);

#endif
