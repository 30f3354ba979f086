/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "progress.h"
#include "monotonic_clock.h"
#include <stdio.h>
#include <unistd.h>

enum { BAR_WIDTH = 40 };

void progress_begin(progress_t *progress, const char *what) {
    progress->what = what;
    progress->terminal = isatty(STDERR_FILENO) == 1;
    progress->drawn_s = progress->terminal ? monotonic_s() : 0.0;
}

void progress_update(progress_t *progress, double fraction) {
    int filled;
    if (!progress->terminal || monotonic_s() - progress->drawn_s < 0.1) {
        return;
    }
    progress->drawn_s = monotonic_s();
    fraction = fraction < 0.0 ? 0.0 : fraction > 1.0 ? 1.0 : fraction;
    filled = (int)(fraction * BAR_WIDTH);
    fprintf(stderr, "\r%s [%.*s%*s] %3.0f %%", progress->what, filled, "########################################",
            BAR_WIDTH - filled, "", 100.0 * fraction);
    fflush(stderr);
}

void progress_end(progress_t *progress) {
    if (progress->terminal) {
        fprintf(stderr, "\r\033[K"); /* to the start of the line, erase it */
        fflush(stderr);
    }
}
