/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Runs a chain, or its stages from one on, piece by piece: what is on its way at a time does not grow with the
 * recording, and what comes in at any stage can be given to other streams that begin there. So simulations that differ
 * in one number share the stages before it (refine_problem.h).
 *
 * A stage knows SIGNAL_AHEAD samples that follow, so its output stays that far behind its input until the signal ends.
 * However it is cut, what comes out is bit for bit what chain_simulate gives for the whole.
 */
#ifndef CHAIN_STREAM_H
#define CHAIN_STREAM_H

#include "chain.h"

/** Samples that may come in at once at a stream of a whole chain, and what may be on its way with them. */
enum { STREAM_PIECE = 512, STREAM_MOST = STREAM_PIECE + SIGNAL_AHEAD * MODEL_MAX_BLOCKS };

/** A part of a signal: what comes in at a stage. */
typedef struct {
    signal_t signal[STREAM_MOST];
    size_t count; /**< 0 or more */
    bool ends;    /**< nothing follows */
} stream_piece_t;

typedef struct {
    size_t first, stages; /**< of chain_order: it runs [first, stages), which may be none */
    chain_stage_t stage[MODEL_MAX_BLOCKS];
    signal_t *signal;                /**< on their way, STREAM_MOST at most; what has come out is in front */
    size_t count, out;               /**< how many; of these, what came out with the last piece */
    size_t seen[MODEL_MAX_BLOCKS];   /**< of these, what has come in at each stage, */
    size_t passed[MODEL_MAX_BLOCKS]; /**< and what has come out of it */
} chain_stream_t;

/** The model must have passed model_check, and may be changed or freed afterwards. first: of chain_order. */
chain_stream_t chain_stream_open(const model_t *model, size_t first, const stage_setup_t *setup);
void chain_stream_close(chain_stream_t *stream);

/** As chain_settle does it. `signal` is what comes in at the first stage: {.value = drive} at that of the chain.
 * entered: gets what comes in at each stage, by its number in chain_order; or NULL. */
void chain_stream_settle(const chain_stream_t *stream, signal_t signal, signal_t *entered);

/** The piece of a recording's drive that begins at sample `start`: as far as a stream of the whole chain has to know it
 * for what comes out before sample `end`. */
void chain_stream_fill(const chain_stream_t *stream, const recording_t *recording, size_t start, size_t end,
                       stream_piece_t *piece);

/**
 * Takes the next `count` samples of what comes in: at most STREAM_PIECE at the chain's first stage; further down, what
 * a stream that begins earlier has got there. ends: nothing follows. stream->signal then holds the stream->out samples
 * that come out next.
 * entered: gets what comes in at each stage, by its number in chain_order; or NULL.
 */
void chain_stream_run(chain_stream_t *stream, const signal_t *signal, size_t count, bool ends, stream_piece_t *entered);

/** Runs the stages from `first` on for a whole recording. signal: what comes in there, as chain_run takes it. Returns
 * false if the model cannot be simulated, or is not finite. */
bool chain_stream_position(const model_t *model, const recording_t *recording, size_t first, const signal_t *signal,
                           double *position_um, failure_t *failure);

#endif
