/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The modified play model of paper 001: a plane of plays, followed by a recursion. docs/MODELS.md, section 9. */
#include "chain/catalogue.h"
#include "compile/compile_modified_play.h"
#include "elements/play_plane.h"
#include "elements/recursion.h"
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

static bool has_recursion(const parameter_t *parameter) {
    return recursion_is_used(parameter + RECURSION);
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

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    const parameter_t *envelope = &parameter[ENVELOPE];
    const modified_play_numbers_t numbers = {.offset_um = parameter[OFFSET].value[0],
                                             .direct_um = parameter[DIRECT].value[0],
                                             .divisions = play_plane_divisions(parameter[CELLS].count),
                                             .cell_um = parameter[CELLS].value,
                                             .fall_s = envelope->count > 0 ? envelope->value[0] : 0.0,
                                             .rise_s = envelope->count > 0 ? envelope->value[1] : 0.0,
                                             .recursion = parameter + RECURSION};
    return compile_modified_play(job, &numbers);
}

const block_t block_modified_play = {.name = "modified_play",
                                     .place = PLACE_HYSTERESIS,
                                     .order = 90,
                                     .one_sample_rate = has_recursion,
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
