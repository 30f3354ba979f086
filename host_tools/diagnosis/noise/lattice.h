/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Whether readings are whole multiples of a step: a converter's resolution, seen without any model. */
#ifndef LATTICE_H
#define LATTICE_H

#include "recording/recording.h"

/**
 * The step, if the distinct readings of each recording are evenly spaced, all within a tenth of the step; 0 if they are
 * not, or if hardly any reading occurs twice. sigma_um: its standard error.
 */
double lattice_step_um(const recording_t *recordings, size_t count, double *sigma_um);

/** The finest step that would be found, for readings have to come back to it, and the coarsest, for there have to be
 * some of them. */
void lattice_visible_steps(const recording_t *recordings, size_t count, double range_um[2]);

/** 2 log likelihood that a reading on the lattice gives it: a tenth of a step to either side is a fifth of all there
 * is. */
double lattice_likelihood_per_sample(void);

#endif
