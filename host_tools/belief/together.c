/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/together.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "diagnosis/evidence/candidate.h"
#include "diagnosis/evidence/searched.h"
#include "diagnosis/noise/lines.h"
#include "numerics/gauss_newton.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Numbers that are fitted at once: of a chain's whole list of findings. */
enum { MOST_NUMBERS = 32, HEARD_MOST = 6 };
/* An iteration that is worth less, in natural units, is the last one. */
static const double settled = 0.2;
static const gauss_newton_tunables_t tunables = {.most_iterations = 8, .most_trials = 4, .worth = 1.0, .shorten = 0.3};

/* The search. Its chain is `fitted`'s own, with other numbers while a move is tried. */
typedef struct {
    fitted_chain_t *fitted, tried; /* tried: of the last move, if it was accepted it takes fitted's place */
    model_t chain;
    searched_t searched[MODEL_MAX_BLOCKS];
    size_t at[MODEL_MAX_BLOCKS], blocks, numbers;
    bool alike; /* what arrives at the operator does not change */
    hysteresis_bases_t bases;
    double gram[MOST_NUMBERS * MOST_NUMBERS], moment[MOST_NUMBERS], expected;
} together_t;

/* The index of a number among its block's. */
static size_t place_of(const together_t *job, size_t number, size_t *block) {
    size_t i = number;
    for (*block = 0; i >= job->searched[*block].count; (*block)++) {
        i -= job->searched[*block].count;
    }
    return i;
}

typedef struct {
    const together_t *job;
    double *column;
} derivatives_t;

static void take_derivative(void *context, size_t number) {
    const derivatives_t *derivatives = context;
    const together_t *job = derivatives->job;
    const imitation_t *imitation = &job->fitted->imitation;
    double *column = derivatives->column + number * imitation->all;
    size_t block;
    model_t nudged;
    const size_t i = place_of(job, number, &block), at = job->at[block];
    const double by = searched_nudge(&job->searched[block], i, &job->chain, at, &nudged);
    const bool good = imitation_altered(imitation, &job->fitted->hysteresis, &nudged, at, column);
    model_free(&nudged);
    for (size_t k = 0; k < imitation->all; k++) {
        column[k] = good ? (column[k] - imitation->simulated_um[k]) / by : 0.0;
    }
}

/* What the position leaves along each number's derivative, the weights integrated out. */
static bool linearise(void *context, double *cost) {
    together_t *job = context;
    const size_t n = job->numbers, width = n + 1, all = job->fitted->imitation.all;
    double product[(MOST_NUMBERS + 1) * (MOST_NUMBERS + 1)];
    const double *column[MOST_NUMBERS + 1] = {job->fitted->hysteresis.position_um};
    derivatives_t derivatives = {.job = job, .column = allocate(n * all, sizeof(double))};
    (void)cost;
    parallel(n, take_derivative, &derivatives);
    for (size_t i = 0; i < n; i++) {
        column[1 + i] = derivatives.column + i * all;
    }
    hysteresis_beyond(fitted_chain_rows(job->fitted), width, column, product);
    for (size_t i = 0; i < n; i++) {
        const double *row = product + (1 + i) * width;
        job->moment[i] = row[0];
        memcpy(job->gram + i * n, row + 1, n * sizeof(double));
    }
    free(derivatives.column);
    return true;
}

/* searched_solve damps it. */
static bool solve(void *context, double damping, double *step) {
    together_t *job = context;
    (void)damping;
    searched_solve(job->numbers, job->gram, job->moment, step);
    job->expected = 0.0;
    for (size_t i = 0; i < job->numbers; i++) {
        job->expected += 0.5 * step[i] * job->moment[i];
    }
    return job->expected > settled;
}

