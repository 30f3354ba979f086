/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/play_stairs.h"
#include <math.h>

size_t play_stairs_bytes(size_t operators) {
    return (operators + 1) * (3 * sizeof(double) + sizeof(play_run_t));
}

void play_stairs_open(play_stairs_t *stairs, void *memory, size_t operators, const double *weight,
                      const double *threshold) {
    const size_t places = operators + 1;
    stairs->operators = operators;
    stairs->runs = 0;
    stairs->threshold = threshold;
    stairs->settled = NULL;
    stairs->run = memory; /* first: it is aligned as widely as anything here */
    stairs->weights = (double *)(stairs->run + places);
    stairs->moments = stairs->weights + places;
    stairs->resting = stairs->moments + places;
    stairs->weights[0] = stairs->moments[0] = 0.0;
    for (size_t i = 0; i < operators; i++) {
        stairs->weights[i + 1] = stairs->weights[i] + weight[i];
        stairs->moments[i + 1] = stairs->moments[i] + weight[i] * threshold[i];
    }
}

bool play_stairs_settle(play_stairs_t *stairs, const double *weight, const double *memory) {
    const size_t n = stairs->operators;
    for (size_t i = 0; i + 1 < n; i++) {
        if (!(fabs(memory[i + 1] - memory[i]) <= stairs->threshold[i + 1] - stairs->threshold[i])) {
            return false;
        }
    }
    stairs->settled = memory;
    stairs->resting[n] = 0.0;
    for (size_t i = n; i-- > 0;) {
        stairs->resting[i] = stairs->resting[i + 1] + weight[i] * memory[i];
    }
    stairs->run[0] = (play_run_t){.end = n};
    stairs->runs = 1;
    return true;
}

/* sum w_i z_i over the run's operators from `begin` on. */
static inline double share(const play_stairs_t *stairs, const play_run_t *run, size_t begin) {
    if (run->side == 0.0) {
        return stairs->resting[begin] - stairs->resting[run->end];
    }
    return run->level * (stairs->weights[run->end] - stairs->weights[begin]) +
           run->side * (stairs->moments[run->end] - stairs->moments[begin]);
}

static inline double play_of(const play_stairs_t *stairs, const play_run_t *run, size_t i) {
    return run->side == 0.0 ? stairs->settled[i] : run->level + run->side * stairs->threshold[i];
}

/* Does a movement outward (+1.0, -1.0) to `drive` carry operator i of the run? */
static inline bool carries(const play_stairs_t *stairs, const play_run_t *run, size_t i, double drive, double outward) {
    if (run->side == -outward) { /* all of them turn at one drive */
        return outward * (drive - run->level) > 0.0;
    }
    return outward * (drive - play_of(stairs, run, i)) > stairs->threshold[i];
}

/* First operator of the run, from `begin` on, that is not carried. By nesting those behind it are not either. Steps
 * that double, then bisection: a movement that goes on finds few at a time. */
static inline size_t carried_until(const play_stairs_t *stairs, const play_run_t *run, size_t begin, double drive,
                                   double outward) {
    size_t low = begin, step = 1;
    while (low + step <= run->end && carries(stairs, run, low + step - 1, drive, outward)) {
        low += step;
        step *= 2;
    }
    size_t high = low + step <= run->end ? low + step - 1 : run->end;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (carries(stairs, run, middle, drive, outward)) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

static inline void move_outward(play_stairs_t *stairs, double drive, double outward) {
    play_run_t *run = &stairs->run[stairs->runs - 1];
    size_t begin = 0, until;
    for (;;) {
        if (run->side == -outward) {
            until = carries(stairs, run, begin, drive, outward) ? run->end : begin;
        } else {
            until = carried_until(stairs, run, begin, drive, outward);
        }
        if (until < run->end || run == stairs->run) {
            break;
        }
        begin = run->end;
        run--;
    }
    double outside = 0.0;
    if (until < run->end) { /* some are left behind */
        outside = run->outside + share(stairs, run, until);
        run++;
    }
    *run = (play_run_t){.end = until, .side = -outward, .level = drive, .outside = outside};
    stairs->runs = (size_t)(run - stairs->run) + 1;
}

double play_stairs_move(play_stairs_t *stairs, double drive) {
    const play_run_t *innermost = &stairs->run[stairs->runs - 1];
    if (carries(stairs, innermost, 0, drive, 1.0)) {
        move_outward(stairs, drive, 1.0);
    } else if (carries(stairs, innermost, 0, drive, -1.0)) {
        move_outward(stairs, drive, -1.0);
    }
    innermost = &stairs->run[stairs->runs - 1];
    return innermost->outside + share(stairs, innermost, 0);
}
