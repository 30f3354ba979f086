/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Between samples u is a polynomial of the time since the last one, a0 + a1 t + a2 t^2 + a3 t^3: the cubic or the line
 * of smooth_drive.h. Another polynomial, b, solves the equation for it; what y deviates from that obeys the equation
 * without input, whose solution over one sample is a constant 2-by-2 matrix. All of it is linear in y - a0, y' and the
 * differences of u that a1 to a3 are made of: what each of these adds is made once.
 */
#include "elements/oscillator.h"
#include <gsl/gsl_math.h>

enum { OUTPUT, RATE, STATES }; /* y, y'; per sample */
enum { FIRST, SECOND, THIRD, DIFFERENCES };

/* Slower modes, in rad per sample, do not see the difference between a line and a cubic, and b would be large. */
static const double slow = 0.01;

/* What a1 t + a2 t^2 + a3 t^3 leads to in one sample from rest at 0. lag, square: 2 zeta / omega and 1 / omega^2. */
static void respond(const oscillator_stage_t *state, double lag, double square, const double a[3],
                    double after[STATES]) {
    const double b3 = a[2], b2 = a[1] - 3.0 * lag * b3, b1 = a[0] - 2.0 * lag * b2 - 6.0 * square * b3,
                 b0 = -lag * b1 - 2.0 * square * b2;
    after[OUTPUT] = b0 + b1 + b2 + b3 - state->transition[OUTPUT][OUTPUT] * b0 - state->transition[OUTPUT][RATE] * b1;
    after[RATE] = b1 + 2.0 * b2 + 3.0 * b3 - state->transition[RATE][OUTPUT] * b0 - state->transition[RATE][RATE] * b1;
}

/* Towards one value, which it is held at. */
static void step_held(double state[STATES], const double transition[STATES][STATES], double value) {
    const double behind = state[OUTPUT] - value, rate = state[RATE];
    state[OUTPUT] = value + transition[OUTPUT][OUTPUT] * behind + transition[OUTPUT][RATE] * rate;
    state[RATE] = transition[RATE][OUTPUT] * behind + transition[RATE][RATE] * rate;
}

/* What the same leads to where it is held at the end of each of so many steps. */
static void respond_to_steps(const double transition[STATES][STATES], size_t steps, const double a[3],
                             double after[STATES]) {
    after[OUTPUT] = after[RATE] = 0.0;
    for (size_t j = 1; j <= steps; j++) {
        const double t = (double)j / (double)steps;
        step_held(after, transition, t * (a[0] + t * (a[1] + t * a[2])));
    }
}

/* Without input, over so many samples. omega: rad per sample. */
static void make_transition(double omega, double zeta, double samples, double transition[STATES][STATES]) {
    const double damped = omega * sqrt(1.0 - zeta * zeta), decay = exp(-zeta * omega * samples);
    const double c = decay * cos(damped * samples), s = decay * sin(damped * samples) / damped;
    transition[OUTPUT][OUTPUT] = c + zeta * omega * s;
    transition[OUTPUT][RATE] = s;
    transition[RATE][OUTPUT] = -omega * omega * s;
    transition[RATE][RATE] = c - zeta * omega * s;
}

void oscillator_stage_open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    /* A difference of one, of three samples: half of t^2 - t, of four: a sixth of t^3 - t. */
    static const double polynomial[DIFFERENCES][3] = {{1.0, 0.0, 0.0}, {-0.5, 0.5, 0.0}, {-1.0 / 6.0, 0.0, 1.0 / 6.0}};
    oscillator_stage_t *state = memory;
    const double omega = 2.0 * M_PI * parameter[0].value[0] / setup->sample_rate_hz; /* rad per sample */
    const double zeta = parameter[1].value[0];
    double of_step[STATES][STATES];
    state->line = omega <= slow;
    state->held = setup->held;
    make_transition(omega, zeta, 1.0, state->transition);
    make_transition(omega, zeta, 1.0 - setup->held_since, state->hold[0]);
    make_transition(omega, zeta, setup->held_since, state->hold[1]);
    make_transition(omega, zeta, 1.0 / fmax(1.0, (double)setup->steps), of_step);
    for (size_t i = 0; i < DIFFERENCES; i++) {
        double after[STATES];
        if (setup->steps > 1) {
            respond_to_steps(of_step, setup->steps, polynomial[i], after);
        } else {
            respond(state, 2.0 * zeta / omega, 1.0 / (omega * omega), polynomial[i], after);
        }
        state->input[OUTPUT][i] = after[OUTPUT];
        state->input[RATE][i] = after[RATE];
    }
}

void oscillator_stage_settle(void *memory, signal_t *signal) {
    oscillator_stage_t *state = memory;
    drive_window_settle(&state->drive, signal->value);
    state->state[OUTPUT] = signal->value;
    state->state[RATE] = 0.0;
}

void oscillator_stage_step(void *memory, signal_t *signal) {
    oscillator_stage_t *state = memory;
    const double *x = state->drive.x;
    drive_window_next(&state->drive, signal);
    if (state->held) {
        step_held(state->state, state->hold[0], x[3]);
        step_held(state->state, state->hold[1], x[2]);
        signal->value = state->state[OUTPUT];
        return;
    }
    const double cubic = state->line ? 0.0 : state->drive.smooth;
    const double behind = state->state[OUTPUT] - x[3], rate = state->state[RATE];
    const double first = x[2] - x[3], second = cubic * (x[2] - 2.0 * x[3] + x[4]),
                 third = cubic * (x[1] - 3.0 * x[2] + 3.0 * x[3] - x[4]);
    double next[STATES];
    for (size_t i = 0; i < STATES; i++) {
        next[i] =
            (state->transition[i][OUTPUT] * behind + state->transition[i][RATE] * rate) +
            (state->input[i][FIRST] * first + (state->input[i][SECOND] * second + state->input[i][THIRD] * third));
    }
    state->state[OUTPUT] = x[3] + next[OUTPUT];
    state->state[RATE] = next[RATE];
    signal->value = state->state[OUTPUT];
}

double oscillator_stage_turn(const oscillator_stage_t *stage, const double before[STATES]) {
    const double rise = stage->state[OUTPUT] - before[OUTPUT];
    const double from = before[RATE], to = stage->state[RATE];
    if (!(from * to < 0.0)) {
        return before[OUTPUT];
    }
    /* before + from s + square s^2 + cube s^3; its slope changes sign once between 0 and 1. */
    const double square = 3.0 * rise - 2.0 * from - to, cube = from + to - 2.0 * rise;
    const double root = sqrt(square * square - 3.0 * cube * from), half = square + (square > 0.0 ? root : -root);
    const double first = -from / half, second = -half / (3.0 * cube);
    const double s = first > 0.0 && first < 1.0 ? first : second;
    return before[OUTPUT] + s * (from + s * (square + s * cube));
}
