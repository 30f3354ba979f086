/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What happened before a recording, as far as its first samples still show it in a Preisach model. */
#ifndef PREISACH_PAST_H
#define PREISACH_PAST_H

#include "preisach_fit.h"

#define PREISACH_PAST 3

/**
 * Searches the drives within range_v that, one after the other from all relays down on, explain the samples [0, end) of
 * the span best (least sum of absolute errors, so that a transient does not decide): on a coarse grid, then in ever
 * smaller steps. Returns whether they do so better than the span's own past; else past_v
 * (which may be that past) is left alone.
 */
bool preisach_find_past(const preisach_grid_t *grid, const preisach_fit_t *fit, const preisach_span_t *span, size_t end,
                        const double range_v[2], double past_v[PREISACH_PAST]);

#endif
