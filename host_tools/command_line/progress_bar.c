/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command_line/progress_bar.h"
#include "base/monotonic_clock.h"
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { BAR_WIDTH = 40 };

static struct {
    bool terminal;
    bool lines;     /* HYST_PROGRESS=lines: for a program that reads them (serve/job.c) */
    double drawn_s; /* monotonic time of the last drawing */
    char what[60];  /* and what it said; "": nothing yet */
} bar;

static void begin(void *context, const char *what) {
    (void)context;
    (void)what;
    bar.terminal = isatty(STDERR_FILENO) == 1;
    const char *const wanted = getenv("HYST_PROGRESS");
    bar.lines = wanted != NULL && strcmp(wanted, "lines") == 0;
    bar.what[0] = '\0';
}

static void update(void *context, const char *what, double fraction) {
    (void)context;
    const bool same = strncmp(bar.what, what, sizeof bar.what - 1) == 0; /* what is new shows at once */
    if ((!bar.terminal && !bar.lines) || (same && monotonic_s() - bar.drawn_s < 0.1)) {
        return;
    }
    bar.drawn_s = monotonic_s();
    (void)snprintf(bar.what, sizeof bar.what, "%s", what);
    if (bar.lines) {
        fprintf(stderr, "progress: %.0f %% %s\n", 100.0 * fraction, what);
        return;
    }
    const int filled = (int)(fraction * BAR_WIDTH);
    fprintf(stderr, "\r\033[K%s [%.*s%*s] %3.0f %%", what, filled, "########################################",
            BAR_WIDTH - filled, "", 100.0 * fraction);
    fflush(stderr);
}

static void end(void *context, const char *what) {
    (void)context;
    (void)what;
    if (bar.terminal) {
        fprintf(stderr, "\r\033[K"); /* to the start of the line, erase it */
        fflush(stderr);
    }
}

const progress_listener_t progress_bar = {begin, update, end, NULL};
