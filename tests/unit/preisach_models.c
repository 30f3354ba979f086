/* SPDX-License-Identifier: MIT */
#include "preisach_models.h"
#include "unity.h"
#include <math.h>

static uint32_t element(uint32_t i, uint32_t j) {
    return i * (i - 1U) / 2U + j;
}

int32_t preisach_least_step(uint32_t intervals) {
    const int32_t whole = 2 * HYST_PREISACH_MIN_SLOPE; /* of the drive's range of 2 */
    const int32_t n = (int32_t)intervals;
    return (whole + n - 1) / n;
}

int64_t preisach_largest_step(uint32_t intervals) {
    return 2 * HYST_PREISACH_MAX_SLOPE / (int64_t)intervals;
}

preisach_arguments_t preisach_random(random_t *random, uint32_t intervals) {
    preisach_arguments_t a = {.intervals = intervals, .offset = random_q31(random) >> (random_bits(random) % 4U)};
    const int64_t least = preisach_least_step(intervals);
    /* A largest step of its own for each table, or else nearly all would be steep. */
    const int64_t largest =
        least + (int64_t)((double)(preisach_largest_step(intervals) - least) * pow(2.0, -8.0 * random_unit(random)));
    for (uint32_t distance = 1; distance <= intervals; distance++) {
        for (uint32_t j = 0; j + distance <= intervals; j++) {
            const uint32_t i = j + distance;
            const int64_t below = distance > 1 ? a.everett[element(i - 1U, j)] : 0;
            const int64_t beside = distance > 1 ? a.everett[element(i, j + 1U)] : 0;
            const int64_t low = (below > beside ? below : beside) + least;
            int64_t high = (below < beside ? below : beside) + largest;
            high = high > INT32_MAX ? INT32_MAX : high; /* happens to the last element of the steepest table only */
            const double where = random_unit(random);
            int64_t value = low + (int64_t)(random_unit(random) * (double)(high - low));
            if (where < 0.2) {
                value = low;
            } else if (where > 0.8) {
                value = high;
            }
            a.everett[element(i, j)] = (hyst_q28_t)value;
        }
    }
    return a;
}

preisach_arguments_t preisach_smooth(uint32_t intervals, double slope, double curve) {
    preisach_arguments_t a = {.intervals = intervals};
    for (uint32_t i = 1; i <= intervals; i++) {
        for (uint32_t j = 0; j < i; j++) {
            const double high = 2.0 * i / intervals - 1.0;
            const double low = 2.0 * j / intervals - 1.0;
            const double d = high - low;
            const double even = 0.05 * slope * (high * high - low * low);
            a.everett[element(i, j)] = (hyst_q28_t)lround((slope * d + curve * d * d + even) * HYST_Q28_ONE);
        }
    }
    return a;
}

hyst_preisach_t preisach_accept(const preisach_arguments_t *arguments) {
    hyst_preisach_t model;
    uint32_t at = 0;
    TEST_ASSERT_EQUAL_INT(HYST_PREISACH_OK, hyst_preisach_build(&model, arguments->intervals, arguments->offset,
                                                                arguments->everett, &at));
    return model;
}

slopes_t preisach_slopes(const hyst_preisach_t *model) {
    slopes_t slopes = {.flattest = HUGE_VAL, .steepest = 0.0};
    for (uint32_t i = 1; i <= model->intervals; i++) {
        for (uint32_t j = 0; j < i; j++) {
            const double here = model->everett[i][j];
            const double rise = here - model->everett[i - 1U][j];
            const double fall = here - model->everett[i][j + 1U];
            slopes.flattest = fmin(slopes.flattest, fmin(rise, fall));
            slopes.steepest = fmax(slopes.steepest, fmax(rise, fall));
        }
    }
    const double scale = model->intervals / 2.0 / HYST_Q28_ONE;
    slopes.flattest *= scale;
    slopes.steepest *= scale;
    return slopes;
}

