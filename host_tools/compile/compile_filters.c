/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "compile/compile_filters.h"
#include <gsl/gsl_math.h>

static const double highest_rolloff =
    0.2; /* of the sample rate: the bilinear transform bends frequencies by 14 % there */
static const double lag_rolloff_ratio = 4.0;      /* keeps every coefficient inside Q28 and the noise gain at 4 */
static const double low_pass_rolloff_ratio = 2.0; /* likewise: the gain goes with its square */
static const double mode_rolloff_damping = 0.7;

/* Group delay at frequency 0 in samples: that of the numerator less that of the denominator, whose sums are equal. */
static double delay_at_rest(const inverse_filter_t *filter) {
    const double gain = filter->b0 + filter->b1 + filter->b2;
    return (filter->b1 + 2.0 * filter->b2 - filter->a1 - 2.0 * filter->a2) / gain;
}

inverse_filter_t invert_lag(double cutoff_hz, double sample_rate_hz, bool no_filters) {
    inverse_filter_t filter = {.delay_s = 1.0 / (2.0 * M_PI * cutoff_hz)};
    const double rolloff_hz = fmin(lag_rolloff_ratio * cutoff_hz, highest_rolloff * sample_rate_hz);
    if (no_filters || rolloff_hz <= cutoff_hz) {
        return filter;
    }
    /* s -> 2 fs (1 - z^-1) / (1 + z^-1) */
    const double c = sample_rate_hz / (M_PI * cutoff_hz), r = sample_rate_hz / (M_PI * rolloff_hz);
    filter.section = true;
    filter.rolloff_hz = rolloff_hz;
    filter.b0 = (1.0 + c) / (1.0 + r);
    filter.b1 = (1.0 - c) / (1.0 + r);
    filter.a1 = (1.0 - r) / (1.0 + r);
    filter.delay_s += delay_at_rest(&filter) / sample_rate_hz;
    return filter;
}

/* 1 + 2 damping p + p^2 over the same of another oscillator. Bilinear transforms, each prewarped there, so that the
 * notch is where the mode is. */
static inverse_filter_t replace_oscillator(double frequency_hz, double damping_ratio, double rolloff_hz,
                                           double rolloff_damping, double sample_rate_hz) {
    const double k = 1.0 / tan(M_PI * frequency_hz / sample_rate_hz), k2 = k * k;
    const double r = 1.0 / tan(M_PI * rolloff_hz / sample_rate_hz), r2 = r * r;
    const double numerator = 2.0 * damping_ratio * k, denominator = 2.0 * rolloff_damping * r;
    const double a0 = r2 + denominator + 1.0;
    inverse_filter_t filter = {.section = true,
                               .rolloff_hz = rolloff_hz,
                               .b0 = (k2 + numerator + 1.0) / a0,
                               .b1 = 2.0 * (1.0 - k2) / a0,
                               .b2 = (k2 - numerator + 1.0) / a0,
                               .a1 = 2.0 * (1.0 - r2) / a0,
                               .a2 = (r2 - denominator + 1.0) / a0};
    filter.delay_s = damping_ratio / (M_PI * frequency_hz) + delay_at_rest(&filter) / sample_rate_hz;
    return filter;
}

static inverse_filter_t invert_oscillator(double frequency_hz, double damping_ratio, double rolloff_hz,
                                          double sample_rate_hz) {
    return replace_oscillator(frequency_hz, damping_ratio, rolloff_hz, mode_rolloff_damping, sample_rate_hz);
}

static inverse_filter_t oscillator_as_delay(double frequency_hz, double damping_ratio) {
    return (inverse_filter_t){.delay_s = damping_ratio / (M_PI * frequency_hz)};
}

inverse_filter_t invert_mode(double frequency_hz, double damping_ratio, double sample_rate_hz, bool no_filters) {
    return no_filters || frequency_hz > highest_rolloff * sample_rate_hz
               ? oscillator_as_delay(frequency_hz, damping_ratio)
               : invert_oscillator(frequency_hz, damping_ratio, frequency_hz, sample_rate_hz);
}

/*
 * With p = s / 2 pi, both modes over one denominator:
 *
 *     (1 - share) / (1 + 2 za p / fa + p^2 / fa^2) + share / (1 + 2 zb p / fb + p^2 / fb^2)
 *   = (1 + 2 z p / f + p^2 / f^2) / ((1 + 2 za p / fa + p^2 / fa^2) (1 + 2 zb p / fb + p^2 / fb^2))
 *
 * 1 / f^2 = (1 - share) / fb^2 + share / fa^2, z / f = (1 - share) zb / fb + share za / fa. The antiresonance f, z has
 * a stable inverse if both are positive; between the modes it is if both shares are.
 */
