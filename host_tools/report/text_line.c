/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/text_line.h"
#include <math.h>
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

/* Precision for %.*g: the value to two digits of its error. */
static int digits_of(double value, double sigma) {
    const int digits = 2 + (int)floor(log10(fabs(value))) - (int)floor(log10(sigma));
    return digits < 2 ? 2 : digits > 9 ? 9 : digits;
}

void text_append_value(char text[DIAGNOSIS_LINE], double value, double sigma) {
    if (isfinite(sigma) && sigma > 0.0 && value != 0.0) {
        text_append(text, "%.*g +- %.2g", digits_of(value, sigma), value, sigma);
    } else {
        text_append(text, "%.4g", value);
    }
}

void text_wrapped(FILE *file, const char *heading, const char *text) {
    fprintf(file, "%-*s", INDENT, heading);
    for (size_t column = INDENT; *text != '\0';) {
        const size_t word = strcspn(text, " ");
        if (column > INDENT && column + word >= WIDTH) {
            fprintf(file, "\n%*s", INDENT, "");
            column = INDENT;
        }
        fprintf(file, "%.*s", (int)word, text);
        column += word;
        text += word;
        if (*text == ' ') {
            text++;
            if (*text != '\0' && column + 1 + strcspn(text, " ") < WIDTH) {
                fputc(' ', file);
                column++;
            } else if (*text != '\0') {
                column = WIDTH;
            }
        }
    }
    fputc('\n', file);
}
