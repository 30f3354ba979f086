/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/evidence/probing.h"
#include "base/parallel.h"
#include "chain/catalogue.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PROBES_AT_ONCE = 16 };

/* The probing of one block. */
typedef struct {
    const search_problem_t *problem;
    const block_t *block;
    candidate_t best; /* block: NULL while no probe could be simulated */
    size_t tested;
    size_t first, some; /* of the block's probes, those that are tried together */
    candidate_t *trial;
    double (*value)[BLOCK_MAX_PARAMETERS];
} probing_t;

/* The next ones of a block's probes: their values. */
static void take_probes(probing_t *probing) {
    const probe_setting_t *setting = probing->problem->setting;
    for (probing->some = 0; probing->some < PROBES_AT_ONCE; probing->some++) {
        if (!candidate_probe(probing->block, setting, probing->first + probing->some, probing->value[probing->some])) {
            return;
        }
    }
}

static void simulate_probe(void *context, size_t index) {
    const probing_t *probing = context;
    candidate_create(probing->problem, probing->block, probing->value[index], &probing->trial[index]);
}

/* The tests of those that could be simulated. */
static void test_probes(probing_t *probing) {
    const evidence_t *evidence = probing->problem->evidence;
    double *signature[PROBES_AT_ONCE];
    evidence_test_t test[PROBES_AT_ONCE];
    size_t count = 0;
    for (size_t i = 0; i < probing->some; i++) {
        if (probing->trial[i].signature != NULL) {
            signature[count++] = probing->trial[i].signature;
        }
    }
    evidence_tests(evidence, count, signature, test);
    for (size_t i = probing->some; i-- > 0;) {
        candidate_t *trial = &probing->trial[i];
        if (trial->signature != NULL) {
            trial->test = test[--count];
            trial->likelihood = trial->test.amplitude < 0.0 && candidate_never_negative(probing->block)
                                    ? 0.0
                                    : evidence_likelihood(evidence, 1.0 - trial->test.explained);
        }
    }
}

/* How small it could be and still be seen. */
static void note_smallest(const search_problem_t *problem, const candidate_t *trial, candidate_t *best) {
    const evidence_test_t *test = &trial->test;
    if (test->own_part > threshold.imitated_part && test->own_um > 0.0) {
        const double amplitude = threshold.least_size * problem->noise->sigma_um / test->own_um;
        const double smallest = amplitude * samples_rms(evidence_samples(problem->evidence), trial->signature);
        if (smallest < best->smallest_um) {
            best->smallest_um = smallest;
            for (size_t p = 0; p < trial->block->parameters; p++) {
                const parameter_info_t *info = &trial->block->parameter[p];
                const parameter_t *parameter = &trial->model.block[trial->at].parameter[p];
                best->smallest_value[p] =
                    parameter->count > 0 ? parameter->value[0] * (info->proportional ? amplitude : 1.0) : 0.0;
            }
        }
    }
}

/* How good a start it is for the refinement, which begins with the probe as it is: as good as the likelihood that it
 * has then, or a part of what it would have with its amplitude. */
static double promise(const evidence_t *evidence, const candidate_t *trial) {
    const double a = trial->test.amplitude, part = 0.25 * trial->likelihood;
    return candidate_grows(trial->block) || a == 0.0
               ? trial->likelihood
               : fmax(part, evidence_likelihood(evidence, 1.0 - trial->test.explained * (2.0 * a - 1.0) / (a * a)));
}

static void keep_best(probing_t *probing, candidate_t *trial, candidate_t *smallest) {
    const evidence_t *evidence = probing->problem->evidence;
    if (trial->signature != NULL) {
        note_smallest(probing->problem, trial, smallest);
        probing->tested++;
    }
    if (trial->signature != NULL &&
        (probing->best.block == NULL || promise(evidence, trial) > promise(evidence, &probing->best))) {
        const candidate_t worse = probing->best;
        probing->best = *trial;
        *trial = worse;
    }
    candidate_free(trial);
}

static void probe(void *context, size_t index) {
    probing_t *probing = &((probing_t *)context)[index];
    candidate_t smallest = {.smallest_um = HUGE_VAL};
    probing->trial = allocate(PROBES_AT_ONCE, sizeof *probing->trial);
    probing->value = allocate(PROBES_AT_ONCE, sizeof *probing->value);
    for (take_probes(probing); probing->some > 0; take_probes(probing)) {
        parallel(probing->some, simulate_probe, probing);
        test_probes(probing);
        for (size_t i = 0; i < probing->some; i++) {
            keep_best(probing, &probing->trial[i], &smallest);
        }
        probing->first += probing->some;
    }
    probing->best.smallest_um = smallest.smallest_um;
    memcpy(probing->best.smallest_value, smallest.smallest_value, sizeof smallest.smallest_value);
    free(probing->trial);
    free(probing->value);
}

/* Whether the problem is about the block. */
static bool asked(const search_problem_t *problem, const block_t *block) {
    const ask_t question = evidence_question(problem->evidence);
    return block != problem->without && (probe_is_first(block->probe) || block == problem->richer) &&
           (question == ASK_ANYTHING || block->probe->shape == (question == ASK_SHAPES)) &&
           model_find(problem->baseline, block->name) == NULL;
}

void probe_blocks(const search_problem_t *problem, candidates_t *probed) {
    probing_t *probing = allocate(catalogue_count, sizeof *probing);
    size_t blocks = 0;
    for (size_t i = 0; i < catalogue_count; i++) {
        if (asked(problem, catalogue[i])) {
            probing[blocks++] = (probing_t){.problem = problem, .block = catalogue[i]};
        }
    }
    parallel(blocks, probe, probing);
    *probed = (candidates_t){.candidate = allocate(catalogue_count, sizeof(candidate_t))};
    for (size_t i = 0; i < blocks; i++) {
        probed->tested += probing[i].tested;
        if (probing[i].best.block != NULL) {
            probed->candidate[probed->count++] = probing[i].best;
        }
    }
    free(probing);
}

bool probe_block(const search_problem_t *problem, const block_t *block, candidate_t *best) {
    probing_t one = {.problem = problem, .block = block};
    probe(&one, 0);
    *best = one.best;
    return best->block != NULL;
}
