/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Completion for bash: the commands, their options, and the values of options that take one of a few words or a file.
 */
#include "manual/manual.h"

static void put_commands(FILE *out) {
    for (size_t i = 0; i < commands_count; i++) {
        fprintf(out, "%s ", commands[i]->name);
    }
}

static void begin(FILE *out) {
    fputs("# Completion of hyst for bash. Made from the option tables by hyst_manual.\n"
          "_hyst() {\n"
          "    local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]}\n"
          "    local command=${COMP_WORDS[1]} words='' files=''\n"
          "    COMPREPLY=()\n"
          "    # bash takes the = of --option=value for a word\n"
          "    if [[ $current == = ]]; then\n"
          "        current=''\n"
          "    elif [[ $before == = ]]; then\n"
          "        before=${COMP_WORDS[COMP_CWORD - 2]}\n"
          "    fi\n"
          "    if ((COMP_CWORD == 1)); then\n"
          "        command=''\n"
          "    fi\n"
          "    case \"$command $before\" in\n"
          "    ' '*) words='",
          out);
    put_commands(out);
    fputs("help --help --version' ;;\n    'help '*) words='", out);
    put_commands(out);
    fputs("' ;;\n", out);
}

static void put_values(FILE *out, const option_t *option) {
    char words[VALUE_WORDS];
    switch (option_values(option, words)) {
    case VALUES_LISTED:
        fprintf(out, "words='%s' ;;\n", words);
        break;
    case VALUES_PORT:
        fputs("words='' files='/dev/tty' ;;\n", out);
        break;
    case VALUES_FILE:
        fputs("words='' files='*' ;;\n", out);
        break;
    case VALUES_FREE:
        fputs("words='' ;;\n", out);
    }
}

static void put_command(FILE *out, const command_t *command, const option_t *options, size_t count) {
    for (size_t i = 0; i < count; i++) {
        if (options[i].argument == NULL) {
            continue;
        }
        fprintf(out, "    '%s %s'", command->name, options[i].name);
        if (options[i].letter != NULL) {
            fprintf(out, " | '%s %s'", command->name, options[i].letter);
        }
        fputs(") ", out);
        put_values(out, &options[i]);
    }
    fprintf(out, "    '%s '*) words='", command->name);
    for (size_t i = 0; i < count; i++) {
        fprintf(out, "%s ", options[i].name);
    }
    fprintf(out, "--help'%s ;;\n", takes_files(command) ? " files='*'" : "");
}

static void end(FILE *out) {
    fputs("    esac\n"
          "    # options only where one is begun, so that files come first\n"
          "    if [[ $files == '*' && -n $words && $current != -* ]]; then\n"
          "        words=''\n"
          "    fi\n"
          "    if [[ -n $words ]]; then\n"
          "        mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$current\")\n"
          "    fi\n"
          "    if [[ -n $files && $current != -* ]]; then\n"
          "        if [[ $files != '*' && -z $current ]]; then\n"
          "            current=$files\n"
          "        fi\n"
          "        compopt -o filenames 2> /dev/null\n"
          "        mapfile -t -O \"${#COMPREPLY[@]}\" COMPREPLY < <(compgen -f -- \"$current\")\n"
          "    fi\n"
          "}\n"
          "complete -F _hyst hyst\n",
          out);
}

const completion_t completion_bash = {"hyst.bash", begin, put_command, end};
