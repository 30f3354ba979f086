/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * One clear line about what went wrong and where.
 *
 * A function that can fail takes a failure_t * and returns false (or NULL) after filling it through fail(). Nobody
 * prints on the way; the command prints the line once, to stderr, and ends with the exit status that belongs to it.
 */
#ifndef FAILURE_H
#define FAILURE_H

#include <stdbool.h>
#include <stddef.h>

/** Exit statuses of every `hyst` command. They are a contract with scripts. */
enum { STATUS_DONE = 0, STATUS_FAILED = 1 /* the input or the device is at fault */, STATUS_USAGE = 2 };

typedef struct {
    char text[1024]; /**< one line without a newline; control characters of the input are shown as '?' */
} failure_t;

/** Fills *failure with the formatted line. Always returns false, so that callers can write `return fail(...)`. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
bool fail(failure_t *failure, const char *format, ...);

/** Puts "context: " in front of the line. Returns false. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
bool fail_in(failure_t *failure, const char *format, ...);

/** Prints "hyst: line" to stderr. Returns STATUS_FAILED. */
int failure_print(const failure_t *failure);

/** malloc, calloc and realloc of count elements that end the program with a line instead of returning NULL. count 0 is
 * allowed. */
void *allocate(size_t count, size_t size);
void *reallocate(void *memory, size_t count, size_t size);
char *copy_text(const char *text);

#endif
