/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Blocks and a hysteresis of any shape, fitted together.
 *
 * A scan (scan.h) asks what a block is worth while the operator's weights stay as they are. That is true to first order
 * only: weights that were fitted without a lag have taken most of it, and what is left points elsewhere. Here the
 * weights follow. They are linear, so each step is one of Gauss and Newton's for the blocks' numbers with the weights
 * eliminated (variable projection: Golub and Pereyra, SIAM J. Numer. Anal. 10, 1973; without the derivative of the
 * projection: Kaufman, BIT 15, 1975), and what it has to raise is the evidence, in which the weights are integrated
 * out.
 */
#ifndef TOGETHER_H
#define TOGETHER_H

#include "belief/fitted_chain.h"

/** Raises the evidence of a fitted chain by the searched numbers of some of its blocks (bits by index). */
void together_fit(fitted_chain_t *fitted, unsigned blocks);

/** A block that speaks, fitted together with the weights. */
typedef struct {
    const block_t *block;
    double gain;           /**< natural units over the chain without it, less what its numbers cost; 0: none */
    fitted_chain_t fitted; /**< with it; may be empty */
} heard_t;

void heard_close(heard_t *heard);

/** The blocks that promise most beside a fitted chain, the one that is worth most first. Returns how many: at most
 * `most`. All are to be closed. */
size_t together_hear(fitted_chain_t *fitted, const probe_setting_t *setting, heard_t *heard, size_t most);

/** What speaks beside a hysteresis of any shape: block after block, each the one that is worth most beside those
 * before, as long as it is worth least_gain; then all of them together. Curves, which a hysteresis of another shape
 * imitates, are not asked. */
typedef struct {
    size_t count;
    const block_t *block[MODEL_MAX_BLOCKS];
    double gain[MODEL_MAX_BLOCKS]; /**< of each when it was added */
    fitted_chain_t fitted;         /**< with all of them; empty if there are none */
} listened_t;

/** To be closed. from: is not changed. */
void together_listen(fitted_chain_t *from, const probe_setting_t *setting, size_t most, listened_t *listened);
void listened_close(listened_t *listened);

#endif
