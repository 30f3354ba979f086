/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The command line of a subcommand: its description, its options, and how they are read.
 */
#ifndef COMMAND_LINE_H
#define COMMAND_LINE_H

#include "base/failure.h"
#include <limits.h>
#include <stddef.h>

typedef struct {
    const char *name;
    unsigned order;        /**< position in `hyst --help`; multiples of ten leave room for later ones */
    const char *arguments; /**< positional arguments as the help shows them: "MODEL RECORDING" */
    const char *summary;   /**< one line */
    const char *details;   /**< further lines of `hyst NAME --help`, or "" */
    /** argv[0] is the name of the command. Returns the exit status. */
    int (*run)(int argc, char **argv);
    const char *files;    /**< for the manual page: lines "NAME: what is read or written, and its format"; or NULL */
    const char *examples; /**< for the manual page: lines "# what for", each followed by its command lines */
} command_t;

/** How an option's argument is read, and what `target` points to. */
typedef enum {
    OPTION_FLAG,        /**< no argument; bool, set to true */
    OPTION_TEXT,        /**< const char * */
    OPTION_INPUT,       /**< const char *, a file that is read */
    OPTION_OUTPUT,      /**< const char *, a file that is written: see options_parse */
    OPTION_NUMBER,      /**< double, finite */
    OPTION_NONZERO,     /**< the same, where 0 in the target means that it was not given */
    OPTION_COUNT,       /**< unsigned long, not negative */
    OPTION_COUNT_IF,    /**< unsigned long, "--name=N" above 0, or "--name" alone: OPTION_NO_COUNT */
    OPTION_RANGE,       /**< double[2] from LO:HI, finite, LO < HI */
    OPTION_JSON,        /**< bool, set to true; "--json" or "--json=FILE": JSON_OPTION */
    OPTION_JSON_OR_WORD /**< the same; a next word that ends in .json is the FILE, as it was in earlier versions */
} option_kind_t;

/** Of an OPTION_COUNT_IF that was given without a number. */
#define OPTION_NO_COUNT ULONG_MAX

typedef struct {
    const char *name;   /**< "--operators" */
    const char *letter; /**< "-o" or NULL */
    option_kind_t kind;
    const char *argument; /**< how the help names the argument: "N"; NULL for a flag */
    const char *help;
    void *target; /**< left alone when the option is not given, so it holds the default */
} option_t;

/** "[=FILE]", "[=N]": what may follow the name of an option of this kind; "" for others. */
const char *option_optional(option_kind_t kind);

/** The line of an option_t table for --json[=FILE], alike in all commands; print.h writes what it asks for. */
#define JSON_OPTION(target) JSON_OPTION_KIND(OPTION_JSON, target)
#define JSON_OPTION_KIND(kind, target)                                                                                 \
    { "--json", NULL, (kind), NULL, "the answer for programs: on stdout in place of the text, or into FILE", (target) }

/** Prints the help of a command, or what else is made of its option table. */
typedef void help_writer_t(const command_t *command, const option_t *options, size_t count);

/**
 * What --help does from now on; NULL: the text on stdout, which is the default. For the program that makes the manual
 * pages and the completion of shells at build time. Not for use beside a thread that parses options.
 */
void options_set_help(help_writer_t *writer);

/** Returned by options_parse when the command shall run. Any other value is the exit status. */
enum { OPTIONS_RUN = -1 };

/**
 * Reads options and positional arguments in any order ("--name value", "--name=value", "-o value"; "--" ends the
 * options; numbers may be negative) and moves the positional ones to argv[1..*positionals]. --help prints the command's
 * help and yields STATUS_DONE. An unknown option, a bad value, or a number of positional arguments outside [least,
 * most] is one line on stderr and STATUS_USAGE.
 *
 * "-" stands for the standard streams: as an input or a positional argument for stdin, as an output for stdout
 * (standard_streams.h); the text of the command then goes to stderr.
 *
 * Each OPTION_OUTPUT whose target is not NULL is tried (output_files_check): a file that cannot be written, or that is
 * an input, is one line and STATUS_FAILED. Inputs are the OPTION_INPUT and all positional arguments. A command whose
 * arguments name files in another way checks those itself. Inputs are noted for what results say of their origin
 * (base/provenance.h).
 */
int options_parse(const command_t *command, const option_t *options, size_t count, int argc, char **argv, size_t least,
                  size_t most, size_t *positionals);

/** "hyst NAME: line" on stderr. Returns STATUS_USAGE. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
int usage_error(const command_t *command, const char *format, ...);

#endif
