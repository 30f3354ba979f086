/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What the build makes from the option tables of the commands: a manual page each, and completion for three shells.
 * Only the program hyst_manual (manual.c) calls these; `hyst` itself does not have them.
 */
#ifndef MANUAL_H
#define MANUAL_H

#include "commands/command.h"
#include <stdio.h>

/** Page hyst-NAME(1) of one command, in the macros of man(7). `date`: YYYY-MM-DD, of the build. */
void manual_page(FILE *out, const char *date, const command_t *command, const option_t *options, size_t count);

/** Page hyst(1), of the whole. */
void manual_overview(FILE *out, const char *date);

/** Tables of the program for the documents: docs/THRESHOLDS.md, and the stages in docs/DIAGNOSIS.md. */
void manual_thresholds(FILE *out);
void manual_stages(FILE *out);

/** What can stand as the argument of an option. */
typedef enum {
    VALUES_FREE,   /**< a number or a text */
    VALUES_LISTED, /**< one of a few words */
    VALUES_PORT,   /**< a serial port */
    VALUES_FILE
} values_t;

enum { VALUE_WORDS = 4096 };

/** Which, of an option that is no flag; words: VALUES_LISTED with spaces between, else empty. */
values_t option_values(const option_t *option, char words[VALUE_WORDS]);

/** Whether the positional arguments of a command are files. */
bool takes_files(const command_t *command);

/** The script that a shell loads for `hyst`: begin, then each command, then end. */
typedef struct {
    const char *file; /**< its name */
    void (*begin)(FILE *out);
    void (*command)(FILE *out, const command_t *command, const option_t *options, size_t count);
    void (*end)(FILE *out);
} completion_t;

extern const completion_t completion_bash, completion_zsh, completion_fish;

#endif
