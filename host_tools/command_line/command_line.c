/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command_line/command_line.h"
#include "base/output_file.h"
#include "base/provenance.h"
#include "command_line/print.h"
#include "command_line/standard_streams.h"
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int usage_error(const command_t *command, const char *format, ...) {
    failure_t failure;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(failure.text, sizeof failure.text, format, arguments);
    va_end(arguments);
    fprintf(stderr, "hyst %s: %s (see hyst %s --help)\n", command->name, failure.text, command->name);
    return STATUS_USAGE;
}

static bool option_is_json(option_kind_t kind) {
    return kind == OPTION_JSON || kind == OPTION_JSON_OR_WORD;
}

const char *option_optional(option_kind_t kind) {
    return option_is_json(kind) ? "[=FILE]" : kind == OPTION_COUNT_IF ? "[=N]" : "";
}

enum { HELP_COLUMN = 33, HELP_WIDTH = 120, HELP_DEEPER = 2 };

/* Behind `column` characters of a line; further lines begin below its first word, or below their parent's. */
static void print_wrapped(const char *text, size_t column) {
    size_t begin = HELP_COLUMN;
    while (*text != '\0') {
        const size_t blanks = strspn(text, " "), word = strcspn(text + blanks, " \n");
        if (column > begin && column + blanks + word > HELP_WIDTH) {
            printf("\n%*s%.*s", (int)begin, "", (int)word, text + blanks);
            column = begin + word;
        } else {
            printf("%.*s", (int)(blanks + word), text);
            column += blanks + word;
        }
        text += blanks + word;
        if (*text == '\n') {
            text++;
            putchar('\n');
            column = 0;
            begin = strspn(text, " ") + HELP_DEEPER;
        }
    }
    putchar('\n');
}

static void print_help(const command_t *command, const option_t *options, size_t count) {
    printf("hyst %s %s\n%s\n\n", command->name, command->arguments, command->summary);
    for (size_t i = 0; i < count; i++) {
        char left[80];
        snprintf(left, sizeof left, "%s%s%s%s%s", options[i].letter != NULL ? options[i].letter : "",
                 options[i].letter != NULL ? ", " : "", options[i].name, options[i].argument != NULL ? " " : "",
                 options[i].argument != NULL ? options[i].argument : option_optional(options[i].kind));
        print_wrapped(options[i].help, (size_t)printf("  %-30s ", left));
    }
    printf("  %-30s %s\n", "--help", "this text");
    if (command->details[0] != '\0') {
        printf("\n%s\n", command->details);
    }
}

static help_writer_t *write_help = print_help;

void options_set_help(help_writer_t *writer) {
    write_help = writer != NULL ? writer : print_help;
}

/* The whole text must be one finite number. */
static bool read_number(const char *text, size_t length, double *number) {
    char copy[64];
    char *end;
    if (length == 0 || length >= sizeof copy) {
        return false;
    }
    memcpy(copy, text, length);
    copy[length] = '\0';
    *number = strtod(copy, &end);
    return end != copy && *end == '\0' && isfinite(*number);
}

static bool read_value(const option_t *option, const char *text) {
    double number[2];
    const char *colon;
    char *end;
    switch (option->kind) {
    case OPTION_TEXT:
    case OPTION_INPUT:
    case OPTION_OUTPUT:
        *(const char **)option->target = text;
        return true;
    case OPTION_NUMBER:
    case OPTION_NONZERO:
        if (!read_number(text, strlen(text), &number[0]) || (option->kind == OPTION_NONZERO && number[0] == 0.0)) {
            return false;
        }
        *(double *)option->target = number[0];
        return true;
    case OPTION_COUNT:
    case OPTION_COUNT_IF:
        if (text[0] < '0' || text[0] > '9') { /* strtoul would accept and wrap a sign */
            return false;
        }
        errno = 0;
        *(unsigned long *)option->target = strtoul(text, &end, 10);
        return *end == '\0' && errno == 0 &&
               (option->kind == OPTION_COUNT ||
                (*(unsigned long *)option->target > 0 && *(unsigned long *)option->target < OPTION_NO_COUNT));
    case OPTION_RANGE:
        colon = strchr(text, ':');
        if (colon == NULL || !read_number(text, (size_t)(colon - text), &number[0]) ||
            !read_number(colon + 1, strlen(colon + 1), &number[1]) || !(number[0] < number[1])) {
            return false;
        }
        memcpy(option->target, number, sizeof number);
        return true;
    case OPTION_FLAG:
    case OPTION_JSON:
    case OPTION_JSON_OR_WORD:
        break;
    }
    return false;
}

/* The option that argument names, and behind '=' its value if it has one. */
static const option_t *find_option(const option_t *options, size_t count, const char *argument, const char **value) {
    const char *equals = argument[1] == '-' ? strchr(argument, '=') : NULL;
    const size_t length = equals != NULL ? (size_t)(equals - argument) : strlen(argument);
    *value = equals != NULL ? equals + 1 : NULL;
    for (size_t i = 0; i < count; i++) {
        const bool long_name = strlen(options[i].name) == length && strncmp(options[i].name, argument, length) == 0;
        if (long_name || (options[i].letter != NULL && strcmp(options[i].letter, argument) == 0)) {
            return &options[i];
        }
    }
    return NULL;
}

