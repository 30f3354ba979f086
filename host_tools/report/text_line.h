/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Text of a diagnosis, composed piece by piece. */
#ifndef TEXT_LINE_H
#define TEXT_LINE_H

#include <stddef.h>
#include <stdio.h>

enum { DIAGNOSIS_LINE = 1000 };

/** Appends; truncates what does not fit. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
void text_append(char text[DIAGNOSIS_LINE], const char *format, ...);

/** The separator before item `index` of `count`: "a", "a and b", "a, b and c". */
const char *text_between(size_t index, size_t count);

/** A paragraph behind a heading of a word or none, in lines of a terminal's width. */
void text_wrapped(FILE *file, const char *heading, const char *text);

#endif
