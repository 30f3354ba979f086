/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The error that a model delivers: what `hyst simulate` says of the same recording, nothing left out and nothing taken
 * out; and two models so plain that none may be worse.
 */
#ifndef DELIVERED_H
#define DELIVERED_H

#include "diagnosis/noise/samples.h"

/** NRMSE of whole recordings as they are simulated, of the worst one; HUGE_VAL: it cannot be simulated. Of several
 * recordings each has its zero, as `hyst simulate` tells it beside the other error. */
double delivered_percent(const samples_t *samples, const model_t *model);

enum { DELIVERED_PLAYS = 30 };

/**
 * A bank of so many non-negative plays with evenly spread thresholds (0: a straight line), fitted to the samples that
 * are not held out. To be freed. false: it could not be fitted.
 */
bool delivered_plain(const samples_t *samples, size_t plays, model_t *model);

#endif
