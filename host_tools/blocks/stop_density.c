/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Weighted stops whose weights are a density of the threshold, offset_um + gain v - sum p(r_j) (r_j - r_j-1) E_j[v].
 *
 * With E = v - play this is a bank of plays, and is run and compiled as one.
 */
#include "elements/stop_density.h"
#include "chain/catalogue.h"
#include "chain/parameter_rows.h"
#include "compile/compile_job.h"
#include <math.h>
#include <stdlib.h>

enum { OFFSET, GAIN, ALPHA, BETA, DELTA, SLOPE, INTERCEPT, LEVELS, INITIAL_MEMORY };

static const parameter_info_t parameters[] = {
    {.name = "offset_um", .unit = "um", .low = -1e9, .high = 1e9, .text = "position at 0 V, demagnetised"},
    {.name = "gain_um_per_v",
     .unit = "um/V",
     .low = -1e9,
     .high = 1e9,
     .text = "slope just after a turning point is "
             "this less all the weights"},
    {.name = "alpha_um_per_v2",
     .unit = "um/V^2",
     .low = -1e9,
     .high = 1e9,
     .text = "height of the density; positive: loops as a piezo's, negative: clockwise as in the thesis"},
    {.name = "beta_per_v2", .unit = "1/V^2", .low = 0.0, .high = 1e9, .text = "narrowness of the density"},
    {.name = "delta_v", .unit = "V", .low = -1e9, .high = 1e9, .text = "threshold at which it is highest"},
    {.name = "a", .unit = "1", .low = 1e-9, .high = 1e9, .text = "thresholds are a times the levels ..."},
    {.name = "b_v", .unit = "V", .low = 0.0, .high = 1e9, .text = "... plus this"},
    PARAMETER_LEVELS("levels_v", "V", 1e-9, "drive levels, strictly rising from above 0"),
    PARAMETER_MEMORY("initial_memory_v", "V",
                     "drive less stop output before the first sample; absent: demagnetised at 0 V")};

double stop_density_bank(const stop_density_t *density, double *threshold_v, double *weight) {
    double below_v = density->b_v, sum = 0.0;
    for (size_t j = 0; j < density->levels; j++) {
        const double r = density->a * density->level_v[j] + density->b_v, d = r - density->delta_v;
        threshold_v[j] = r;
        weight[j] = density->alpha_um_per_v2 * exp(-density->beta_per_v2 * d * d) * (r - below_v);
        sum += weight[j];
        below_v = r;
    }
    return sum;
}

/* What block prandtl_ishlinskii is given in place of these parameters. */
typedef struct {
    parameter_t parameter[4];
    double *weight, *threshold_v;
} bank_t;

static bank_t make_bank(const parameter_t *parameter) {
    const stop_density_t density = {.alpha_um_per_v2 = parameter[ALPHA].value[0],
                                    .beta_per_v2 = parameter[BETA].value[0],
                                    .delta_v = parameter[DELTA].value[0],
                                    .a = parameter[SLOPE].value[0],
                                    .b_v = parameter[INTERCEPT].value[0],
                                    .levels = parameter[LEVELS].count,
                                    .level_v = parameter[LEVELS].value};
    const size_t n = density.levels;
    bank_t bank = {.weight = allocate(n + 1, sizeof(double)), .threshold_v = allocate(n, sizeof(double))};
    bank.weight[0] = parameter[GAIN].value[0] - stop_density_bank(&density, bank.threshold_v, bank.weight + 1);
    bank.parameter[0] = parameter[OFFSET];
    bank.parameter[1] = (parameter_t){.count = n + 1, .value = bank.weight};
    bank.parameter[2] = (parameter_t){.count = n, .value = bank.threshold_v};
    bank.parameter[3] = parameter[INITIAL_MEMORY];
    return bank;
}

static void free_bank(bank_t *bank) {
    free(bank->weight);
    free(bank->threshold_v);
}

static bool check(const parameter_t *parameter, failure_t *failure) {
    bank_t bank = make_bank(parameter);
    const bool good = block_prandtl_ishlinskii.check(bank.parameter, failure);
    free_bank(&bank);
    return good;
}

static size_t further_bytes(const parameter_t *parameter, const stage_setup_t *setup) {
    bank_t bank = make_bank(parameter);
    const size_t bytes =
        block_prandtl_ishlinskii.state_bytes + block_prandtl_ishlinskii.further_bytes(bank.parameter, setup);
    free_bank(&bank);
    return bytes;
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    bank_t bank = make_bank(parameter);
    block_prandtl_ishlinskii.open(memory, bank.parameter, setup);
    free_bank(&bank);
}

static void settle(void *memory, signal_t *signal) {
    block_prandtl_ishlinskii.settle(memory, signal);
}

static void step(void *memory, signal_t *signal) {
    block_prandtl_ishlinskii.step(memory, signal);
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    bank_t bank = make_bank(parameter);
    const bool good = block_prandtl_ishlinskii.compile(job, bank.parameter);
    free_bank(&bank);
    return good;
}

const block_t block_stop_density = {.name = "stop_density",
                                    .place = PLACE_HYSTERESIS,
                                    .order = 50,
                                    .can_widen = true,
                                    .text = "hysteresis as stops weighted by a density of their threshold",
                                    .parameter = parameters,
                                    .parameters = sizeof parameters / sizeof parameters[0],
                                    .check = check,
                                    .further_bytes = further_bytes,
                                    .open = open,
                                    .settle = settle,
                                    .step = step,
                                    .compile = compile};
