/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Frequencies at which a signal has a narrow peak: where to look for a mode or for hum. */
#ifndef LINES_H
#define LINES_H

#include <stddef.h>

enum { LINES_MOST = 6 };

/** The strongest first. A peak stands out from the median of the frequencies around it by a factor of 20 in power.
 * Of fewer than 4 samples: none. */
size_t find_lines(const double *signal, size_t samples, double sample_rate_hz, double hz[LINES_MOST]);

#endif
