/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The ranges in a model's "fit" object: what the recordings covered, and the converters that made them. `hyst compile`
 * uses them by default.
 */
#ifndef FIT_RANGES_H
#define FIT_RANGES_H

#include "chain/model.h"
#include "recording/recording.h"

/** Header keys that `hyst record` and `hyst track` write: the values at the ends of the converters, as LO:HI. Also keys
 * of "fit". */
#define DRIVE_CONVERTER_KEY    "drive_converter_v"
#define POSITION_CONVERTER_KEY "position_converter_um"

/**
 * Sets "drive_range_v" and "displacement_range_um" in fit, [low, high] each: the range of these recordings, joined with
 * that of `known`, the initial model of the fit (NULL: none). Sets the two converter keys from the recordings that have
 * them, else from `known`. Where recordings contradict each other, the keys stay unset.
 */
void fit_ranges_set(json_t *fit, const recording_t *recordings, size_t count, const model_t *known);

#endif
