/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/waveform.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static const char *const names[] = {"sine", "triangle", "staircase", "sweep", "multisine"};

/* Two corners a cycle and one at the end; two corners a step, up and down. */
#define TRIANGLE_MAX_CYCLES ((WAVEFORM_MAX_BREAKPOINTS - 1) / 2)
#define STAIRCASE_MAX_STEPS (WAVEFORM_MAX_BREAKPOINTS / 4)

#define SWEEP_MOST_S 3600.0

/* A peak is looked for at so many instants of the shortest period. Between two of them the sum of the tones is higher
 * by at most this share of its peak, by Bernstein's inequality: (2 pi / 64)^2 / 8. */
#define INSTANTS         64
#define BETWEEN_INSTANTS 0.0013
#define MOST_HARMONIC    20000.0

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
    if (waveform->kind == WAVEFORM_SWEEP && !(waveform->end_frequency_hz > 0.0)) {
        return fail(failure, "--end-frequency %g: must be positive", waveform->end_frequency_hz);
    }
    if (waveform->kind == WAVEFORM_SWEEP && !(waveform->sweep_s > 0.0 && waveform->sweep_s <= SWEEP_MOST_S)) {
        return fail(failure, "--sweep-time %g: must be above 0 and at most %g s", waveform->sweep_s, SWEEP_MOST_S);
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

static double value_of_tones(const waveform_t *waveform, double turns) {
    double sum = 0.0;
    for (size_t i = 0; i < waveform->tones; i++) {
        const waveform_tone_t *tone = &waveform->tone[i];
        sum += tone->amplitude * sin(2.0 * acos(-1.0) * (tone->harmonic * turns + tone->phase_turns));
    }
    return sum;
}

/* Odd harmonics: what a distortion without a mean makes of them falls on odd harmonics only, so even ones, which are
 * not excited, show the other kind. Schroeder's phases keep the peak low. */
static bool make_tones(const waveform_options_t *options, waveform_t *waveform, failure_t *failure) {
    const double highest = floor(options->end_frequency_hz / waveform->frequency_hz + 1e-9);
    if (options->tones < 1 || options->tones > SOURCE_TONES_MAX) {
        return fail(failure, "--tones %lu: outside 1..%u", options->tones, SOURCE_TONES_MAX);
    }
    if (!(highest >= 1.0 && highest <= MOST_HARMONIC)) {
        return fail(failure, "--end-frequency %g: outside 1..%g times --frequency", options->end_frequency_hz,
                    MOST_HARMONIC);
    }
    for (unsigned long i = 0; i < options->tones; i++) {
        const double share = options->tones > 1 ? (double)i / (double)(options->tones - 1) : 0.0;
        const uint32_t odd = 2U * (uint32_t)floor((pow(highest, share) - 1.0) / 2.0 + 1e-9) + 1U;
        const uint32_t last = waveform->tones > 0 ? waveform->tone[waveform->tones - 1].harmonic : 0;
        const uint32_t harmonic = odd > last ? odd : last + 2U; /* the low ones would be the same */
        if (harmonic <= highest) {
            waveform->tone[waveform->tones++] = (waveform_tone_t){.harmonic = harmonic, .amplitude = 1.0};
        }
    }
    const double tones = (double)waveform->tones;
    for (size_t i = 0; i < waveform->tones; i++) {
        const double turns = -0.5 * (double)i * ((double)i + 1.0) / tones;
        waveform->tone[i].phase_turns = turns - floor(turns);
    }
    const uint32_t instants = INSTANTS * waveform->tone[waveform->tones - 1].harmonic;
    double peak = 0.0;
    for (uint32_t k = 0; k < instants; k++) {
        peak = fmax(peak, fabs(value_of_tones(waveform, (double)k / instants)));
    }
    for (size_t i = 0; i < waveform->tones; i++) {
        waveform->tone[i].amplitude = (1.0 - BETWEEN_INSTANTS) / peak;
    }
    return true;
}

bool waveform_make(const waveform_options_t *options, const double range[2], const char *unit, waveform_t *waveform,
                   failure_t *failure) {
    *waveform = (waveform_t){.frequency_hz = options->frequency_hz,
                             .cycles = options->cycles,
                             .steps = options->steps,
                             .end_frequency_hz = options->end_frequency_hz,
                             .sweep_s = options->sweep_s,
                             .linear = options->linear};
    if (options->name == NULL) {
        return fail(failure, "--waveform NAME is missing: " WAVEFORM_NAMES);
    }
    size_t kind = 0;
    while (kind < sizeof names / sizeof names[0] && strcmp(options->name, names[kind]) != 0) {
        kind++;
    }
    if (kind == sizeof names / sizeof names[0]) {
        return fail(failure, "--waveform %s: not " WAVEFORM_NAMES, options->name);
    }
    waveform->kind = (waveform_kind_t)kind;
    waveform->offset = isnan(options->offset) ? (range[0] + range[1]) / 2.0 : options->offset;
    waveform->amplitude =
        isnan(options->amplitude) ? AMPLITUDE_DEFAULT * (range[1] - range[0]) / 2.0 : options->amplitude;
    return check_length(waveform, failure) && check_levels(waveform, range, unit, failure) &&
           (waveform->kind != WAVEFORM_MULTISINE || make_tones(options, waveform, failure));
}

void waveform_describe(const waveform_t *w, char text[120]) {
    if (w->kind == WAVEFORM_SWEEP) {
        (void)snprintf(text, 120, "%lu cycles from %g to %g Hz, %s, in %g s each", w->cycles, w->frequency_hz,
                       w->end_frequency_hz, w->linear ? "linear" : "logarithmic", w->sweep_s);
    } else if (w->kind == WAVEFORM_MULTISINE) {
        (void)snprintf(text, 120, "%lu cycles at %g Hz, %zu tones up to %g Hz", w->cycles, w->frequency_hz, w->tones,
                       w->frequency_hz * w->tone[w->tones - 1].harmonic);
    } else {
        (void)snprintf(text, 120, "%lu cycles at %g Hz", w->cycles, w->frequency_hz);
    }
}

double waveform_start(const waveform_t *waveform) {
    if (waveform->kind == WAVEFORM_MULTISINE) {
        return waveform->offset + waveform->amplitude * value_of_tones(waveform, 0.0);
    }
    return waveform->kind == WAVEFORM_STAIRCASE ? waveform->offset - waveform->amplitude : waveform->offset;
}

double waveform_samples(const waveform_t *waveform, double sample_rate_hz) {
    const double cycles = (double)waveform->cycles;
    return waveform->kind == WAVEFORM_SWEEP ? cycles * fmax(1.0, round(waveform->sweep_s * sample_rate_hz))
                                            : ceil(cycles / waveform->frequency_hz * sample_rate_hz);
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

double waveform_lowest_hz(const waveform_t *waveform, double sample_rate_hz) {
    /* The longest, in cycles: from peak to peak, or a hold. */
    const double line = waveform->kind == WAVEFORM_TRIANGLE    ? 0.5
                        : waveform->kind == WAVEFORM_STAIRCASE ? (1.0 - STEP_RISE) / (2.0 * (double)waveform->steps)
                                                               : 0.0;
    return line * sample_rate_hz / (UINT32_MAX - 1.0); /* its ends are rounded */
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
