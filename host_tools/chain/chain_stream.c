/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "chain/chain_stream.h"
#include "base/progress.h"
#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

chain_stream_t chain_stream_open(const model_t *model, size_t first, const stage_setup_t *setup) {
    size_t order[MODEL_MAX_BLOCKS];
    chain_stream_t stream = {
        .first = first, .stages = chain_order(model, order), .signal = allocate(STREAM_MOST, sizeof(signal_t))};
    for (size_t stage = first; stage < stream.stages; stage++) {
        stream.stage[stage] = chain_stage_open(model, order[stage], setup);
    }
    return stream;
}

void chain_stream_close(chain_stream_t *stream) {
    for (size_t stage = stream->first; stage < stream->stages; stage++) {
        chain_stage_close(&stream->stage[stage]);
    }
    free(stream->signal);
}

void chain_stream_settle(const chain_stream_t *stream, signal_t signal, signal_t *entered) {
    for (size_t stage = stream->first; stage < stream->stages; stage++) {
        if (entered != NULL) {
            entered[stage] = signal;
        }
        chain_stage_settle(&stream->stage[stage], &signal);
    }
}

void chain_stream_fill(const chain_stream_t *stream, const recording_t *recording, size_t start, size_t end,
                       stream_piece_t *piece) {
    const size_t known = end + SIGNAL_AHEAD * stream->stages;
    const size_t left = (known < recording->samples ? known : recording->samples) - start;
    piece->count = left < STREAM_PIECE ? left : STREAM_PIECE;
    piece->ends = start + piece->count == recording->samples;
    for (size_t k = 0; k < piece->count; k++) {
        piece->signal[k] = (signal_t){.value = recording->column[COLUMN_DRIVE][start + k]};
    }
}

/* Of what came out with the last piece. */
static void forget(chain_stream_t *stream) {
    stream->count -= stream->out;
    memmove(stream->signal, stream->signal + stream->out, stream->count * sizeof(signal_t));
    for (size_t stage = stream->first; stage < stream->stages; stage++) {
        stream->seen[stage] -= stream->out;
        stream->passed[stage] -= stream->out;
    }
    stream->out = 0;
}

void chain_stream_run(chain_stream_t *stream, const signal_t *signal, size_t count, bool ends,
                      stream_piece_t *entered) {
    forget(stream);
    assert(stream->count + count <= STREAM_MOST);
    memcpy(stream->signal + stream->count, signal, count * sizeof(signal_t));
    stream->count += count;
    stream->out = stream->count;
    for (size_t stage = stream->first; stage < stream->stages; stage++) {
        const size_t seen = stream->seen[stage], passed = stream->passed[stage];
        const size_t behind = ends ? 0 : SIGNAL_AHEAD;
        if (entered != NULL) {
            entered[stage].count = stream->out - seen;
            entered[stage].ends = ends;
            memcpy(entered[stage].signal, stream->signal + seen, entered[stage].count * sizeof(signal_t));
        }
        stream->seen[stage] = stream->out;
        stream->out -= behind < stream->out ? behind : stream->out;
        chain_stage_run(&stream->stage[stage], stream->signal + passed, stream->out - passed,
                        stream->seen[stage] - passed);
        stream->passed[stage] = stream->out;
    }
}

/* The signals with what is added to them; themselves where that is nothing. */
static const signal_t *with_added(const signal_t *signal, const stream_added_t *added, size_t start, size_t count,
                                  signal_t *piece) {
    if (added == NULL) {
        return signal + start;
    }
    memcpy(piece, signal + start, count * sizeof *piece);
    for (size_t k = 0; k < count; k++) {
        piece[k].value += added->times * added->column[start + k];
    }
    return piece;
}

static void run_pieces(chain_stream_t *stream, const signal_t *signal, const stream_added_t *added, size_t samples,
                       double *position_um) {
    signal_t *piece = added != NULL ? allocate(STREAM_PIECE, sizeof *piece) : NULL;
    for (size_t start = 0, k = 0; k < samples; start += STREAM_PIECE) {
        const size_t left = samples - start, count = left < STREAM_PIECE ? left : STREAM_PIECE;
        chain_stream_run(stream, with_added(signal, added, start, count, piece), count, count == left, NULL);
        for (size_t i = 0; i < stream->out; i++, k++) {
            position_um[k] = stream->signal[i].value;
        }
    }
    free(piece);
}

bool chain_stream_position(const model_t *model, const recording_t *recording, size_t first, const signal_t *signal,
                           const stream_added_t *added, double *position_um, failure_t *failure) {
    const size_t samples = recording->samples;
    stage_setup_t setup;
    bool finite = true;
    if (!chain_setup(model, recording, 0, &setup, failure)) {
        return false;
    }
    chain_stream_t stream = chain_stream_open(model, first, &setup);
    signal_t settled = signal[0];
    if (added != NULL) {
        settled.value += added->times * added->column[0];
    }
    chain_stream_settle(&stream, settled, NULL);
    if (stream.stages == first + 1 && added == NULL) { /* nothing is on its way to another stage */
        chain_stage_values(&stream.stage[first], signal + 1, samples, position_um);
    } else {
        run_pieces(&stream, signal + 1, added, samples, position_um);
    }
    chain_stream_close(&stream);
    for (size_t k = 0; k < samples && finite; k++) {
        finite = isfinite(position_um[k]);
    }
    return finite || fail(failure, "the model runs away");
}

bool chain_simulate(const model_t *model, const recording_t *recording, uint64_t seed, double *position_um,
                    failure_t *failure) {
    stage_setup_t setup;
    bool good = true;
    if (!chain_setup(model, recording, seed, &setup, failure)) {
        return false;
    }
    chain_stream_t stream = chain_stream_open(model, 0, &setup);
    stream_piece_t *piece = allocate(1, sizeof *piece);
    chain_stream_settle(&stream, (signal_t){.value = recording->column[COLUMN_DRIVE][0]}, NULL);
    for (size_t start = 0, k = 0; good && k < recording->samples; start += piece->count) {
        chain_stream_fill(&stream, recording, start, recording->samples, piece);
        chain_stream_run(&stream, piece->signal, piece->count, piece->ends, NULL);
        for (size_t i = 0; i < stream.out; i++, k++) {
            position_um[k] = stream.signal[i].value;
        }
        good = progress_go_on(failure);
    }
    free(piece);
    chain_stream_close(&stream);
    return good;
}
