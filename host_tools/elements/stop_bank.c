/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/stop_bank.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

bool stop_bank_rises(const stop_bank_t *bank) {
    double slope = bank->stiffness;
    for (size_t i = bank->operators; slope > 0.0 && i-- > 0;) {
        slope += bank->weight[i];
    }
    return slope > 0.0;
}

double stop_bank_solve(const stop_bank_t *bank, const double *memory, double further, double value) {
    double slope = further + bank->stiffness, constant = 0.0, x, direction;
    for (size_t i = 0; i < bank->operators; i++) {
        slope += bank->weight[i];
        constant -= bank->weight[i] * memory[i];
    }
    /* Inside all stops. By nesting, the stops give way in the order of their thresholds, on either side. */
    x = (value - constant) / slope;
    direction = bank->operators > 0 && x < memory[0] ? -1.0 : 1.0;
    for (size_t i = 0; i < bank->operators; i++) {
        if (direction * (x - memory[i]) <= bank->threshold[i]) {
            break;
        }
        slope -= bank->weight[i];
        constant += bank->weight[i] * (memory[i] + direction * bank->threshold[i]);
        x = (value - constant) / slope;
    }
    return x;
}

void stop_bank_advance(const stop_bank_t *bank, double *memory, double x) {
    for (size_t i = 0; i < bank->operators; i++) {
        memory[i] = fmax(x - bank->threshold[i], fmin(x + bank->threshold[i], memory[i]));
    }
}

void stop_bank_to_play(const stop_bank_t *bank, play_bank_t *play) {
    double slope = bank->stiffness;
    for (size_t i = 0; i < bank->operators; i++) {
        slope += bank->weight[i];
    }
    play->operators = bank->operators;
    play->weight[0] = 1.0 / slope;
    for (size_t i = 0; i < bank->operators; i++) {
        const double step = bank->threshold[i] - (i > 0 ? bank->threshold[i - 1] : 0.0);
        play->threshold[i] = (i > 0 ? play->threshold[i - 1] : 0.0) + slope * step;
        play->weight[i + 1] = 1.0 / (slope - bank->weight[i]) - 1.0 / slope;
        slope -= bank->weight[i];
    }
}

/*
 * The i-th play of the inverse has the memory z'_i = S_i z_i - sum_{j>i} w_j z_j: the drive at which the position
 * equals the memory z_i of H. S_i is the slope after the i-th corner. From the outermost inwards.
 */
void stop_bank_memory(const stop_bank_t *bank, const double *play_v, double *memory_um) {
    double slope = bank->stiffness, outside = 0.0;
    for (size_t i = bank->operators; i-- > 0;) {
        memory_um[i] = (play_v[i] + outside) / slope;
        outside += bank->weight[i] * memory_um[i];
        slope += bank->weight[i];
    }
}

stop_bank_t stop_bank_of(const parameter_t *parameter) {
    return (stop_bank_t){.operators = parameter[STOP_THRESHOLDS].count,
                         .stiffness = parameter[STOP_WEIGHTS].value[0],
                         .weight = parameter[STOP_WEIGHTS].value + 1,
                         .threshold = parameter[STOP_THRESHOLDS].value};
}

bool stop_bank_check(const parameter_t *parameter, failure_t *failure) {
    if (!check_operators(parameter + STOP_WEIGHTS, failure)) {
        return false;
    }
    const stop_bank_t bank = stop_bank_of(parameter);
    return stop_bank_rises(&bank) ||
           fail(failure, "the drive does not rise with the position on every branch: the "
                         "weights from some stop on add up, with the stiffness, to 0 or less");
}

size_t stop_spring_bytes(const parameter_t *parameter, const stage_setup_t *setup) {
    (void)setup;
    return 4 * parameter[STOP_THRESHOLDS].count * sizeof(double);
}

void stop_spring_open(stop_spring_t *spring, double *array, const parameter_t *parameter) {
    const size_t n = parameter[STOP_THRESHOLDS].count;
    double *initial = array + 2 * n;
    if (n > 0) {
        memcpy(array, parameter[STOP_WEIGHTS].value + 1, n * sizeof(double));
        memcpy(array + n, parameter[STOP_THRESHOLDS].value, n * sizeof(double));
    }
    if (parameter[STOP_INITIAL_MEMORY].count > 0) {
        memcpy(initial, parameter[STOP_INITIAL_MEMORY].value, n * sizeof(double));
    }
    *spring = (stop_spring_t){.offset_v = parameter[STOP_OFFSET].value[0],
                              .bank = {.operators = n,
                                       .stiffness = parameter[STOP_WEIGHTS].value[0],
                                       .weight = array,
                                       .threshold = array + n},
                              .initial = initial,
                              .memory = array + 3 * n};
}

double stop_spring_settle(stop_spring_t *spring, double drive_v) {
    const size_t n = spring->bank.operators;
    double x;
    if (n > 0) {
        memcpy(spring->memory, spring->initial, n * sizeof(double));
        /* Solving needs a nested memory, which one from a file may not be. From the smallest stop outwards. */
        for (size_t i = 1; i < n; i++) {
            const double distance = spring->bank.threshold[i] - spring->bank.threshold[i - 1];
            spring->memory[i] =
                fmax(spring->memory[i - 1] - distance, fmin(spring->memory[i - 1] + distance, spring->memory[i]));
        }
    }
    x = stop_bank_solve(&spring->bank, spring->memory, 0.0, drive_v - spring->offset_v);
    stop_bank_advance(&spring->bank, spring->memory, x);
    return x;
}
