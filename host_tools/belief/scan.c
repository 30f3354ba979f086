/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/scan.h"
#include "base/parallel.h"
#include "chain/catalogue.h"
#include "diagnosis/evidence/candidate.h"
#include "diagnosis/evidence/searched.h"
#include "numerics/gauss_newton.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { AT_ONCE = 16 };
/* Of a signature's square, what the operator leaves has to be more than this part: below, it is a matter of the last
 * digits. */
static const double least_beyond = 1e-8;
/* A step of the refinement that is worth less, in natural units, is the last one. One step, a third of it, a ninth ..
 */
static const double settled = 0.2;
static const gauss_newton_tunables_t usual = {
    .most_iterations = SCAN_STEPS, .most_trials = 4, .worth = 1.0, .shorten = 0.3};

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
} probing_t;

/* How small it could be and still be heard. */
static void note_smallest(probing_t *probing, const double value[BLOCK_MAX_PARAMETERS], double beyond,
                          const double *signature) {
    const size_t all = probing->scan->imitation->all;
    const double amplitude = sqrt(2.0 * threshold.least_gain / beyond);
    const double smallest_um = amplitude * cblas_dnrm2((int)all, signature, 1) / sqrt((double)all);
    suspect_t *best = &probing->best;
    if (best->smallest_um > 0.0 && best->smallest_um <= smallest_um) {
        return;
    }
    best->smallest_um = smallest_um;
    for (size_t p = 0; p < probing->block->parameters; p++) {
        best->smallest_value[p] = value[p] * (probing->block->parameter[p].proportional ? amplitude : 1.0);
    }
}

