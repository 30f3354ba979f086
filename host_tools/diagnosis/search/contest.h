/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Blocks against each other where one effect is so strong that no hysteresis fits without it.
 *
 * The search proper (search_round.h) asks what is missing beside a hysteresis that was fitted first. Rails that cut off
 * a tenth of the stroke, or a mode inside the band, are then partly in that hysteresis, and what is left looks like no
 * block. So here each block, from each of its probes, is fitted together with the hysteresis of a chain. Residuals
 * count as they are: what a model leaves says nothing about the noise then. What is so strong shows in a part: of long
 * recordings a contest uses windows (windows.h), and the winner has to stand on all samples after that.
 *
 * A sweep through a mode that comes late by half a turn shows neither of both alone. So the contest goes on beside what
 * has won, as long as the next block again leaves less than contest_worth of the power.
 */
#ifndef CONTEST_H
#define CONTEST_H

#include "chain/probe.h"
#include "diagnosis/noise/samples.h"

enum { CONTEST_MOST_BLOCKS = 3 };

/** What leaves least: these blocks, in the order in which they won, and the chain with them, fitted together. */
typedef struct {
    size_t blocks;
    const block_t *block[CONTEST_MOST_BLOCKS];
    model_t model;
} contest_winner_t;

/** Among all blocks that the chain does not have. false: none leaves less than contest_worth of the standing model's
 * power, or one that is itself a shape leaves the least; beside an effect that has won a shape may win, as the bank has
 * no bends. The winner's model is to be freed. */
bool contest(const samples_t *samples, const probe_setting_t *setting, const model_t *standing, const model_t *chain,
             contest_winner_t *winner);

/** One block alone, whatever it leaves. false: the recordings have none of it, or it cannot be simulated. Its model is
 * to be freed. */
bool contest_fit(const samples_t *samples, const probe_setting_t *setting, const model_t *chain, const block_t *block,
                 contest_winner_t *fitted);

/** Whether this block in the chain leaves no more than the standing model's power over contest_worth. */
bool contest_stands(const samples_t *samples, const probe_setting_t *setting, const model_t *standing,
                    const model_t *chain, const block_t *block);

#endif
