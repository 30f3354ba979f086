/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/text_line.h"
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { INDENT = 11, WIDTH = 110 };

void text_append(char text[DIAGNOSIS_LINE], const char *format, ...) {
    const size_t length = strlen(text);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text + length, DIAGNOSIS_LINE - length, format, arguments);
    va_end(arguments);
}

const char *text_between(size_t index, size_t count) {
    return index == 0 ? "" : index + 1 < count ? ", " : " and ";
}

/* Up to where a line may break: not inside of "2.95 .. 3.05" and "301.1 +- 0.3". */
static size_t word_length(const char *text) {
    size_t length = strcspn(text, " ");
    while (strncmp(text + length, " .. ", 4) == 0 || strncmp(text + length, " +- ", 4) == 0) {
        length += 4 + strcspn(text + length + 4, " ");
    }
    return length;
}

void text_wrapped(FILE *file, const char *heading, const char *text) {
    fprintf(file, "%-*s", INDENT, heading);
    for (size_t column = INDENT; *text != '\0';) {
        const size_t word = word_length(text);
        if (column > INDENT && column + word >= WIDTH) {
            fprintf(file, "\n%*s", INDENT, "");
            column = INDENT;
        }
        fprintf(file, "%.*s", (int)word, text);
        column += word;
        text += word;
        if (*text == ' ') {
            text++;
            if (*text != '\0' && column + 1 + word_length(text) < WIDTH) {
                fputc(' ', file);
                column++;
            } else if (*text != '\0') {
                column = WIDTH;
            }
        }
    }
    fputc('\n', file);
}
