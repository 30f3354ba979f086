/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/failure.h"
#include "base/shown_name.h"
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A message may quote a broken file: whatever is not printable must not reach the terminal. UTF-8 is left alone. */
static void make_printable(char *text) {
    for (; *text != '\0'; text++) {
        const unsigned char c = (unsigned char)*text;
        if (c < 0x20 || c == 0x7F) {
            *text = '?';
        }
    }
}

bool fail(failure_t *failure, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(failure->text, sizeof failure->text, format, arguments);
    va_end(arguments);
    make_printable(failure->text);
    shown_names_put_in(failure->text, sizeof failure->text);
    return false;
}

bool fail_in(failure_t *failure, const char *format, ...) {
    char context[sizeof failure->text / 2];
    const failure_t inner = *failure;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(context, sizeof context, format, arguments);
    va_end(arguments);
    return fail(failure, "%s: %.*s", context, (int)(sizeof inner.text / 2), inner.text);
}

static out_of_memory_t *out_of_memory;

void on_out_of_memory(out_of_memory_t *handler) {
    out_of_memory = handler;
}

static void give_up(size_t count, size_t size) {
    if (out_of_memory != NULL) {
        out_of_memory(count, size);
    }
    abort();
}

void *allocate(size_t count, size_t size) {
    void *memory = calloc(count > 0 ? count : 1, size);
    if (memory == NULL) {
        give_up(count, size);
    }
    return memory;
}

void *reallocate(void *memory, size_t count, size_t size) {
    void *larger = count <= SIZE_MAX / size ? realloc(memory, (count > 0 ? count : 1) * size) : NULL;
    if (larger == NULL) {
        give_up(count, size);
    }
    return larger;
}

char *copy_text(const char *text) {
    const size_t size = strlen(text) + 1;
    return memcpy(allocate(size, 1), text, size);
}
