/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command_line/ending_signals.h"
#include "base/output_file.h"
#include <signal.h>
#include <stddef.h>

/* The signal comes once more when this returns, and then does what it does by itself. */
static void remove_parts(int number) {
    output_files_remove_parts();
    (void)raise(number);
}

void ending_signals_remove_parts(void) {
    static const int ending[] = {SIGINT, SIGTERM, SIGHUP, SIGPIPE};
    struct sigaction action = {.sa_handler = remove_parts, .sa_flags = (int)SA_RESETHAND};
    (void)sigemptyset(&action.sa_mask);
    for (size_t i = 0; i < sizeof ending / sizeof ending[0]; i++) {
        struct sigaction before;
        if (sigaction(ending[i], NULL, &before) == 0 && before.sa_handler == SIG_DFL) {
            (void)sigaction(ending[i], &action, NULL);
        }
    }
}
