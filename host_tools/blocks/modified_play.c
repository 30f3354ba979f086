/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The modified play model of paper 001: a plane of plays, and the recursion behind it. docs/MODELS.md, section 9. */
#include "catalogue.h"
#include "compile_job.h"
#include "play_plane.h"
#include "recursion.h"
#include <gsl/gsl_math.h>
#include <string.h>

enum { OFFSET, DIRECT, CELLS, ENVELOPE, RECURSION };

static const parameter_info_t parameters[] = {
    {.name = "offset_um", .unit = "um", .low = -1e9, .high = 1e9, .text = "added to every sample's recursion"},
    {.name = "direct_um",
     .unit = "um",
     .low = -1e9,
     .high = 1e9,
     .text = "2 A: of the drive itself, as a fraction of its half range"},
    {.name = "cells_um",
     .unit = "um",
     .low = -1e9,
     .high = 1e9,
     .array = true,
     .text = "of the N (N - 1) / 2 cells of the plane, row by row"},
    {.name = "envelope_s",
     .unit = "s",
     .low = 0.0,
     .high = 1e3,
     .array = true,
     .optional = true,
     .text = "alpha, beta: what the drive rate adds to the plays' width, falling and rising"},
    RECURSION_PARAMETER_TABLE};

typedef struct {
    double offset_um, direct_um;
    play_plane_t plane;
    recursion_t recursion;
    double array[]; /* weights, cells */
} state_t;

static bool check(const parameter_t *parameter, failure_t *failure) {
    if (play_plane_divisions(parameter[CELLS].count) == 0) {
        return fail(failure, "cells_um has %zu elements, which are no N (N - 1) / 2 with N = 2 to %d",
                    parameter[CELLS].count, PLAY_PLANE_MAX);
    }
    if (parameter[ENVELOPE].count != 0 && parameter[ENVELOPE].count != 2) {
        return fail(failure, "envelope_s has %zu elements instead of 2", parameter[ENVELOPE].count);
    }
    return recursion_check(parameter + RECURSION, failure);
}

static size_t further_bytes(const parameter_t *parameter, const stage_setup_t *setup) {
    (void)setup;
    return 2 * parameter[CELLS].count * sizeof(double);
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    const double *envelope = parameter[ENVELOPE].value;
    const bool widened = parameter[ENVELOPE].count > 0;
    state->offset_um = parameter[OFFSET].value[0];
    state->direct_um = parameter[DIRECT].value[0];
    play_plane_open(&state->plane, play_plane_divisions(parameter[CELLS].count), widened ? envelope[0] : 0.0,
                    widened ? envelope[1] : 0.0, setup->sample_rate_hz);
    recursion_open(&state->recursion, parameter + RECURSION, setup);
    memcpy(state->array, parameter[CELLS].value, parameter[CELLS].count * sizeof(double));
}

static double respond(state_t *state, double u, void (*move)(play_plane_t *plane, double u, double *cell)) {
    const size_t cells = play_plane_cells(state->plane.divisions);
    double *cell = state->array + cells, sum = state->offset_um + state->direct_um * u;
    move(&state->plane, u, cell);
    for (size_t i = 0; i < cells; i++) {
        sum += state->array[i] * cell[i];
    }
    return sum;
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double u = recursion_input(&state->recursion, signal->value);
    signal->value = recursion_settle(&state->recursion, respond(state, u, play_plane_settle), u);
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double u = recursion_input(&state->recursion, signal->value);
    signal->value = recursion_step(&state->recursion, respond(state, u, play_plane_step), u);
}

/* hyst/modified_play.h divides position by half its range; the plane's grid and the drive's fraction stay what they
 * are. */
