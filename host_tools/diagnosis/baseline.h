/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The hysteresis that a diagnosis without a model starts from. */
#ifndef BASELINE_H
#define BASELINE_H

#include "family.h"

/** The shapes of a hysteresis that a diagnosis tries, the first one a play bank. */
size_t baseline_shapes(void);

/** Fits one of them. *family: which. Fails where it does not apply. */
bool baseline_fit(size_t shape, const recording_t *recordings, size_t count, model_t *baseline, const family_t **family,
                  failure_t *failure);

#endif