void preisach_reference_begin(preisach_reference_t *reference, const preisach_arguments_t *arguments) {
    reference->intervals = arguments->intervals;
    for (uint32_t k = 0; k < HYST_PREISACH_ELEMENTS(arguments->intervals); k++) {
        reference->everett[k] = arguments->everett[k] * 0x1p-28L;
    }
    reference->lowest = arguments->offset * 0x1p-31L - reference->everett[element(arguments->intervals, 0)] / 2.0L;
    reference->extremes = 0;
    reference->drive = -1.0L;
}

/* X(alpha, beta) of paper 002: the plane a_0 + a_1 alpha + a_2 beta in a triangle (2.25), b_0 + b_1 alpha + b_2 beta +
 * b_3 alpha beta in a square (2.26). Coefficients from the corners. */
static long double x_of(const preisach_reference_t *m, long double alpha, long double beta) {
    const long double width = 2.0L / m->intervals;
    const uint32_t last = m->intervals - 1U;
    uint32_t i = (uint32_t)((alpha + 1.0L) / width);
    uint32_t j = (uint32_t)((beta + 1.0L) / width);
    i = i > last ? last : i;
    j = j > last ? last : j;
    const long double p = (alpha - (-1.0L + i * width)) / width;
    const long double q = (beta - (-1.0L + j * width)) / width;
    if (i == j) {
        return m->everett[element(i + 1U, i)] * (p - q);
    }
    const long double x00 = m->everett[element(i, j)];
    const long double x10 = m->everett[element(i + 1U, j)];
    const long double x01 = j + 1U == i ? 0.0L : m->everett[element(i, j + 1U)];
    const long double x11 = m->everett[element(i + 1U, j + 1U)];
    return x00 + (x10 - x00) * p + (x01 - x00) * q + (x11 - x10 - x01 + x00) * p * q;
}

long double preisach_reference_forward(preisach_reference_t *reference, long double drive) {
    /* Maxima at even indices: n extremes, odd n: falling now. */
    const bool falling_now = reference->extremes % 2U == 1U;
    if (drive > reference->drive && falling_now) {
        TEST_ASSERT_TRUE(reference->extremes < REFERENCE_EXTREMES);
        reference->extreme[reference->extremes++] = reference->drive;
    } else if (drive < reference->drive && !falling_now) {
        TEST_ASSERT_TRUE(reference->extremes < REFERENCE_EXTREMES);
        reference->extreme[reference->extremes++] = reference->drive;
    }
    reference->drive = drive;
    while (reference->extremes >= 2U) {
        const bool falling = reference->extremes % 2U == 1U;
        const long double opposite = reference->extreme[reference->extremes - 2U];
        if (falling ? drive > opposite : drive < opposite) {
            break;
        }
        reference->extremes -= 2U;
    }
    if (reference->extremes == 1U && drive <= -1.0L) {
        reference->extremes = 0;
    }
    long double y = reference->lowest;
    long double beta = -1.0L;
    for (uint32_t k = 0; k + 1U < reference->extremes; k += 2U) {
        y += x_of(reference, reference->extreme[k], beta) -
             x_of(reference, reference->extreme[k], reference->extreme[k + 1U]);
        beta = reference->extreme[k + 1U];
    }
    if (reference->extremes % 2U == 0U) {
        return y + x_of(reference, drive, beta); /* (2.18) */
    }
    const long double alpha = reference->extreme[reference->extremes - 1U];
    return y + x_of(reference, alpha, beta) - x_of(reference, alpha, drive); /* (2.22) */
}

void preisach_carry(const hyst_preisach_t *from, const hyst_preisach_state_t *from_state, const hyst_preisach_t *to,
                    hyst_preisach_state_t *to_state) {
    uint32_t carried = 0;
    uint32_t calls = 1;
    while (!hyst_preisach_carry(from, from_state, to, to_state, &carried)) {
        calls++;
    }
    TEST_ASSERT_TRUE(calls < HYST_PREISACH_CARRY_CALLS); /* nothing is merged in between */
}
