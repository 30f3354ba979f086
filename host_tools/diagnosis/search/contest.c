/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/search/contest.h"
#include "base/parallel.h"
#include "chain/catalogue.h"
#include "diagnosis/evidence/candidate.h"
#include "diagnosis/search/windows.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* All starts are fitted by so many iterations; then the best ones of them, of each block at most so many. */
enum { FIRST_ITERATIONS = 2, LAST_ITERATIONS = 8, MOST_LAST = 8, MOST_OF_A_BLOCK = 2 };

static const noise_t white = {.sigma_um = 1.0, .rms_um = 1.0};

/* One block from one of its probes, beside those that have won before. */
typedef struct {
    contest_winner_t entry;
    double left; /* HUGE_VAL: it cannot be simulated */
} start_t;

typedef struct {
    start_t *start;
    size_t count;
} starts_t;

typedef struct {
    const samples_t *samples;
    size_t iterations;
    start_t *start;
} round_t;

static void fit_start(void *context, size_t index) {
    const round_t *round = context;
    start_t *start = &round->start[index];
    joint_power_t power;
    failure_t refusal;
    const bool good =
        isfinite(start->left) && joint_fit(round->samples, &white, &start->entry.model,
                                           joint_blocks(&start->entry.model, start->entry.block, start->entry.blocks),
                                           round->iterations, &power, &refusal);
    start->left = good ? power.fitted : HUGE_VAL;
}

static int by_left(const void *one, const void *other) {
    const double a = ((const start_t *)one)->left, b = ((const start_t *)other)->left;
    return (a > b) - (a < b);
}

static void fit_some(const samples_t *samples, size_t iterations, start_t *start, size_t count) {
    parallel(count, fit_start, &(round_t){.samples = samples, .iterations = iterations, .start = start});
    if (start != NULL) {
        qsort(start, count, sizeof *start, by_left);
    }
}

/* The last block of a list, in a chain that has the others, from every probe. */
static void add_starts(const probe_setting_t *setting, const model_t *chain, const contest_winner_t *list,
                       starts_t *starts) {
    const block_t *const block = list->block[list->blocks - 1];
    double value[BLOCK_MAX_PARAMETERS];
    probe_setting_t strong = *setting;
    strong.strong = true;
    for (size_t probe = 0; candidate_probe(block, &strong, probe, value); probe++) {
        starts->start = reallocate(starts->start, starts->count + 1, sizeof(start_t));
        start_t *added = &starts->start[starts->count++];
        *added = (start_t){.entry = *list};
        (void)candidate_insert(&added->entry.model, chain, block, value);
    }
}

static const block_t *last_of(const start_t *start) {
    return start->entry.block[start->entry.blocks - 1];
}

/* The best ones first, but of each block only so many. */
static size_t choose_last(start_t *start, size_t count) {
    size_t chosen = 0;
    for (size_t i = 0; i < count && chosen < MOST_LAST; i++) {
        size_t of_block = 0;
        for (size_t k = 0; k < chosen; k++) {
            of_block += last_of(&start[k]) == last_of(&start[i]) ? 1 : 0;
        }
        if (of_block < MOST_OF_A_BLOCK) {
            const start_t better = start[i];
            start[i] = start[chosen];
            start[chosen++] = better;
        }
    }
    return chosen;
}

/* The best one comes first. */
static void fit_starts(const samples_t *samples, const starts_t *starts) {
    fit_some(samples, FIRST_ITERATIONS, starts->start, starts->count);
    fit_some(samples, LAST_ITERATIONS, starts->start, choose_last(starts->start, starts->count));
}

static void free_starts(starts_t *starts, size_t from) {
    for (size_t i = from; i < starts->count; i++) {
        model_free(&starts->start[i].entry.model);
    }
    free(starts->start);
}

/* Of all blocks that this chain does not have the one that leaves least beside what has won before. false: that is not
 * less than a part of `power`, or a shape. *left is what it leaves. */
static bool find_next(const samples_t *samples, const probe_setting_t *setting, const model_t *chain,
                      contest_winner_t *winner, double power, double *left) {
    starts_t starts = {0};
    contest_winner_t list = {.blocks = winner->blocks + 1};
    memcpy(list.block, winner->block, sizeof list.block);
    for (size_t i = 0; i < catalogue_count; i++) {
        if (probe_is_first(catalogue[i]->probe) && model_find(chain, catalogue[i]->name) == NULL) {
            list.block[list.blocks - 1] = catalogue[i];
            add_starts(setting, chain, &list, &starts);
        }
    }
    fit_starts(samples, &starts);
    const start_t *best = starts.start;
    const bool won = starts.count > 0 && best->left < threshold.contest_worth * power &&
                     (winner->blocks > 0 || !last_of(best)->probe->shape);
    if (won) {
        *left = best->left;
        *winner = best->entry;
    }
    free_starts(&starts, won ? 1 : 0);
    return won;
}

static bool find_winner(const samples_t *samples, const probe_setting_t *setting, const model_t *standing,
                        const model_t *chain, contest_winner_t *winner) {
    joint_power_t power;
    failure_t refusal;
    double left;
    *winner = (contest_winner_t){0};
    if (!joint_power(samples, &white, standing, &power, &refusal) ||
        !find_next(samples, setting, chain, winner, power.fitted, &left)) {
        return false;
    }
    for (bool goes_on = true; goes_on && winner->blocks < CONTEST_MOST_BLOCKS;) {
        model_t before = winner->model;
        goes_on = find_next(samples, setting, &before, winner, left, &left);
        if (goes_on) {
            model_free(&before);
        }
    }
    return true;
}

bool contest(const samples_t *samples, const probe_setting_t *setting, const model_t *standing, const model_t *chain,
             contest_winner_t *winner) {
    windows_t windows;
    windows_open(&windows, samples, chain, (size_t)threshold.contest_samples);
    const bool won = find_winner(windows.samples, setting, standing, chain, winner);
    windows_close(&windows);
    return won;
}

bool contest_fit(const samples_t *samples, const probe_setting_t *setting, const model_t *chain, const block_t *block,
                 contest_winner_t *fitted) {
    starts_t starts = {0};
    add_starts(setting, chain, &(contest_winner_t){.blocks = 1, .block = {block}}, &starts);
    fit_starts(samples, &starts);
    const bool good = starts.count > 0 && isfinite(starts.start[0].left);
    if (good) {
        *fitted = starts.start[0].entry;
    }
    free_starts(&starts, good ? 1 : 0);
    return good;
}

bool contest_stands(const samples_t *samples, const probe_setting_t *setting, const model_t *standing,
                    const model_t *chain, const block_t *block) {
    joint_power_t power;
    failure_t refusal;
    starts_t starts = {0};
    add_starts(setting, chain, &(contest_winner_t){.blocks = 1, .block = {block}}, &starts);
    fit_starts(samples, &starts);
    const bool stands = starts.count > 0 && joint_power(samples, &white, standing, &power, &refusal) &&
                        threshold.contest_worth * starts.start[0].left < power.fitted;
    free_starts(&starts, 0);
    return stands;
}
