/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Whether what a model leaves is more than noise, without a name for it.
 *
 * Some thirty columns that no block stands for (the drive's rate and acceleration, their magnitudes, powers and
 * products with the drive, its slow and fast averages, those of the rate's magnitude, half waves over the recording)
 * are fitted to the residual beyond J in one half of the blocks of time and have to explain the other half. Coloured
 * noise does not pass this: what it has in common with the columns in one half, it has not in the other. Single samples
 * far outside the noise count too.
 */
#ifndef REMAINDER_H
#define REMAINDER_H

#include "evidence.h"

typedef struct {
    double likelihood; /**< 2 log likelihood that the columns gain */
    size_t outliers;   /**< whitened samples beyond 7 deviations */
    bool structured;   /**< by either */
} remainder_t;

remainder_t evidence_remainder(const evidence_t *evidence);

#endif
