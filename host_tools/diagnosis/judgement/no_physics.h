/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What a block may say of the recordings and is no physics, however much it explains. */
#ifndef NO_PHYSICS_H
#define NO_PHYSICS_H

#include "diagnosis/noise/samples.h"

/**
 * Whether a block of a chain, with its numbers, is no effect of the actuator:
 *
 * - a lag shorter than a fiftieth of a sample (threshold.least_lag_samples): between samples the drive is known no
 * better;
 * - a mode above half of the sample rate: of such a one recordings show a gain and a lag, and no ringing;
 * - a line with its own clock where the drive has a line (drive_lines.h): it is how the loops are bent, or what a
 *   corner between two samples leaves. Where the drive rests, and the line is there too with half its amplitude at
 *   least, it is hum.
 */
bool no_physics(const samples_t *samples, const model_block_t *block);

#endif
