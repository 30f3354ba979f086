/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The header keys of this project's CSV, also as a spreadsheet writes the file anew: with a byte order mark, quotes
 * around lines, and the separators of empty cells behind them. */
#include "recording/recording.h"
#include "recording/table/column.h"
#include <stdio.h>
#include <string.h>

static void cut_behind(char *text, const char *signs) {
    size_t length = strlen(text);
    while (length > 0 && strchr(signs, text[length - 1]) != NULL) {
        text[--length] = '\0';
    }
}

void recording_cut_cells(char *text) {
    cut_behind(text, " \t\r\n,;");
}

/* "key: value" behind the sign for a remark: the key, and *value. NULL: the line is no remark. "": it has no key. */
static char *key_of(char *line, char **value) {
    static const char mark[] = "\xEF\xBB\xBF";
    char *key = strncmp(line, mark, strlen(mark)) == 0 ? line + strlen(mark) : line;
    const bool quoted = *key == '"';
    key += strspn(key, " \t\"");
    if (*key != '#') {
        return NULL;
    }
    key += 1 + strspn(key + 1, " \t");
    char *const colon = strchr(key, ':');
    if (colon == NULL) {
        *key = '\0';
        return key;
    }
    *colon = '\0';
    cut_behind(key, " \t");
    *value = colon + 1 + strspn(colon + 1, " \t");
    cut_behind(*value, quoted ? " \t\r\n,;\"" : " \t\r\n,;");
    return key;
}

/* Keys that are not the recording's, but of its rate or of a column. */
static bool is_of_columns(const char *key) {
    static const char *const endings[] = {COLUMN_UNIT_KEY, COLUMN_LONG_NAME_KEY};
    const size_t length = strlen(key);
    bool is = recording_is_unit_key(key);
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++) {
        const size_t ending = strlen(endings[i]);
        is = is || (length > ending && strcmp(key + length - ending, endings[i]) == 0);
    }
    return is;
}

void recording_take_header(recording_t *recording, const char *path) {
    char line[RECORDING_MAX_LINE + 2], *key, *value = NULL;
    bool own = false;
    FILE *file = fopen(path, "rb");
    for (int pass = 0; file != NULL && pass < 2; pass++) {
        while (fgets(line, sizeof line, file) != NULL && (key = key_of(line, &value)) != NULL) {
            own = own || strcmp(key, "sample_rate_hz") == 0;
            if (pass == 1 && own && key[0] != '\0' && !is_of_columns(key) && recording_key(recording, key) == NULL) {
                recording_set_key(recording, key, value);
            }
        }
        rewind(file);
    }
    if (file != NULL) {
        fclose(file);
    }
}
