/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "effects.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

static double logarithmic(random_t *random, double low, double high) {
    return low * pow(high / low, random_unit(random));
}

static double sign_of(random_t *random) {
    return random_unit(random) < 0.5 ? -1.0 : 1.0;
}

static double duration_s(const passage_t *passage) {
    return passage->step_s * (double)passage->count;
}

static double half_range_v(const passage_t *passage) {
    return 0.5 * (passage->actuator->high_v - passage->actuator->low_v);
}

static double middle_v(const passage_t *passage) {
    return 0.5 * (passage->actuator->high_v + passage->actuator->low_v);
}

/* Size is the first parameter. */
static void set_first(const passage_t *passage, double size, random_t *random, double *parameter) {
    (void)passage;
    (void)random;
    parameter[0] = size;
}

/* Refers to half of the drive range. */
static void set_bend(const passage_t *passage, double size, random_t *random, double *parameter) {
    parameter[0] = sign_of(random) * size;
    parameter[1] = half_range_v(passage);
}

static void delay(passage_t *passage, const double *parameter) {
    const double behind = parameter[0] / passage->step_s;
    const size_t whole = (size_t)behind;
    const double part = behind - (double)whole, first = passage->value[0];
    for (size_t k = passage->count; k-- > 0;) {
        const double newer = k >= whole ? passage->value[k - whole] : first;
        const double older = k >= whole + 1 ? passage->value[k - whole - 1] : first;
        passage->value[k] = newer + part * (older - newer);
    }
}

/* tau x' = u - x with u straight between the instants: the lag of a ramp is tau times its slope, and what deviates from
 * it decays. */
static void low_pass(passage_t *passage, double tau_s) {
    const double decay = exp(-passage->step_s / tau_s);
    double output = passage->value[0], before = output;
    for (size_t k = 1; k < passage->count; k++) {
        const double behind = tau_s * (passage->value[k] - before) / passage->step_s;
        output = passage->value[k] - behind + (output - before + behind) * decay;
        before = passage->value[k];
        passage->value[k] = output;
    }
}

static void set_cutoff(const passage_t *passage, double size, random_t *random, double *parameter) {
    (void)passage;
    (void)random;
    parameter[0] = 1.0 / (2.0 * pi * size); /* size: the time constant */
}

static void bandwidth(passage_t *passage, const double *parameter) {
    low_pass(passage, 1.0 / (2.0 * pi * parameter[0]));
}

static void set_slew(const passage_t *passage, double size, random_t *random, double *parameter) {
    (void)random;
    parameter[0] = passage->largest_rate_v_per_s / (1.0 + size);
}

static void slew(passage_t *passage, const double *parameter) {
    const double most = parameter[0] * passage->step_s;
    for (size_t k = 1; k < passage->count; k++) {
        const double change = passage->value[k] - passage->value[k - 1];
        passage->value[k] = passage->value[k - 1] + fmax(-most, fmin(most, change));
    }
}

static void set_rail(const passage_t *passage, double size, random_t *random, double *parameter) {
    (void)random;
    parameter[0] = passage->actuator->high_v - 2.0 * half_range_v(passage) * size;
}

static void rail(passage_t *passage, const double *parameter) {
    for (size_t k = 0; k < passage->count; k++) {
        passage->value[k] = fmin(parameter[0], passage->value[k]);
    }
}

static void asymmetric(passage_t *passage, const double *parameter) {
    for (size_t k = 0; k < passage->count; k++) {
        const double s = (passage->value[k] - middle_v(passage)) / half_range_v(passage);
        passage->value[k] += half_range_v(passage) * parameter[0] * (s * s - 1.0);
    }
}

static void rate_dependent(passage_t *passage, const double *parameter) {
    for (size_t k = 1; k < passage->count; k++) {
        passage->growth_v[k] = parameter[0] * fabs(passage->value[k] - passage->value[k - 1]) / passage->step_s;
    }
}

