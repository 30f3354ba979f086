/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The drive before a recording, as far as a Preisach model can infer it from the first samples. */
#ifndef PREISACH_PAST_H
#define PREISACH_PAST_H

#include "identify/preisach_fit.h"

#define PREISACH_PAST 3

/**
 * Searches the drives within range_v that, one after the other from all relays down on, fit the samples [0, end) of the
 * span best, by the least sum of absolute errors, which is robust against a transient. The search uses a coarse grid,
 * then decreasing steps. Returns whether they fit better than span->past; otherwise past_v (which may be that past) is
 * unchanged.
 */
bool preisach_find_past(const preisach_grid_t *grid, const preisach_fit_t *fit, const preisach_span_t *span, size_t end,
                        const double range_v[2], double past_v[PREISACH_PAST]);

#endif
