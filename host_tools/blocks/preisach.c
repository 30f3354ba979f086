/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Preisach model in Everett form: preisach_grid.h. */
#include "chain/catalogue.h"
#include "chain/parameter_rows.h"
#include "compile/compile_preisach.h"
#include <string.h>

enum { LEVELS, EVERETT, OFFSET, PAST };

static const parameter_info_t parameters[] = {
    PARAMETER_LEVELS("levels_v", "V", -1e9, "of the drive, strictly rising, two or more"),
    {.name = "everett_um",
     .unit = "um",
     .low = -1e9,
     .high = 1e9,
     .array = true,
     .text = "change of the position when the drive rises from level j to level i: E(1,0); E(2,0), E(2,1); E(3,0) ..."},
    {.name = "offset_um",
     .unit = "um",
     .low = -1e9,
     .high = 1e9,
     .text = "mean of the positions at the lowest level (coming from below) and the highest"},
    PARAMETER_MEMORY(
        "past_v", "V",
        "drives before the first sample, one after the other, from the lowest level on; absent: demagnetised")};

typedef struct {
    preisach_grid_t grid;
    size_t past;
    const double *table, *past_v;
    double offset_um;
    preisach_memory_t memory;
    preisach_sums_t sums;
    bool moved; /* since it was opened: then this is the position at the memory's drive */
    double position_um;
    double array[]; /* levels, table, past */
} state_t;

static bool check(const parameter_t *parameter, failure_t *failure) {
    const size_t levels = parameter[LEVELS].count;
    if (levels < 2) {
        return fail(failure, "levels_v needs two levels or more");
    }
    if (parameter[EVERETT].count != preisach_elements(levels)) {
        return fail(failure, "%zu values of everett_um for %zu levels, there must be %zu", parameter[EVERETT].count,
                    levels, preisach_elements(levels));
    }
    return true;
}

static size_t further_bytes(const parameter_t *parameter, const stage_setup_t *setup) {
    (void)setup;
    return (parameter[LEVELS].count + parameter[EVERETT].count + parameter[PAST].count) * sizeof(double);
}

static double *copy_to(double *to, const parameter_t *from) {
    if (from->count > 0) {
        memcpy(to, from->value, from->count * sizeof(double));
    }
    return to + from->count;
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    double *table = copy_to(state->array, &parameter[LEVELS]);
    double *past_v = copy_to(table, &parameter[EVERETT]);
    (void)setup;
    copy_to(past_v, &parameter[PAST]);
    state->grid = (preisach_grid_t){.levels = parameter[LEVELS].count, .level_v = state->array};
    state->table = table;
    state->past = parameter[PAST].count;
    state->past_v = past_v;
    state->offset_um = parameter[OFFSET].value[0];
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double drive_v = signal->value, relays_v = drive_v - signal->slack_v;
    if (!state->moved || relays_v != state->memory.drive_v) {
        preisach_memory_move(&state->memory, &state->grid, relays_v);
        state->position_um =
            preisach_output_next(&state->grid, state->table, state->offset_um, &state->memory, &state->sums);
        state->moved = true;
    }
    signal->value = state->position_um;
    if (relays_v != drive_v) {
        signal->value += preisach_reversible(&state->grid, state->table, drive_v, relays_v);
    }
}

static void pass(void *memory, double drive_v) {
    step(memory, &(signal_t){.value = drive_v});
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    preisach_memory_settle(&state->memory, &state->grid, state->past_v, state->past);
    step(state, signal);
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    const preisach_grid_t grid = {.levels = parameter[LEVELS].count, .level_v = parameter[LEVELS].value};
    return compile_preisach(job, &grid, parameter[EVERETT].value, parameter[OFFSET].value[0]);
}

const block_t block_preisach = {.name = "preisach",
                                .place = PLACE_HYSTERESIS,
                                .order = 40,
                                .can_widen = true,
                                .text =
                                    "hysteresis as relays over the plane of their switching drives, in Everett form",
                                .operators = OPERATORS_RELAYS,
                                .parameter = parameters,
                                .parameters = 4,
                                .check = check,
                                .state_bytes = sizeof(state_t),
                                .further_bytes = further_bytes,
                                .open = open,
                                .settle = settle,
                                .step = step,
                                .pass = pass,
                                .compile = compile};
