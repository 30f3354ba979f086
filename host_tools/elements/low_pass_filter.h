/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What low passes of second order have in common: the amplifier's and the sensor's.
 *
 * Damping 0.2 is where a low pass ends and a mode of the mechanics begins, which is looked for up to there: in the
 * position alone a mode behind the hysteresis that is damped more is this low pass. 0.707 is Butterworth's, 0.866
 * Bessel's.
 */
#ifndef LOW_PASS_FILTER_H
#define LOW_PASS_FILTER_H

#include "elements/oscillator.h"

enum { LOW_PASS_FILTER_PARAMETERS = 2 };
extern const parameter_info_t low_pass_filter_parameters[LOW_PASS_FILTER_PARAMETERS];

/** Starting points of a search: one after the other (probe.h). */
bool low_pass_filter_probe(const probe_setting_t *setting, size_t index, double *value);
/** Whether it is what a look has seen ring: one that is damped little. */
bool low_pass_filter_rings(const probe_seen_t *seen, const double *value);

#endif