static bool compile_numbers(compile_job_t *job, const parameter_t *parameter, hyst_modified_play_parameters_t *p) {
    const parameter_t *recursion = parameter + RECURSION, *feedback = &recursion[RECURSION_FEEDBACK_TERMS];
    const parameter_t *harmonic = &recursion[RECURSION_HARMONIC_TERMS];
    const double turns = recursion[RECURSION_FREQUENCY].value[0] / job->rate_hz;
    const double first = recursion[RECURSION_PHASE].value[0] / (2.0 * M_PI) - turns; /* the sample before the first */
    double rest = 1.0;
    bool good = true;
    for (size_t i = 0; good && i < feedback->count; i++) {
        rest -= feedback->value[i];
        good = compile_to_fixed(job, feedback->value[i], 28, "feedback", &p->feedback[i]);
    }
    for (size_t i = 0; good && i < harmonic->count; i++) {
        const size_t power = i % HYST_MODIFIED_PLAY_HARMONICS;
        good = compile_to_fixed(job, harmonic->value[i] / job->elastic_half_um, 28, "harmonics_um",
                                i == power ? &p->sine[power] : &p->cosine[power]);
    }
    for (size_t i = 0; good && i < parameter[CELLS].count; i++) {
        good = compile_to_fixed(job, p->divisions * parameter[CELLS].value[i] / job->elastic_half_um, 28, "cells_um",
                                &p->slope[i]);
    }
    if (good && parameter[ENVELOPE].count > 0) {
        good = compile_to_fixed(job, parameter[ENVELOPE].value[0] * job->rate_hz, 20, "alpha", &p->alpha) &&
               compile_to_fixed(job, parameter[ENVELOPE].value[1] * job->rate_hz, 20, "beta", &p->beta);
    }
    p->rate_gain = HYST_Q30_ONE;
    p->phase_step = (uint32_t)llrint(ldexp(turns - floor(turns), 32));
    p->phase = (uint32_t)llrint(ldexp(first - floor(first), 32));
    return good &&
           compile_to_fixed(job, parameter[DIRECT].value[0] / job->elastic_half_um, 28, "direct_um", &p->direct) &&
           compile_to_fixed(job, recursion[RECURSION_BILINEAR].value[0], 28, "bilinear_gain", &p->bilinear) &&
           compile_to_fixed(job, (parameter[OFFSET].value[0] - rest * job->elastic_center_um) / job->elastic_half_um,
                            31, "offset_um", &p->offset);
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    const double center_v = parameter[RECURSION + RECURSION_CENTER].value[0];
    const double half_v = parameter[RECURSION + RECURSION_HALF_RANGE].value[0];
    const double microvolt = 1e-6, bilinear = parameter[RECURSION + RECURSION_BILINEAR].value[0];
    hyst_modified_play_parameters_t *p = &job->parameters->modified_play[0];
    if (!(fabs(job->drive_center_v - center_v) <= microvolt && fabs(job->drive_half_v - half_v) <= microvolt)) {
        return fail(job->failure, "its plane of plays needs --drive-range %.6f:%.6f", center_v - half_v,
                    center_v + half_v);
    }
    if (bilinear != 0.0 && job->elastic_center_um != 0.0) {
        return fail(job->failure, "bilinear_gain needs a --position-range from minus to plus the same");
    }
    p->divisions = (uint32_t)play_plane_divisions(parameter[CELLS].count);
    if (p->divisions > HYST_MODIFIED_PLAY_MAX_DIVISIONS) {
        return fail(job->failure, "the amplifier has at most %d divisions", HYST_MODIFIED_PLAY_MAX_DIVISIONS);
    }
    job->parameters->family = HYST_FAMILY_MODIFIED_PLAY;
    job->parameters->modified_plays = 1;
    job->report->model_operators = p->divisions - 1;
    if (parameter[RECURSION + RECURSION_HARMONIC_TERMS].count > 0) {
        compile_note(job, "%s: the harmonics hold for a reference of %.6g Hz that starts with them", job->block,
                     parameter[RECURSION + RECURSION_FREQUENCY].value[0]);
    }
    return compile_numbers(job, parameter, p);
}

const block_t block_modified_play = {.name = "modified_play",
                                     .place = PLACE_HYSTERESIS,
                                     .one_sample_rate = true,
                                     .text = "hysteresis of a bimorph: plane of plays, recursion, harmonics",
                                     .parameter = parameters,
                                     .parameters = RECURSION + RECURSION_PARAMETERS,
                                     .check = check,
                                     .state_bytes = sizeof(state_t),
                                     .further_bytes = further_bytes,
                                     .open = open,
                                     .settle = settle,
                                     .step = step,
                                     .compile = compile};
