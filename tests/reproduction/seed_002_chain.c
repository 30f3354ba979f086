/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "seed_002_chain.h"
#include "chain/catalogue.h"
#include "identify/refine.h"
#include "seed_002_loops.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { RECORDINGS = 4, OPERATORS = 12, MOST_UNKNOWNS = OPERATORS + 8 };

static const double rate_hz = 10000.0, top_v = 70.0;

/* From rest, so that creep has the same beginning as in the model. So many periods that no frequency is drowned. */
static recording_t record_case(double hz, double peak_v, uint64_t seed) {
    const size_t periods = hz < 0.5 ? 1 : (size_t)ceil(3.0 * sqrt(10.0 * hz));
    return record_from_rest_002(hz, rate_hz, peak_v, periods, seed);
}

/* A start: no asymmetry, no creep, half the slope in the operators. */
static void make_start(model_t *model) {
    double weight[OPERATORS + 1], threshold_v[OPERATORS];
    weight[0] = 0.15;
    for (size_t i = 0; i < OPERATORS; i++) {
        threshold_v[i] = 0.5 * top_v * (double)(i + 1) / (OPERATORS + 1);
        weight[i + 1] = 0.15 / OPERATORS;
    }
    model_create(model, rate_hz);
    model_set(model_append(model, &block_amplifier_bandwidth), "cutoff_hz", 1000.0);
    model_block_t *block = model_append(model, &block_asymmetric_hysteresis);
    model_set(block, "center_v", 0.5 * top_v);
    model_set(block, "half_range_v", 0.5 * top_v);
    block = model_append(model, &block_prandtl_ishlinskii);
    model_set_array(block, "weights", OPERATORS + 1, weight, NULL);
    model_set_array(block, "thresholds_v", OPERATORS, threshold_v, NULL);
    /* At 0 V after a fall from beyond the range a play stands its threshold above the drive. */
    model_set_array(block, "initial_memory_v", OPERATORS, threshold_v, NULL);
    block = model_append(model, &block_creep);
    model_set(block, "shortest_s", 0.01); /* three decades, to the longest period */
    model_set(block, "longest_s", 10.0);
}

static size_t list_unknowns(const model_t *model, refine_unknown_t *unknown) {
    size_t n = 0;
    unknown[n++] = refine_unknown(model, "amplifier_bandwidth", "cutoff_hz", 0);
    unknown[n++] = refine_unknown(model, "asymmetric_hysteresis", "asymmetry", 0);
    unknown[n++] = refine_unknown(model, "creep", "gamma_per_decade", 0);
    unknown[n++] = refine_unknown(model, "prandtl_ishlinskii", "offset_um", 0);
    for (size_t i = 0; i <= OPERATORS; i++) {
        unknown[n] = refine_unknown(model, "prandtl_ishlinskii", "weights", i);
        unknown[n++].low = i == 0 ? 0.05 : 0.0; /* invertible */
    }
    return n;
}

static bool fit(model_t *model, refine_report_t *report, failure_t *failure) {
    static const double hz[RECORDINGS] = {0.1, 1.0, 10.0, 100.0};
    static const size_t from[RECORDINGS] = {0};
    recording_t recording[RECORDINGS];
    refine_unknown_t unknown[MOST_UNKNOWNS];
    for (size_t i = 0; i < RECORDINGS; i++) {
        recording[i] = record_case(hz[i], top_v, 50 + i);
    }
    const refine_job_t job = {.recordings = recording,
                              .count = RECORDINGS,
                              .from = from,
                              .unknown = unknown,
                              .unknowns = list_unknowns(model, unknown),
                              .most_iterations = 20};
    const bool good = refine(model, &job, report, failure);
    for (size_t i = 0; i < RECORDINGS; i++) {
        recording_free(&recording[i]);
    }
    return good;
}

/* A new recording of the case. */
static bool judge(reproduction_t *reproduction, const model_t *model, const chain_002_case_t *judged, uint64_t seed,
                  failure_t *failure) {
    recording_t recording = record_case(judged->hz, judged->top_v, seed);
    const double *measured = recording.column[COLUMN_DISPLACEMENT];
    const double percent = 100.0 / stroke_002(measured, recording.samples);
    double *simulated = allocate(recording.samples, sizeof(double)), mean = 0.0;
    const bool good = chain_simulate(model, &recording, 1, simulated, failure);
    for (size_t k = 0; good && k < recording.samples; k++) {
        mean += percent * fabs(simulated[k] - measured[k]) / (double)recording.samples;
    }
    free(simulated);
    recording_free(&recording);
    if (good) {
        char quantity[200];
        snprintf(quantity, sizeof quantity, "one set of a chain for all frequencies: mean error, %s", judged->name);
        reproduction_row(reproduction, quantity, judged->paper_percent, mean, "%", MET_AT_MOST, 0.0);
    }
    return good;
}

bool fit_chain_002(reproduction_t *reproduction, const chain_002_case_t *cases, size_t count, model_t *model,
                   failure_t *failure) {
    refine_report_t report;
    make_start(model);
    if (!fit(model, &report, failure)) {
        model_free(model);
        return false;
    }
    reproduction_text(
        reproduction,
        "**One set for all frequencies.** The thesis has one set of numbers a frequency and leaves rate dependence "
        "to future work. Here a chain of amplifier (cutoff %.0f ± %.0f Hz), asymmetry (%.4f ± %.4f), %d plays and "
        "creep (gamma %.4f ± %.4f a decade, 10 ms to 10 s) has %zu numbers, found together from 0 to 70 V at 0.1, 1, "
        "10 and 100 Hz from rest. Judged on other recordings than it was found from, at 0.1 Hz with another "
        "amplitude, its mean error stands in the rows beside that of the thesis' Preisach model of the one frequency.",
        model_parameter(&model->block[0], "cutoff_hz")->value[0], report.sigma[0],
        model_parameter(&model->block[1], "asymmetry")->value[0], report.sigma[1], OPERATORS,
        model_parameter(&model->block[3], "gamma_per_decade")->value[0], report.sigma[2], report.unknowns);
    refine_report_free(&report);
    for (size_t i = 0; i < count; i++) {
        if (!judge(reproduction, model, &cases[i], 60 + i, failure)) {
            model_free(model);
            return false;
        }
    }
    return true;
}
