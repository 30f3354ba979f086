/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/stop_signal.h"
#include <stddef.h>

static volatile sig_atomic_t stop;

static void request_stop(int number) {
    stop = number;
}

const volatile sig_atomic_t *stop_on_signal(void) {
    struct sigaction action = {.sa_handler = request_stop};
    struct sigaction before;
    (void)sigemptyset(&action.sa_mask);
    (void)sigaction(SIGINT, &action, NULL);
    (void)sigaction(SIGTERM, &action, NULL);
    if (sigaction(SIGHUP, NULL, &before) == 0 && before.sa_handler != SIG_IGN) {
        (void)sigaction(SIGHUP, &action, NULL);
    }
    action.sa_handler = SIG_IGN;
    (void)sigaction(SIGPIPE, &action, NULL);
    return &stop;
}

const char *stop_signal_name(int number) {
    switch (number) {
    case SIGINT:
        return "SIGINT";
    case SIGTERM:
        return "SIGTERM";
    case SIGHUP:
        return "SIGHUP";
    case STOP_BY_PROGRAM:
        return "by the program";
    default:
        return "a signal";
    }
}

int stop_signal(void) {
    return stop;
}
