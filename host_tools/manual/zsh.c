/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Completion for zsh: the specifications of _arguments for each command. */
#include "manual/manual.h"
#include <string.h>

/* Text inside single quotes, with what _arguments and _describe reserve escaped; its first line. */
static void put_escaped(FILE *out, const char *text) {
    for (; *text != '\0' && *text != '\n'; text++) {
        if (*text == '\'') {
            fputs("'\\''", out);
        } else {
            fprintf(out, strchr(":[]\\", *text) != NULL ? "\\%c" : "%c", *text);
        }
    }
}

static void begin(FILE *out) {
    fputs("#compdef hyst\n"
          "# Completion of hyst for zsh. Made from the option tables by hyst_manual.\n"
          "_hyst() {\n"
          "    local -a commands\n"
          "    commands=(\n",
          out);
    for (size_t i = 0; i < commands_count; i++) {
        fprintf(out, "        '%s:", commands[i]->name);
        put_escaped(out, commands[i]->summary);
        fputs("'\n", out);
    }
    fputs("    )\n"
          "    if ((CURRENT == 2)); then\n"
          "        if [[ $PREFIX == -* ]]; then\n"
          "            compadd -- --help --version\n"
          "        else\n"
          "            _describe -t commands 'command' commands -- '(help:\"the options of a command\")'\n"
          "        fi\n"
          "        return\n"
          "    fi\n"
          "    shift words\n"
          "    ((CURRENT--))\n"
          "    case $words[1] in\n"
          "    help) _describe -t commands 'command' commands ;;\n",
          out);
}

/* ":N: " after the option: its name, and what completes it. */
static void put_values(FILE *out, const option_t *option) {
    char words[VALUE_WORDS];
    fputc(':', out);
    put_escaped(out, option->argument);
    switch (option_values(option, words)) {
    case VALUES_LISTED:
        fprintf(out, ":(%s)", words);
        break;
    case VALUES_PORT:
        fputs(":{compadd -f -- /dev/tty*(N); _files}", out);
        break;
    case VALUES_FILE:
        fputs(":_files", out);
        break;
    case VALUES_FREE:
        fputs(": ", out);
    }
}

static void put_command(FILE *out, const command_t *command, const option_t *options, size_t count) {
    fprintf(out, "    %s)\n        _arguments -S \\\n", command->name);
    for (size_t i = 0; i < count; i++) {
        const option_t *option = &options[i];
        const bool flag = option->argument == NULL;
        fputs("            ", out);
        if (option->letter != NULL) {
            fprintf(out, "'(%s %s)'{%s,%s%s}", option->letter, option->name, option->letter, option->name,
                    flag ? "" : "=");
        } else {
            fprintf(out, "%s%s", option->name, flag ? "" : "=");
        }
        fputs("'[", out);
        put_escaped(out, option->help);
        fputc(']', out);
        if (!flag) {
            put_values(out, option);
        }
        fputs("' \\\n", out);
    }
    fprintf(out, "            '(- *)'{-h,--help}'[a summary of the command]'%s ;;\n",
            takes_files(command) ? " \\\n            '*:file:_files'" : "");
}

static void end(FILE *out) {
    fputs("    esac\n"
          "}\n"
          "if [[ $funcstack[1] == _hyst ]]; then\n"
          "    _hyst \"$@\"\n"
          "else\n"
          "    compdef _hyst hyst\n"
          "fi\n",
          out);
}

const completion_t completion_zsh = {"hyst.zsh", begin, put_command, end};
