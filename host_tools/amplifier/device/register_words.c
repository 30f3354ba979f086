/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/device/register_words.h"
#include <inttypes.h>
#include <stdio.h>

static int64_t decode(register_type_t type, const uint16_t *words) {
    if (REGISTER_SIZE(type) == 1) {
        return words[0];
    }
    const uint32_t whole = ((uint32_t)words[0] << 16) | words[1];
    return type == REGISTER_U32 ? (int64_t)whole : (int64_t)(int32_t)whole;
}

request_t register_words_request(int first, int last, uint16_t *words) {
    const int start = register_table[first].address;
    const int end = register_table[last].address + (int)REGISTER_SIZE(register_table[last].type);
    return (request_t){.what = register_table[first].name, .address = start, .count = end - start, .read = words};
}

void register_words_decode(int first, int last, const uint16_t *words, int64_t *value) {
    for (int i = first; i <= last; i++) {
        value[i] = decode(register_table[i].type, words + (register_table[i].address - register_table[first].address));
    }
}

void register_words_name(int first, int last, char what[REGISTER_SPAN_NAME]) {
    if (first == last) {
        (void)snprintf(what, REGISTER_SPAN_NAME, "register %s", register_table[first].name);
    } else {
        (void)snprintf(what, REGISTER_SPAN_NAME, "registers %s to %s", register_table[first].name,
                       register_table[last].name);
    }
}

bool register_words_read(serial_line_t *line, int first, int last, int64_t *value, failure_t *failure) {
    uint16_t words[MODBUS_MAX_READ_REGISTERS];
    const request_t request = register_words_request(first, last, words);
    if (serial_line_request(line, &request, REGISTER_TRIES, NULL, failure) != LINE_DONE) {
        return false;
    }
    register_words_decode(first, last, words, value);
    return true;
}

void register_words_range(int which, int64_t *low, int64_t *high) {
    const register_type_t type = register_table[which].type;
    const bool is_signed = REGISTER_SIZE(type) == 2 && type != REGISTER_U32;
    *low = is_signed ? INT32_MIN : 0;
    *high = is_signed ? INT32_MAX : REGISTER_SIZE(type) == 2 ? UINT32_MAX : UINT16_MAX;
}

bool register_words_append(int which, int64_t value, uint16_t *words, int *count, failure_t *failure) {
    const uint32_t whole = (uint32_t)value;
    int64_t low, high;
    register_words_range(which, &low, &high);
    if (value < low || value > high) {
        return fail(failure, "register %s takes %" PRId64 " to %" PRId64 ", not %" PRId64, register_table[which].name,
                    low, high, value);
    }
    if (REGISTER_SIZE(register_table[which].type) == 2) {
        words[(*count)++] = (uint16_t)(whole >> 16);
    }
    words[(*count)++] = (uint16_t)whole;
    return true;
}
