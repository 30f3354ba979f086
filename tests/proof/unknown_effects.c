/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "effects.h"
#include <math.h>
#include <stdlib.h>

static const double pi = 3.14159265358979323846;

/* Size in um for a size in parts of half the stroke. */
static void set_um(const passage_t *passage, double size, random_t *random, double *parameter) {
    (void)random;
    parameter[0] = size * passage->actuator->um_per_half_range;
}

static void set_first(const passage_t *passage, double size, random_t *random, double *parameter) {
    (void)passage;
    (void)random;
    parameter[0] = size;
}

/* Play between mechanics and sensor. */
static void backlash(passage_t *passage, const double *parameter) {
    double output = passage->value[0];
    for (size_t k = 0; k < passage->count; k++) {
        output = fmax(passage->value[k] - parameter[0], fmin(passage->value[k] + parameter[0], output));
        passage->value[k] = output;
    }
}

/* Sticks until the spring pulls hard enough, then slips all the way. */
static void stiction(passage_t *passage, const double *parameter) {
    double output = passage->value[0];
    for (size_t k = 0; k < passage->count; k++) {
        if (fabs(passage->value[k] - output) > parameter[0]) {
            output = passage->value[k];
        }
        passage->value[k] = output;
    }
}

static void set_gain_step(const passage_t *passage, double size, random_t *random, double *parameter) {
    (void)passage;
    parameter[0] = random_unit(random) < 0.5 ? -size : size;
    parameter[1] = 0.3 + 0.6 * random_unit(random); /* when, of the recording */
}

static void gain_step(passage_t *passage, const double *parameter) {
    for (size_t k = (size_t)(parameter[1] * (double)passage->count); k < passage->count; k++) {
        passage->value[k] *= 1.0 + parameter[0];
    }
}

/* An adhesive of one relaxation time, a second: part of every step arrives later. */
static void relaxation(passage_t *passage, const double *parameter) {
    const double gain = -expm1(-passage->step_s);
    double late = passage->value[0];
    for (size_t k = 0; k < passage->count; k++) {
        late += gain * (passage->value[k] - late);
        passage->value[k] += parameter[0] * (late - passage->value[k]);
    }
}

static void set_mode(const passage_t *passage, double size, random_t *random, double *parameter) {
    parameter[0] = size;
    parameter[1] = (0.06 + 0.06 * random_unit(random)) / (passage->step_s * OVERSAMPLING); /* Hz: of the sample rate */
}

/* A second mode, coupled: a zero pair just below its pole pair. */
static void antiresonance(passage_t *passage, const double *parameter) {
    const double zero = 2.0 * pi * parameter[1], pole = zero * (1.0 + parameter[0]), zeta = 0.01, h = passage->step_s;
    double q = passage->value[0], v = 0.0;
    for (size_t k = 0; k < passage->count; k++) { /* semi-implicit: the step is a small part of the period */
        const double acceleration = pole * pole * (passage->value[k] - q) - 2.0 * zeta * pole * v;
        v += h * acceleration;
        q += h * v;
        passage->value[k] = q + 2.0 * zeta / zero * v + acceleration / (zero * zero);
    }
}

/* Size is the squared period, as of the catalogue's mode. */
static void set_stiffening(const passage_t *passage, double size, random_t *random, double *parameter) {
    (void)passage;
    (void)random;
    parameter[0] = 1.0 / sqrt(size);
}

/* A mode whose stiffness grows with the square of the position: at the ends of the stroke its frequency is double. */
static void stiffening_mode(passage_t *passage, const double *parameter) {
    const double w = 2.0 * pi * parameter[0], zeta = 0.02;
    const double half = passage->actuator->um_per_half_range, middle = passage->actuator->offset_um;
    /* Semi-implicit: at least 40 steps a period. */
    const size_t steps = (size_t)ceil(80.0 * parameter[0] * passage->step_s);
    const double h = passage->step_s / (double)steps;
    double q = passage->value[0], v = 0.0;
    for (size_t k = 0; k < passage->count; k++) {
        for (size_t i = 0; i < steps; i++) {
            const double s = (q - middle) / half, stiffer = 1.0 + 3.0 * s * s;
            v += h * (w * w * stiffer * (passage->value[k] - q) - 2.0 * zeta * w * v);
            q += h * v;
        }
        passage->value[k] = q;
    }
}

/* In the lowest quarter of the stroke the mount loses contact. */
static void contact(passage_t *passage, const double *parameter) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (size_t k = 0; k < passage->count; k++) {
        low = fmin(low, passage->value[k]);
        high = fmax(high, passage->value[k]);
    }
    for (size_t k = 0; k < passage->count; k++) {
        passage->value[k] -= parameter[0] * fmin(0.0, passage->value[k] - low - 0.25 * (high - low));
    }
}

/* Of the drive at a sample, in parts of a typical one. */
static double rate_at(const passage_t *passage, size_t k) {
    const double typical_v_per_s = 10.0 * (passage->actuator->high_v - passage->actuator->low_v);
    return (passage->drive_v[k] - passage->drive_v[k - 1]) / passage->step_s / typical_v_per_s;
}

