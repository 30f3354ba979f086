/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command.h"
#include <stdio.h>
#include <string.h>

#define COMMAND_ADDRESS(name) &command_##name,
static const command_t *const commands[] = {COMMANDS(COMMAND_ADDRESS)};

static void print_help(void) {
    puts("hyst COMMAND ...\n\nFinds out from recordings what a piezo actuator does to its drive, and makes the "
         "amplifier undo it.\n");
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        printf("  %-10s %s\n", commands[i]->name, commands[i]->summary);
    }
    puts("\nhyst COMMAND --help explains one, hyst --version prints the version.\n"
         "Exit status: 0 done, 1 the input or the device is at fault (one line on stderr says what and where), 2 wrong "
         "usage.");
}

/* A result that did not reach a full disk or a closed pipe must not look like success. */
static int finish(int status) {
    if (fflush(stdout) != 0 || ferror(stdout)) {
        fputs("hyst: the result could not be written to stdout\n", stderr);
        return STATUS_FAILED;
    }
    return status;
}

int main(int argc, char **argv) {
    if (argc < 2) {
        fputs("hyst: which command? See hyst --help\n", stderr);
        return STATUS_USAGE;
    }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0 || strcmp(argv[1], "help") == 0) {
        print_help();
        return finish(STATUS_DONE);
    }
    if (strcmp(argv[1], "--version") == 0) {
        puts("hyst " HYST_VERSION);
        return finish(STATUS_DONE);
    }
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        if (strcmp(argv[1], commands[i]->name) == 0) {
            return finish(commands[i]->run(argc - 1, argv + 1));
        }
    }
    fprintf(stderr, "hyst: unknown command '%s'. See hyst --help\n", argv[1]);
    return STATUS_USAGE;
}
