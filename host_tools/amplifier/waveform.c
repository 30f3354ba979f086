/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/waveform.h"
#include <math.h>
#include <string.h>

static const char *const names[] = {"sine", "triangle", "staircase"};

/* Two corners a cycle and one at the end; two corners a step, up and down. */
#define TRIANGLE_MAX_CYCLES ((WAVEFORM_MAX_BREAKPOINTS - 1) / 2)
#define STAIRCASE_MAX_STEPS (WAVEFORM_MAX_BREAKPOINTS / 4)

#define STEP_RISE 0.2 /* of the time of a step */

/* Fraction of the range, when no amplitude is given. */
#define AMPLITUDE_DEFAULT 0.8

const char *waveform_name(waveform_kind_t kind) {
    return names[kind];
}

static bool check_length(const waveform_t *waveform, failure_t *failure) {
    if (!(waveform->frequency_hz > 0.0)) {
        return fail(failure, "--frequency %g: must be positive", waveform->frequency_hz);
    }
    if (waveform->cycles < 1 || waveform->cycles > 1000000) {
        return fail(failure, "--cycles %lu: outside 1..1000000", waveform->cycles);
    }
    if (waveform->kind == WAVEFORM_TRIANGLE && waveform->cycles > TRIANGLE_MAX_CYCLES) {
        return fail(failure, "--cycles %lu: a triangle has at most %d, each smaller than the one before",
                    waveform->cycles, TRIANGLE_MAX_CYCLES);
    }
    if (waveform->kind == WAVEFORM_STAIRCASE && (waveform->steps < 1 || waveform->steps > STAIRCASE_MAX_STEPS)) {
        return fail(failure, "--steps %lu: outside 1..%d", waveform->steps, STAIRCASE_MAX_STEPS);
    }
    return true;
}

static bool check_levels(const waveform_t *waveform, const double range[2], const char *unit, failure_t *failure) {
    if (!(waveform->amplitude > 0.0)) {
        return fail(failure, "--amplitude %g: must be positive", waveform->amplitude);
    }
    const double low = waveform->offset - waveform->amplitude;
    const double high = waveform->offset + waveform->amplitude;
    /* Room for the rounding of a range that was typed in as it was printed. */
    const double room = 1e-6 * (range[1] - range[0]);
    if (low < range[0] - room || high > range[1] + room) {
        return fail(failure, "--offset, --amplitude: %g..%g %s is outside of the range %g..%g %s", low, high, unit,
                    range[0], range[1], unit);
    }
    return true;
}

bool waveform_make(const waveform_options_t *options, const double range[2], const char *unit, waveform_t *waveform,
                   failure_t *failure) {
    *waveform = (waveform_t){.frequency_hz = options->frequency_hz, .cycles = options->cycles, .steps = options->steps};
    if (options->name == NULL) {
        return fail(failure, "--waveform NAME is missing: sine, triangle or staircase");
    }
    size_t kind = 0;
    while (kind < sizeof names / sizeof names[0] && strcmp(options->name, names[kind]) != 0) {
        kind++;
    }
    if (kind == sizeof names / sizeof names[0]) {
        return fail(failure, "--waveform %s: not sine, triangle or staircase", options->name);
    }
    waveform->kind = (waveform_kind_t)kind;
    waveform->offset = isnan(options->offset) ? (range[0] + range[1]) / 2.0 : options->offset;
    waveform->amplitude =
        isnan(options->amplitude) ? AMPLITUDE_DEFAULT * (range[1] - range[0]) / 2.0 : options->amplitude;
    return check_length(waveform, failure) && check_levels(waveform, range, unit, failure);
}

double waveform_start(const waveform_t *waveform) {
    return waveform->kind == WAVEFORM_STAIRCASE ? waveform->offset - waveform->amplitude : waveform->offset;
}

double waveform_samples(const waveform_t *waveform, double sample_rate_hz) {
    return ceil((double)waveform->cycles / waveform->frequency_hz * sample_rate_hz);
}

/* Appends corners at absolute times, so that rounding to samples does not add up. */
typedef struct {
    breakpoint_t *corner;
    size_t count;
    double samples_per_cycle;
    double last; /* samples from the start to the last corner */
} polygon_t;

static void corner_at(polygon_t *polygon, double cycles, double level) {
    const double now = round(cycles * polygon->samples_per_cycle);
    polygon->corner[polygon->count++] = (breakpoint_t){(uint32_t)(now - polygon->last), level};
    polygon->last = now;
}

static void triangle(const waveform_t *waveform, polygon_t *polygon) {
    const double cycles = (double)waveform->cycles;
    for (unsigned long k = 0; k < waveform->cycles; k++) {
        const double swing = waveform->amplitude * (cycles - (double)k) / cycles;
        corner_at(polygon, (double)k + 0.25, waveform->offset + swing);
        corner_at(polygon, (double)k + 0.75, waveform->offset - swing);
    }
    corner_at(polygon, cycles, waveform->offset);
}

static void staircase(const waveform_t *waveform, polygon_t *polygon) {
    const unsigned long steps = waveform->steps;
    const double height = 2.0 * waveform->amplitude / (double)steps;
    const double bottom = waveform->offset - waveform->amplitude;
    for (unsigned long k = 0; k < 2 * steps; k++) {
        const unsigned long level = k < steps ? k + 1 : 2 * steps - 1 - k;
        const double start = (double)k / (double)(2 * steps);
        const double step = 1.0 / (double)(2 * steps);
        corner_at(polygon, start + STEP_RISE * step, bottom + height * (double)level);
        corner_at(polygon, start + step, bottom + height * (double)level);
    }
}

size_t waveform_breakpoints(const waveform_t *waveform, double sample_rate_hz,
                            breakpoint_t corners[WAVEFORM_MAX_BREAKPOINTS]) {
    polygon_t polygon = {.corner = corners, .samples_per_cycle = sample_rate_hz / waveform->frequency_hz};
    if (waveform->kind == WAVEFORM_TRIANGLE) {
        triangle(waveform, &polygon);
    } else if (waveform->kind == WAVEFORM_STAIRCASE) {
        staircase(waveform, &polygon);
    }
    return polygon.count;
}
