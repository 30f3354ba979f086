/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Completion for fish: one line `complete` for each command and each option. */
#include "manual/manual.h"
#include <string.h>

/* The first line of a text inside single quotes. */
static void put_quoted(FILE *out, const char *text) {
    fputc('\'', out);
    for (; *text != '\0' && *text != '\n'; text++) {
        fprintf(out, *text == '\'' || *text == '\\' ? "\\%c" : "%c", *text);
    }
    fputs("'\n", out);
}

static void begin(FILE *out) {
    fputs("# Completion of hyst for fish. Made from the option tables by hyst_manual.\n"
          "function __hyst_command --description 'whether the command before the cursor is the given one; none: no "
          "command'\n"
          "    set -l words (commandline -opc)\n"
          "    if not set -q argv[1]\n"
          "        test (count $words) -eq 1\n"
          "    else\n"
          "        test (count $words) -ge 2; and test $words[2] = $argv[1]\n"
          "    end\n"
          "end\n"
          "complete -c hyst -f\n"
          "complete -c hyst -n __hyst_command -a help -d 'the options of a command'\n"
          "complete -c hyst -n __hyst_command -l help -s h -d 'the commands'\n"
          "complete -c hyst -n __hyst_command -l version -s V -d 'the version'\n",
          out);
    for (size_t i = 0; i < commands_count; i++) {
        fprintf(out, "complete -c hyst -n __hyst_command -a %s -d ", commands[i]->name);
        put_quoted(out, commands[i]->summary);
        fprintf(out, "complete -c hyst -n '__hyst_command help' -a %s -d ", commands[i]->name);
        put_quoted(out, commands[i]->summary);
    }
}

static void put_values(FILE *out, const option_t *option) {
    char words[VALUE_WORDS];
    switch (option_values(option, words)) {
    case VALUES_LISTED:
        fprintf(out, " -x -a '%s'", words);
        break;
    case VALUES_PORT:
        fputs(" -x -a '(__fish_complete_path /dev/tty)'", out);
        break;
    case VALUES_FILE:
        fputs(" -r -F", out);
        break;
    case VALUES_FREE:
        fputs(" -x", out);
    }
}

static void put_command(FILE *out, const command_t *command, const option_t *options, size_t count) {
    if (takes_files(command)) {
        fprintf(out, "complete -c hyst -n '__hyst_command %s' -F\n", command->name);
    }
    for (size_t i = 0; i < count; i++) {
        fprintf(out, "complete -c hyst -n '__hyst_command %s' -l %s", command->name, options[i].name + 2);
        if (options[i].letter != NULL) {
            fprintf(out, " -s %s", options[i].letter + 1);
        }
        if (options[i].argument != NULL) {
            put_values(out, &options[i]);
        }
        fputs(" -d ", out);
        put_quoted(out, options[i].help);
    }
    fprintf(out, "complete -c hyst -n '__hyst_command %s' -l help -s h -d 'a summary of the command'\n", command->name);
}

static void end(FILE *out) {
    (void)out;
}

const completion_t completion_fish = {"hyst.fish", begin, put_command, end};
