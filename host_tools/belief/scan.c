/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/scan.h"
#include "base/parallel.h"
#include "chain/catalogue.h"
#include "diagnosis/evidence/candidate.h"
#include "diagnosis/evidence/searched.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { AT_ONCE = 16, MOST_STEPS = 8 };
/* Of a signature's square, what the operator leaves has to be more than this part: below, it is a matter of the last
 * digits. */
static const double least_beyond = 1e-8;
/* A step of the refinement that is worth less, in natural units, is the last one. */
static const double settled = 0.2;

/* The column of a chain's signature; false if there is none. */
static bool signature_of(const scan_t *scan, const model_t *chain, size_t at, double *column) {
    const imitation_t *imitation = scan->imitation;
    if (!imitation_altered(imitation, scan->rows->hysteresis, chain, at, column)) {
        return false;
    }
    for (size_t k = 0; k < imitation->all; k++) {
        column[k] -= imitation->simulated_um[k];
    }
    return true;
}

static double square_of(const scan_t *scan, const double *column) {
    double square = 0.0;
    for (size_t r = 0; r < scan->rows->rows; r++) {
        square += gsl_pow_2(column[scan->rows->sample[r]]);
    }
    return square / scan->rows->hysteresis->evidence.variance;
}

/* Whether the effect is proportional to a number that is never below 0. */
static bool never_negative(const block_t *block) {
    for (size_t p = 0; p < block->parameters; p++) {
        if (candidate_proportional(block, p) && searched_low(block, p) >= 0.0) {
            return true;
        }
    }
    return false;
}

/* The probing of one block. */
typedef struct {
    const scan_t *scan;
    suspect_t best; /* block: NULL while no probe could be simulated */
    const block_t *block;
    size_t tried;
} probing_t;

static bool take_probe(const probing_t *probing, size_t index, double *value) {
    const block_t *block = probing->block;
    for (size_t p = 0; p < block->parameters; p++) {
        value[p] = block->parameter[p].optional ? block->parameter[p].default_value : 0.0;
    }
    return block->probe->probe(probing->scan->setting, index, value);
}

/* Whether the effect grows with one of the numbers that are searched: then a probe of any size is as good a start. */
static bool grows_with_a_number(const block_t *block) {
    for (size_t p = 0; p < block->parameters; p++) {
        if (candidate_proportional(block, p)) {
            return true;
        }
    }
    return false;
}

static void keep_better(probing_t *probing, const double value[BLOCK_MAX_PARAMETERS], double along, double beyond) {
    const double a = along / beyond, least = 0.1;
    const double gain = a < 0.0 && never_negative(probing->block) ? 0.0 : along * along / (2.0 * beyond);
    const double most = fmax(probing->best.gain, gain);
    /* What it is worth as it is, amplitude 1, or a part of what it would be worth with another one. */
    const double promise = grows_with_a_number(probing->block) ? gain : fmax(along - beyond / 2.0, least * gain);
    probing->tried++;
    if (probing->best.block == NULL || promise > probing->best.promise) {
        model_free(&probing->best.chain);
        probing->best =
            (suspect_t){.block = probing->block, .promise = promise, .amplitude = a, .sigma = 1.0 / sqrt(beyond)};
        probing->best.at =
            candidate_insert(&probing->best.chain, &probing->scan->imitation->chain, probing->block, value);
    }
    probing->best.gain = most;
}

/* Some of a block's probes from index on. Returns how many there were. */
static size_t probe_some(probing_t *probing, size_t index, double *room) {
    const scan_t *scan = probing->scan;
    const size_t all = scan->imitation->all;
    double value[AT_ONCE][BLOCK_MAX_PARAMETERS], product[(AT_ONCE + 1) * (AT_ONCE + 1)];
    const double *column[AT_ONCE + 1] = {scan->rows->hysteresis->position_um};
    size_t some = 0, there = 0, width;
    for (; some < AT_ONCE && take_probe(probing, index + some, value[there]); some++) {
        model_t chain;
        const size_t at = candidate_insert(&chain, &scan->imitation->chain, probing->block, value[there]);
        if (signature_of(scan, &chain, at, room + there * all)) {
            column[1 + there] = room + there * all;
            there++;
        }
        model_free(&chain);
    }
    if (there > 0) {
        width = there + 1;
        hysteresis_beyond(scan->rows, width, column, product);
        for (size_t i = 1; i < width; i++) {
            if (product[i * width + i] > least_beyond * square_of(scan, column[i])) {
                keep_better(probing, value[i - 1], product[i], product[i * width + i]);
            }
        }
    }
    return some;
}

static void probe_block(void *context, size_t index) {
    probing_t *probing = &((probing_t *)context)[index];
    double *room = allocate(AT_ONCE * probing->scan->imitation->all, sizeof(double));
    size_t from = 0, some;
    do {
        some = probe_some(probing, from, room);
        from += some;
    } while (some == AT_ONCE);
    free(room);
}

static int by_gain(const void *one, const void *other) {
    const double a = ((const suspect_t *)one)->gain, b = ((const suspect_t *)other)->gain;
    return a < b ? 1 : a > b ? -1 : 0;
}

