/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/sine_fit.h"
#include "numerics/least_squares.h"
#include "numerics/period_tracker.h"
#include <gsl/gsl_math.h>

/* One Gauss-Newton step in frequency, offset and the two quadratures; with unknowns = 3 the frequency stays. */
static bool refine(const double *value, size_t count, double *angle, double *offset, double quadrature[2],
                   size_t unknowns, double *rms, failure_t *failure) {
    static const double unbounded[4] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    normal_equations_t equations;
    double x[4] = {0};
    bool good;
    normal_equations_create(&equations, unknowns);
    for (size_t k = 0; k < count; k++) {
        const double t = (double)k - 0.5 * (double)count; /* from the middle: decorrelates frequency and phase */
        const double s = sin(*angle * t), c = cos(*angle * t);
        const double row[4] = {1.0, s, c, t * (quadrature[0] * c - quadrature[1] * s)};
        normal_equations_add(&equations, row, value[k]);
    }
    normal_equations_finish(&equations);
    good = solve_bounded(&equations, unbounded, x, NULL, failure);
    if (good) {
        *rms = sqrt(squared_error(&equations, x) / (double)count);
        *offset = x[0];
        quadrature[0] = x[1];
        quadrature[1] = x[2];
        *angle += x[3];
    }
    normal_equations_free(&equations);
    return good;
}

/* From crossings of the mean; 0 if there are too few. */
static double rough_angle(const double *value, size_t count) {
    double mean = 0.0, sum = 0.0, periods = 0.0;
    period_tracker_t tracker = {0};
    for (size_t k = 0; k < count; k++) {
        mean += value[k] / (double)count;
    }
    for (size_t k = 0; k < count; k++) {
        const double period = period_track(&tracker, value[k] - mean);
        sum += period;
        periods += period > 0.0 ? 1.0 : 0.0;
    }
    return periods > 0.0 ? 2.0 * M_PI * periods / sum : 0.0;
}

static bool fit(const double *value, size_t count, double sample_rate_hz, double angle, bool known, sine_t *sine,
                failure_t *failure) {
    const int rounds = known ? 1 : 12;
    double quadrature[2] = {0.0, 0.0};
    for (int round = 0; round < rounds; round++) { /* the first one has no quadratures to turn yet */
        if (!refine(value, count, &angle, &sine->offset, quadrature, known || round == 0 ? 3 : 4, &sine->rms,
                    failure)) {
            return false;
        }
        if (!(angle > 0.0 && angle < M_PI)) {
            return fail(failure, "no sine comes near the samples");
        }
    }
    sine->frequency_hz = angle * sample_rate_hz / (2.0 * M_PI);
    sine->amplitude = hypot(quadrature[0], quadrature[1]);
    /* Back from the middle to sample 0. */
    sine->phase = remainder(atan2(quadrature[1], quadrature[0]) - 0.5 * angle * (double)count, 2.0 * M_PI);
    return true;
}

bool sine_fit(const double *value, size_t count, double sample_rate_hz, sine_t *sine, failure_t *failure) {
    const double angle = rough_angle(value, count);
    if (!(angle > 0.0 && angle < M_PI)) {
        return fail(failure, "less than a period of an oscillation");
    }
    return fit(value, count, sample_rate_hz, angle, false, sine, failure);
}

bool sine_fit_at(const double *value, size_t count, double sample_rate_hz, double frequency_hz, sine_t *sine,
                 failure_t *failure) {
    return fit(value, count, sample_rate_hz, 2.0 * M_PI * frequency_hz / sample_rate_hz, true, sine, failure);
}
