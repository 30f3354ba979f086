/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/monotonic_clock.h"
#include <math.h>
#include <time.h>

double monotonic_s(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void sleep_until(double until_s) {
    const struct timespec until = {(time_t)until_s, (long)((until_s - floor(until_s)) * 1e9)};
    (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
}
