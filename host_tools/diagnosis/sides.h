/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * On which side of the actuator's voltage a found block is, where voltage or current were measured (electrical.h).
 *
 * The search asks the columns about one block at a time. When all are found and fitted together it is asked again about
 * the two low passes, of which the position alone says hardly more than that they are there.
 */
#ifndef SIDES_H
#define SIDES_H

#include "attempt.h"
#include "electrical.h"

/** Whose change is looked for in the columns: a block of the electronics itself; amplifier_bandwidth for
 * sensor_bandwidth. NULL: they say nothing of this block. */
const block_t *sides_block(const block_t *block);
/** How much of that change is in a column: of the chain without the finding, and with that block with the finding's
 * numbers. */
electrical_change_t sides_change(const diagnosis_t *diagnosis, const finding_t *finding, column_t column);
/** Whether a change that is present is clearly less than all of it. */
bool sides_only_part(const electrical_change_t *change);

/**
 * A low pass that the columns contradict goes to the other side. One that the voltage shows in part is split into one
 * on either side, the amplifier's with the cutoff that the voltage says; all other numbers are then fitted again. It
 * stays so when position and columns together prefer it by what makes a name; a second low pass when the position alone
 * does, held-out samples included. Nothing happens without these columns.
 */
bool sides_settle(attempt_t *job);

#endif
