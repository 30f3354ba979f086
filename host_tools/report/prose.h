/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef PROSE_H
#define PROSE_H

#include <stdio.h>

/** The terminal's text in the characters of a page: a plus-minus sign, "to" in ranges (a dash reads as a minus sign
 * before a negative number), micrometres. Lines do not break at a plus-minus sign, before a unit or a percent sign. */
void write_prose(FILE *file, const char *text);

#endif
