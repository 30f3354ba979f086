/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Subcommands of `hyst`. A new one is one file that defines a command_t, and one line in COMMANDS below.
 */
#ifndef COMMAND_H
#define COMMAND_H

#include "failure.h"
#include <stddef.h>

typedef struct {
    const char *name;
    const char *arguments; /**< positional arguments as the help shows them: "MODEL RECORDING" */
    const char *summary;   /**< one line */
    const char *details;   /**< further lines of `hyst NAME --help`, or "" */
    /** argv[0] is the name of the command. Returns the exit status. */
    int (*run)(int argc, char **argv);
} command_t;

/* In the order in which `hyst --help` lists them. */
#define COMMANDS(COMMAND)                                                                                              \
    COMMAND(fit)                                                                                                       \
    COMMAND(simulate)                                                                                                  \
    COMMAND(diagnose)                                                                                                  \
    COMMAND(compile)                                                                                                   \
    COMMAND(blocks)                                                                                                    \
    COMMAND(push)                                                                                                      \
    COMMAND(pull)                                                                                                      \
    COMMAND(info)                                                                                                      \
    COMMAND(monitor)                                                                                                   \
    COMMAND(record)                                                                                                    \
    COMMAND(track)                                                                                                     \
    COMMAND(report)                                                                                                    \
    COMMAND(twin)                                                                                                      \
    COMMAND(bench)

#define COMMAND_DECLARE(name) extern const command_t command_##name;
COMMANDS(COMMAND_DECLARE)
#undef COMMAND_DECLARE

/** How an option's argument is read, and what `target` points to. */
typedef enum {
    OPTION_FLAG,   /**< no argument; bool, set to true */
    OPTION_TEXT,   /**< const char * */
    OPTION_NUMBER, /**< double, finite */
    OPTION_COUNT,  /**< unsigned long, not negative */
    OPTION_RANGE   /**< double[2] from LO:HI, finite, LO < HI */
} option_kind_t;

typedef struct {
    const char *name;   /**< "--operators" */
    const char *letter; /**< "-o" or NULL */
    option_kind_t kind;
    const char *argument; /**< how the help names the argument: "N"; NULL for a flag */
    const char *help;
    void *target; /**< left alone when the option is not given, so it holds the default */
} option_t;

/** Returned by options_parse when the command shall run. Any other value is the exit status. */
enum { OPTIONS_RUN = -1 };

/**
 * Reads options and positional arguments in any order ("--name value", "--name=value", "-o value"; "--" ends the
 * options; numbers may be negative) and moves the positional ones to argv[1..*positionals]. --help prints the command's
 * help and yields STATUS_DONE. An unknown option, a bad value, or a number of positional arguments outside [least,
 * most] is one line on stderr and STATUS_USAGE.
 */
int options_parse(const command_t *command, const option_t *options, size_t count, int argc, char **argv, size_t least,
                  size_t most, size_t *positionals);

/** "hyst NAME: line" on stderr. Returns STATUS_USAGE. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
int usage_error(const command_t *command, const char *format, ...);

#endif
