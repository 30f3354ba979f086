/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/fitted_chain.h"
#include "chain/catalogue.h"
#include "operator/equations.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rows of the final fit: 40 for each of the operator's columns. */
enum { CHAIN_ROUNDS = 6, MOST_FITTED = 12000 };
/* Of what the chain adds from round to round, in parts of the noise: with less it is the last one, and after more the
 * next one need not be fine. Between the two (1 to 5 of them behind creep) the noise's spectrum still moves, by a
 * factor of 10 from round to round: it has to be improved each time. */
static const double settled = 0.1, far = 10.0;

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
    suspects_free(&f->scanned);
    suspects_free(&f->searched);
    imitation_close(&f->imitation);
    kept_rows_close(&f->fitted_rows);
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

/* What the chain adds to its linear part, column by column: simulated less the operator's position through that. */
static void added(const fitted_chain_t *f, const state_space_t *behind, double *added_um) {
    const imitation_t *imitation = &f->imitation;
    memcpy(added_um, imitation->predicted_um, f->samples->all * sizeof(double));
    for (size_t i = 0; i < f->samples->count; i++) {
        state_space_column(behind, added_um + f->samples->begin[i], f->samples->recordings[i].samples);
    }
    hysteresis_add_offsets(&f->hysteresis, imitation->paths, imitation->count, added_um);
    for (size_t k = 0; k < f->samples->all; k++) {
        added_um[k] = imitation->simulated_um[k] - added_um[k];
    }
}

/* What the chain adds, round by round: a column that a fit takes as given, and what comes out beside that fit. */
typedef struct {
    double *given_um, *out_um, *before_given_um, *before_out_um;
} addition_t;

static void addition_open(const samples_t *samples, addition_t *addition) {
    *addition = (addition_t){samples_column(samples), samples_column(samples), samples_column(samples),
                             samples_column(samples)};
}

static void addition_close(addition_t *addition) {
    free(addition->given_um);
    free(addition->out_um);
    free(addition->before_given_um);
    free(addition->before_out_um);
}

/* The root mean square by which what comes out is not what was given, in parts of the noise. */
static double change_of(const addition_t *a, const fitted_chain_t *f) {
    const size_t samples = f->samples->all;
    double sum = 0.0;
    for (size_t k = 0; k < samples; k++) {
        sum += gsl_pow_2(a->out_um[k] - a->given_um[k]);
    }
    return sqrt(sum / (double)samples / f->hysteresis.evidence.variance);
}

/* What the next round takes as given: what came out, moved on along what two rounds have in common (Anderson, Journal
 * of the ACM 12, 1965, of depth 1). */
static void take_next(addition_t *a, size_t samples, bool first) {
    double along = 0.0, square = 0.0;
    for (size_t k = 0; !first && k < samples; k++) {
        const double change = a->out_um[k] - a->given_um[k];
        const double bend = change - (a->before_out_um[k] - a->before_given_um[k]);
        along += change * bend;
        square += bend * bend;
    }
    const double part = square > 0.0 ? along / square : 0.0;
    for (size_t k = 0; k < samples; k++) {
        const double next_um = a->out_um[k] - part * (a->out_um[k] - a->before_out_um[k]);
        a->before_out_um[k] = a->out_um[k];
        a->before_given_um[k] = a->given_um[k];
        a->given_um[k] = next_um;
    }
}

/* The operator's columns pass through the linear part of what is behind it. The rest goes by the operator's position,
 * and that by the rest: in rounds, until the noise hides what is still to come. target_um: a column, the position less
 * that rest. */
static bool fit_weights(fitted_chain_t *f, const hysteresis_t *like, double *target_um, addition_t *addition) {
    failure_t ignored;
    imitation_t *imitation = &f->imitation;
    const size_t all = f->samples->all;
    state_space_t *behind = allocate(1, sizeof *behind);
    hysteresis_bases_t bases = {0};
    imitation_behind(imitation, behind);
    const hysteresis_data_t data = {imitation->paths, imitation->count, target_um, f->use, f->thin, behind};
    bool good = imitation_rest(imitation, &ignored), goes_on = true, roughly = false;
    added(f, behind, addition->given_um);
    for (int round = 0; good && goes_on && round < CHAIN_ROUNDS; round++) {
        hysteresis_t before = f->hysteresis;
        const hysteresis_t *start = round > 0 ? &before : like;
        if (round > 0) {
            take_next(addition, all, round == 1);
        }
        for (size_t k = 0; k < all; k++) {
            target_um[k] = f->position_um[k] - addition->given_um[k];
        }
        good = (roughly ? hysteresis_fit_roughly(&data, start, &bases, &f->hysteresis, &ignored)
                        : hysteresis_fit(&data, start, &bases, &f->hysteresis, &ignored)) &&
               imitation_run(imitation, &f->hysteresis, &ignored);
        if (good) {
            added(f, behind, addition->out_um);
            const double change = change_of(addition, f);
            goes_on = roughly || change > settled;
            roughly = change > far && round + 2 < CHAIN_ROUNDS; /* the last one is fine */
        }
        hysteresis_free(&before);
    }
    if (good) {
        (void)equations_take_rows(&bases, &f->hysteresis, f->thin, &f->fitted_rows);
    }
    hysteresis_bases_close(&bases);
    free(behind);
    return good;
}

const hysteresis_rows_t *fitted_chain_rows(fitted_chain_t *f) {
    if (f->rows.hysteresis == NULL && f->fitted_rows.row != NULL) {
        f->rows = (hysteresis_rows_t){&f->hysteresis, f->imitation.paths, f->imitation.count, f->fitted_rows};
        f->fitted_rows = (kept_rows_t){0};
    } else if (f->rows.hysteresis == NULL) {
        hysteresis_rows_open(&f->rows, &f->hysteresis, f->imitation.paths, f->imitation.count, f->use, f->thin);
    }
    return &f->rows;
}

bool fitted_chain_open(fitted_chain_t *f, const samples_t *samples, const model_t *chain, const hysteresis_t *like) {
    failure_t ignored;
    *f = (fitted_chain_t){0};
    if (!imitation_open(&f->imitation, chain, samples->recordings, samples->count, &ignored)) {
        return false; /* imitation_open leaves nothing behind */
    }
    take_samples(f, samples);
    double *target_um = samples_column(samples);
    addition_t addition;
    addition_open(samples, &addition);
    const bool good = fit_weights(f, like, target_um, &addition);
    addition_close(&addition);
    free(target_um);
    if (!good) {
        fitted_chain_close(f);
    }
    return good;
}

bool fitted_chain_is_of(const fitted_chain_t *f, const samples_t *samples, const model_t *chain) {
    model_t operated;
    if (f->samples != samples) {
        return false;
    }
    chain_for_operator(chain, &operated);
    const bool same = model_same_blocks(&operated, &f->imitation.chain);
    model_free(&operated);
    return same;
}

scan_t fitted_chain_scan(fitted_chain_t *f, const probe_setting_t *setting) {
    return (scan_t){.imitation = &f->imitation, .rows = fitted_chain_rows(f), .setting = setting};
}
