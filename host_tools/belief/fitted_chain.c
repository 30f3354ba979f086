/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/fitted_chain.h"
#include "chain/catalogue.h"
#include "diagnosis/noise/lines.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rows of the final fit: 40 for each of the operator's columns. */
enum { CHAIN_ROUNDS = 2, MOST_FITTED = 12000 };

void chain_for_operator(const model_t *from, model_t *chain) {
    imitation_chain(from->sample_rate_hz, chain);
    const model_block_t holder = chain->block[0];
    chain->blocks = 0;
    model_free(chain);
    model_copy(chain, from);
    for (size_t b = chain->blocks; b-- > 0;) {
        if (chain->block[b].block->readings != READINGS_AS_THEY_ARE) {
            model_remove(chain, b);
        } else if (block_is_hysteresis(chain->block[b].block)) {
            model_t old;
            model_create(&old, from->sample_rate_hz);
            old.blocks = 1;
            old.block[0] = chain->block[b];
            chain->block[b] = holder;
            model_free(&old);
        }
    }
}

void fitted_chain_close(fitted_chain_t *f) {
    imitation_close(&f->imitation);
    hysteresis_rows_close(&f->rows);
    hysteresis_free(&f->hysteresis);
    free(f->use);
    free(f->position_um);
    *f = (fitted_chain_t){0};
}

static void take_samples(fitted_chain_t *f, const samples_t *samples) {
    size_t used = 0;
    f->samples = samples;
    f->use = allocate(samples->all, 1);
    f->position_um = samples_column(samples);
    for (size_t i = 0; i < samples->count; i++) {
        const recording_t *r = &samples->recordings[i];
        memcpy(f->position_um + samples->begin[i], r->column[COLUMN_DISPLACEMENT], r->samples * sizeof(double));
        for (size_t k = 0; k < r->samples; k++) {
            const bool masked = r->masked != NULL && r->masked[k] != 0;
            f->use[samples->begin[i] + k] = samples->part[samples->begin[i] + k] != SAMPLE_HELD_OUT && !masked;
            used += f->use[samples->begin[i] + k];
        }
    }
    f->thin = used / MOST_FITTED + 1;
}

/* What the chain adds behind the operator, out of the position. */
static void take_target(const fitted_chain_t *f, double *target_um) {
    for (size_t k = 0; k < f->samples->all; k++) {
        target_um[k] = f->position_um[k] - f->imitation.simulated_um[k] + f->imitation.predicted_um[k];
    }
}

/* What the chain adds behind the operator goes by the operator's position, and that by what the chain adds: in turns.
 * target_um: a column, the position less what the chain adds. */
static bool fit_weights(fitted_chain_t *f, double *target_um) {
    failure_t ignored;
    imitation_t *imitation = &f->imitation;
    hysteresis_bases_t bases = {0};
    bool good = true;
    const int rounds = imitation->chain.blocks == 1 ? 1 : CHAIN_ROUNDS;
    memcpy(target_um, f->position_um, f->samples->all * sizeof(double));
    for (int round = 0; good && round < rounds; round++) {
        if (round > 0) {
            take_target(f, target_um);
        }
        hysteresis_free(&f->hysteresis);
        good = hysteresis_fit(imitation->paths, imitation->count, target_um, f->use, f->thin, &bases, &f->hysteresis,
                              &ignored) &&
               imitation_run(imitation, &f->hysteresis, &ignored);
    }
    hysteresis_bases_close(&bases);
    return good;
}

bool fitted_chain_beside(fitted_chain_t *f, const fitted_chain_t *like, const model_t *chain,
                         hysteresis_bases_t *bases) {
    failure_t ignored;
    const samples_t *samples = like->samples;
    *f = (fitted_chain_t){.samples = samples, .thin = like->thin};
    if (!imitation_open(&f->imitation, chain, samples->recordings, samples->count, &ignored)) {
        return false;
    }
    f->use = allocate(samples->all, 1);
    f->position_um = samples_column(samples);
    memcpy(f->use, like->use, samples->all);
    memcpy(f->position_um, like->position_um, samples->all * sizeof(double));
    imitation_take_ranges(&f->imitation, &like->imitation);
    double *target_um = samples_column(samples);
    const int rounds = chain->blocks == 1 ? 1 : CHAIN_ROUNDS;
    bool good = imitation_run(&f->imitation, &like->hysteresis, &ignored);
    for (int round = 0; good && round < rounds; round++) {
        take_target(f, target_um);
        hysteresis_free(&f->hysteresis);
        good = hysteresis_fit_like(&like->hysteresis, f->imitation.paths, f->imitation.count, target_um, f->use,
                                   f->thin, bases, &f->hysteresis, &ignored) &&
               imitation_run(&f->imitation, &f->hysteresis, &ignored);
    }
    free(target_um);
    if (!good) {
        fitted_chain_close(f);
    }
    return good;
}

const hysteresis_rows_t *fitted_chain_rows(fitted_chain_t *f) {
    if (f->rows.kept.row == NULL) {
        hysteresis_rows_open(&f->rows, &f->hysteresis, f->imitation.paths, f->imitation.count, f->use, f->thin);
    }
    return &f->rows;
}

bool fitted_chain_open(fitted_chain_t *f, const samples_t *samples, const model_t *chain) {
    failure_t ignored;
    *f = (fitted_chain_t){0};
    if (!imitation_open(&f->imitation, chain, samples->recordings, samples->count, &ignored)) {
        return false; /* imitation_open leaves nothing behind */
    }
    take_samples(f, samples);
    double *target_um = samples_column(samples);
    const bool good = fit_weights(f, target_um);
    free(target_um);
    if (!good) {
        fitted_chain_close(f);
    }
    return good;
}

probe_setting_t fitted_chain_setting(const fitted_chain_t *f, const probe_setting_t *setting, double *line_hz) {
    probe_setting_t here = *setting;
    const size_t longest = samples_longest(f->samples), begin = f->samples->begin[longest];
    const size_t count = f->samples->recordings[longest].samples;
    double *left = allocate(count, sizeof(double));
    for (size_t k = 0; k < count; k++) {
        left[k] = f->position_um[begin + k] - f->imitation.simulated_um[begin + k];
    }
    here.lines = find_lines(left, count, setting->sample_rate_hz, line_hz);
    here.line_hz = line_hz;
    free(left);
    return here;
}

scan_t fitted_chain_scan(fitted_chain_t *f, const probe_setting_t *setting) {
    return (scan_t){.imitation = &f->imitation, .rows = fitted_chain_rows(f), .setting = setting};
}
