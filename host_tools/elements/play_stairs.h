/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A bank of play operators as a staircase: all operators that one monotone movement has carried along lie on one line
 * over the threshold, and only these lines (runs) are kept. A sample takes a few operations however many operators
 * there are. It is the play bank of lib/hyst (prandtl_ishlinskii.h) in double precision; docs/MODELS.md, section 2.1.
 *
 * The sum is that of the plain loop but for rounding: every run's share is worked out from prefix sums of the weights,
 * and nothing is added up from sample to sample (tests/host/test_play_stairs.c: within 1e-13 of sum |w_i z_i|).
 *
 * One thread. The caller owns the memory.
 */
#ifndef PLAY_STAIRS_H
#define PLAY_STAIRS_H

#include <stdbool.h>
#include <stddef.h>

/** With fewer operators the plain loop is as fast. */
#define PLAY_STAIRS_WORTH_IT 24

/** Neighbouring operators on one line, z_i = level + side r_i. It begins where the next inner run ends. */
typedef struct {
    size_t end;     /**< one past its last operator */
    double side;    /**< -1 where the drive rose last, +1 where it fell, 0 as the bank was settled */
    double level;   /**< drive at which it turned */
    double outside; /**< sum of w_i z_i from operator `end` on */
} play_run_t;

typedef struct {
    size_t operators, runs;
    const double *threshold, *settled; /**< r_i; z_i as the bank was settled */
    double *weights, *moments;         /**< of the first j operators: sum w_i, sum w_i r_i */
    double *resting;                   /**< from operator j on: sum w_i z_i as the bank was settled */
    play_run_t *run;                   /**< from the outermost to the innermost */
} play_stairs_t;

/** Bytes that play_stairs_open needs. */
size_t play_stairs_bytes(size_t operators);

/** Puts the stairs into `memory` (play_stairs_bytes, as malloc aligns). weight, threshold (rising): 1 or more operators
 * each. `threshold` has to stay. */
void play_stairs_open(play_stairs_t *stairs, void *memory, size_t operators, const double *weight,
                      const double *threshold);

/** Begins with these z_i, which have to stay. False, and nothing is done, unless they are nested: |z_i+1 - z_i| <=
 * r_i+1 - r_i, which every history from a demagnetised bank leaves behind. */
bool play_stairs_settle(play_stairs_t *stairs, const double *weight, const double *memory);

/** Moves the bank to this drive. Returns sum w_i z_i. */
double play_stairs_move(play_stairs_t *stairs, double drive);

#endif
