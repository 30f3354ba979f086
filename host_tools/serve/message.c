/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "serve/message.h"
#include <limits.h>
#include <string.h>

bool message_number(json_t *message, const char *key, double *value, failure_t *failure) {
    const json_t *const member = json_object_get(message, key);
    if (member == NULL) {
        return true;
    }
    *value = json_number_value(member);
    return json_is_number(member) || fail(failure, "%s: not a number", key);
}

bool message_count(json_t *message, const char *key, unsigned long *value, failure_t *failure) {
    const json_t *const member = json_object_get(message, key);
    if (member == NULL) {
        return true;
    }
    const json_int_t whole = json_integer_value(member);
    if (!json_is_integer(member) || whole < 0 || whole > UINT_MAX) {
        return fail(failure, "%s: not a whole number of 0 or more", key);
    }
    *value = (unsigned long)whole;
    return true;
}

bool message_flag(json_t *message, const char *key, bool *value, failure_t *failure) {
    const json_t *const member = json_object_get(message, key);
    if (member == NULL) {
        return true;
    }
    *value = json_is_true(member);
    return json_is_boolean(member) || fail(failure, "%s: not true or false", key);
}

bool message_range(json_t *message, const char *key, double value[2], failure_t *failure) {
    const json_t *const member = json_object_get(message, key);
    if (member == NULL) {
        return true;
    }
    if (json_array_size(member) != 2 || !json_is_number(json_array_get(member, 0)) ||
        !json_is_number(json_array_get(member, 1))) {
        return fail(failure, "%s: not two numbers", key);
    }
    value[0] = json_number_value(json_array_get(member, 0));
    value[1] = json_number_value(json_array_get(member, 1));
    return value[0] < value[1] || fail(failure, "%s: the first has to be below the second", key);
}

bool message_text(json_t *message, const char *key, char *value, size_t size, failure_t *failure) {
    const json_t *const member = json_object_get(message, key);
    if (member == NULL) {
        return true;
    }
    if (!json_is_string(member) || json_string_length(member) >= size ||
        strlen(json_string_value(member)) != json_string_length(member)) {
        return fail(failure, "%s: not a text of less than %zu characters", key, size);
    }
    memcpy(value, json_string_value(member), json_string_length(member) + 1);
    return true;
}
