/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Fits offset and weights of a chain's play bank again, with everything else in the chain as it is. */
#ifndef BANK_REFIT_H
#define BANK_REFIT_H

#include "chain.h"

/** Uses the samples that are not held out (evidence.h) and whose memory is determined. */
bool bank_refit(model_t *model, const recording_t *recordings, size_t count, failure_t *failure);

#endif
