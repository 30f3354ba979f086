/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/review/seen.h"
#include "diagnosis/evidence/candidate.h"
#include "numerics/least_squares.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>

enum { PARABOLA = 3, RING = 2, COLUMNS = PARABOLA + RING };

/* A ring is looked at for so many times its decay: a twentieth is left of it then. */
static const double decays = 3.0;

static bool chain_rings(const model_t *chain, const probe_seen_t *seen) {
    double value[BLOCK_MAX_PARAMETERS];
    for (size_t b = 0; b < chain->blocks; b++) {
        const block_t *block = chain->block[b].block;
        if (block->probe != NULL && block->probe->rings != NULL) {
            candidate_value(&chain->block[b], value);
            if (block->probe->rings(seen, value)) {
                return true;
            }
        }
    }
    return false;
}

static void fill_columns(const probe_seen_t *seen, double rate_hz, size_t count, double *columns) {
    const double alpha = 2.0 * M_PI * seen->ring_hz * seen->ring_damping / rate_hz;
    const double omega = 2.0 * M_PI * seen->ring_hz * sqrt(1.0 - gsl_pow_2(seen->ring_damping)) / rate_hz;
    for (size_t k = 0; k < count; k++) {
        const double t = (double)k, x = t / (double)count, decay = exp(-alpha * t);
        columns[k] = 1.0;
        columns[count + k] = x;
        columns[2 * count + k] = x * x;
        columns[3 * count + k] = decay * cos(omega * t);
        columns[4 * count + k] = decay * sin(omega * t);
    }
}

/* Sum of squares that the first columns leave of the values; amplitude (may be NULL): of the ring. HUGE_VAL: they
 * cannot be fitted. */
static double left_by(const double *columns, const double *value, size_t count, size_t used, double *amplitude) {
    double x[COLUMNS], square = 0.0;
    failure_t ignored;
    if (!fit_columns(columns, value, count, used, NULL, x, &ignored)) {
        return HUGE_VAL;
    }
    for (size_t k = 0; k < count; k++) {
        double rest = value[k];
        for (size_t i = 0; i < used; i++) {
            rest -= x[i] * columns[i * count + k];
        }
        square += rest * rest;
    }
    if (amplitude != NULL) {
        *amplitude = hypot(x[PARABOLA], x[PARABOLA + 1]);
    }
    return square;
}

/* What is left of the ring behind one step, of what the chain leaves; 0: nothing that chance would not leave. */
static double ring_left_behind(const probe_seen_t *seen, const recording_t *recording, const double *left, size_t at) {
    const double alpha = 2.0 * M_PI * seen->ring_hz * seen->ring_damping / recording->sample_rate_hz;
    const size_t there = recording->samples - at, wanted = (size_t)ceil(decays / alpha);
    const size_t count = there < wanted ? there : wanted;
    double amplitude = 0.0;
    if (count < 4 * COLUMNS) {
        return 0.0;
    }
    double *columns = allocate(COLUMNS * count, sizeof *columns);
    fill_columns(seen, recording->sample_rate_hz, count, columns);
    const double without = left_by(columns, left + at, count, PARABOLA, NULL);
    const double with = left_by(columns, left + at, count, COLUMNS, &amplitude);
    free(columns);
    /* Two columns more, noise alone: the ratio falls below r with a chance of r^(degrees of freedom / 2). */
    const double log_chance = 0.5 * (double)(count - COLUMNS) * log(with / without);
    return isfinite(without) && log_chance < log(threshold.false_ring) ? amplitude : 0.0;
}

static double ring_left(const state_t *state) {
    const answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    const probe_seen_t *seen = &question->seen;
    const recording_t *recording = &question->recordings[seen->ring_recording];
    double *left = allocate(recording->samples, sizeof *left), most = 0.0;
    failure_t ignored;
    if (chain_simulate(&answer->model, recording, 0, left, &ignored)) {
        for (size_t k = 0; k < recording->samples; k++) {
            left[k] = recording->column[COLUMN_DISPLACEMENT][k] - left[k];
        }
        for (size_t i = 0; i < seen->rings; i++) {
            most = fmax(most, ring_left_behind(seen, recording, left, seen->ring_step[i]));
        }
    }
    free(left);
    return most;
}

bool seen_compare(state_t *state) {
    answer_t *answer = &state->answer;
    const probe_seen_t *seen = &answer->question->seen;
    if (seen->rings == 0 || chain_rings(&answer->model, seen)) {
        return true;
    }
    answer->ring_left_um = ring_left(state);
    if (answer->ring_left_um > 0.0) {
        answer->remainder.structured = true;
        if (answer->verdict == NOTHING_MISSING) {
            answer->verdict = UNKNOWN_PHYSICS;
        } else if (answer->verdict == EXPLAINED) {
            answer->verdict = PARTLY_EXPLAINED;
        }
    }
    return true;
}