/* What the drive's line couples into the sensor's. */
static void rate_crosstalk(passage_t *passage, const double *parameter) {
    for (size_t k = 1; k < passage->count; k++) {
        passage->value[k] += parameter[0] * rate_at(passage, k);
    }
}

static void squared_rate_crosstalk(passage_t *passage, const double *parameter) {
    for (size_t k = 1; k < passage->count; k++) {
        passage->value[k] += parameter[0] * rate_at(passage, k) * rate_at(passage, k);
    }
}

/* Interference far above the Nyquist frequency that folds down into a tone which wanders. */
static void aliased_tone(passage_t *passage, const double *parameter) {
    random_t random = {passage->seed};
    const double middle_hz = (0.05 + 0.2 * random_unit(&random)) / (passage->step_s * OVERSAMPLING);
    double turns = 0.0;
    for (size_t k = 0; k < passage->count; k++) {
        turns += passage->step_s * middle_hz * (1.0 + 0.1 * sin(2.0 * pi * passage->step_s * (double)k / 7.0));
        passage->value[k] += parameter[0] * sin(2.0 * pi * turns);
    }
}

/* The clock of the converter wanders, within some 10 ms from one side to the other. */
static void jitter(passage_t *passage, const double *parameter) {
    random_t random = {passage->seed};
    const double memory = exp(-passage->step_s / 0.01);
    double *early = proof_allocate(passage->count, sizeof *early), wander = 0.0;
    for (size_t k = 0; k < passage->count; k++) {
        wander = memory * wander + sqrt(1.0 - memory * memory) * random_normal(&random);
        const double at =
            fmax(0.0, fmin((double)(passage->count - 1), (double)k + parameter[0] * wander / passage->step_s));
        const size_t whole = (size_t)at < passage->count - 1 ? (size_t)at : passage->count - 2;
        early[k] = passage->value[whole] + (at - (double)whole) * (passage->value[whole + 1] - passage->value[whole]);
    }
    for (size_t k = 0; k < passage->count; k++) {
        passage->value[k] = early[k];
    }
    free(early);
}

/* Codes that the converter never gives: near twelve positions the reading sticks to the edge of a gap. */
static void missing_codes(passage_t *passage, const double *parameter) {
    const double half = passage->actuator->um_per_half_range, middle = passage->actuator->offset_um;
    for (size_t k = 0; k < passage->count; k++) {
        for (int gap = -6; gap < 6; gap++) {
            const double from_center = passage->value[k] - (middle + half * ((double)gap + 0.5) / 6.3);
            if (fabs(from_center) < parameter[0]) {
                passage->value[k] += copysign(parameter[0], from_center) - from_center;
                break;
            }
        }
    }
}

static void spikes(passage_t *passage, const double *parameter) {
    random_t random = {passage->seed};
    for (size_t k = 0; k < passage->count; k++) {
        const double chance = random_unit(&random);
        passage->value[k] += chance < 0.002 ? parameter[0] : chance < 0.004 ? -parameter[0] : 0.0;
    }
}

/* The reading jumps between two levels, with a mean of two seconds on each. */
static void telegraph(passage_t *passage, const double *parameter) {
    random_t random = {passage->seed};
    bool up = false;
    for (size_t k = 0; k < passage->count; k++) {
        up = random_unit(&random) < passage->step_s / 2.0 ? !up : up;
        passage->value[k] += up ? parameter[0] : 0.0;
    }
}

const effect_t unknown_effects[] = {
    {"relaxation of one time", {NULL}, 0.01, 0.2, set_first, relaxation, STAGE_POSITION, false},
    {"gain step", {NULL}, 0.01, 0.5, set_gain_step, gain_step, STAGE_POSITION, false},
    {"cross-talk of the rate", {NULL}, 0.005, 10.0, set_um, rate_crosstalk, STAGE_POSITION, false},
    {"mode with antiresonance", {NULL}, 0.05, 1.0, set_mode, antiresonance, STAGE_POSITION, false},
    {"stiffening mode", {NULL}, 1e-5, 1e-3, set_stiffening, stiffening_mode, STAGE_POSITION, false},
    {"contact lost below a position", {NULL}, 0.02, 0.9, set_first, contact, STAGE_POSITION, false},
    {"backlash", {NULL}, 0.005, 0.2, set_um, backlash, STAGE_POSITION, false},
    {"stiction", {NULL}, 0.005, 0.2, set_um, stiction, STAGE_POSITION, false},
    {"cross-talk of the squared rate", {NULL}, 0.05, 10.0, set_um, squared_rate_crosstalk, STAGE_POSITION, false},
    {"aliased tone that wanders", {NULL}, 0.002, 0.5, set_um, aliased_tone, STAGE_POSITION, false},
    {"timing jitter", {NULL}, 1e-4, 0.05, set_first, jitter, STAGE_POSITION, false},
    {"missing codes", {NULL}, 0.005, 0.07, set_um, missing_codes, STAGE_POSITION, false},
    {"spikes", {NULL}, 0.02, 1.0, set_um, spikes, STAGE_SAMPLES, false},
    {"random telegraph signal", {NULL}, 0.005, 0.5, set_um, telegraph, STAGE_SAMPLES, false},
};
const size_t unknown_effect_count = sizeof unknown_effects / sizeof unknown_effects[0];
