/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The position keeps moving after the drive has stopped, in proportion to the logarithm of time. docs/MODELS.md,
 * section 5. */
#include "chain/catalogue.h"
#include "chain/parameter_rows.h"
#include "compile/compile_job.h"
#include "elements/creep_cells.h"
#include <math.h>

static const parameter_info_t parameters[] = {
    {.name = "gamma_per_decade",
     .proportional = true,
     .unit = "1",
     .low = -0.1,
     .high = 0.1,
     .text = "growth of a step per decade of time, as a part of the step"},
    {.name = "shortest_s",
     .unit = "s",
     .low = 1e-3, /* faster relaxation is block dielectric_loss */
     .high = 1e3,
     .optional = true,
     .default_value = 0.1,
     .chosen = true,
     .text = "creep is logarithmic from this time on"},
    {.name = "longest_s",
     .unit = "s",
     .low = 1e-2,
     .high = 1e5,
     .optional = true,
     .default_value = 1000.0,
     .chosen = true,
     .text = "to this time"},
    PARAMETER_INITIAL("initial_um", "um",
                      "what had been present, before creep, when the recording began (default: its first sample)")};

typedef struct {
    creep_cells_t cells;
    double level[CREEP_MAX_CELLS];
    bool has_initial;
    double initial;
} state_t;

static bool check(const parameter_t *parameter, failure_t *failure) {
    const double shortest = parameter[1].value[0], longest = parameter[2].value[0];
    const double decades = (CREEP_MAX_CELLS - 1) / (double)CREEP_CELLS_PER_DECADE;
    if (!(longest >= shortest && log10(longest / shortest) <= decades)) {
        return fail(failure, "longest_s must be at least shortest_s, and at most %g decades longer", decades);
    }
    return true;
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    state->cells =
        creep_cells(parameter[0].value[0], parameter[1].value[0], parameter[2].value[0], setup->sample_rate_hz);
    state->has_initial = parameter[3].count > 0;
    state->initial = state->has_initial ? parameter[3].value[0] : 0.0;
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    creep_settle(&state->cells, state->level, state->has_initial ? state->initial : signal->value);
    signal->value += creep_offset(&state->cells, state->level);
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double elastic = signal->value;
    signal->value += creep_offset(&state->cells, state->level);
    creep_follow(&state->cells, state->level, elastic);
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    return compile_creep(
        job, creep_cells(parameter[0].value[0], parameter[1].value[0], parameter[2].value[0], job->rate_hz));
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    value[0] = 0.002;
    value[1] = 0.1;
    value[2] = 1000.0;
    (void)setting;
    return index == 0;
}

static bool from_look(const probe_seen_t *seen, size_t index, double *value) {
    value[0] = seen->creep_per_decade;
    value[1] = 0.1;
    value[2] = 1000.0;
    return index == 0 && seen->creep_per_decade > 0.0;
}

static const probe_t looked_for = {
    .group = "slow",
    .explanation = "The position goes on moving after the drive has stopped, in proportion to the logarithm of time, "
                   "in the direction of the last step.",
    .excitation = "holds over two decades of time at two levels, reached from both sides",
    .parts = PROBE_SILENCE | PROBE_STAIRCASE | PROBE_CHIRPS,
    .probe = probe,
    .from_look = from_look,
    .searched = 3U,
    .positive = 1U, /* creep continues in the direction of the step; a return is charge leakage */
    .accuracy = {0.03},
    .times = {"shortest_s", "longest_s", "dielectric_loss", "thermal_drift"}};

const block_t block_creep = {.name = "creep",
                             .place = PLACE_SLOW,
                             .order = 10,
                             .text = "log-type creep: slow motion after the drive has stopped",
                             .parameter = parameters,
                             .parameters = 4,
                             .check = check,
                             .state_bytes = sizeof(state_t),
                             .open = open,
                             .settle = settle,
                             .step = step,
                             .compile = compile,
                             .probe = &looked_for};
