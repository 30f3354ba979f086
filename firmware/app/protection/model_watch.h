/* SPDX-License-Identifier: MIT */
/**
 * Whether the model is still true: the position that was measured against the one that was meant.
 *
 * In mode compensate the reference is the model's prediction of the position: the drive was chosen so that the model's
 * position equals it. So the difference of the two, aligned (loop.h), is the error of the model, unless a limit or a
 * transition kept the drive from being the model's. The loop leaves such samples out (`watched`).
 *
 * The error is summed up over blocks of MODEL_WATCH_BLOCK samples. A block whose root mean square is above the limit is
 * a bad one; as many of them in a row as the time says, and the warning is live, until a block is below the limit. It
 * is a warning only: nothing stops.
 *
 * Limitations. An error of the sensor is one of the model here. Where nothing is compensated, nothing is watched.
 */
#ifndef MODEL_WATCH_H
#define MODEL_WATCH_H

#include "hyst/fixed.h"
#include <stdbool.h>

/** Samples of a block: a tenth of a second at 10 kHz. A power of two, so that means are shifts. */
#define MODEL_WATCH_BLOCK_BITS 10U
#define MODEL_WATCH_BLOCK      (1U << MODEL_WATCH_BLOCK_BITS)

/** The registers model_error_... */
typedef struct {
    hyst_q31_t rms, largest, slow, fast;
    uint32_t blocks; /**< since start, wraps */
} model_error_t;

/** No limit, nothing seen. Before the sample interrupt runs. */
void model_watch_init(void);

/** Sample interrupt, for each sample that is watched. Returns whether the warning is live. Constant time:
 * docs/TIMING.md.
 */
bool model_watch_sample(hyst_q31_t reference, hyst_q31_t position);

/** Main loop, under board_lock. limit: of the root mean square, 0 is none; `samples`: how long above it. Begins to
 * count anew. */
void model_watch_set_limit(hyst_q31_t limit, uint32_t samples);

/** Main loop, under board_lock: forgets the largest. */
void model_watch_clear(void);

/** Main loop, not under board_lock: the last whole block. */
model_error_t model_watch_error(void);

#endif
