/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/prose.h"
#include "page/svg_plot.h"
#include <ctype.h>
#include <stdbool.h>
#include <string.h>

/* A unit ends where its word does: "us" is in "use", too. */
static bool stands_here(const char *text, const char *plain) {
    const size_t length = strlen(plain);
    return strncmp(text, plain, length) == 0 &&
           !(isalpha((unsigned char)plain[length - 1]) != 0 && isalpha((unsigned char)text[length]) != 0);
}

void write_prose(FILE *file, const char *text) {
    static const struct {
        const char *plain, *html;
    } better[] = {{" +- ", "&nbsp;±&nbsp;"}, {" .. ", "&nbsp;to&nbsp;"}, {" %", "&nbsp;%"},
                  {" um", "&nbsp;µm"},       {" us", "&nbsp;µs"},        {" uV", "&nbsp;µV"}};
    while (*text != '\0') {
        size_t i = 0;
        while (i < sizeof better / sizeof better[0] && !stands_here(text, better[i].plain)) {
            i++;
        }
        if (i < sizeof better / sizeof better[0]) {
            fputs(better[i].html, file);
            text += strlen(better[i].plain);
        } else {
            write_escaped(file, (const char[]){*text++, '\0'});
        }
    }
}