void scan_blocks(const scan_t *scan, suspect_t **suspect, size_t *count, size_t *signatures) {
    probing_t *probing = allocate(catalogue_count, sizeof *probing);
    size_t blocks = 0, tried = 0;
    for (size_t i = 0; i < catalogue_count; i++) {
        if (catalogue[i]->probe != NULL && model_find(&scan->imitation->chain, catalogue[i]->name) == NULL) {
            probing[blocks++] = (probing_t){.scan = scan, .block = catalogue[i]};
        }
    }
    parallel(blocks, probe_block, probing);
    *suspect = allocate(catalogue_count, sizeof **suspect);
    *count = 0;
    for (size_t i = 0; i < blocks; i++) {
        tried += probing[i].tried;
        if (probing[i].best.block != NULL) {
            (*suspect)[(*count)++] = probing[i].best;
        }
    }
    qsort(*suspect, *count, sizeof **suspect, by_gain);
    if (signatures != NULL) {
        *signatures = tried;
    }
    free(probing);
}

/* What a suspect's numbers are worth as they are, and what its derivatives say: product of target, signature, and
 * these. */
typedef struct {
    double *column; /* signature, derivatives; one after the other */
    double product[(BLOCK_MAX_PARAMETERS + 2) * (BLOCK_MAX_PARAMETERS + 2)];
    size_t width;
} look_t;

static bool look_at(const scan_t *scan, suspect_t *suspect, const searched_t *searched, look_t *look) {
    const size_t all = scan->imitation->all;
    const double *column[BLOCK_MAX_PARAMETERS + 2] = {scan->rows->hysteresis->position_um, look->column};
    look->width = 2 + (searched != NULL ? searched->count : 0);
    if (!signature_of(scan, &suspect->chain, suspect->at, look->column)) {
        return false;
    }
    for (size_t i = 0; searched != NULL && i < searched->count; i++) {
        model_t nudged;
        double *derivative = look->column + (1 + i) * all;
        const double by = searched_nudge(searched, i, &suspect->chain, suspect->at, &nudged);
        const bool good = signature_of(scan, &nudged, suspect->at, derivative);
        model_free(&nudged);
        for (size_t k = 0; k < all; k++) {
            derivative[k] = good ? (derivative[k] - look->column[k]) / by : 0.0;
        }
        column[2 + i] = derivative;
    }
    hysteresis_beyond(scan->rows, look->width, column, look->product);
    return true;
}

/* With the numbers as they are: amplitude 1. */
static double gain_of(const look_t *look) {
    return look->product[1] - 0.5 * look->product[look->width + 1];
}

static void step_from(const look_t *look, double *step) {
    const size_t n = look->width - 2;
    double gram[BLOCK_MAX_PARAMETERS * BLOCK_MAX_PARAMETERS], moment[BLOCK_MAX_PARAMETERS];
    for (size_t i = 0; i < n; i++) {
        const double *row = look->product + (2 + i) * look->width;
        moment[i] = row[0] - row[1];
        for (size_t j = 0; j < n; j++) {
            gram[i * n + j] = row[2 + j];
        }
    }
    searched_solve(n, gram, moment, step);
}

/* A parameter that the effect is proportional to takes the amplitude of the linear scan. */
static void start_from_amplitude(suspect_t *suspect) {
    const block_t *block = suspect->block;
    model_block_t *inserted = &suspect->chain.block[suspect->at];
    for (size_t p = 0; p < block->parameters; p++) {
        if (candidate_proportional(block, p)) {
            double *value = inserted->parameter[p].value;
            *value = fmax(searched_low(block, p), fmin(block->parameter[p].high, *value * suspect->amplitude));
        }
    }
}

static void refine(const scan_t *scan, suspect_t *suspect) {
    searched_t searched;
    look_t look = {.column = allocate((BLOCK_MAX_PARAMETERS + 1) * scan->imitation->all, sizeof(double))};
    double step[BLOCK_MAX_PARAMETERS], best = -HUGE_VAL, part = 1.0;
    start_from_amplitude(suspect);
    searched_open(&searched, &suspect->chain, suspect->at);
    bool good = look_at(scan, suspect, &searched, &look);
    for (int i = 0; good && i < MOST_STEPS; i++) {
        const double gain = gain_of(&look);
        if (gain > best) {
            const double better = gain - best;
            best = gain;
            suspect->amplitude = look.product[1] / look.product[look.width + 1];
            suspect->sigma = 1.0 / sqrt(look.product[look.width + 1]);
            if (better < settled) {
                break;
            }
            step_from(&look, step);
            part = 1.0;
        } else {
            searched_back(&searched);
            part *= 0.3;
            if (part < 0.02) {
                break;
            }
        }
        searched_move(&searched, step, part);
        good = look_at(scan, suspect, &searched, &look);
    }
    if (good && gain_of(&look) < best) {
        searched_back(&searched);
    }
    suspect->refined = true;
    suspect->gain = fmax(best, 0.0);
    free(look.column);
}

typedef struct {
    const scan_t *scan;
    suspect_t *suspect;
} refinement_t;

static void refine_one(void *context, size_t index) {
    const refinement_t *job = context;
    refine(job->scan, &job->suspect[index]);
}

void scan_refine(const scan_t *scan, suspect_t *suspect, size_t count) {
    parallel(count, refine_one, &(refinement_t){.scan = scan, .suspect = suspect});
    qsort(suspect, count, sizeof *suspect, by_gain);
}

void suspects_free(suspect_t *suspect, size_t count) {
    for (size_t i = 0; i < count; i++) {
        model_free(&suspect[i].chain);
    }
    free(suspect);
}