static double move(void *context, const double *step, double part) {
    together_t *job = context;
    hysteresis_bases_t own = {0};
    size_t from = 0;
    for (size_t b = 0; b < job->blocks; from += job->searched[b++].count) {
        searched_move(&job->searched[b], step + from, part);
    }
    const bool good = fitted_chain_beside(&job->tried, job->fitted, &job->chain, job->alike ? &job->bases : &own);
    hysteresis_bases_close(&own);
    return good ? -job->tried.hysteresis.evidence.log_evidence : HUGE_VAL;
}

static void move_back(void *context, const double *step, double part) {
    together_t *job = context;
    (void)step;
    (void)part;
    fitted_chain_close(&job->tried);
    for (size_t b = 0; b < job->blocks; b++) {
        searched_back(&job->searched[b]);
    }
}

static void keep(void *context) {
    together_t *job = context;
    fitted_chain_close(job->fitted);
    *job->fitted = job->tried;
    job->tried = (fitted_chain_t){0};
}

static bool ends(void *context, bool improved, double before, double now) {
    (void)context;
    return !improved || before - now < settled;
}

void together_fit(fitted_chain_t *fitted, unsigned blocks) {
    together_t job = {.fitted = fitted, .alike = true};
    double cost = -fitted->hysteresis.evidence.log_evidence;
    model_copy(&job.chain, &fitted->imitation.chain);
    for (size_t b = 0; b < job.chain.blocks; b++) {
        searched_t searched;
        if ((blocks >> b & 1U) != 0) {
            searched_open(&searched, &job.chain, b);
            if (searched.count > 0 && job.numbers + searched.count <= MOST_NUMBERS) {
                job.at[job.blocks] = b;
                job.searched[job.blocks++] = searched;
                job.numbers += searched.count;
                job.alike = job.alike && !imitation_is_before(job.chain.block[b].block);
            }
        }
    }
    const gauss_newton_problem_t problem = {&job, job.numbers, linearise, solve, move, move_back, keep, ends};
    if (job.numbers > 0) {
        (void)gauss_newton(&problem, &tunables, &cost);
    }
    hysteresis_bases_close(&job.bases);
    model_free(&job.chain);
}

void heard_close(heard_t *heard) {
    fitted_chain_close(&heard->fitted);
    *heard = (heard_t){0};
}

/* Blocks beside a chain. */
typedef struct {
    const fitted_chain_t *without;
    const probe_setting_t *setting;
    double evidence; /* of it, by such a fit as those with a block */
    suspect_t *suspect;
    heard_t *heard;
} hearing_t;

static double evidence_of(const fitted_chain_t *fitted) {
    return fitted->hysteresis.evidence.log_evidence;
}

/* With the chain, if that is likelier than what is there. */
static void try_start(const hearing_t *hearing, const model_t *chain, fitted_chain_t *best) {
    fitted_chain_t tried;
    hysteresis_bases_t bases = {0};
    if (fitted_chain_beside(&tried, hearing->without, chain, &bases)) {
        const bool better = best->use == NULL || evidence_of(&tried) > evidence_of(best);
        fitted_chain_close(better ? best : &tried);
        if (better) {
            *best = tried;
        }
    }
    hysteresis_bases_close(&bases);
}

/* Where the best probe of the scan is worth nothing any more once the weights follow, each of them is tried. */
static void try_probes(const hearing_t *hearing, const block_t *block, fitted_chain_t *best) {
    double value[BLOCK_MAX_PARAMETERS];
    for (size_t probe = 0; candidate_probe(block, hearing->setting, probe, value); probe++) {
        model_t chain;
        candidate_insert(&chain, &hearing->without->imitation.chain, block, value);
        try_start(hearing, &chain, best);
        model_free(&chain);
    }
}

