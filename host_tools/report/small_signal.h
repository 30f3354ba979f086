/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A model under a small drive, for its frequency response: a sum of sines that is repeated. */
#ifndef SMALL_SIGNAL_H
#define SMALL_SIGNAL_H

#include "chain/chain.h"

/** NAN: from the model. */
typedef struct {
    double bias_v, amplitude_v, sample_rate_hz;
} small_signal_t;

small_signal_t small_signal_unset(void);
/** Whether any of them is set. */
bool small_signal_set(const small_signal_t *wish);

/**
 * Simulates it. The drive is a sum of up to 40 sines of one amplitude about the bias, three times over. Their
 * frequencies stand at equal distances on a logarithmic axis, from a 4096th of the sample rate to 0.4 of it. Their
 * phases keep the peak low (Schroeder 1970). The peak is the amplitude, by default a hundredth of the drive range that
 * the model was fitted over (1 V where it does not say one), around its middle (0 V). A bias outside of that range, and
 * a swing wider than it, are refused. Noise, hum and steps of the sensor are in it as the model has them. On success
 * *recording is to be freed; `name` is its name.
 */
bool small_signal(const model_t *model, const char *name, const small_signal_t *wish, recording_t *recording,
                  failure_t *failure);

#endif
