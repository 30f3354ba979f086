/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/between.h"
#include "chain/catalogue.h"
#include "diagnosis/evidence/joint_fit.h"
#include "diagnosis/evidence/probing.h"
#include "numerics/golden_section.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

/* About the best instant the search goes so many parts of a sample. */
enum { STEPS = 10 /* to a hundredth of half a sample */ };
static const double step_of_search = 0.5;

typedef struct {
    question_t *question;
    const model_t *model;
    const block_t *block; /* the best one's, and its numbers */
    double value[BLOCK_MAX_PARAMETERS];
} asked_t;

static void take(question_t *question, bool held, double since) {
    for (size_t i = 0; i < question->samples.count; i++) {
        question->recordings[i].held = held;
        question->recordings[i].held_since = since;
    }
}

/* A block that does nothing quick is no reason: all readings are alike to it. */
static bool moves_between_samples(const block_t *block) {
    return block->smooths || block->lag != LAG_NONE;
}

/* 2 log likelihood of the position with the best block, as the recordings are now; -HUGE_VAL: none can be simulated.
 * known: only that block, from its numbers. */
static double likelihood(asked_t *asked, bool known) {
    question_t *question = asked->question;
    joint_power_t power;
    failure_t ignored;
    double best = 0.0;
    evidence_t *evidence = evidence_open(asked->model, &question->samples, &question->noise, &ignored);
    if (evidence == NULL || !joint_power(&question->samples, &question->noise, asked->model, &power, &ignored)) {
        evidence_close(evidence);
        return -HUGE_VAL;
    }
    const search_problem_t problem = {
        .evidence = evidence, .noise = &question->noise, .baseline = asked->model, .setting = &question->setting};
    evidence_ask(evidence, ASK_EFFECTS);
    if (known) {
        candidate_t one;
        candidate_create(&problem, asked->block, asked->value, &one);
        candidate_refine(&problem, &one);
        best = one.likelihood;
        candidate_free(&one);
    } else {
        for (size_t i = 0; i < catalogue_count; i++) {
            candidate_t one;
            if (moves_between_samples(catalogue[i]) && probe_is_first(catalogue[i]->probe) &&
                model_find(asked->model, catalogue[i]->name) == NULL && probe_block(&problem, catalogue[i], &one)) {
                candidate_refine(&problem, &one);
                if (one.likelihood > best) {
                    best = one.likelihood;
                    asked->block = one.block;
                    candidate_value(&one.model.block[one.at], asked->value);
                }
                candidate_free(&one);
            }
        }
    }
    evidence_close(evidence);
    return best - (double)question->samples.fitted * log(power.fitted);
}

static bool unlikelihood_since(void *context, double since, double *value) {
    asked_t *asked = context;
    take(asked->question, true, since);
    *value = -likelihood(asked, true);
    return isfinite(*value);
}

/* When the position was read, in parts of a sample. */
static double search_since(asked_t *asked, double from) {
    const double low = fmax(0.0, from - step_of_search), high = fmin(1.0, from + step_of_search);
    double since = from;
    if (!golden_section(unlikelihood_since, asked, low, high, STEPS, &since)) {
        return from;
    }
    return since < threshold.least_lag_samples ? 0.0 : since > 1.0 - threshold.least_lag_samples ? 1.0 : since;
}

/* As they came: held_since is 0 where the header does not say it. */
static void take_back(question_t *question, const bool *was_held) {
    for (size_t i = 0; i < question->samples.count; i++) {
        question->recordings[i].held = was_held[i];
        question->recordings[i].held_since = 0.0;
    }
}

/* Held, if that is likelier; then when the position was read. */
static bool choose(question_t *question, const model_t *model, bool any_held) {
    static const double instants[] = {0.0, 0.5, 1.0};
    asked_t asked = {.question = question, .model = model}, best = asked;
    double most = -HUGE_VAL, since = 0.0;
    take(question, false, 0.0);
    const double smooth = any_held ? -HUGE_VAL : likelihood(&asked, false);
    for (size_t i = 0; i < sizeof instants / sizeof instants[0]; i++) {
        take(question, true, instants[i]);
        asked.block = NULL;
        const double here = likelihood(&asked, false);
        if (asked.block != NULL && here > most) {
            most = here;
            since = instants[i];
            best = asked;
        }
    }
    if (best.block == NULL || !(most > smooth + threshold.naming_margin)) {
        return false;
    }
    take(question, true, search_since(&best, since));
    return true;
}

void between_choose(question_t *question, const model_t *model) {
    if (!question->seen.may_be_held ||
        (question->shape.fitted && question->shape.silent && question->seen.rings == 0)) {
        return;
    }
    bool *was_held = allocate(question->samples.count, sizeof *was_held), any_held = false;
    for (size_t i = 0; i < question->samples.count; i++) {
        was_held[i] = question->recordings[i].held;
        any_held = any_held || was_held[i];
    }
    question->held_by_likelihood = choose(question, model, any_held);
    if (!question->held_by_likelihood) {
        take_back(question, was_held);
    }
    free(was_held);
}
