/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Runs of equal readings, and how probable they are by chance. */
#ifndef LOOK_RUNS_H
#define LOOK_RUNS_H

#include "look/look.h"

typedef struct {
    look_span_t span;  /**< samples with one reading, two or more */
    double log_chance; /**< log10 of the chance of such a run anywhere in the recording; 0: nothing to compare with */
} equal_run_t;

/**
 * All runs of four equal readings or more. The chance p of a pair of equal readings is the larger one of two. One is
 * what white noise of the prediction's size makes with the converter's step (or the file's last digit). The other is
 * the share of equal pairs within 256 samples where the drive does the same (rests, or moves), other long runs counting
 * as one pair. A run of m pairs has the chance p^m, N of them are possible. Without 64 pairs to compare with, or with
 * noise below a third of a step, nothing is said: noise-free readings may well be equal.
 */
equal_run_t *equal_runs(const look_t *look, size_t *count);

#endif
