/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/scan.h"
#include "base/parallel.h"
#include "chain/catalogue.h"
#include "diagnosis/evidence/candidate.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { AT_ONCE = 16 };
/* Of a signature's square, what the operator leaves has to be more than this part: below, it is a matter of the last
 * digits. */
static const double least_beyond = 1e-8;

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
    for (size_t r = 0; r < scan->rows->kept.rows; r++) {
        square += gsl_pow_2(column[scan->rows->kept.sample[r]]);
    }
    return square / scan->rows->hysteresis->evidence.variance;
}

/* The probing of one block. */
typedef struct {
    const scan_t *scan;
    suspect_t best; /* block: NULL while no probe could be simulated */
    const block_t *block;
    size_t tried;
} probing_t;

static void keep_better(probing_t *probing, const double value[BLOCK_MAX_PARAMETERS], double along, double beyond) {
    const double a = along / beyond, least = 0.1;
    const double gain = a < 0.0 && candidate_never_negative(probing->block) ? 0.0 : along * along / (2.0 * beyond);
    const double most = fmax(probing->best.gain, gain);
    /* What it is worth as it is, amplitude 1, or a part of what it would be worth with another one. */
    const double promise = candidate_grows(probing->block) ? gain : fmax(along - beyond / 2.0, least * gain);
    probing->tried++;
    if (probing->best.block == NULL || promise > probing->best.promise) {
        model_free(&probing->best.chain);
        probing->best = (suspect_t){.block = probing->block, .promise = promise, .amplitude = a};
        probing->best.at =
            candidate_insert(&probing->best.chain, &probing->scan->imitation->chain, probing->block, value);
    }
    probing->best.gain = most;
}

/* Signatures of some of a block's probes. */
typedef struct {
    probing_t *probing;
    double value[AT_ONCE][BLOCK_MAX_PARAMETERS], *room;
    bool there[AT_ONCE];
} probes_t;

static void simulate_probe(void *context, size_t index) {
    probes_t *probes = context;
    const scan_t *scan = probes->probing->scan;
    model_t chain;
    const size_t at = candidate_insert(&chain, &scan->imitation->chain, probes->probing->block, probes->value[index]);
    probes->there[index] = signature_of(scan, &chain, at, probes->room + index * scan->imitation->all);
    model_free(&chain);
}

/* Some of a block's probes from index on. Returns how many there were. */
static size_t probe_some(probing_t *probing, size_t index, double *room) {
    const scan_t *scan = probing->scan;
    probes_t probes = {.probing = probing, .room = room};
    double product[(AT_ONCE + 1) * (AT_ONCE + 1)];
    const double *column[AT_ONCE + 1] = {scan->rows->hysteresis->position_um};
    size_t some = 0, width = 1, of[AT_ONCE + 1];
    while (some < AT_ONCE && candidate_probe(probing->block, scan->setting, index + some, probes.value[some])) {
        some++;
    }
    parallel(some, simulate_probe, &probes);
    for (size_t i = 0; i < some; i++) {
        if (probes.there[i]) {
            of[width] = i;
            column[width++] = room + i * scan->imitation->all;
        }
    }
    if (width > 1) {
        hysteresis_beyond(scan->rows, width, column, product);
        for (size_t i = 1; i < width; i++) {
            if (product[i * width + i] > least_beyond * square_of(scan, column[i])) {
                keep_better(probing, probes.value[of[i]], product[i], product[i * width + i]);
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
        if (probe_is_first(catalogue[i]->probe) && model_find(&scan->imitation->chain, catalogue[i]->name) == NULL) {
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

void suspects_free(suspect_t *suspect, size_t count) {
    for (size_t i = 0; i < count; i++) {
        model_free(&suspect[i].chain);
    }
    free(suspect);
}
