/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What goes with the position in what a model leaves: its means over 48 levels of the position, rising and falling by
 * themselves. Noise has none, whatever its spectrum, so that little is seen where it is always at the same place: a
 * curve of another bend than the one that was found, contact that is lost, play behind the actuator.
 */
#ifndef BY_LEVEL_H
#define BY_LEVEL_H

#include "diagnosis/noise/samples.h"

typedef struct {
    double part; /**< root mean square of what the means have beyond chance, in parts of the noise; 0: nothing */
    double low_um, high_um; /**< the levels that hold most of it; 0, 0: none */
} by_level_t;

/** white: what is left, whitened, whose noise has that deviation; position: as the model has it. Both are columns. */
by_level_t by_level(const samples_t *samples, double sigma_um, const double *position, const double *white);

#endif
