/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Beyond paper 001: one physical chain for all frequencies instead of 110 sets of numbers. */
#include "chain/catalogue.h"
#include "chain/chain.h"
#include "elements/play_plane.h"
#include "elements/recursion.h"
#include "identify/family.h"
#include "identify/refine.h"
#include "seed_001.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

/* What the poles do not have of the driver's held output and of the latency between the two converters. */
static const size_t lookahead = 2;
enum { MOST_RECORDINGS = 10, OPERATORS = 9, DIVISIONS = OPERATORS + 1 };
/* The mode's transient of the simulation's start is over by then: five times 1 / (damping omega). */
static const double seconds = 2.4, counts_from_s = 1.4;

typedef struct {
    recording_t recording[MOST_RECORDINGS];
    size_t from[MOST_RECORDINGS], count;
} set_t;

static void free_set(set_t *set) {
    for (size_t i = 0; i < set->count; i++) {
        recording_free(&set->recording[i]);
    }
}

/* At +-75 V, or at the drive that brings the displacement to the reference's amplitude. */
static void record_set(set_t *set, bool reduced, bool matched) {
    static const double all[] = {1.0, 8.0, 15.0, 25.0, 40.0, 55.0, 66.0, 78.0, 90.0, 110.0},
                        few[] = {1.0, 25.0, 60.0, 95.0};
    const double *frequency = reduced ? few : all;
    set->count = reduced ? sizeof few / sizeof few[0] : sizeof all / sizeof all[0];
    for (size_t i = 0; i < set->count; i++) {
        recording_t *recording = &set->recording[i];
        seed_001_record(recording, frequency[i], TWIN_001_RANGE_V, seconds, 20 + i);
        if (matched) {
            const double drive_v = TWIN_001_RANGE_V * SEED_001_REFERENCE_UM / seed_001_amplitude(recording);
            recording_free(recording);
            seed_001_record(recording, frequency[i], fmin(drive_v, TWIN_001_RANGE_V), seconds, 20 + i);
        }
        set->from[i] = (size_t)(counts_from_s * TWIN_001_RATE_HZ);
    }
}

/* Driver's lag, play operators, mode, curved sensor; the operators from the slowest recording, the rest as a guess. */
static void start_chain(const set_t *set, model_t *model) {
    double weight[OPERATORS + 1], threshold_v[OPERATORS];
    const double stiff_um = seed_001_amplitude(&set->recording[0]) / TWIN_001_RANGE_V;
    for (size_t i = 0; i < OPERATORS; i++) {
        threshold_v[i] = TWIN_001_RANGE_V * (double)(i + 1) / DIVISIONS;
        weight[i + 1] = 0.03 * stiff_um;
    }
    weight[0] = 0.8 * stiff_um;
    model_create(model, TWIN_001_RATE_HZ);
    model_set(model_append(model, &block_amplifier_bandwidth), "cutoff_hz", 800.0);
    model_block_t *block = model_append(model, &block_prandtl_ishlinskii);
    model_set_array(block, "weights", OPERATORS + 1, weight, NULL);
    model_set_array(block, "thresholds_v", OPERATORS, threshold_v, NULL);
    block = model_append(model, &block_resonance);
    model_set(block, "frequency_hz", 74.0);
    model_set(block, "damping_ratio", 0.02);
    block = model_append(model, &block_static_nonlinearity);
    model_set(block, "center_um", 0.0);
    model_set(block, "half_range_um", 1000.0);
}

static bool refine_chain(const set_t *set, model_t *model, size_t iterations, failure_t *failure) {
    refine_unknown_t unknown[5 + OPERATORS + 1] = {refine_unknown(model, "amplifier_bandwidth", "cutoff_hz", 0),
                                                   refine_unknown(model, "resonance", "frequency_hz", 0),
                                                   refine_unknown(model, "resonance", "damping_ratio", 0),
                                                   refine_unknown(model, "static_nonlinearity", "quadratic", 0),
                                                   refine_unknown(model, "prandtl_ishlinskii", "offset_um", 0)};
    for (size_t i = 0; i <= OPERATORS; i++) {
        unknown[5 + i] = refine_unknown(model, "prandtl_ishlinskii", "weights", i);
        unknown[5 + i].low = 0.0;
    }
    const refine_job_t job = {.recordings = set->recording,
                              .count = set->count,
                              .from = set->from,
                              .unknown = unknown,
                              .unknowns = 6 + OPERATORS,
                              .most_iterations = iterations};
    refine_report_t report;
    if (!refine(model, &job, &report, failure)) {
        return false;
    }
    refine_report_free(&report);
    return true;
}

/*
 * The chain as the amplifier inverts it exactly: plays in the plane, where the cells of a row that weigh the same are
 * the row's play, and the lag and the mode as the poles of the recursion. The sampled mode has zeros as well; what
 * leaving them out does to gain and phase the refinement of the poles makes good.
 */
