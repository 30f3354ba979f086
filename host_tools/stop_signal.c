/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "stop_signal.h"
#include <stddef.h>

static volatile sig_atomic_t stop;

static void request_stop(int signal) {
    (void)signal;
    stop = 1;
}

const volatile sig_atomic_t *stop_on_signal(void) {
    struct sigaction action = {.sa_handler = request_stop};
    (void)sigemptyset(&action.sa_mask);
    (void)sigaction(SIGINT, &action, NULL);
    (void)sigaction(SIGTERM, &action, NULL);
    action.sa_handler = SIG_IGN;
    (void)sigaction(SIGPIPE, &action, NULL);
    return &stop;
}