static bool looks_like_option(const char *argument) {
    double number;
    return argument[0] == '-' && argument[1] != '\0' && !read_number(argument, strlen(argument), &number);
}

static int check_files(const option_t *options, size_t count, char *const *positional, size_t positionals) {
    const char **output = allocate(count, sizeof *output);
    const char **input = allocate(count + positionals, sizeof *input);
    for (size_t i = 0; i < count; i++) {
        output[i] = options[i].kind == OPTION_OUTPUT  ? *(const char *const *)options[i].target
                    : option_is_json(options[i].kind) ? json_file()
                                                      : NULL;
        input[i] = options[i].kind == OPTION_INPUT ? *(const char *const *)options[i].target : NULL;
        if (input[i] != NULL) {
            provenance_add_file(input[i]);
        }
    }
    for (size_t i = 0; i < positionals; i++) {
        input[count + i] = positional[i];
        provenance_add_file(positional[i]);
    }
    failure_t failure;
    const bool good = output_files_check(output, count, input, count + positionals, &failure);
    free(output);
    free(input);
    return good ? OPTIONS_RUN : failure_print(&failure);
}

static bool ends_in_json(const char *word) {
    const size_t length = strlen(word);
    return length > 5 && strcmp(word + length - 5, ".json") == 0;
}

/* "-" as a name: what the stream is called from now on. false: it cannot be had. */
static bool take_streams(const option_t *options, size_t count, char **positional, size_t positionals, bool json,
                         failure_t *failure) {
    bool good = true;
    for (size_t i = 0; good && i < count; i++) {
        const bool output = options[i].kind == OPTION_OUTPUT;
        const char **file = options[i].target;
        if ((output || options[i].kind == OPTION_INPUT) && *file != NULL && strcmp(*file, "-") == 0) {
            *file = output ? standard_output_take(failure) : standard_input_take(failure);
            good = *file != NULL;
            good =
                good && (!output || !json || json_file() != NULL ||
                         fail(failure, "two outputs on stdout: use --json=FILE, or give %s a file", options[i].name));
        }
    }
    for (size_t i = 0; good && i < positionals; i++) {
        if (strcmp(positional[i], "-") == 0) {
            const char *name = standard_input_take(failure);
            good = name != NULL;
            positional[i] = good ? copy_text(name) : positional[i]; /* for as long as the arguments themselves */
        }
    }
    return good;
}

int options_parse(const command_t *command, const option_t *options, size_t count, int argc, char **argv, size_t least,
                  size_t most, size_t *positionals) {
    bool names_ended = false, json = false;
    failure_t failure;
    *positionals = 0;
    json_into(NULL);
    for (int i = 1; i < argc; i++) {
        char *argument = argv[i];
        const char *value;
        const option_t *option;
        if (names_ended || !looks_like_option(argument)) {
            argv[++*positionals] = argument; /* never overtakes i */
            continue;
        }
        if (strcmp(argument, "--") == 0) {
            names_ended = true;
            continue;
        }
        if (strcmp(argument, "--help") == 0 || strcmp(argument, "-h") == 0) {
            write_help(command, options, count);
            return STATUS_DONE;
        }
        option = find_option(options, count, argument, &value);
        if (option == NULL) {
            return usage_error(command, "unknown option %s", argument);
        }
        if (option_is_json(option->kind)) {
            if (value == NULL && option->kind == OPTION_JSON_OR_WORD && i + 1 < argc && ends_in_json(argv[i + 1])) {
                value = argv[++i];
            }
            if (value != NULL && value[0] == '\0') {
                return usage_error(command, "--json= needs the name of a file");
            }
            json_into(value != NULL && strcmp(value, "-") != 0 ? value : NULL);
            *(bool *)option->target = json = true;
            continue;
        }
        if (option->kind == OPTION_FLAG) {
            if (value != NULL) {
                return usage_error(command, "%s takes no value", option->name);
            }
            *(bool *)option->target = true;
            continue;
        }
        if (option->kind == OPTION_COUNT_IF && value == NULL) {
            *(unsigned long *)option->target = OPTION_NO_COUNT;
            continue;
        }
        if (value == NULL) {
            if (i + 1 >= argc) {
                return usage_error(command, "%s needs a value: %s", option->name, option->argument);
            }
            value = argv[++i];
        }
        if (!read_value(option, value)) {
            return usage_error(command, "%s: '%s' is not a valid %s", option->name, value,
                               option->argument != NULL ? option->argument : "number above 0");
        }
    }
    if (*positionals < least) {
        return usage_error(command, "missing argument, expected: hyst %s %s", command->name, command->arguments);
    }
    if (*positionals > most) {
        return usage_error(command, "too many arguments from '%s' on", argv[most + 1]);
    }
    if (!take_streams(options, count, argv + 1, *positionals, json, &failure)) {
        return usage_error(command, "%s", failure.text);
    }
    return check_files(options, count, argv + 1, *positionals);
}
