/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Inverse filters of compile.h: a lag or a mode inverted and rolled off, by the bilinear transform.
 */
#ifndef COMPILE_FILTERS_H
#define COMPILE_FILTERS_H

#include "elements/second_order.h"
#include "hyst/iir.h"
#include <stdbool.h>

/** The inverse filter of a block. */
typedef struct {
    bool section;              /**< an IIR section is needed */
    double b0, b1, b2, a1, a2; /**< of that section */
    double rolloff_hz;         /**< of that section */
    double delay_s;            /**< low-frequency delay of block and section together, for the lookahead */
} inverse_filter_t;

/** (1 + s/w_c) / (1 + s/w_r), w_r = min(4 w_c, 2 pi fs / 5); without a section if w_r would not exceed w_c. */
inverse_filter_t invert_lag(double cutoff_hz, double sample_rate_hz, bool no_filters);

/** The mode inverted, times a mode of the same frequency and damping 0.7; without a section above fs / 5. */
inverse_filter_t invert_mode(double frequency_hz, double damping_ratio, double sample_rate_hz, bool no_filters);

typedef struct {
    double frequency_hz, damping_ratio;
} oscillation_t;

/** A sum of two modes inverted, as two sections: the lower mode as invert_mode has it, and the upper one over the
 * antiresonance between them, exactly. false: that antiresonance has no stable inverse, or is above fs / 5; then the
 * second section is that of the upper mode alone. upper_share: of the position at rest; the lower mode's is the rest of
 * 1. */
bool invert_two_modes(oscillation_t lower, oscillation_t upper, double upper_share, double sample_rate_hz,
                      bool no_filters, inverse_filter_t inverse[2]);

/** A low pass of second order inverted, times one of damping 0.7 at min(2 frequency, fs / 5); without a section if that
 * would not exceed its frequency. */
inverse_filter_t invert_low_pass(double frequency_hz, double damping_ratio, double sample_rate_hz, bool no_filters);

/** The filter itself inverted, without a roll-off. false: that is not stable, or does not fit the number format. */
bool invert_second_order(const second_order_t *filter, double sample_rate_hz, bool no_filters,
                         inverse_filter_t *inverse);

/** A low pass of second order for a sum of the last three inputs: gain / (1 + a1 z^-1 + a2 z^-2), 1 at rest. */
typedef struct {
    double gain, a1, a2;
    double delay_samples; /**< at low frequencies */
} rolled_off_t;

/** The one of damping 0.7 and the highest corner with which a sum whose weights have these magnitudes together fits the
 * number format (hyst/iir.h); none, of gain 1, where the weights fit as they are. */
rolled_off_t roll_off(double magnitudes);

/** Rounds to Q28. Each coefficient must be inside [-8, 8). */
hyst_iir_section_t quantise_section(const inverse_filter_t *filter);

#endif
