/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Readings without noise, as a simulation writes them. A diagnosis judges everything by the noise: of such readings
 * any difference from a model would be physics, and a model of a few numbers is an approximation. */
#ifndef NOISELESS_H
#define NOISELESS_H

#include "look/look.h"

/**
 * Adds white noise of threshold.added_noise_percent of their range to readings that have less than
 * threshold.least_noise_percent, as their look says of rests and repeated passes, or else by third differences; and
 * digits that are finer. The same readings get the same noise. Readings of a converter or of a file with coarser steps
 * stay: their steps are their noise. So do readings that neither rest nor repeat and move far within a few samples.
 * Returns how much was added, in percent; 0: nothing.
 */
double noiseless_add(recording_t *recordings, const look_t *looks, size_t count);

#endif
