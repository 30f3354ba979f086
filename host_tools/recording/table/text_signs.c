/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/table/text_signs.h"
#include <ctype.h>
#include <string.h>

enum { ENOUGH = 3 /* numbers of a kind that are no accident */ };

/* Bytes of a sign between thousands that a text begins with, 0: none. A blank may be one that does not break. */
static size_t sign_between(const char *text, size_t length) {
    static const char *const wide[] = {"\xC2\xA0", "\xE2\x80\xAF", "\xE2\x80\x89", "\xE2\x80\x99"};
    if (length > 0 && strchr(",.' ", text[0]) != NULL) {
        return 1;
    }
    for (size_t i = 0; i < sizeof wide / sizeof wide[0]; i++) {
        if (length >= strlen(wide[i]) && memcmp(text, wide[i], strlen(wide[i])) == 0) {
            return strlen(wide[i]);
        }
    }
    return 0;
}

static size_t digits_of(const char *text, size_t length) {
    size_t count = 0;
    while (count < length && isdigit((unsigned char)text[count])) {
        count++;
    }
    return count;
}

bool text_is_grouped(const char *field, size_t length) {
    const char *at = field, *const end = field + length;
    const char *between = NULL;
    size_t groups = 0;
    at += length > 0 && (*at == '-' || *at == '+') ? 1 : 0;
    const size_t first = digits_of(at, (size_t)(end - at));
    if (first == 0 || first > 3) {
        return false;
    }
    at += first;
    while (at < end) {
        const size_t sign = sign_between(at, (size_t)(end - at));
        const size_t digits = digits_of(at + sign, (size_t)(end - at) - sign);
        if (sign == 0 || digits != 3 || (between != NULL && *between != *at)) {
            break;
        }
        between = at;
        at += sign + digits;
        groups++;
    }
    if (groups > 0 && at < end && (*at == '.' || *at == ',') && *at != *between) { /* decimals */
        at += 1 + digits_of(at + 1, (size_t)(end - at) - 1);
    }
    return groups > 0 && at == end;
}

bool text_groups_count(text_groups_t *groups, const char *field, size_t length) {
    const size_t sign = length > 0 && (*field == '-' || *field == '+') ? 1 : 0;
    const size_t digits = digits_of(field + sign, length - sign);
    const bool grouped = text_is_grouped(field, length) && field[sign] != '0';
    const bool shorter = digits > 0 && digits <= 3 && sign + digits == length;
    groups->grouped += grouped;
    groups->shorter += shorter;
    groups->others += !grouped && !shorter;
    return grouped;
}

bool text_groups_are_even(const text_groups_t *groups) {
    return groups->grouped >= ENOUGH && groups->others == 0;
}

bool text_groups_are_thousands(const text_groups_t *groups) {
    return text_groups_are_even(groups) && groups->shorter > 0;
}

const char *text_signs_problem(const text_signs_t *signs) {
    if (signs->names < 2 || signs->fields <= signs->names) {
        return NULL;
    }
    return signs->whole ? "all whole numbers: decimal commas and separators are the same sign: export with "
                          "semicolons between columns, or with decimal points"
           : signs->thousands
               ? "one of up to three digits before one of three: signs between thousands are separators, "
                 "too: export the numbers without them"
               : NULL;
}