/* From its best probe, at the amplitude that the scan gives it. */
static void hear_one(void *context, size_t index) {
    const hearing_t *hearing = context;
    suspect_t *suspect = &hearing->suspect[index];
    heard_t *heard = &hearing->heard[index];
    heard->block = suspect->block;
    candidate_take_amplitude(&suspect->chain.block[suspect->at], suspect->amplitude);
    try_start(hearing, &suspect->chain, &heard->fitted);
    if (heard->fitted.use == NULL || evidence_of(&heard->fitted) <= hearing->evidence) {
        try_probes(hearing, suspect->block, &heard->fitted);
    }
    if (heard->fitted.use != NULL) {
        together_fit(&heard->fitted, 1U << suspect->at);
        heard->gain =
            fmax(0.0, evidence_of(&heard->fitted) - hearing->evidence - 0.5 * candidate_price(suspect->block));
        hysteresis_rows_close(&heard->fitted.rows); /* they know where the chain is, and it moves */
    }
}

static double evidence_again(const fitted_chain_t *fitted) {
    fitted_chain_t again;
    hysteresis_bases_t bases = {0};
    double evidence = HUGE_VAL;
    if (fitted_chain_beside(&again, fitted, &fitted->imitation.chain, &bases)) {
        evidence = evidence_of(&again);
        fitted_chain_close(&again);
    }
    hysteresis_bases_close(&bases);
    return evidence;
}

static int by_gain(const void *one, const void *other) {
    const double a = ((const heard_t *)one)->gain, b = ((const heard_t *)other)->gain;
    return (a < b) - (a > b);
}

size_t together_hear(fitted_chain_t *fitted, const probe_setting_t *setting, heard_t *heard, size_t most) {
    suspect_t *suspect;
    size_t count, taken = 0;
    const scan_t scan = fitted_chain_scan(fitted, setting);
    scan_blocks(&scan, &suspect, &count, NULL);
    while (taken < count && taken < most && suspect[taken].gain >= threshold.rival_promise * suspect[0].gain) {
        heard[taken++] = (heard_t){0};
    }
    parallel(taken, hear_one,
             &(hearing_t){.without = fitted,
                          .setting = setting,
                          .evidence = evidence_again(fitted),
                          .suspect = suspect,
                          .heard = heard});
    suspects_free(suspect, count);
    qsort(heard, taken, sizeof *heard, by_gain);
    return taken;
}

/* The best one takes the chain's place. */
static bool add_best(listened_t *listened, fitted_chain_t *without, const probe_setting_t *setting) {
    double line_hz[LINES_MOST];
    heard_t heard[HEARD_MOST];
    const probe_setting_t here = fitted_chain_setting(without, setting, line_hz);
    const size_t count = together_hear(without, &here, heard, HEARD_MOST);
    size_t best = 0;
    while (best < count && heard[best].block->probe->shape) {
        best++;
    }
    const bool loud = best < count && heard[best].gain >= threshold.least_gain;
    if (loud) {
        fitted_chain_close(&listened->fitted);
        listened->fitted = heard[best].fitted;
        heard[best].fitted = (fitted_chain_t){0};
        listened->block[listened->count] = heard[best].block;
        listened->gain[listened->count++] = heard[best].gain;
    }
    for (size_t i = 0; i < count; i++) {
        heard_close(&heard[i]);
    }
    return loud;
}

static unsigned bits_of(const listened_t *listened) {
    const model_t *chain = &listened->fitted.imitation.chain;
    unsigned bits = 0;
    for (size_t b = 0; b < chain->blocks; b++) {
        for (size_t i = 0; i < listened->count; i++) {
            bits |= chain->block[b].block == listened->block[i] ? 1U << b : 0;
        }
    }
    return bits;
}

void together_listen(fitted_chain_t *from, const probe_setting_t *setting, size_t most, listened_t *listened) {
    *listened = (listened_t){0};
    bool more = add_best(listened, from, setting);
    while (more && listened->count < most && !progress_cancelled()) {
        more = add_best(listened, &listened->fitted, setting);
        if (more) {
            together_fit(&listened->fitted, bits_of(listened));
        }
    }
}

void listened_close(listened_t *listened) {
    fitted_chain_close(&listened->fitted);
    *listened = (listened_t){0};
}