/* y(t) = h(t) + g y(t - T) s(t - T), T one sample, s the drive in parts of its half range. */
static void interleaved(passage_t *passage, const double *parameter) {
    for (size_t k = 0; k < passage->count; k++) {
        const size_t then = k >= OVERSAMPLING ? k - OVERSAMPLING : 0;
        const double s = (passage->drive_v[then] - middle_v(passage)) / half_range_v(passage);
        if (then == 0) { /* as it has been without end */
            passage->value[k] /= 1.0 - parameter[0] * s;
        } else {
            passage->value[k] += parameter[0] * passage->value[then] * s;
        }
    }
}

/* Adds relaxations that begin with the recording: `growth` of what comes in with every decade of time. */
static void add_relaxations(passage_t *passage, double shortest_s, size_t decades, size_t a_decade, double growth) {
    const size_t cells = decades * a_decade;
    const double first = passage->value[0];
    double *state = proof_allocate(cells, sizeof *state), *gain = proof_allocate(cells, sizeof *gain);
    for (size_t i = 0; i < cells; i++) {
        gain[i] = -expm1(-passage->step_s / (shortest_s * pow(10.0, ((double)i + 0.5) / (double)a_decade)));
    }
    for (size_t k = 0; k < passage->count; k++) {
        double sum = 0.0;
        for (size_t i = 0; i < cells; i++) { /* states count from the first value */
            state[i] += gain[i] * (passage->value[k] - first - state[i]);
            sum += state[i];
        }
        passage->value[k] += growth / (double)a_decade * sum;
    }
    free(state);
    free(gain);
}

/* A straight line over the logarithm of time from 0.1 s to 1000 s. */
static void creep(passage_t *passage, const double *parameter) {
    add_relaxations(passage, 0.1, 4, 8, parameter[0]);
}

/* The same lag at all frequencies, by relaxations of six decades. Of a response of 1 at once and g more with every
 * decade of time, the sine part is pi / (2 ln 10) g. What rests has relaxed: 1 + 6 g in all, here called 1. */
static void constant_phase(passage_t *passage, const double *parameter) {
    enum { DECADES = 6 };
    const double growth = 2.0 * log(10.0) / pi * parameter[0], first = passage->value[0];
    add_relaxations(passage, 1e-4, DECADES, 4, growth);
    for (size_t k = 0; k < passage->count; k++) {
        passage->value[k] = first + (passage->value[k] - first) / (1.0 + DECADES * growth);
    }
}

static void set_leakage(const passage_t *passage, double size, random_t *random, double *parameter) {
    (void)random;
    parameter[0] = duration_s(passage) / size;
}

static void leakage(passage_t *passage, const double *parameter) {
    const double gain = -expm1(-passage->step_s / parameter[0]), rest = passage->value[0];
    double leaked = rest;
    for (size_t k = 0; k < passage->count; k++) {
        leaked += gain * (passage->value[k] - leaked);
        passage->value[k] += rest - leaked;
    }
}

static void set_gain_drift(const passage_t *passage, double size, random_t *random, double *parameter) {
    parameter[0] = sign_of(random) * size / duration_s(passage);
}

static void gain_drift(passage_t *passage, const double *parameter) {
    for (size_t k = 0; k < passage->count; k++) {
        passage->value[k] *= 1.0 + parameter[0] * passage->step_s * (double)k;
    }
}

/* Size is the gain's change by lasting loops over the range, one a second. */
static void set_self_heating(const passage_t *passage, double size, random_t *random, double *parameter) {
    parameter[0] = sign_of(random) * size;
    parameter[1] = duration_s(passage) * logarithmic(random, 0.05, 0.3);
    parameter[2] = half_range_v(passage);
}

/* Hooks on strings of evenly spread lengths, which the drive drags along once it has left them by that length; what
 * they are dragged is heat. */
static void self_heating(passage_t *passage, const double *parameter) {
    enum { HOOKS = 100 };
    double hook_v[HOOKS], heat = 0.0;
    for (size_t i = 0; i < HOOKS; i++) {
        hook_v[i] = passage->drive_v[0];
    }
    for (size_t k = 1; k < passage->count; k++) {
        double dragged_v = 0.0;
        for (size_t i = 0; i < HOOKS; i++) {
            const double length_v = parameter[2] * ((double)i + 0.5) / HOOKS, away_v = passage->drive_v[k] - hook_v[i];
            const double drag_v = copysign(fmax(0.0, fabs(away_v) - length_v), away_v);
            hook_v[i] += drag_v;
            dragged_v += fabs(drag_v) / HOOKS;
        }
        const double power_hz = dragged_v / passage->step_s / (2.0 * parameter[2]);
        heat += passage->step_s / parameter[1] * (power_hz - heat);
        passage->value[k] *= 1.0 + parameter[0] * heat;
    }
}

