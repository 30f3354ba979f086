/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/imitation.h"
#include "chain/catalogue.h"
#include "chain/chain.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Samples of a response that are looked at. */
enum { RESPONSE = 8192 };
/* Of a filter's step response: it is exact; it is of no use. In between the rounds of a fit make up for the rest. */
static const double realised_well = 1e-6, realised_at_all = 0.05;

void imitation_chain(double sample_rate_hz, model_t *chain) {
    const double weight = 1.0;
    model_create(chain, sample_rate_hz);
    model_set_array(model_append(chain, &block_prandtl_ishlinskii), "weights", 1, &weight, NULL);
}

/* Index in chain_order of the hysteresis, and how many stages there are. */
static size_t stage_of_hysteresis(const model_t *chain, size_t *stages) {
    size_t order[MODEL_MAX_BLOCKS], stage = 0;
    *stages = chain_order(chain, order);
    while (!block_is_hysteresis(chain->block[order[stage]].block)) {
        stage++;
    }
    return stage;
}

/* Whether the block runs before the operator. */
static bool is_before(const block_t *block) {
    return block->place < PLACE_HYSTERESIS || block->modifies_hysteresis;
}

/* The drive of one recording up to the hysteresis. */
static bool run_before(const model_t *chain, const recording_t *recording, double *level_v, double *slack_v,
                       failure_t *failure) {
    const double *drive = recording->column[COLUMN_DRIVE];
    signal_t *signal = allocate(recording->samples + 1, sizeof *signal);
    size_t stages;
    signal[0].value = drive[0];
    for (size_t k = 0; k < recording->samples; k++) {
        signal[1 + k].value = drive[k];
    }
    const bool good = chain_run(chain, recording, 0, 0, stage_of_hysteresis(chain, &stages), signal, failure);
    for (size_t k = 0; k < recording->samples; k++) {
        level_v[k] = signal[1 + k].value;
        slack_v[k] = signal[1 + k].slack_v;
    }
    free(signal);
    return good;
}

/* The operator's position of one recording through what is behind it, in place. */
static bool run_behind(const model_t *chain, const recording_t *recording, const double *level_v, double *position_um,
                       failure_t *failure) {
    signal_t *signal = allocate(recording->samples + 1, sizeof *signal);
    size_t stages;
    const size_t hysteresis = stage_of_hysteresis(chain, &stages);
    for (size_t k = 0; k < recording->samples; k++) {
        signal[1 + k] = (signal_t){.value = position_um[k], .drive_v = level_v[k]};
    }
    signal[0] = signal[1];
    const bool good = chain_run(chain, recording, 0, hysteresis + 1, stages, signal, failure);
    bool finite = true;
    for (size_t k = 0; k < recording->samples; k++) {
        position_um[k] = signal[1 + k].value;
        finite = finite && isfinite(position_um[k]);
    }
    free(signal);
    return good && finite;
}

bool imitation_open(imitation_t *imitation, const model_t *chain, const recording_t *recordings, size_t count,
                    failure_t *failure) {
    *imitation = (imitation_t){.recordings = recordings, .count = count};
    for (size_t i = 0; i < count; i++) {
        imitation->all += recordings[i].samples;
    }
    model_copy(&imitation->chain, chain);
    imitation->level_v = allocate(imitation->all, sizeof(double));
    imitation->slack_v = allocate(imitation->all, sizeof(double));
    imitation->predicted_um = allocate(imitation->all, sizeof(double));
    imitation->simulated_um = allocate(imitation->all, sizeof(double));
    imitation->paths = allocate(count, sizeof *imitation->paths);
    bool good = true;
    for (size_t i = 0, at = 0; good && i < count; at += recordings[i++].samples) {
        good = run_before(chain, &recordings[i], imitation->level_v + at, imitation->slack_v + at, failure);
        if (good) {
            operator_path_open(&imitation->paths[i], imitation->level_v + at, imitation->slack_v + at,
                               recordings[i].samples);
        }
    }
    if (!good) {
        imitation_close(imitation);
    }
    return good;
}

void imitation_close(imitation_t *imitation) {
    for (size_t i = 0; i < imitation->count; i++) {
        operator_path_close(&imitation->paths[i]);
    }
    model_free(&imitation->chain);
    free(imitation->paths);
    free(imitation->level_v);
    free(imitation->slack_v);
    free(imitation->predicted_um);
    free(imitation->simulated_um);
    *imitation = (imitation_t){0};
}

