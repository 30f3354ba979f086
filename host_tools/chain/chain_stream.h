/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Simulates a chain, or its last stages, piece by piece, in memory that does not grow with the recording. The input of
 * any stage can be passed to other streams that begin there. Simulations that differ in one parameter so share the
 * stages before it (refine_problem.h).
 *
 * A stage looks SIGNAL_AHEAD samples ahead, so its output stays that far behind its input until the signal ends. The
 * output equals that of chain_simulate bit for bit, however the signal is cut.
 */
#ifndef CHAIN_STREAM_H
#define CHAIN_STREAM_H

#include "chain/chain.h"

/** Most input samples in one piece for a stream of a whole chain, and most samples in flight with them. */
enum { STREAM_PIECE = 512, STREAM_MOST = STREAM_PIECE + SIGNAL_AHEAD * MODEL_MAX_BLOCKS };

/** A piece of a signal at the input of a stage. */
typedef struct {
    signal_t signal[STREAM_MOST];
    size_t count; /**< 0 or more */
    bool ends;    /**< nothing follows */
} stream_piece_t;

typedef struct {
    size_t first, stages; /**< of chain_order: it runs [first, stages), which may be none */
    chain_stage_t stage[MODEL_MAX_BLOCKS];
    signal_t *signal;                /**< samples in flight, at most STREAM_MOST; the output comes first */
    size_t count, out;               /**< their number; of these, the output of the last piece */
    size_t seen[MODEL_MAX_BLOCKS];   /**< of these, the input of each stage so far, */
    size_t passed[MODEL_MAX_BLOCKS]; /**< and its output so far */
} chain_stream_t;

/** The model must have passed model_check, and may be changed or freed afterwards. first: of chain_order. */
chain_stream_t chain_stream_open(const model_t *model, size_t first, const stage_setup_t *setup);
void chain_stream_close(chain_stream_t *stream);

/** Like chain_settle. `signal` is the input of the first stage: {.value = drive} for that of the chain. entered:
 * receives the input of each stage, by its number in chain_order; or NULL. */
void chain_stream_settle(const chain_stream_t *stream, signal_t signal, signal_t *entered);

/** The piece of a recording's drive from sample `start` on, as far as a stream of the whole chain needs it for its
 * output before sample `end`. */
void chain_stream_fill(const chain_stream_t *stream, const recording_t *recording, size_t start, size_t end,
                       stream_piece_t *piece);

/**
 * Takes the next `count` input samples: at most STREAM_PIECE at the chain's first stage; at a later stage, what an
 * earlier stream produced there. ends: the signal ends with them. Afterwards stream->signal holds the next stream->out
 * output samples. entered: gets what comes in at each stage, by its number in chain_order; or NULL.
 */
void chain_stream_run(chain_stream_t *stream, const signal_t *signal, size_t count, bool ends, stream_piece_t *entered);

/** A column that is added to a signal, so many times. */
typedef struct {
    const double *column;
    double times;
} stream_added_t;

/** Runs the stages from `first` on for a whole recording. signal: the input there, as for chain_run. added: to that;
 * NULL: nothing. Returns false if the model cannot be simulated or its output is not finite. */
bool chain_stream_position(const model_t *model, const recording_t *recording, size_t first, const signal_t *signal,
                           const stream_added_t *added, double *position_um, failure_t *failure);

#endif
