/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What the drive did between samples, where neither its column nor the header says it.
 *
 * A converter that holds each value makes of a fast mode another frequency and damping than a line or a curve does, and
 * of nothing a lag of half a sample. So the likeliest block of the catalogue is looked for with each reading: the drive
 * as it is interpolated, and held, the position read when the value goes out, half a sample later, or when the next one
 * comes. Held stands if it makes the position likelier by naming_margin; then when the position was read is searched.
 * This is done only where a block speaks beside the universal operator, or the look saw something ring: nothing else
 * moves between samples. A delay of less than a sample is then part of this reading, and no block.
 */
#ifndef BETWEEN_H
#define BETWEEN_H

#include "diagnosis/question.h"

/** With a model of the hysteresis. Sets held and held_since of the question's recordings. */
void between_choose(question_t *question, const model_t *model);

#endif
