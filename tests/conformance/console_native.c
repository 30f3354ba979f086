/* SPDX-License-Identifier: MIT */
#include "console.h"
#include <stdio.h>
#include <stdlib.h>

void console_write(const char *text) {
    (void)fputs(text, stdout);
}

_Noreturn void console_exit(int status) {
    if (fflush(stdout) != 0) {
        exit(EXIT_FAILURE);
    }
    exit(status);
}
