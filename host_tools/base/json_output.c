/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/json_output.h"
#include "base/output_file.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

json_t *json_number_or_null(double value) {
    return isfinite(value) ? json_real(value) : json_null();
}

/* How many bytes from here on are a character, or what there is of one; *whole says which. */
static size_t character_length(const unsigned char *c, bool *whole) {
    const size_t length = c[0] < 0x80 ? 1 : c[0] < 0xC2 ? 0 : c[0] < 0xE0 ? 2 : c[0] < 0xF0 ? 3 : c[0] < 0xF5 ? 4 : 0;
    /* Of the second byte: no longer form than is needed, no surrogate, nothing beyond U+10FFFF. */
    unsigned char low = c[0] == 0xE0 ? 0xA0 : c[0] == 0xF0 ? 0x90 : 0x80;
    unsigned char high = c[0] == 0xED ? 0x9F : c[0] == 0xF4 ? 0x8F : 0xBF;
    size_t i = 1;
    while (i < length && c[i] >= low && c[i] <= high) { /* a text's end is neither */
        low = 0x80;
        high = 0xBF;
        i++;
    }
    *whole = i == length;
    return i;
}

json_t *json_text(const char *text) {
    static const char replacement[] = "\xEF\xBF\xBD"; /* U+FFFD */
    if (text == NULL) {
        return json_null();
    }
    char *valid = allocate(3 * strlen(text) + 1, 1); /* each byte may become one */
    size_t length = 0;
    while (*text != '\0') {
        bool whole;
        const size_t bytes = character_length((const unsigned char *)text, &whole);
        memcpy(valid + length, whole ? text : replacement, whole ? bytes : 3);
        length += whole ? bytes : 3;
        text += bytes;
    }
    json_t *const json = json_string(valid);
    free(valid);
    return json;
}

bool json_write(json_t *value, const char *path, failure_t *failure) {
    output_file_t output;
    bool written = output_file_open(&output, path, failure);
    if (written) {
        /* jansson does not say why; what the file does not take, closing it reports. */
        const bool dumped = json_dumpf(value, output.file, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) == 0;
        const bool good = dumped || ferror(output.file) != 0 || fail(failure, "%s: nothing that JSON can hold", path);
        written = output_file_close(&output, good, failure);
    }
    json_decref(value);
    return written;
}
