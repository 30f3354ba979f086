/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The rate-dependent Prandtl-Ishlinskii model that paper 004 prints (III.B), and the loops that it draws.
 *
 *     y = a_0 u + sum a_i z_i,    z_i = max(u - r_i, min(u + r_i, z_i)),    r_i = i spacing + beta |du/dt|
 */
#ifndef PRINTED_004_H
#define PRINTED_004_H

#include "chain/model.h"
#include "recording/recording.h"
#include <stdint.h>

enum { PRINTED_004_OPERATORS = 10 };

/** um/V. */
extern const double printed_004_weight[PRINTED_004_OPERATORS + 1];
extern const double printed_004_spacing_v, printed_004_beta_s;

/** The same as a chain of the host tool's blocks, at the paper's 0.2 ms. Free with model_free. */
void printed_004_model(model_t *model, double rate_filter_s);

/** What makes the loops of a sine grow with its frequency. */
typedef struct {
    double beta_s;  /**< of the thresholds */
    double delay_s; /**< of the drive before it reaches the plays */
} printed_004_rate_t;

/**
 * A new recording of 10 V sin(2 pi f t) at the paper's 0.2 ms. The play operators are stepped 64 times a sample, with
 * the exact rate of the sine; they have forgotten their start when the recording begins. Sensor: steps of 10 nm as
 * printed, and 30 nm rms of normal noise, which is chosen: "a precision of 100 nm".
 */
void printed_004_record(recording_t *recording, double frequency_hz, printed_004_rate_t rate, double seconds,
                        uint64_t seed);

/** Largest distance of the two branches of that loop at one drive, without noise, um. */
double printed_004_width(double frequency_hz, printed_004_rate_t rate);

#endif
