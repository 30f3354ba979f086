/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The actuator of paper 003 (Gu and Zhu): a preloaded stack in a one-axis stage, 90 um at 150 V, behind 16-bit
 * converters at 10 kHz.
 *
 * Reported: ranges, converters, sample rate, that the amplifier has a fixed gain, and table 1: an ellipse for each of
 * nine frequencies. Chosen so that those ellipses come out (twin_003.c): a dense, slowly falling density of play
 * operators, logarithmic creep down to a millisecond, and stage and electronics as one well damped second-order lag.
 * Chosen freely: noise of the strain gauge, 10 nm RMS.
 */
#ifndef TWIN_003_H
#define TWIN_003_H

#include "recording/recording.h"
#include <stdint.h>

#define TWIN_003_RATE_HZ  10000.0
#define TWIN_003_DRIVE_V  150.0 /**< range of the drive, from 0 */
#define TWIN_003_RANGE_UM 90.0  /**< range of the displacement, from 0 */
#define TWIN_003_BIAS_V   75.0

typedef struct twin_003 twin_003_t;

/** At rest at TWIN_003_BIAS_V, risen there from 0 V. Free with free(). */
twin_003_t *twin_003_open(uint64_t seed);

/** Returns the displacement as measured now, in um, and then holds the drive for one sample. */
double twin_003_sample(twin_003_t *twin, double drive_v);

/** A new recording of bias + amplitude sin(2 pi f t) after `settle` periods that are not recorded. */
void twin_003_record(recording_t *recording, double frequency_hz, double amplitude_v, unsigned settle, unsigned periods,
                     uint64_t seed);

#endif
