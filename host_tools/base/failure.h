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

/**
 * Called when there is no memory for `count` elements of `size` bytes. It must not return: it ends the program, or
 * leaves by longjmp. Without a handler, or if it returns, the process is aborted: no caller of allocate looks for NULL.
 */
typedef void out_of_memory_t(size_t count, size_t size);
/** Sets the handler of the whole process; NULL: none. */
void on_out_of_memory(out_of_memory_t *handler);

/** calloc, realloc and strdup that never return NULL (on_out_of_memory). count 0 is allowed. */
void *allocate(size_t count, size_t size);
void *reallocate(void *memory, size_t count, size_t size);
char *copy_text(const char *text);

#endif
