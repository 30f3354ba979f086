/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "excitation.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double pi = 3.14159265358979323846;

void *proof_allocate(size_t count, size_t size) {
    void *memory = calloc(count > 0 ? count : 1, size);
    if (memory == NULL) {
        fputs("proof: no memory\n", stderr);
        exit(EXIT_FAILURE);
    }
    return memory;
}

const char *excitation_name(excitation_kind_t kind) {
    static const char *const name[EXCITATION_COUNT] = {"designed", "short", "sine", "sines", "multisine"};
    return name[kind];
}

/* A curve that grows at its end, between -1 and 1. */
typedef struct {
    double rate_hz; /* samples of the recording */
    double *value;
    size_t count, room;
} curve_t;

static void append(curve_t *curve, double value) {
    if (curve->count == curve->room) {
        curve->room = curve->room > 0 ? 2 * curve->room : 4096;
        curve->value = realloc(curve->value, curve->room * sizeof *curve->value);
        if (curve->value == NULL) {
            fputs("proof: no memory\n", stderr);
            exit(EXIT_FAILURE);
        }
    }
    curve->value[curve->count++] = value;
}

static double end_of(const curve_t *curve) {
    return curve->value[curve->count - 1];
}

/* Instants of a part of the curve: a whole number of samples. */
static size_t instants_of(const curve_t *curve, double seconds) {
    return OVERSAMPLING * (size_t)fmax(1.0, floor(seconds * curve->rate_hz + 0.5));
}

static void hold(curve_t *curve, double seconds) {
    const double value = end_of(curve);
    for (size_t n = instants_of(curve, seconds); n > 0; n--) {
        append(curve, value);
    }
}

static void straight(curve_t *curve, double to, double seconds) {
    const double from = end_of(curve);
    const size_t n = instants_of(curve, seconds);
    for (size_t i = 1; i <= n; i++) {
        append(curve, from + (to - from) * (double)i / (double)n);
    }
}

/* A step, rounded as an amplifier's input filter rounds it: half a cosine over 8 samples. */
static void step(curve_t *curve, double to) {
    const double from = end_of(curve);
    const size_t n = instants_of(curve, 8.0 / curve->rate_hz);
    for (size_t i = 1; i <= n; i++) {
        append(curve, from + (to - from) * 0.5 * (1.0 - cos(pi * (double)i / (double)n)));
    }
}

/* A sine about the present value whose frequency goes from one to the other, evenly in its logarithm. */
static void chirp(curve_t *curve, double amplitude, double from_hz, double to_hz, double seconds) {
    const double middle = end_of(curve), step_s = 1.0 / (curve->rate_hz * OVERSAMPLING);
    const size_t n = instants_of(curve, seconds);
    double turns = 0.0;
    for (size_t i = 1; i <= n; i++) {
        turns += step_s * from_hz * pow(to_hz / from_hz, ((double)i - 0.5) / (double)n);
        append(curve, middle + amplitude * sin(2.0 * pi * turns));
    }
    step(curve, middle);
}

static void decaying_triangle(curve_t *curve, double seconds) {
    enum { HALF_PERIODS = 9 };
    for (int i = 0; i < HALF_PERIODS; i++) {
        const double amplitude = 1.0 - (double)i / HALF_PERIODS;
        straight(curve, i % 2 == 0 ? amplitude : -amplitude, seconds / HALF_PERIODS);
    }
    step(curve, 0.0);
}

/* `swept`: it begins with a sweep of the whole range, after which the memory does not depend on what was before. */
static void designed(curve_t *curve, double length, bool swept) {
    static const double stair[] = {-0.6, 0.1, 0.8, 0.1, -0.6, -1.0, 0.0};
    const double fastest_hz = curve->rate_hz / 40.0;
    append(curve, -1.0);
    if (swept) {
        straight(curve, 1.0, 0.5 * length);
        straight(curve, -1.0, 0.5 * length);
    }
    hold(curve, 1.0 * length);
    step(curve, 0.1);
    hold(curve, 1.0 * length);
    for (size_t i = 0; i < sizeof stair / sizeof stair[0]; i++) {
        step(curve, stair[i]);
        hold(curve, 1.5 * length);
    }
    decaying_triangle(curve, 2.5 * length);
    decaying_triangle(curve, 0.7 * length);
    chirp(curve, 0.05, 1.0, fastest_hz, 1.5 * length);
    chirp(curve, 0.3, 1.0, fastest_hz, 1.5 * length);
    chirp(curve, 0.6, 0.4 * fastest_hz, 0.4 * fastest_hz, 1.5 * length);
    hold(curve, 1.5 * length);
}

static void sines(curve_t *curve) {
    static const double amplitude[] = {0.95, 0.5, 0.2};
    const double hz[] = {1.0, 5.0, curve->rate_hz / 100.0};
    append(curve, 0.0);
    for (size_t i = 0; i < 9; i++) {
        chirp(curve, amplitude[i / 3], hz[i % 3], hz[i % 3], 2.0);
        hold(curve, 0.4);
    }
}

static void multisine(curve_t *curve, random_t *random) {
    enum { LINES = 20 };
    const double slowest_hz = 0.2, fastest_hz = curve->rate_hz / 80.0, step_s = 1.0 / (curve->rate_hz * OVERSAMPLING);
    double phase[LINES], hz[LINES], peak = 0.0;
    for (size_t i = 0; i < LINES; i++) {
        phase[i] = 2.0 * pi * random_unit(random);
        hz[i] = slowest_hz * pow(fastest_hz / slowest_hz, (double)i / (LINES - 1));
    }
    const size_t n = instants_of(curve, 22.0);
    for (size_t k = 0; k <= n; k++) {
        double sum = 0.0;
        for (size_t i = 0; i < LINES; i++) {
            sum += sin(2.0 * pi * hz[i] * step_s * (double)k + phase[i]) / sqrt(hz[i]);
        }
        append(curve, sum);
        peak = fmax(peak, fabs(sum));
    }
    for (size_t k = 0; k <= n; k++) {
        curve->value[k] /= peak;
    }
}

excitation_t excitation_make(excitation_kind_t kind, double sample_rate_hz, double low_v, double high_v,
                             random_t *random) {
    curve_t curve = {.rate_hz = sample_rate_hz};
    switch (kind) {
    case EXCITATION_SINE:
        append(&curve, 0.0);
        chirp(&curve, 1.0, 1.0, 1.0, 22.0);
        break;
    case EXCITATION_SINES:
        sines(&curve);
        break;
    case EXCITATION_MULTISINE:
        multisine(&curve, random);
        break;
    case EXCITATION_SHORT:
        designed(&curve, 1.0 / 3.0, false);
        break;
    default:
        designed(&curve, 1.0, true);
        break;
    }
    for (size_t i = 0; i < curve.count; i++) {
        curve.value[i] = 0.5 * (high_v + low_v) + 0.5 * (high_v - low_v) * curve.value[i];
    }
    return (excitation_t){.sample_rate_hz = sample_rate_hz,
                          .samples = (curve.count - 1) / OVERSAMPLING + 1,
                          .instants = curve.count,
                          .drive_v = curve.value,
                          .low_v = low_v,
                          .high_v = high_v};
}

void excitation_free(excitation_t *excitation) {
    free(excitation->drive_v);
    *excitation = (excitation_t){0};
}