/* The operator's position through what is behind it, all recordings. hysteresis: its offsets; NULL: none. */
static bool all_behind(const imitation_t *imitation, const hysteresis_t *hysteresis, const model_t *chain,
                       double *position_um, failure_t *failure) {
    bool good = true;
    for (size_t i = 0, at = 0; good && i < imitation->count; at += imitation->recordings[i++].samples) {
        good = run_behind(chain, &imitation->recordings[i], imitation->level_v + at, position_um + at, failure);
    }
    if (hysteresis != NULL) {
        hysteresis_add_offsets(hysteresis, imitation->paths, imitation->count, position_um);
    }
    return good;
}

/* A small part of the stroke: what is behind the operator may be curved. */
static double change_um(const double *position_um, size_t samples) {
    double range_um[2];
    values_range(position_um, samples, range_um);
    return 1e-3 * (range_um[1] - range_um[0]);
}

/* The response of what is behind the operator to one sample that differs, in parts of it. */
static bool respond(const imitation_t *imitation, const recording_t *recording, double step_um, double *response) {
    failure_t ignored;
    double *level_v = allocate(recording->samples, sizeof(double)),
           *without = allocate(recording->samples, sizeof(double));
    for (size_t k = 0; k < recording->samples; k++) {
        level_v[k] = imitation->level_v[0];
        response[k] = k == STATE_SPACE_AHEAD ? step_um : 0.0;
    }
    const bool good = run_behind(&imitation->chain, recording, level_v, without, &ignored) &&
                      run_behind(&imitation->chain, recording, level_v, response, &ignored);
    for (size_t k = 0; k < recording->samples; k++) {
        response[k] = (response[k] - without[k]) / step_um;
    }
    free(level_v);
    free(without);
    return good;
}

void imitation_behind(const imitation_t *imitation, state_space_t *behind) {
    size_t longest = 0;
    for (size_t i = 0; i < imitation->count; i++) {
        longest = imitation->recordings[i].samples > imitation->recordings[longest].samples ? i : longest;
    }
    recording_t some = imitation->recordings[longest];
    some.samples = some.samples < RESPONSE ? some.samples : RESPONSE;
    const double *position_um = some.column[COLUMN_DISPLACEMENT];
    double *response = allocate(some.samples, sizeof(double));
    const double step_um = change_um(position_um, some.samples);
    *behind = state_space_identity();
    if (imitation->chain.blocks > 1 && some.samples > STATE_SPACE_AHEAD && step_um > 0.0 &&
        respond(imitation, &some, step_um, response)) {
        state_space_t filter;
        if (state_space_realise(response, some.samples, STATE_SPACE_AHEAD, BEHIND_STATES, realised_well, &filter) <
            realised_at_all) {
            *behind = filter;
        }
    }
    free(response);
}

bool imitation_run(imitation_t *imitation, const hysteresis_t *hysteresis, failure_t *failure) {
    hysteresis_predict(hysteresis, imitation->paths, imitation->count, imitation->predicted_um);
    memcpy(imitation->simulated_um, imitation->predicted_um, imitation->all * sizeof(double));
    return all_behind(imitation, hysteresis, &imitation->chain, imitation->simulated_um, failure);
}

bool imitation_rest(imitation_t *imitation, failure_t *failure) {
    memset(imitation->predicted_um, 0, imitation->all * sizeof(double));
    memset(imitation->simulated_um, 0, imitation->all * sizeof(double));
    return all_behind(imitation, NULL, &imitation->chain, imitation->simulated_um, failure);
}

bool imitation_altered(const imitation_t *imitation, const hysteresis_t *hysteresis, const model_t *chain, size_t at,
                       double *position_um) {
    failure_t ignored;
    if (!is_before(chain->block[at].block)) {
        memcpy(position_um, imitation->predicted_um, imitation->all * sizeof(double));
        return all_behind(imitation, hysteresis, chain, position_um, &ignored);
    }
    imitation_t other;
    if (!imitation_open(&other, chain, imitation->recordings, imitation->count, &ignored)) {
        return false;
    }
    for (size_t i = 0; i < imitation->count; i++) { /* what its past left depends on the range it was fitted with */
        memcpy(other.paths[i].range_v, imitation->paths[i].range_v, sizeof other.paths[i].range_v);
    }
    const bool good = imitation_run(&other, hysteresis, &ignored);
    memcpy(position_um, other.simulated_um, imitation->all * sizeof(double));
    imitation_close(&other);
    return good;
}
