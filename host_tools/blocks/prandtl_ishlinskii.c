/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Weighted sum of play operators, offset_um + w_0 u + sum w_i z_i with z_i = max(u - r_i, min(u + r_i, z_i)). */
#include "chain/catalogue.h"
#include "chain/parameter_rows.h"
#include "compile/compile_job.h"
#include "elements/play_stairs.h"
#include <math.h>
#include <string.h>

enum { OFFSET, WEIGHTS, THRESHOLDS, INITIAL_MEMORY };

static const parameter_info_t parameters[] = {
    {.name = "offset_um", .unit = "um", .low = -1e9, .high = 1e9, .text = "position at 0 V, demagnetised"},
    PARAMETER_WEIGHTS("um/V", "w_0 of the drive itself, then one a play operator"),
    PARAMETER_THRESHOLDS("thresholds_v", "V", "of the play operators, strictly rising"),
    PARAMETER_MEMORY("initial_memory_v", "V",
                     "of the play operators before the first sample; absent: demagnetised at 0 V")};

typedef struct {
    size_t operators;
    double offset_um, direct;              /* direct: w_0 */
    bool moved;                            /* since it was settled: then the operators are where these led them */
    double drive_v, behind_v, position_um; /* behind_v: of the slack */
    bool staircase;                        /* the stairs are in use: many operators, in a memory that is nested */
    play_stairs_t stairs;
    double array[]; /* weights w_1.., thresholds, initial memory, memory: operators each; then what the stairs need */
} state_t;

static bool check(const parameter_t *parameter, failure_t *failure) {
    return check_operators(parameter + WEIGHTS, failure);
}

static size_t further_bytes(const parameter_t *parameter, const stage_setup_t *setup) {
    (void)setup;
    const size_t n = parameter[THRESHOLDS].count;
    return 4 * n * sizeof(double) + (n >= PLAY_STAIRS_WORTH_IT ? play_stairs_bytes(n) : 0);
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    const size_t n = parameter[THRESHOLDS].count;
    (void)setup;
    state->operators = n;
    state->offset_um = parameter[OFFSET].value[0];
    state->direct = parameter[WEIGHTS].value[0];
    memcpy(state->array, parameter[WEIGHTS].value + 1, n * sizeof(double));
    memcpy(state->array + n, parameter[THRESHOLDS].value, n * sizeof(double));
    if (parameter[INITIAL_MEMORY].count > 0) {
        memcpy(state->array + 2 * n, parameter[INITIAL_MEMORY].value, n * sizeof(double));
    }
    if (n >= PLAY_STAIRS_WORTH_IT) {
        play_stairs_open(&state->stairs, state->array + 4 * n, n, state->array, state->array + n);
    }
}

/* Where an operator is that the drive leads. */
static inline double follow(double play, double drive_v, double threshold_v) {
    const double low = drive_v - threshold_v, high = drive_v + threshold_v;
    const double above = play > low ? play : low;
    return above < high ? above : high;
}

/* Operators do not wait for each other: four sums, so that additions do not either, and loops in which nothing
 * branches, so that a compiler can take several at once. */
static double sum_of_operators(size_t n, const double *restrict weight, const double *restrict threshold,
                               double *restrict play, double drive_v) {
    enum { SUMS = 4 };
    double sum[SUMS] = {0.0};
    size_t i = 0;
    for (; i + SUMS <= n; i += SUMS) {
        for (size_t j = 0; j < SUMS; j++) {
            play[i + j] = follow(play[i + j], drive_v, threshold[i + j]);
        }
        for (size_t j = 0; j < SUMS; j++) {
            sum[j] += weight[i + j] * play[i + j];
        }
    }
    for (; i < n; i++) {
        play[i] = follow(play[i], drive_v, threshold[i]);
        sum[0] += weight[i] * play[i];
    }
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double drive_v = signal->value, behind_v = signal->value - signal->slack_v;
    const size_t n = state->operators;
    if (!state->moved || drive_v != state->drive_v || behind_v != state->behind_v) {
        const double sum = state->staircase
                               ? play_stairs_move(&state->stairs, behind_v)
                               : sum_of_operators(n, state->array, state->array + n, state->array + 3 * n, behind_v);
        state->position_um = state->offset_um + state->direct * drive_v + sum;
        state->drive_v = drive_v;
        state->behind_v = behind_v;
        state->moved = true;
    }
    signal->value = state->position_um;
}

static void pass(void *memory, double drive_v) {
    step(memory, &(signal_t){.value = drive_v});
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    const size_t n = state->operators;
    memcpy(state->array + 3 * n, state->array + 2 * n, n * sizeof(double)); /* zeros if none was given */
    state->staircase =
        n >= PLAY_STAIRS_WORTH_IT && play_stairs_settle(&state->stairs, state->array, state->array + 2 * n);
    state->moved = false;
    step(state, signal);
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    return compile_play_bank(job, parameter[OFFSET].value[0], parameter[THRESHOLDS].count, parameter[WEIGHTS].value,
                             parameter[THRESHOLDS].value);
}

const block_t block_prandtl_ishlinskii = {.name = "prandtl_ishlinskii",
                                          .place = PLACE_HYSTERESIS,
                                          .order = 30,
                                          .can_widen = true,
                                          .text = "hysteresis as a weighted sum of play operators",
                                          .operators = OPERATORS_PLAYS,
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