/* Size is the squared period, to which the lag of a mode far above the drive is proportional. */
static void set_mode(const passage_t *passage, double size, random_t *random, double *parameter) {
    (void)passage;
    parameter[0] = 1.0 / sqrt(size);
    parameter[1] = logarithmic(random, 0.01, 0.05);
}

/* q'' = w^2 (u - q) - 2 zeta w q', fourth order, u straight between the instants, at least 20 steps a period. */
static void mode(passage_t *passage, const double *parameter) {
    const double w = 2.0 * pi * parameter[0], damping = 2.0 * parameter[1] * w;
    const size_t steps = (size_t)ceil(20.0 * parameter[0] * passage->step_s);
    const double h = passage->step_s / (double)steps;
    double q = passage->value[0], v = 0.0, input = q;
    for (size_t k = 1; k < passage->count; k++) {
        const double slope = (passage->value[k] - input) / (double)steps;
        for (size_t i = 0; i < steps; i++) {
            const double u0 = input + slope * (double)i, u1 = u0 + 0.5 * slope, u2 = u0 + slope;
            const double q1 = v, v1 = w * w * (u0 - q) - damping * v;
            const double q2 = v + 0.5 * h * v1, v2 = w * w * (u1 - q - 0.5 * h * q1) - damping * q2;
            const double q3 = v + 0.5 * h * v2, v3 = w * w * (u1 - q - 0.5 * h * q2) - damping * q3;
            const double q4 = v + h * v3, v4 = w * w * (u2 - q - h * q3) - damping * q4;
            q += h * (q1 + 2.0 * q2 + 2.0 * q3 + q4) / 6.0;
            v += h * (v1 + 2.0 * v2 + 2.0 * v3 + v4) / 6.0;
        }
        input = passage->value[k];
        passage->value[k] = q;
    }
}

static void preload(passage_t *passage, const double *parameter) {
    for (size_t k = 0; k < passage->count; k++) {
        passage->value[k] /= 1.0 + parameter[0] * passage->preload_n;
    }
}

static void set_curved_sensor(const passage_t *passage, double size, random_t *random, double *parameter) {
    const double part = random_unit(random) < 0.5 ? 1.0 : 0.0, sign = sign_of(random);
    parameter[0] = sign * size * part;
    parameter[1] = sign * size * (1.0 - part);
    parameter[2] = passage->actuator->um_per_half_range;
    parameter[3] = passage->actuator->offset_um;
}

static void curved_sensor(passage_t *passage, const double *parameter) {
    const double half = parameter[2], middle = parameter[3];
    for (size_t k = 0; k < passage->count; k++) {
        const double s = (passage->value[k] - middle) / half;
        passage->value[k] += half * s * s * (parameter[0] + parameter[1] * s);
    }
}

static void set_thermal(const passage_t *passage, double size, random_t *random, double *parameter) {
    parameter[0] = sign_of(random) * size * passage->actuator->um_per_half_range;
    parameter[1] = duration_s(passage) * logarithmic(random, 0.2, 1.0);
}

static void thermal(passage_t *passage, const double *parameter) {
    for (size_t k = 0; k < passage->count; k++) {
        passage->value[k] += parameter[0] * (1.0 - exp(-passage->step_s * (double)k / parameter[1]));
    }
}

static void set_hum(const passage_t *passage, double size, random_t *random, double *parameter) {
    static const double mains_hz[] = {50.0, 60.0, 100.0, 150.0};
    parameter[0] = mains_hz[random_between(random, 0, 3)] * (1.0 + 0.0005 * random_normal(random));
    parameter[1] = size * passage->actuator->um_per_half_range;
    parameter[2] = 2.0 * pi * random_unit(random);
}

