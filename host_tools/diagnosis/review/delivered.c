/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/review/delivered.h"
#include "chain/catalogue.h"
#include "identify/linear_fit.h"
#include <math.h>
#include <stdlib.h>

double delivered_percent(const samples_t *samples, const model_t *model) {
    bool good = true;
    double worst = 0.0;
    for (size_t i = 0; good && i < samples->count; i++) {
        const recording_t *part = &samples->recordings[i], *r = part->whole != NULL ? part->whole : part;
        double *position = allocate(r->samples, sizeof *position);
        failure_t ignored;
        good = chain_simulate(model, r, 0, position, &ignored);
        if (good && samples->count > 1) {
            error_take_zero(r->column[COLUMN_DISPLACEMENT], position, r->samples);
        }
        worst = good ? fmax(worst, measure_error(r->column[COLUMN_DISPLACEMENT], position, r->samples).nrmse_percent)
                     : HUGE_VAL;
        free(position);
    }
    return worst;
}

/* Runs of samples that are not held out. Returns how many; span NULL: only counts. */
static size_t spans_of(const samples_t *samples, const recording_t *recordings, fit_span_t *span) {
    size_t spans = 0;
    for (size_t i = 0; i < samples->count; i++) {
        const unsigned char *part = samples->part + samples->begin[i];
        const size_t end = samples->recordings[i].samples;
        for (size_t k = 0; k < end;) {
            size_t to = k;
            while (to < end && (part[to] == SAMPLE_HELD_OUT) == (part[k] == SAMPLE_HELD_OUT)) {
                to++;
            }
            if (part[k] != SAMPLE_HELD_OUT) {
                if (span != NULL) {
                    span[spans] = (fit_span_t){.recording = &recordings[i], .from = k, .to = to};
                }
                spans++;
            }
            k = to;
        }
    }
    return spans;
}

/* Moves copies of the recordings by what each, but the first, is off in the mean beside the first. */
static void take_zeros(const samples_t *samples, const model_t *model, recording_t *moved) {
    double *position = samples_column(samples), first_um = 0.0;
    failure_t ignored;
    const bool good = samples_simulate(samples, model, position, &ignored);
    for (size_t i = 0; good && i < samples->count; i++) {
        double *measured = moved[i].column[COLUMN_DISPLACEMENT];
        const double zero_um = error_take_zero(position + samples->begin[i], measured, moved[i].samples);
        first_um = i == 0 ? zero_um : first_um;
        for (size_t k = 0; k < moved[i].samples; k++) {
            measured[k] -= first_um;
        }
    }
    free(position);
}

static bool fit_plays(const play_basis_t *basis, const samples_t *samples, const recording_t *recordings,
                      model_t *model) {
    const linear_options_t options = {.drift = false};
    const size_t spans = spans_of(samples, recordings, NULL);
    fit_span_t *span = allocate(spans, sizeof *span);
    linear_fit_t fit;
    failure_t ignored;
    spans_of(samples, recordings, span);
    const bool good = linear_fit(basis, span, spans, &options, &fit, &ignored);
    if (good) {
        model_create(model, samples_fastest_hz(samples));
        model_block_t *block = model_append(model, &block_prandtl_ishlinskii);
        model_set(block, "offset_um", fit.offset_um);
        model_set_array(block, "weights", basis->operators + 1, fit.weight, NULL);
        model_set_array(block, "thresholds_v", basis->operators, basis->threshold_v, NULL);
        linear_fit_free(&fit);
    }
    free(span);
    return good;
}

bool delivered_plain(const samples_t *samples, size_t plays, model_t *model) {
    enum { ROUNDS = 4 }; /* zeros and weights hardly know of each other */
    double threshold_v[DELIVERED_PLAYS], range[2];
    recordings_range(samples->recordings, samples->count, COLUMN_DRIVE, range);
    for (size_t i = 0; i < plays; i++) {
        threshold_v[i] = 0.5 * (range[1] - range[0]) * (double)(i + 1) / (double)(plays + 1);
    }
    const play_basis_t basis = {.operators = plays, .threshold_v = threshold_v};
    bool good = fit_plays(&basis, samples, samples->recordings, model);
    if (samples->count == 1 || !good) {
        return good;
    }
    recording_t *moved = allocate(samples->count, sizeof *moved);
    for (size_t i = 0; i < samples->count; i++) {
        recording_copy(&moved[i], &samples->recordings[i], 0, samples->recordings[i].samples);
    }
    for (size_t round = 1; good && round < ROUNDS; round++) {
        take_zeros(samples, model, moved);
        model_free(model);
        good = fit_plays(&basis, samples, moved, model);
    }
    for (size_t i = 0; i < samples->count; i++) {
        recording_free(&moved[i]);
    }
    free(moved);
    return good;
}
