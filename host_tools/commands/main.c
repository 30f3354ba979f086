/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/provenance.h"
#include "command_line/ending_signals.h"
#include "command_line/progress_bar.h"
#include "commands/command.h"
#include "numerics/blas.h"
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void print_help(void) {
    puts("hyst COMMAND ...\n\n" HYST_PURPOSE "\n");
    for (size_t i = 0; i < commands_count; i++) {
        printf("  %-10s %s\n", commands[i]->name, commands[i]->summary);
    }
    puts("\nhyst help COMMAND explains one, as hyst COMMAND --help does; hyst --version prints the version.\n"
         "--json gives the answer for programs on stdout, --json=FILE in a file; - stands for stdin or stdout.\n"
         "No output is coloured, with NO_COLOR or without it.\n"
         "Exit status: " HYST_EXIT_STATUS);
}

static const command_t *find_command(const char *name) {
    for (size_t i = 0; i < commands_count; i++) {
        if (strcmp(name, commands[i]->name) == 0) {
            return commands[i];
        }
    }
    fprintf(stderr, "hyst: unknown command '%s'. See hyst --help\n", name);
    return NULL;
}

/* `hyst help`, `hyst help COMMAND`. Returns the exit status. */
static int help(int argc, char **argv) {
    char ask[] = "--help";
    if (argc < 2) {
        print_help();
        return STATUS_DONE;
    }
    if (argc > 2) {
        fprintf(stderr, "hyst help: too many arguments from '%s' on\n", argv[2]);
        return STATUS_USAGE;
    }
    const command_t *command = find_command(argv[1]);
    char *request[] = {argv[1], ask, NULL};
    return command != NULL ? command->run(2, request) : STATUS_USAGE;
}

/* A result that did not reach a full disk or a closed pipe must not look like success. */
static int finish(int status) {
    failure_t failure;
    if (!json_end(status == STATUS_DONE, &failure) && status == STATUS_DONE) {
        return failure_print(&failure);
    }
    if (fflush(stdout) != 0 || ferror(stdout)) {
        if (reader_has_left()) { /* quietly, as other commands end: these waited until all was in order */
            (void)signal(SIGPIPE, SIG_DFL);
            (void)raise(SIGPIPE);
        }
        if (status == STATUS_DONE) { /* else there is a line already */
            fputs("hyst: the result could not be written to stdout\n", stderr);
        }
        return STATUS_FAILED;
    }
    return status;
}

/* OpenBLAS reads its environment when it is loaded: the process begins again, at once, with the code that its processor
 * can run. Where it cannot begin again it goes on, slower. */
static void begin_with_fast_code(char **argv) {
    const char *code = blas_better_code();
    if (code != NULL && setenv("OPENBLAS_CORETYPE", code, 1) == 0) {
        (void)execv("/proc/self/exe", argv);
    }
}

int main(int argc, char **argv) {
    (void)signal(SIGXFSZ, SIG_IGN); /* a file that may not grow is an error of writing, with its line */
    on_out_of_memory(out_of_memory_print);
    progress_listen(&progress_bar);
    if (argc < 2) {
        fputs("hyst: which command? See hyst --help\n", stderr);
        return STATUS_USAGE;
    }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0 || strcmp(argv[1], "help") == 0) {
        return finish(help(strcmp(argv[1], "help") == 0 ? argc - 1 : 1, argv + 1));
    }
    if (strcmp(argv[1], "--version") == 0 || strcmp(argv[1], "-V") == 0) {
        puts("hyst " HYST_VERSION);
        return finish(STATUS_DONE);
    }
    begin_with_fast_code(argv);
    ending_signals_remove_parts();
    const command_t *command = find_command(argv[1]);
    static provenance_note_t *note; /* of the process: a command is one run */
    note = provenance_note();
    (void)provenance_enter(note);
    provenance_set_command(argc, argv);
    return command != NULL ? finish(command->run(argc - 1, argv + 1)) : STATUS_USAGE;
}
