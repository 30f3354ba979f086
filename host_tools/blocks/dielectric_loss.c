/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The ceramic lags by the same phase at every frequency: relaxations over six decades, y = h + sum c s_j, as in creep,
 * but with time constants down to less than a sample. docs/MODELS.md, section 5. */
#include "chain/catalogue.h"
#include "chain/parameter_rows.h"
#include "compile/compile_job.h"
#include "elements/creep_cells.h"
#include "elements/lag_bank.h"
#include <gsl/gsl_math.h>

enum { DECADES = 6, CELLS = DECADES * CREEP_CELLS_PER_DECADE + 1 };
_Static_assert((int)CELLS <= (int)LAG_BANK_PLACES, "room for all cells");
static const double shortest_s = 1e-4, longest_s = 100.0;

static const parameter_info_t parameters[] = {
    {.name = "loss_tangent",
     .proportional = true,
     .unit = "1",
     .low = 0.0,
     .high = 0.1,
     .text = "tangent of the angle that the position is behind, at frequencies between 0.01 Hz and 1 kHz"},
    PARAMETER_INITIAL("initial_um", "um",
                      "what had been present, before the loss, when the recording began (default: its first sample)")};

typedef struct {
    double gain; /* of each cell */
    drive_window_t drive;
    lag_bank_t cells;
    bool has_initial;
    double initial_um;
} state_t;

/* Growth per decade of time. The cells of a decade of frequency, ln 10 wide, are behind by pi / 2 of that. */
static double growth_per_decade(const parameter_t *parameter) {
    return parameter[0].value[0] * 2.0 * M_LN10 / M_PI;
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    state->gain = growth_per_decade(parameter) / CREEP_CELLS_PER_DECADE;
    state->has_initial = parameter[1].count > 0;
    state->initial_um = state->has_initial ? parameter[1].value[0] : 0.0;
    for (size_t j = 0; j < CELLS; j++) {
        first_order_lag_t lag = {0};
        first_order_lag_set(&lag, 1.0 / (2.0 * M_PI * creep_time_constant_s(shortest_s, j)), setup->sample_rate_hz,
                            setup->steps);
        if (setup->held) {
            first_order_lag_hold(&lag, setup->held_since);
        }
        lag_bank_add(&state->cells, &lag);
    }
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    drive_window_settle(&state->drive, signal->value);
    const double level_um = state->has_initial ? state->initial_um : signal->value;
    lag_bank_settle(&state->cells, level_um);
    signal->value += state->gain * CELLS * level_um;
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    drive_window_next(&state->drive, signal);
    signal->value += state->gain * lag_bank_next(&state->cells, &state->drive);
}

/* The amplifier has one bank of cells. A cell faster than its sample period is late by a sample there, which delays the
 * position by c samples, about a hundredth of one. */
static bool compile(compile_job_t *job, const parameter_t *parameter) {
    return compile_creep(job, creep_cells(growth_per_decade(parameter), shortest_s, longest_s, job->rate_hz));
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    (void)setting;
    value[0] = 0.005;
    return index == 0;
}

static const probe_t looked_for = {
    .group = "slow",
    .explanation =
        "The position is behind by the same angle at every frequency, from slow to fast, as a lossy dielectric is.",
    .excitation = "holds, and chirps over three decades of frequency: creep is slow alone",
    .parts = PROBE_STAIRCASE | PROBE_FAST_TRIANGLE | PROBE_CHIRPS,
    .probe = probe,
    .searched = 1U,
    .joins = 1U << 1,
    .join = probe_join_level,
    .accuracy = {0.03},
    .together = {"creep", "sensor_bandwidth"}};

const block_t block_dielectric_loss = {.name = "dielectric_loss",
                                       .place = PLACE_SLOW,
                                       .order = 20,
                                       .text = "lag by the same angle at every frequency",
                                       .parameter = parameters,
                                       .parameters = 2,
                                       .state_bytes = sizeof(state_t),
                                       .open = open,
                                       .settle = settle,
                                       .step = step,
                                       .compile = compile,
                                       .probe = &looked_for};
