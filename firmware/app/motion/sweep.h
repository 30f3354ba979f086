/* SPDX-License-Identifier: MIT */
/**
 * A phase whose increment goes from one value to another in so many samples: in equal steps (a linear sweep) or by
 * equal factors (a logarithmic one).
 *
 * Phase and increment are in 2^-64 turns: the upper word is the phase of hyst_sine. Sample n has the phase p(n), with
 * p(0) = 0, p(n + 1) = p(n) + i(n), i(0) = start, and i(n) = end exactly from n = samples on.
 *
 * Exactness. A linear step is (end - start) / samples, rounded down to 2^-64 turns. A logarithmic increment has a
 * relative error of at most 1e-8 + n / (2^30 start): tests/firmware/test_sweep.c.
 */
#ifndef SWEEP_H
#define SWEEP_H

#include <stdbool.h>
#include <stdint.h>

/** Register `sweep_spacing`. */
typedef enum { SWEEP_LINEAR = 0, SWEEP_LOGARITHMIC = 1 } sweep_spacing_t;

/** What is worked out once. */
typedef struct {
    uint32_t start, end; /**< increments in 2^-32 turns, 1 to 2^31 */
    uint32_t samples;    /**< 1 or more */
    bool falls;
    bool logarithmic;
    uint64_t step; /**< magnitude: linear in 2^-64 turns, logarithmic as a fraction of the increment, Q64 */
} sweep_t;

typedef struct {
    uint64_t phase, increment; /**< of the next sample */
    uint32_t left;             /**< samples until the increment is `end` */
    bool turned;               /**< the next sample begins a new turn */
} sweep_state_t;

/** Main loop: divides. False when an end is outside 1 .. 2^31, there are no samples, or a logarithmic one would change
 * by an octave a sample or more. */
bool sweep_make(uint32_t start, uint32_t end, uint32_t samples, sweep_spacing_t spacing, sweep_t *sweep);

/** At the beginning. */
void sweep_begin(const sweep_t *sweep, sweep_state_t *state);

/** Sample interrupt. Gives the phase of this sample, in 2^-32 turns. Behind the sweep the last turn is completed at the
 * increment `end`; false in the sample that would begin a new one: there is no phase then, and the next sample is the
 * first of another pass. Constant time. */
bool sweep_next(const sweep_t *sweep, sweep_state_t *state, uint32_t *phase);

#endif