static bool to_modified_play(set_t *set, const model_t *chain, size_t iterations, model_t *model, failure_t *failure) {
    const model_block_t *plays = model_find(chain, "prandtl_ishlinskii"), *mode = model_find(chain, "resonance");
    const double *weight = model_parameter(plays, "weights")->value;
    const double cutoff_hz = model_parameter(model_find(chain, "amplifier_bandwidth"), "cutoff_hz")->value[0];
    const double omega = 2.0 * M_PI * model_parameter(mode, "frequency_hz")->value[0] / TWIN_001_RATE_HZ;
    const double zeta = model_parameter(mode, "damping_ratio")->value[0], radius = exp(-zeta * omega);
    const double twice = 2.0 * radius * cos(omega * sqrt(1.0 - zeta * zeta)), square = radius * radius;
    const double lag = exp(-2.0 * M_PI * cutoff_hz / TWIN_001_RATE_HZ);
    const double feedback[RECURSION_FEEDBACK] = {twice + lag, -square - lag * twice, lag * square};
    const double at_rest = TWIN_001_RANGE_V * (1.0 - feedback[0] - feedback[1] - feedback[2]);
    double cell[DIVISIONS * OPERATORS / 2], *next = cell;
    for (size_t i = 1; i <= OPERATORS; i++) {
        for (size_t j = 0; j < DIVISIONS - i; j++) {
            *next++ = at_rest * weight[i] / DIVISIONS;
        }
    }
    model_create(model, TWIN_001_RATE_HZ);
    model_block_t *block = model_append(model, &block_modified_play);
    model_set(block, "half_range_v", TWIN_001_RANGE_V);
    model_set(block, "direct_um", at_rest * weight[0]);
    model_set_array(block, "cells_um", play_plane_cells(DIVISIONS), cell, NULL);
    model_set_array(block, "feedback", RECURSION_FEEDBACK, feedback, NULL);
    refine_unknown_t unknown[5] = {refine_unknown(model, "modified_play", "offset_um", 0),
                                   refine_unknown(model, "modified_play", "direct_um", 0)};
    for (size_t i = 0; i < RECURSION_FEEDBACK; i++) {
        unknown[2 + i] = refine_unknown(model, "modified_play", "feedback", i);
    }
    for (size_t i = 0; i < set->count; i++) { /* the position of `lookahead` samples later */
        double *y = set->recording[i].column[COLUMN_DISPLACEMENT];
        set->recording[i].samples -= lookahead;
        memmove(y, y + lookahead, set->recording[i].samples * sizeof(double));
    }
    const refine_job_t job = {.recordings = set->recording,
                              .count = set->count,
                              .from = set->from,
                              .unknown = unknown,
                              .unknowns = 5,
                              .most_iterations = iterations};
    refine_report_t report;
    if (!refine(model, &job, &report, failure)) {
        return false;
    }
    refine_report_free(&report);
    return true;
}

static bool simulate_everywhere(const model_t *model, const double *frequency_hz, size_t count, double *rms_um,
                                failure_t *failure) {
    const size_t samples = (size_t)(seconds * TWIN_001_RATE_HZ), from = (size_t)(counts_from_s * TWIN_001_RATE_HZ);
    double *simulated = allocate(samples, sizeof(double));
    bool good = true;
    for (size_t i = 0; good && i < count; i++) {
        recording_t recording;
        seed_001_record(&recording, frequency_hz[i], TWIN_001_RANGE_V, seconds, 40 + i);
        good = chain_simulate(model, &recording, 0, simulated, failure);
        rms_um[i] =
            measure_error(recording.column[COLUMN_DISPLACEMENT] + from, simulated + from, samples - from).rms_um;
        recording_free(&recording);
    }
    free(simulated);
    return good;
}

static bool track_everywhere(const model_t *model, const double *frequency_hz, size_t count,
                             seed_001_tracked_t *tracked, failure_t *failure) {
    const seed_001_control_t control = {.lookahead = lookahead, .exact = true};
    for (size_t i = 0; i < count; i++) {
        if (!seed_001_track_in_amplifier(model, frequency_hz[i], &control, &tracked[i], failure)) {
            return false;
        }
    }
    return true;
}

bool seed_001_chain(bool reduced, const double *frequency_hz, size_t count, seed_001_chain_t *result,
                    failure_t *failure) {
    const size_t iterations = reduced ? 6 : 15;
    set_t set;
    model_t chain, inverted;
    record_set(&set, reduced, false);
    start_chain(&set, &chain);
    bool good = refine_chain(&set, &chain, iterations, failure) &&
                simulate_everywhere(&chain, frequency_hz, count, result->simulated_um, failure);
    free_set(&set);
    model_free(&chain);
    record_set(&set, reduced, true);
    start_chain(&set, &chain);
    good = good && refine_chain(&set, &chain, iterations, failure);
    result->mode_hz = model_parameter(model_find(&chain, "resonance"), "frequency_hz")->value[0];
    result->damping_ratio = model_parameter(model_find(&chain, "resonance"), "damping_ratio")->value[0];
    result->cutoff_hz = model_parameter(model_find(&chain, "amplifier_bandwidth"), "cutoff_hz")->value[0];
    if (good) {
        good = to_modified_play(&set, &chain, iterations, &inverted, failure) &&
               track_everywhere(&inverted, frequency_hz, count, result->tracked, failure);
        model_free(&inverted);
    }
    free_set(&set);
    model_free(&chain);
    return good;
}
