/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command_line/standard_streams.h"
#include "base/shown_name.h"
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { NAME = 40, PIECE = 65536 };

const char *standard_output_take(failure_t *failure) {
    static char name[NAME];
    if (name[0] != '\0') {
        (void)fail(failure, "two outputs on stdout: give one of them a file");
        return NULL;
    }
    const int copy = dup(STDOUT_FILENO);
    if (copy < 0 || fflush(stdout) != 0 || dup2(STDERR_FILENO, STDOUT_FILENO) < 0) {
        (void)fail(failure, "stdout: %s", strerror(errno));
        return NULL;
    }
    (void)snprintf(name, sizeof name, "/dev/fd/%d", copy);
    shown_name_set(name, "standard output");
    return name;
}

const char *standard_input_take(failure_t *failure) {
    static char name[NAME];
    char piece[PIECE];
    if (name[0] != '\0') {
        return name;
    }
    FILE *kept = tmpfile(); /* open until the process ends */
    size_t length;
    bool good = kept != NULL;
    while (good && (length = fread(piece, 1, sizeof piece, stdin)) > 0) {
        good = fwrite(piece, 1, length, kept) == length;
    }
    if (!good || ferror(stdin) != 0 || fflush(kept) != 0) {
        (void)fail(failure, "stdin: %s", strerror(errno));
        return NULL;
    }
    (void)snprintf(name, sizeof name, "/dev/fd/%d", fileno(kept));
    shown_name_set(name, "standard input");
    return name;
}
