/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A mass on a damper and a hysteretic spring:
 *
 *     m x'' + c x' + k x + sum w_i stop_i[x] = drive - offset_v
 *
 * Trapezoidal rule (Newmark's with constant average acceleration). The rate and the acceleration at the new sample are
 * linear in the new position, so they only stiffen the spring, and the equation is solved exactly.
 * docs/MODELS.md, section 11.
 */
#include "chain/catalogue.h"
#include "compile/compile_filters.h"
#include "compile/compile_stop_bank.h"
#include "elements/stop_bank.h"

enum { DAMPING = STOP_PARAMETERS, MASS, PARAMETERS };

static const parameter_info_t parameters[] = {
    STOP_PARAMETER_TABLE,
    {.name = "damping_v_s_per_um", .unit = "V s/um", .low = 0.0, .high = 1e6, .text = "drive per rate of the position"},
    {.name = "mass_v_s2_per_um",
     .unit = "V s2/um",
     .low = 0.0,
     .high = 1e6,
     .text = "drive per acceleration of the position"}};

typedef struct {
    stop_spring_t spring;
    double damping, mass;          /* per sample, per sample^2 */
    double position, rate, change; /* um, um a sample, um a sample^2, at the last sample */
    double array[];
} state_t;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    stop_spring_open(&state->spring, state->array, parameter);
    state->damping = parameter[DAMPING].value[0] * setup->sample_rate_hz;
    state->mass = parameter[MASS].value[0] * setup->sample_rate_hz * setup->sample_rate_hz;
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    state->position = stop_spring_settle(&state->spring, signal->value);
    state->rate = 0.0;
    state->change = 0.0;
    signal->value = state->position;
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    stop_spring_t *spring = &state->spring;
    const double x0 = state->position, past = state->damping * (2.0 * x0 + state->rate) +
                                              state->mass * (4.0 * (x0 + state->rate) + state->change);
    const double x = stop_bank_solve(&spring->bank, spring->memory, 2.0 * state->damping + 4.0 * state->mass,
                                     signal->value - spring->offset_v + past);
    stop_bank_advance(&spring->bank, spring->memory, x);
    state->change = 4.0 * (x - x0 - state->rate) - state->change;
    state->rate = 2.0 * (x - x0) - state->rate;
    state->position = x;
    signal->value = x;
}

/*
 * The drive for mass and damper, in addition to that of the spring, is a weighted sum of the last three positions:
 *
 *     x'  = (3 x[k] - 4 x[k-1] + x[k-2]) / (2 dt)      error (w dt)^2 / 3
 *     x'' = (x[k] - 2 x[k-1] + x[k-2]) / dt^2          late by one sample
 *
 * What is too large for the number format is rolled off by a low pass of second order (a1, a2; compile_filters.h). Its
 * corner, where the mass' share has the largest gain there is room for, does not depend on the rate; it adds delay.
 */
static bool compile(compile_job_t *job, const parameter_t *parameter) {
    const double scale = job->elastic_half_um / job->drive_half_v;
    const double c = parameter[DAMPING].value[0] * job->rate_hz * scale;
    const double m = parameter[MASS].value[0] * job->rate_hz * job->rate_hz * scale, sum = 4.0 * (c + m);
    const rolled_off_t low = roll_off(sum);
    hyst_parameters_t *p = job->parameters;
    hyst_iir_section_t *section = &p->inertia[0];
    if (!stop_bank_compile(job, parameter)) {
        return false;
    }
    if (!(sum > 0.0)) {
        return true;
    }
    if (!compile_to_fixed(job, -2.0 * low.gain * (c + m), 28, "damping and mass", &section->b1) ||
        !compile_to_fixed(job, low.gain * (0.5 * c + m), 28, "damping and mass", &section->b2) ||
        !compile_to_fixed(job, low.a1, 28, "the roll-off of damping and mass", &section->a1) ||
        !compile_to_fixed(job, low.a2, 28, "the roll-off of damping and mass", &section->a2)) {
        return false;
    }
    section->b0 = -section->b1 - section->b2; /* nothing at rest, to the bit; |b1| < 8 and b2 <= -b1 / 2: no overflow */
    p->inertia_sections = 1;
    compile_note(job,
                 "%s: damping and mass compensated by feedforward; the acceleration's share is late by %.3g samples",
                 job->block, 1.0 + low.delay_samples);
    return true;
}

const block_t block_inertial_hysteresis = {.name = "inertial_hysteresis",
                                           .place = PLACE_HYSTERESIS,
                                           .order = 70,
                                           .text = "a mass on a damper and a spring made of stops",
                                           .parameter = parameters,
                                           .parameters = PARAMETERS,
                                           .check = stop_bank_check,
                                           .state_bytes = sizeof(state_t),
                                           .further_bytes = stop_spring_bytes,
                                           .open = open,
                                           .settle = settle,
                                           .step = step,
                                           .compile = compile};