static void keep_better(probing_t *probing, const double value[BLOCK_MAX_PARAMETERS], double along, double beyond,
                        const double *signature) {
    const double a = along / beyond, least = 0.1;
    const double gain = a < 0.0 && candidate_never_negative(probing->block) ? 0.0 : along * along / (2.0 * beyond);
    const double most = fmax(probing->best.gain, gain);
    /* What it is worth as it is, amplitude 1, or a part of what it would be worth with another one. */
    const double promise = candidate_grows(probing->block) ? gain : fmax(along - beyond / 2.0, least * gain);
    if (probing->best.block == NULL || promise > probing->best.promise) {
        model_free(&probing->best.chain);
        probing->best.block = probing->block;
        probing->best.promise = promise;
        probing->best.amplitude = a;
        probing->best.sigma = 1.0 / sqrt(beyond);
        probing->best.at =
            candidate_insert(&probing->best.chain, &probing->scan->imitation->chain, probing->block, value);
    }
    probing->best.gain = most;
    note_smallest(probing, value, beyond, signature);
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
                keep_better(probing, probes.value[of[i]], product[i], product[i * width + i], column[i]);
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

void suspects_sort(suspects_t *suspects) {
    if (suspects->count > 0) {
        qsort(suspects->suspect, suspects->count, sizeof *suspects->suspect, by_gain);
    }
}

void scan_blocks(const scan_t *scan, suspects_t *suspects) {
    probing_t *probing = allocate(catalogue_count, sizeof *probing);
    size_t blocks = 0;
    for (size_t i = 0; i < catalogue_count; i++) {
        if (probe_is_first(catalogue[i]->probe) && model_find(&scan->imitation->chain, catalogue[i]->name) == NULL) {
            probing[blocks++] = (probing_t){.scan = scan, .block = catalogue[i]};
        }
    }
    parallel(blocks, probe_block, probing);
    *suspects = (suspects_t){.suspect = allocate(catalogue_count, sizeof *suspects->suspect)};
    for (size_t i = 0; i < blocks; i++) {
        if (probing[i].best.block != NULL) {
            suspects->suspect[suspects->count++] = probing[i].best;
        }
    }
    suspects_sort(suspects);
    free(probing);
}

size_t scan_promising(const suspects_t *suspects, size_t most) {
    size_t count = 0;
    while (count < suspects->count && count < most &&
           suspects->suspect[count].gain >= threshold.rival_promise * suspects->suspect[0].gain) {
        count++;
    }
    return count;
}

/* The search for a suspect's numbers. Products are of what they name, beyond what the operator imitates. */
typedef struct {
    const scan_t *scan;
    suspect_t *suspect;
    searched_t searched;
    double *column;                                           /* signature, derivatives; one after the other */
    double along, square;                                     /* of the signature: with the position, with itself */
    double gram[BLOCK_MAX_PARAMETERS * BLOCK_MAX_PARAMETERS]; /* of the derivatives */
    double moment[BLOCK_MAX_PARAMETERS]; /* of them with what the signature leaves of the position */
} refinement_t;

/* The sum of squares that the signature, amplitude 1, leaves of the position, less what there is without it. HUGE_VAL
 * where it cannot be simulated. */
static double cost_of(refinement_t *job) {
    const scan_t *scan = job->scan;
    const double *column[] = {scan->rows->hysteresis->position_um, job->column};
    double product[4];
    if (!signature_of(scan, &job->suspect->chain, job->suspect->at, job->column)) {
        return HUGE_VAL;
    }
    hysteresis_beyond(scan->rows, 2, column, product);
    job->along = product[1];
    job->square = product[3];
    return job->square - 2.0 * job->along;
}

static void take_derivative(void *context, size_t i) {
    const refinement_t *job = context;
    double *column = job->column + (1 + i) * job->scan->imitation->all;
    const size_t all = job->scan->imitation->all;
    model_t nudged;
    const double by = searched_nudge(&job->searched, i, &job->suspect->chain, job->suspect->at, &nudged);
    const bool good = signature_of(job->scan, &nudged, job->suspect->at, column);
    model_free(&nudged);
    for (size_t k = 0; k < all; k++) {
        column[k] = good ? (column[k] - job->column[k]) / by : 0.0;
    }
}

/* The signature is there: of the start, or of the last move, which was accepted or ended the search. */
static bool linearise(void *context, double *cost) {
    refinement_t *job = context;
    const size_t n = job->searched.count, width = n + 2, all = job->scan->imitation->all;
    const double *column[BLOCK_MAX_PARAMETERS + 2] = {job->scan->rows->hysteresis->position_um, job->column};
    double product[(BLOCK_MAX_PARAMETERS + 2) * (BLOCK_MAX_PARAMETERS + 2)];
    (void)cost;
    parallel(n, take_derivative, job);
    for (size_t i = 0; i < n; i++) {
        column[2 + i] = job->column + (1 + i) * all;
    }
    hysteresis_beyond(job->scan->rows, width, column, product);
    for (size_t i = 0; i < n; i++) {
        const double *row = product + (2 + i) * width;
        job->moment[i] = row[0] - row[1];
        for (size_t j = 0; j < n; j++) {
            job->gram[i * n + j] = row[2 + j];
        }
        if (row[2 + i] < least_beyond * square_of(job->scan, column[2 + i])) {
            job->gram[i * n + i] = 0.0; /* the operator imitates what this number does: it stays */
        }
    }
    return true;
}

/* searched_solve damps it. */
static bool solve(void *context, double damping, double *step) {
    const refinement_t *job = context;
    (void)damping;
    searched_solve(job->searched.count, job->gram, job->moment, step);
    return true;
}

static double move(void *context, const double *step, double part) {
    refinement_t *job = context;
    searched_move(&job->searched, step, part);
    return cost_of(job);
}

static void move_back(void *context, const double *step, double part) {
    refinement_t *job = context;
    (void)step;
    (void)part;
    searched_back(&job->searched);
}

/* A signature is nothing where the chain has the block with these numbers already. */
static void keep(void *context) {
    const refinement_t *job = context;
    if (job->square > 0.0) {
        job->suspect->amplitude = job->along / job->square;
        job->suspect->sigma = 1.0 / sqrt(job->square);
    }
    job->suspect->gain = fmax(job->along - 0.5 * job->square, 0.0);
}

static bool ends(void *context, bool improved, double before, double now) {
    (void)context;
    return !improved || before - now < 2.0 * settled;
}

void scan_refine(const scan_t *scan, size_t steps, suspect_t *suspect) {
    gauss_newton_tunables_t tunables = usual;
    tunables.most_iterations = steps;
    refinement_t job = {.scan = scan,
                        .suspect = suspect,
                        .column = allocate((BLOCK_MAX_PARAMETERS + 1) * scan->imitation->all, sizeof(double))};
    candidate_take_amplitude(&suspect->chain.block[suspect->at], suspect->amplitude);
    searched_open(&job.searched, &suspect->chain, suspect->at,
                  recordings_held_s(scan->imitation->recordings, scan->imitation->count));
    const gauss_newton_problem_t problem = {&job, job.searched.count, linearise, solve, move, move_back, keep, ends};
    double cost = cost_of(&job);
    suspect->refined = true;
    suspect->gain = 0.0;
    if (isfinite(cost)) {
        keep(&job);
        (void)gauss_newton(&problem, &tunables, &cost);
    }
    free(job.column);
}

void scan_errors(const scan_t *scan, model_t *chain, size_t at) {
    suspect_t suspect = {.chain = *chain, .at = at};
    refinement_t job = {.scan = scan,
                        .suspect = &suspect,
                        .column = allocate((BLOCK_MAX_PARAMETERS + 1) * scan->imitation->all, sizeof(double))};
    double ignored;
    searched_open(&job.searched, &suspect.chain, at,
                  recordings_held_s(scan->imitation->recordings, scan->imitation->count));
    (void)linearise(&job, &ignored); /* the signature is 0: the chain has the block */
    for (size_t i = 0; i < job.searched.count; i++) {
        double unit[BLOCK_MAX_PARAMETERS] = {0.0}, variance[BLOCK_MAX_PARAMETERS];
        parameter_t *parameter = job.searched.parameter[i];
        unit[i] = 1.0;
        searched_solve(job.searched.count, job.gram, unit, variance);
        free(parameter->sigma);
        parameter->sigma = NULL;
        if (variance[i] > 0.0) {
            parameter->sigma = allocate(1, sizeof(double));
            *parameter->sigma = sqrt(variance[i]) * searched_unit(&job.searched, i);
        }
    }
    *chain = suspect.chain;
    free(job.column);
}

void suspects_copy(const suspects_t *suspects, size_t count, suspects_t *copy) {
    *copy = (suspects_t){.suspect = allocate(count + 1, sizeof *copy->suspect), .count = count};
    for (size_t i = 0; i < count; i++) {
        copy->suspect[i] = suspects->suspect[i];
        model_copy(&copy->suspect[i].chain, &suspects->suspect[i].chain);
    }
}

void suspects_free(suspects_t *suspects) {
    for (size_t i = 0; i < suspects->count; i++) {
        model_free(&suspects->suspect[i].chain);
    }
    free(suspects->suspect);
    *suspects = (suspects_t){0};
}
