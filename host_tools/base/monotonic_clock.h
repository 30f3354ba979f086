/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef MONOTONIC_CLOCK_H
#define MONOTONIC_CLOCK_H

/** Seconds since an arbitrary time in the past; unaffected by changes of the system time. */
double monotonic_s(void);

/** Returns when the clock has reached `until_s`, or earlier if a signal arrives. */
void sleep_until(double until_s);

#endif