static void hum(passage_t *passage, const double *parameter) {
    for (size_t k = 0; k < passage->count; k++) {
        passage->value[k] += parameter[1] * sin(2.0 * pi * parameter[0] * passage->step_s * (double)k + parameter[2]);
    }
}

static void set_steps(const passage_t *passage, double size, random_t *random, double *parameter) {
    (void)random;
    parameter[0] = size * passage->actuator->um_per_half_range;
}

static void steps(passage_t *passage, const double *parameter) {
    for (size_t k = 0; k < passage->count; k++) {
        passage->value[k] = parameter[0] * floor(passage->value[k] / parameter[0] + 0.5);
    }
}

const effect_t catalogue_effects[] = {
    {"transport_delay", {"delay_s"}, 2e-4, 2e-2, set_first, delay, STAGE_ELECTRONICS, false},
    {"amplifier_bandwidth", {"cutoff_hz"}, 2e-4, 2e-2, set_cutoff, bandwidth, STAGE_ELECTRONICS, false},
    {"amplifier_slew_limit", {"limit_v_per_s"}, 0.5, 100.0, set_slew, slew, STAGE_ELECTRONICS, false},
    {"amplifier_saturation", {"high_v"}, 0.05, 0.4, set_rail, rail, STAGE_ELECTRONICS, false},
    {"asymmetric_hysteresis", {"asymmetry", "half_range_v"}, 0.03, 0.3, set_bend, asymmetric, STAGE_HYSTERESIS, false},
    {"rate_dependent_hysteresis", {"beta_s"}, 1e-3, 0.1, set_first, rate_dependent, STAGE_HYSTERESIS, true},
    {"interleaved_hysteresis",
     {"bilinear_gain", "half_range_v"},
     0.02,
     0.3,
     set_bend,
     interleaved,
     STAGE_POSITION,
     false},
    {"creep", {"gamma_per_decade"}, 0.015, 0.1, set_first, creep, STAGE_POSITION, false},
    {"dielectric_loss", {"loss_tangent"}, 0.01, 0.1, set_first, constant_phase, STAGE_POSITION, false},
    {"charge_leakage", {"time_constant_s"}, 0.2, 20.0, set_leakage, leakage, STAGE_POSITION, false},
    {"gain_drift", {"gain_per_s"}, 0.02, 0.5, set_gain_drift, gain_drift, STAGE_POSITION, false},
    {"self_heating",
     {"gain_per_hz", "time_constant_s", "half_range_v"},
     0.01,
     0.5,
     set_self_heating,
     self_heating,
     STAGE_POSITION,
     false},
    {"resonance", {"frequency_hz", "damping_ratio"}, 1e-5, 1e-3, set_mode, mode, STAGE_POSITION, false},
    {"preload", {"compliance_per_n"}, 0.003, 0.1, set_first, preload, STAGE_POSITION, false},
    {"sensor_bandwidth", {"cutoff_hz"}, 2e-4, 2e-2, set_cutoff, bandwidth, STAGE_POSITION, false},
    {"static_nonlinearity",
     {"quadratic", "half_range_um", "center_um"},
     0.01,
     0.3,
     set_curved_sensor,
     curved_sensor,
     STAGE_POSITION,
     false},
    {"thermal_drift", {"drift_um", "time_constant_s"}, 0.02, 1.0, set_thermal, thermal, STAGE_POSITION, false},
    {"mains_interference", {"frequency_hz", "amplitude_um"}, 2e-3, 0.5, set_hum, hum, STAGE_POSITION, false},
    {"quantisation", {"step_um"}, 5e-3, 0.5, set_steps, steps, STAGE_SAMPLES, false},
};
const size_t catalogue_effect_count = sizeof catalogue_effects / sizeof catalogue_effects[0];

const effect_t *effect_find(const char *name) {
    for (size_t i = 0; i < catalogue_effect_count; i++) {
        if (strcmp(catalogue_effects[i].name, name) == 0) {
            return &catalogue_effects[i];
        }
    }
    fprintf(stderr, "proof: no effect %s\n", name);
    exit(EXIT_FAILURE);
}