bool invert_two_modes(oscillation_t lower, oscillation_t upper, double upper_share, double sample_rate_hz,
                      bool no_filters, inverse_filter_t inverse[2]) {
    const double rest = 1.0 - upper_share, highest_hz = highest_rolloff * sample_rate_hz;
    const double square =
        rest / gsl_pow_2(upper.frequency_hz) + upper_share / gsl_pow_2(lower.frequency_hz); /* 1 / f^2 */
    const double lag =
        rest * upper.damping_ratio / upper.frequency_hz + upper_share * lower.damping_ratio / lower.frequency_hz;
    const oscillation_t zero = {1.0 / sqrt(square),
                                lag / sqrt(square)}; /* of no meaning where square is not positive */
    inverse[0] = invert_mode(lower.frequency_hz, lower.damping_ratio, sample_rate_hz, no_filters);
    if (square > 0.0 && lag > 0.0 && inverse[0].section && upper.frequency_hz <= highest_hz &&
        zero.frequency_hz <= highest_hz) {
        inverse[1] = replace_oscillator(upper.frequency_hz, upper.damping_ratio, zero.frequency_hz, zero.damping_ratio,
                                        sample_rate_hz);
        inverse[1].delay_s -= lag / M_PI;
        return true;
    }
    inverse[1] = invert_mode(upper.frequency_hz, upper.damping_ratio, sample_rate_hz, no_filters);
    inverse[1].delay_s -= lag / M_PI;
    return no_filters;
}

inverse_filter_t invert_low_pass(double frequency_hz, double damping_ratio, double sample_rate_hz, bool no_filters) {
    const double rolloff_hz = fmin(low_pass_rolloff_ratio * frequency_hz, highest_rolloff * sample_rate_hz);
    return no_filters || rolloff_hz <= frequency_hz
               ? oscillator_as_delay(frequency_hz, damping_ratio)
               : invert_oscillator(frequency_hz, damping_ratio, rolloff_hz, sample_rate_hz);
}

bool invert_second_order(const second_order_t *filter, double sample_rate_hz, bool no_filters,
                         inverse_filter_t *inverse) {
    static const double most = 8.0; /* of Q28 */
    *inverse = (inverse_filter_t){.delay_s = no_filters ? filter->delay_s : 0.0};
    if (!filter->invertible) {
        return false;
    }
    if (!no_filters) {
        inverse->section = true;
        inverse->b0 = 1.0 / filter->b0;
        inverse->b1 = filter->a1 / filter->b0;
        inverse->b2 = filter->a2 / filter->b0;
        inverse->a1 = filter->b1 / filter->b0;
        inverse->a2 = filter->b2 / filter->b0;
        inverse->rolloff_hz = 0.5 * sample_rate_hz;
    }
    return fabs(inverse->b0) < most && fabs(inverse->b1) < most && fabs(inverse->b2) < most &&
           fabs(inverse->a1) < most && fabs(inverse->a2) < most;
}

rolled_off_t roll_off(double magnitudes) {
    static const double most = 14.5, most_of_past = 3.0; /* all of a section's magnitudes; |a1| + |a2| */
    if (magnitudes <= most) {
        return (rolled_off_t){.gain = 1.0};
    }
    /* The denominator of the bilinear transform, r = cot(pi f / fs): a0 + .. = 4 at rest. */
    const double a0 = 4.0 * magnitudes / (most - most_of_past), d = mode_rolloff_damping;
    const double r = sqrt(d * d - 1.0 + a0) - d;
    return (rolled_off_t){.gain = 4.0 / a0,
                          .a1 = 2.0 * (1.0 - r * r) / a0,
                          .a2 = (r * r - 2.0 * d * r + 1.0) / a0,
                          .delay_samples = d * r - 1.0};
}

static hyst_q28_t to_q28(double coefficient) {
    return (hyst_q28_t)floor(coefficient * (double)HYST_Q28_ONE + 0.5);
}

hyst_iir_section_t quantise_section(const inverse_filter_t *filter) {
    hyst_iir_section_t section = {
        .b1 = to_q28(filter->b1), .b2 = to_q28(filter->b2), .a1 = to_q28(filter->a1), .a2 = to_q28(filter->a2)};
    /* Gain 1 at rest to the bit: b0 takes up the rounding of the others. */
    section.b0 = (hyst_q28_t)((int64_t)HYST_Q28_ONE + section.a1 + section.a2 - section.b1 - section.b2);
    return section;
}
