/* SPDX-License-Identifier: MIT */
#include "hyst/board_limits.h"

#define IMPULSE       (1 << 24)
#define LONGEST       (1U << 16)
#define QUIET         8 /* of 2^-31: what is left of the response adds less than 2^-7 to the gain */
#define POLE_DISTANCE (HYST_Q28_ONE >> 13)

/* At frequency 0 (sign 1) and at half the sample rate (sign -1): |numerator| > gain * denominator. */
static bool exceeds_at(const hyst_iir_coefficients_t *s, int64_t sign, int64_t gain) {
    const int64_t numerator = s->b0 + sign * hyst_iir_first(s->b) + hyst_iir_second(s->b); /* |.| < 15 * 2^28 */
    const int64_t denominator =
        (int64_t)HYST_Q28_ONE - sign * hyst_iir_first(s->minus_a) - hyst_iir_second(s->minus_a); /* > 0, below 2^30 */
    return hyst_magnitude(numerator) > gain * denominator;
}

/* A pair of complex poles has the radius sqrt(a2). Real ones show at the ends of the frequency range. */
static bool rings_for_ever(const hyst_iir_coefficients_t *s) {
    const hyst_q28_t minus_a1 = hyst_iir_first(s->minus_a);
    const hyst_q28_t minus_a2 = hyst_iir_second(s->minus_a);
    const int64_t discriminant = hyst_product(minus_a1, minus_a1) + 4 * (int64_t)HYST_Q28_ONE * minus_a2;
    return discriminant < 0 && HYST_Q28_ONE + minus_a2 < POLE_DISTANCE;
}

static bool at_rest(const hyst_iir_t *filter, const hyst_iir_state_t *state) {
    for (uint32_t i = 0; i < filter->sections; i++) {
        const hyst_iir_section_state_t *s = &state->section[i];
        if (hyst_magnitude(s->y1) > QUIET || hyst_magnitude(s->y2) > QUIET) {
            return false;
        }
    }
    return true;
}

bool hyst_filter_gain_exceeds(const hyst_iir_t *filter, uint32_t gain) {
    hyst_iir_state_t state;
    bool saturated = false;
    const int64_t most = (int64_t)gain * IMPULSE;
    int64_t sum = 0;
    for (uint32_t i = 0; i < filter->sections; i++) {
        const hyst_iir_coefficients_t *s = &filter->section[i];
        if (exceeds_at(s, 1, gain) || exceeds_at(s, -1, gain) || rings_for_ever(s)) {
            return true;
        }
    }
    hyst_iir_reset(&state);
    hyst_q31_t x = IMPULSE;
    for (uint32_t k = 0; k < LONGEST; k++) {
        sum += hyst_magnitude(hyst_iir_step(filter, &state, x, &saturated)); /* below 2^16 * 2^31 */
        x = 0;
        if (sum > most || saturated) {
            return true;
        }
        if (k > 1U && at_rest(filter, &state)) {
            return false;
        }
    }
    return true;
}

hyst_parameters_fault_t hyst_board_limits_check(const hyst_board_limits_t *limits,
                                                const hyst_compensator_t *compensator) {
    const bool slew_good = compensator->transition_slew >= limits->transition_slew_min &&
                           compensator->transition_slew <= limits->transition_slew_max;
    const bool any_gain = limits->filter_gain_max == 0;
    const struct {
        bool bad;
        hyst_field_t field;
    } checks[] = {
        {!slew_good, HYST_FIELD_TRANSITION_SLEW},
        {!any_gain && hyst_filter_gain_exceeds(&compensator->shape, limits->filter_gain_max), HYST_FIELD_SHAPE},
        {!any_gain && hyst_filter_gain_exceeds(&compensator->inertia, limits->filter_gain_max), HYST_FIELD_INERTIA},
        {!any_gain && hyst_filter_gain_exceeds(&compensator->equalise, limits->filter_gain_max), HYST_FIELD_EQUALISE},
    };
    for (size_t i = 0; i < sizeof checks / sizeof checks[0]; i++) {
        if (checks[i].bad) {
            return (hyst_parameters_fault_t){.error = HYST_PARAMETERS_OUT_OF_RANGE, .field = checks[i].field};
        }
    }
    return (hyst_parameters_fault_t){.error = HYST_PARAMETERS_OK, .field = HYST_FIELD_NONE};
}
