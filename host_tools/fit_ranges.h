/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a model says about the ranges it was found in, among its "fit" facts: where it is known, and which converters
 * recorded it. Compiling without given ranges goes by these.
 */
#ifndef FIT_RANGES_H
#define FIT_RANGES_H

#include "model.h"
#include "recording.h"

/** Header keys of what `hyst record` and `hyst track` write: what the converters' ends stand for, as LO:HI. Keys of
 * "fit" too. */
#define DRIVE_CONVERTER_KEY    "drive_converter_v"
#define POSITION_CONVERTER_KEY "position_converter_um"

/**
 * Sets "drive_range_v" and "displacement_range_um" in fit, [low, high] each: what these recordings cover, and what
 * `known`, the model that the fit began with, covers already; NULL without one. Sets the two converter keys as the
 * recordings say that have them, else as `known` says; where recordings contradict each other, not at all.
 */
void fit_ranges_set(json_t *fit, const recording_t *recordings, size_t count, const model_t *known);

#endif
