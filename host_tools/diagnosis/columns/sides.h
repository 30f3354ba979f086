/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * On which side of the actuator's voltage a found block is, where voltage or current were measured (electrical.h).
 *
 * The search asks the columns about one block at a time. When all are found and fitted together they decide again
 * about the lags (the two low passes and the delay), of which the position alone says hardly more than how long they
 * take together.
 */
#ifndef SIDES_H
#define SIDES_H

#include "diagnosis/answer/answer.h"
#include "diagnosis/evidence/electrical.h"

struct state; /* state.h */

/** Whose change is looked for in the columns: a block of the electronics itself; amplifier_bandwidth for
 * sensor_bandwidth. NULL: they say nothing of this block. */
const block_t *sides_block(const block_t *block);
/** How much of that change is in a column: of the chain without the finding, and with that block with the finding's
 * numbers. */
electrical_change_t sides_change(const answer_t *answer, const finding_t *finding, column_t column);

/**
 * A lag that the voltage shows in part becomes two: a low pass or a delay before it, with the number that the voltage
 * says, and one behind it. All other numbers are fitted again, and other findings that were too small beside the two
 * go. It stays so when the position prefers it by what makes a name, held-out samples included, and the voltage does,
 * too; of the pairs that do the most preferred. Otherwise a low pass that the columns contradict goes to the other
 * side, if position and columns together prefer it. Nothing happens without these columns.
 */
bool sides_settle(struct state *state);

#endif
