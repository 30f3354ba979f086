/* SPDX-License-Identifier: MIT */
/**
 * Where the reference may be, and how fast it may get there, whatever source makes it: the setpoint, a sine that
 * starts, a table with a step. In the unit of the reference: a position, or a drive in direct mode.
 *
 * May be called from: the sample interrupt.
 */
#ifndef REFERENCE_LIMIT_H
#define REFERENCE_LIMIT_H

#include "hyst/fixed.h"
#include <stdbool.h>

typedef struct {
    hyst_q31_t low, high; /**< low <= high */
    hyst_q31_t slew;      /**< per sample, > 0 */
} reference_limit_t;

/** `wanted` within the limits, at most `slew` from `last`: a last one that is outside comes back that fast. *held: it
 * is another. */
static inline hyst_q31_t reference_limited(const reference_limit_t *limit, hyst_q31_t last, hyst_q31_t wanted,
                                           bool *held) {
    const hyst_q31_t lowest = hyst_subtract(last, limit->slew);
    const hyst_q31_t highest = hyst_add(last, limit->slew);
    if (wanted >= limit->low && wanted <= limit->high && wanted >= lowest && wanted <= highest) {
        *held = false;
        return wanted; /* most often */
    }
    const hyst_q31_t limited = hyst_clamp(hyst_clamp(wanted, limit->low, limit->high), lowest, highest);
    *held = limited != wanted;
    return limited;
}

#endif
