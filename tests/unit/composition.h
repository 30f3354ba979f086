/* SPDX-License-Identifier: MIT */
/** What the tests of forward after inverse share. */
#ifndef COMPOSITION_H
#define COMPOSITION_H

#include "hyst/fixed.h"
#include <stdbool.h>

typedef struct {
    uint64_t composed, out_of_reach; /**< samples */
    int64_t worst;                   /**< error, units of 2^-31 */
} composition_count_t;

/** Samples per model family that the composition must survive unsaturated: 10^7, or HYST_COMPOSITION_SAMPLES. */
uint64_t composition_samples(void);

/** One sample: the position that was wanted, the drive that the inverse found, and the position that forward makes of
 * it. Asserts that the error is within the bound, or, out of reach, that the drive is at its nearer end. */
void composition_add(composition_count_t *total, hyst_q31_t wanted, hyst_q31_t drive, bool saturated, hyst_q31_t got,
                     int64_t bound);

/** Prints it, and asserts that some samples were out of reach. */
void composition_report(const composition_count_t *total);

#endif
