/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/play_basis.h"
#include "chain/catalogue.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

void play_walk_begin(play_walk_t *walk, const play_basis_t *basis, const recording_t *recording,
                     const double *initial_v) {
    *walk = (play_walk_t){.basis = basis,
                          .drive = recording->column[COLUMN_DRIVE],
                          .memory_v = allocate(basis->operators, sizeof(double))};
    if (initial_v != NULL) {
        memcpy(walk->memory_v, initial_v, basis->operators * sizeof(double));
    }
    if (basis->rate_dependent) {
        const stage_setup_t setup = {.sample_rate_hz = recording->sample_rate_hz};
        double values[] = {basis->beta_s, basis->rate_filter_s, basis->limit_v, 0.0};
        const parameter_t parameters[] = {
            {1, &values[0], NULL}, {1, &values[1], NULL}, {1, &values[2], NULL}, {1, &values[3], NULL}};
        signal_t first = {.value = walk->drive[0]};
        walk->growth_state = block_open(&block_rate_dependent_hysteresis, parameters, &setup);
        block_rate_dependent_hysteresis.settle(walk->growth_state, &first);
    }
}

void play_walk_step(play_walk_t *walk) {
    signal_t signal = {.value = walk->drive[walk->next++]};
    if (walk->growth_state != NULL) {
        block_rate_dependent_hysteresis.step(walk->growth_state, &signal);
    }
    const double behind = signal.value - signal.slack_v;
    for (size_t i = 0; i < walk->basis->operators; i++) {
        const double r = walk->basis->threshold_v[i];
        walk->memory_v[i] = fmax(behind - r, fmin(behind + r, walk->memory_v[i]));
    }
}

void play_walk_end(play_walk_t *walk) {
    free(walk->memory_v);
    free(walk->growth_state);
}

/* How many operators are determined before `end`, and the sample from which on they are. */
static size_t determined_operators(const play_basis_t *basis, const recording_t *recording, size_t end, size_t *from) {
    double *extreme = allocate(basis->operators, sizeof(double));
    play_walk_t low, high;
    size_t determined = 0;
    *from = 0;
    for (size_t i = 0; i < basis->operators; i++) {
        extreme[i] = -HUGE_VAL;
    }
    play_walk_begin(&low, basis, recording, extreme);
    for (size_t i = 0; i < basis->operators; i++) {
        extreme[i] = HUGE_VAL;
    }
    play_walk_begin(&high, basis, recording, extreme);
    for (size_t k = 0; k < end && determined < basis->operators; k++) {
        play_walk_step(&low);
        play_walk_step(&high);
        while (determined < basis->operators && !(low.memory_v[determined] < high.memory_v[determined])) {
            determined++; /* in the order of the thresholds: memory is nested */
            *from = k;
        }
    }
    play_walk_end(&low);
    play_walk_end(&high);
    free(extreme);
    return determined;
}

size_t play_memory_determined(const play_basis_t *basis, const recording_t *recording, size_t end) {
    size_t from;
    return determined_operators(basis, recording, end, &from) == basis->operators ? from : end;
}

size_t play_memory_as_determined_as_possible(const play_basis_t *basis, const recording_t *recording, size_t end) {
    size_t from;
    determined_operators(basis, recording, end, &from);
    return from;
}
