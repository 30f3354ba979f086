/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/recursion.h"
#include <gsl/gsl_math.h>
#include <string.h>

/* Jury's conditions of z^3 - c1 z^2 - c2 z - c3. */
static double jury_slack(double c1, double c2, double c3) {
    const double ends = fmin(1.0 - c1 - c2 - c3, 1.0 + c1 - c2 + c3);
    return fmin(ends, fmin(1.0 - fabs(c3), 1.0 - c3 * c3 - fabs(c2 + c1 * c3)));
}

/* For given c2 and c3 every condition is concave in c1, so the ends of [c1 - |g|, c1 + |g|] decide. */
double recursion_margin(const double feedback[RECURSION_FEEDBACK], double bilinear) {
    return fmin(jury_slack(feedback[0] - bilinear, feedback[1], feedback[2]),
                jury_slack(feedback[0] + bilinear, feedback[1], feedback[2]));
}

bool recursion_check(const parameter_t *parameter, failure_t *failure) {
    static const double none[RECURSION_FEEDBACK] = {0.0};
    const parameter_t *feedback = &parameter[RECURSION_FEEDBACK_TERMS],
                      *harmonic = &parameter[RECURSION_HARMONIC_TERMS];
    if (feedback->count != 0 && feedback->count != RECURSION_FEEDBACK) {
        return fail(failure, "feedback has %zu elements instead of %d", feedback->count, RECURSION_FEEDBACK);
    }
    if (harmonic->count != 0 && harmonic->count != RECURSION_HARMONICS) {
        return fail(failure, "harmonics_um has %zu elements instead of %d", harmonic->count, RECURSION_HARMONICS);
    }
    if (!(recursion_margin(feedback->count > 0 ? feedback->value : none, parameter[RECURSION_BILINEAR].value[0]) >
          0.0)) {
        return fail(failure, "feedback and bilinear_gain make the position run away");
    }
    return true;
}

static bool any(const parameter_t *parameter) {
    size_t i = 0;
    while (i < parameter->count && parameter->value[i] == 0.0) {
        i++;
    }
    return i < parameter->count;
}

bool recursion_is_used(const parameter_t *parameter) {
    return any(&parameter[RECURSION_FEEDBACK_TERMS]) || any(&parameter[RECURSION_BILINEAR]) ||
           any(&parameter[RECURSION_HARMONIC_TERMS]);
}

void recursion_open(recursion_t *recursion, const parameter_t *parameter, const stage_setup_t *setup) {
    memset(recursion, 0, sizeof *recursion);
    recursion->center_v = parameter[RECURSION_CENTER].value[0];
    recursion->half_range_v = parameter[RECURSION_HALF_RANGE].value[0];
    recursion->bilinear = parameter[RECURSION_BILINEAR].value[0];
    if (parameter[RECURSION_FEEDBACK_TERMS].count > 0) {
        memcpy(recursion->feedback, parameter[RECURSION_FEEDBACK_TERMS].value, sizeof recursion->feedback);
    }
    if (parameter[RECURSION_HARMONIC_TERMS].count > 0) {
        memcpy(recursion->harmonic, parameter[RECURSION_HARMONIC_TERMS].value, sizeof recursion->harmonic);
    }
    recursion->harmonics = any(&parameter[RECURSION_HARMONIC_TERMS]);
    recursion->angle_step = 2.0 * M_PI * parameter[RECURSION_FREQUENCY].value[0] / setup->sample_rate_hz;
    recursion->angle = parameter[RECURSION_PHASE].value[0] - recursion->angle_step;
}

void recursion_harmonics(double u, double angle, double product[RECURSION_HARMONICS]) {
    const double s = sin(angle), c = cos(angle), cube = u * u * u;
    product[0] = u * s;
    product[1] = cube * s;
    product[2] = cube * u * u * s;
    product[3] = u * c;
    product[4] = cube * c;
    product[5] = cube * u * u * c;
}

double recursion_settle(recursion_t *recursion, double x, double u) {
    const double gain = recursion->feedback[0] + recursion->feedback[1] + recursion->feedback[2];
    const double y = x / (1.0 - gain - recursion->bilinear * fmax(-1.0, fmin(1.0, u)));
    for (size_t i = 0; i < RECURSION_FEEDBACK; i++) {
        recursion->output[i] = y;
    }
    recursion->input = u;
    return y;
}

double recursion_step(recursion_t *recursion, double x, double u) {
    double *const past = recursion->output;
    double y = x + (recursion->feedback[0] + recursion->bilinear * recursion->input) * past[0] +
               recursion->feedback[1] * past[1] + recursion->feedback[2] * past[2];
    if (recursion->harmonics) {
        double product[RECURSION_HARMONICS];
        recursion_harmonics(recursion->input, recursion->angle, product);
        for (size_t i = 0; i < RECURSION_HARMONICS; i++) {
            y += recursion->harmonic[i] * product[i];
        }
        recursion->angle = remainder(recursion->angle + recursion->angle_step, 2.0 * M_PI);
    }
    past[2] = past[1];
    past[1] = past[0];
    past[0] = y;
    recursion->input = u;
    return y;
}
