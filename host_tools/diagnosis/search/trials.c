/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/search/trials.h"
#include "base/parallel.h"
#include "chain/catalogue.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/evidence/probing.h"
#include "diagnosis/judgement/verdict.h"
#include "diagnosis/nuisance/hysteresis_numbers.h"
#include "diagnosis/search/attempt.h"
#include "diagnosis/search/contest.h"
#include "diagnosis/search/heard.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

enum { PROMISE_ITERATIONS = 8 };

static bool shape_found(const answer_t *answer) {
    for (size_t i = 0; i < answer->findings; i++) {
        if (answer->finding[i].shape) {
            return true;
        }
    }
    return false;
}

/* Of a model: what it leaves, raised by what its hysteresis may imitate. named: and by something that another shape can
 * imitate: a block that is a curve, or another shape than the given one. */
static double raised(const samples_t *samples, const model_t *model, bool named, double held) {
    const double price = threshold.hysteresis_number_price * (double)hysteresis_numbers_count(model) +
                         (named ? threshold.naming_margin : 0.0);
    return held * exp(price / (double)samples->held) *
           (1.0 + (named || hysteresis_imitates_curves(model) ? threshold.curve_handicap : 0.0));
}

/* What a diagnosis leaves of the held-out samples, raised where part of it could as well be another shape's, and where
 * it is not the whole answer. */
static double cost_of(const answer_t *answer, double held) {
    const question_t *question = answer->question;
    return raised(&question->samples, &answer->model,
                  shape_found(answer) || (question->model_given && answer->family != NULL), held) *
           (1.0 + (answer->remainder.structured ? threshold.incomplete_handicap : 0.0));
}

/* The search from one shape. */
typedef struct {
    const model_t *from;
    state_t state;
    failure_t refusal;
} trial_t;

/* The trial's answer takes the standing one's place if it is better. Frees the models of the other one. */
static void keep_one(state_t *state, const trial_t *trial, bool better) {
    answer_t worse = trial->state.answer;
    if (better) {
        worse = state->answer;
        state->answer = trial->state.answer;
        state->power = trial->state.power;
    }
    answer_free_models(&worse);
}

static void prepare(trial_t *trial, const state_t *state, const question_t *question, const model_t *from,
                    const family_t *family) {
    trial->from = from;
    trial->state = *state;
    trial->state.failure = &trial->refusal;
    state_begin(&trial->state, question, family);
}

/* The work goes on from where it is. */
static bool try_shape(state_t *state, trial_t *trial, const begin_t *begin) {
    const bool good = attempt_from(&trial->state, trial->from, begin);
    state->progress = trial->state.progress;
    state->left = trial->state.left;
    if (!good) {
        answer_free_models(&trial->state.answer);
    }
    return good;
}

/* The better answer stands. One of them may not apply. */
static void try_another(state_t *state, trial_t *trial, const begin_t *begin) {
    if (try_shape(state, trial, begin)) {
        const double cost = cost_of(&trial->state.answer, trial->state.power.held);
        keep_one(state, trial, cost < cost_of(&state->answer, state->power.held));
    }
}

void trial_without_the_first(state_t *state) {
    const answer_t *answer = &state->answer;
    if (!answer->remainder.structured || answer->findings == 0 || answer->finding[0].in_readings ||
        answer->finding[0].block->probe->shape || !hysteresis_numbers_few(hysteresis_numbers_count(&answer->model))) {
        return;
    }
    trial_t again;
    prepare(&again, state, answer->question, &answer->given, answer->family);
    again.state.without = answer->finding[0].block;
    try_another(state, &again, NULL);
}

/* By its best probe; NULL: none promises anything. */
static const block_t *most_promising_richer(const state_t *state) {
    const answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    failure_t refusal;
    evidence_t *evidence = evidence_open(&answer->model, &question->samples, &question->noise, &refusal);
    const search_problem_t problem = {
        .evidence = evidence, .noise = &question->noise, .baseline = &answer->model, .setting = &state->setting};
    const block_t *best = NULL;
    double most = threshold.least_likelihood;
    if (evidence == NULL) {
        return NULL;
    }
    evidence_ask(evidence, ASK_EFFECTS);
    for (size_t i = 0; i < catalogue_count; i++) {
        const block_t *block = catalogue[i];
        candidate_t candidate;
        if (block->probe != NULL && !probe_is_first(block->probe) && model_find(&answer->model, block->name) == NULL &&
            probe_block(&problem, block, &candidate)) {
            if (candidate.likelihood > most) {
                most = candidate.likelihood;
                best = block;
            }
            candidate_free(&candidate);
        }
    }
    evidence_close(evidence);
    return best;
}

/* Nothing is left but noise, or another shape of the hysteresis: beside it the operator leaves only noise, and without
 * it more. */
static bool explains_all(const state_t *state, const answer_t *with) {
    shape_t shape;
    if (!with->remainder.structured) {
        return true;
    }
    if (with->question->shape.whole) {
        return false;
    }
    state_ask_shape(state, &with->model, &shape);
    return shape.whole;
}

void trial_of_richer(state_t *state) {
    const answer_t *answer = &state->answer;
    const block_t *block = answer->remainder.structured ? most_promising_richer(state) : NULL;
    trial_t trial;
    if (block == NULL) {
        return;
    }
    prepare(&trial, state, answer->question, &answer->given, answer->family);
    trial.state.richer = block;
    if (try_shape(state, &trial, NULL)) {
        const answer_t *with = &trial.state.answer;
        keep_one(state, &trial, finding_of(with, block) != NULL && explains_all(&trial.state, with));
    }
}

/* Whether the operator leaves only noise beside it, or a hysteresis of few numbers less than without. */
static bool is_supported(const answer_t *with, const heard_t *heard) {
    return heard->shape.whole || with->held_out_percent < with->baseline_held_out_percent;
}

/* Whether the position is likelier beside it than beside what was found, or samples that no fit saw miss it there. */
static bool is_better(const state_t *state, const heard_t *heard) {
    shape_t found;
    state_ask_shape(state, &state->answer.model, &found);
    return !found.fitted || 2.0 * (heard->shape.log_evidence - found.log_evidence) > threshold.naming_margin ||
           found.operator_percent > threshold.clearly_more * heard->shape.operator_percent;
}

void trial_of_heard(state_t *state) {
    answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    trial_t trial;
    heard_t heard;
    if (!answer->remainder.structured || !question->shape.fitted || question->shape.silent) {
        return;
    }
    heard_listen(state, &heard);
    if (heard.count > 0 && is_better(state, &heard)) {
        prepare(&trial, state, question, &answer->given, answer->family);
        if (attempt_with(&trial.state, trial.from, &heard)) {
            keep_one(state, &trial, is_supported(&trial.state.answer, &heard));
        } else {
            answer_free_models(&trial.state.answer);
        }
    }
    heard_free(&heard);
}

/* What a shape can be expected to leave of the held-out samples, by two measures of which the smaller one counts. */
typedef struct {
    const state_t *first; /* the answer from the first shape */
    const baseline_t *baseline;
    size_t from;    /* of the shapes, the first that may be tried */
    double *least;  /* of each shape */
    model_t *begin; /* of each: it as it was fitted beside what was found, if that leaves the least; else empty */
    bool together;  /* with what was found; else without */
} promises_t;

void baseline_put_into(baseline_t *shape, const model_t *chain) {
    model_t model;
    chain_with_hysteresis_of(&shape->model, chain, &model);
    model_free(&shape->model);
    shape->model = model;
}

void chain_with_hysteresis_of(const model_t *from, const model_t *chain, model_t *model) {
    model_t other;
    model_copy(model, chain);
    model_copy_place(&other, from, PLACE_HYSTERESIS);
    model_block_t *one = &model->block[hysteresis_index(model)], *two = &other.block[hysteresis_index(&other)];
    const model_block_t was = *one;
    *one = *two;
    *two = was;
    model_free(&other);
}

static void remove_found(const answer_t *answer, bool curves_only, model_t *model) {
    for (size_t b = model->blocks; b-- > 0;) {
        const finding_t *finding = finding_of(answer, model->block[b].block);
        if (finding != NULL && (finding->shape || !curves_only)) {
            model_remove(model, b);
        }
    }
}

/* What was found, but for curves, and this shape, fitted together. model: gets the shape, with or without that; to be
 * freed. */
static double left_beside_found(const state_t *first, const model_t *shape, bool together, model_t *model) {
    const answer_t *answer = &first->answer;
    joint_power_t power;
    failure_t refusal;
    chain_with_hysteresis_of(shape, &answer->model, model);
    model_without_noise(model);
    remove_found(answer, true, model);
    const bool good = joint_fit(&answer->question->samples, &answer->question->noise, model,
                                blocks_fitted(answer, model), PROMISE_ITERATIONS, &power, &refusal);
    if (!together) {
        remove_found(answer, false, model);
    }
    return good ? power.held : HUGE_VAL;
}

/* Beside the best probe of every block, and beside what was found, fitted. */
static void find_promise(void *context, size_t index) {
    const promises_t *promises = context;
    const size_t shape = promises->from + index;
    const baseline_t *baseline = &promises->baseline[shape];
    const answer_t *answer = &promises->first->answer;
    model_t model;
    const double beside_probes =
        baseline_says(&answer->question->samples, &answer->question->noise, baseline->held) ? baseline->held : HUGE_VAL;
    const double linear = raised(&answer->question->samples, &baseline->model, shape_found(answer), beside_probes);
    const double beside_found =
        raised(&answer->question->samples, &baseline->model, false,
               left_beside_found(promises->first, &baseline->model, promises->together, &model));
    promises->least[shape] = fmin(linear, beside_found);
    if (beside_found < linear) {
        promises->begin[shape] = model;
    } else {
        model_free(&model);
    }
}

bool trial_leaves_nothing(const state_t *state, const baseline_t *first) {
    const answer_t *answer = &state->answer;
    return !answer->remainder.structured && !shape_found(answer) && !first->many_numbers &&
           excess(answer, state->power.held) < threshold.worth_another_shape;
}

/* Whether another shape may do better than the answer so far, by what that leaves and the other promises. */
static bool may_do_better(const state_t *state, double promise) {
    const answer_t *answer = &state->answer;
    const bool whole = !answer->remainder.structured && !hysteresis_imitates_curves(&answer->model) &&
                       excess(answer, state->power.held) <= threshold.little_more;
    return promise < (whole ? 1.0 : threshold.promising_shape) *
                         raised(&answer->question->samples, &answer->model, shape_found(answer), state->power.held);
}

/* The symmetric plane among them, if the last one is the free one; else none: shapes. */
static size_t symmetric_one(const baseline_t *baseline, size_t shapes) {
    const baseline_t *last = &baseline[shapes - 1];
    size_t shape = 0;
    while (shape < shapes &&
           !(last->many_numbers && baseline[shape].family == last->family && !baseline[shape].many_numbers)) {
        shape++;
    }
    return shape;
}

/* Of those that have not been tried; 0: of none. */
static size_t most_promising(const double *least, const bool *tried, size_t shapes) {
    size_t best = 0;
    for (size_t shape = 1; shape < shapes; shape++) {
        if (!tried[shape] && (best == 0 || least[shape] < least[best])) {
            best = shape;
        }
    }
    return best;
}

/* The blocks that were found, but for curves. Returns how many. */
static size_t blocks_of(const answer_t *answer, const block_t **block) {
    size_t count = 0;
    for (size_t f = 0; f < answer->findings; f++) {
        if (!answer->finding[f].shape && !answer->finding[f].in_readings) {
            block[count++] = answer->finding[f].block;
        }
    }
    return count;
}

/* The most promising first, as long as they may do better than the best so far. together: with what was found in the
 * chain from the beginning. */
static void try_others(state_t *state, const baseline_t *baseline, size_t shapes, bool together) {
    const answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    double least[TRIALS_MOST_SHAPES];
    bool tried[TRIALS_MOST_SHAPES] = {false};
    model_t begin[TRIALS_MOST_SHAPES] = {0};
    const size_t symmetric = symmetric_one(baseline, shapes), from = symmetric == 0 ? 0 : 1;
    const block_t *found[DIAGNOSIS_MOST_FINDINGS];
    const size_t blocks = together ? blocks_of(answer, found) : 0;
    promises_t promises = {
        .first = state, .baseline = baseline, .from = from, .least = least, .begin = begin, .together = together};
    parallel(shapes - from, find_promise, &promises);
    if (question->model_given && answer->remainder.structured) {
        least[1] = 0.0; /* the one that a search without a model begins with is tried in any case */
    }
    /* A free plane that promises no more than a symmetric one. What it has and the others have not is that it imitates
     * curves. */
    const bool for_curves_only = remainder_knows_noise(&question->samples, &question->noise) && symmetric < shapes &&
                                 least[shapes - 1] > threshold.better_plane * least[symmetric];
    for (size_t next = most_promising(least, tried, shapes); next > 0; next = most_promising(least, tried, shapes)) {
        tried[next] = true;
        if (may_do_better(state, least[next]) &&
            !(next == shapes - 1 && for_curves_only && !shape_found(&state->answer))) {
            trial_t trial;
            const begin_t elsewhere = {.model = &begin[next], .block = found, .blocks = blocks};
            prepare(&trial, state, answer->question, &baseline[next].model, baseline[next].family);
            try_another(state, &trial, begin[next].blocks > 0 ? &elsewhere : NULL);
        }
    }
    for (size_t shape = 0; shape < shapes; shape++) {
        model_free(&begin[shape]);
    }
}

void trials_of_others(state_t *state, const baseline_t *baseline, size_t shapes) {
    try_others(state, baseline, shapes, false);
}

/* Of the shapes, each fitted alone, the one that leaves least of the held-out samples. Returns its index; shapes: none
 * leaves clearly less than the answer. */
static size_t best_alone(const state_t *state, const baseline_t *baseline, size_t shapes, model_t *best,
                         joint_power_t *power) {
    const question_t *question = state->answer.question;
    size_t least = shapes;
    *power = (joint_power_t){.held = state->power.held / pow(threshold.clearly_more, 2.0)};
    *best = (model_t){0};
    for (size_t shape = 0; shape < shapes; shape++) {
        model_t model;
        joint_power_t left;
        failure_t refusal;
        model_copy(&model, &baseline[shape].model);
        if (joint_fit(&question->samples, &question->noise, &model, 0, PROMISE_ITERATIONS, &left, &refusal) &&
            left.held < power->held) {
            const model_t worse = *best;
            *best = model;
            model = worse;
            *power = left;
            least = shape;
        }
        model_free(&model);
    }
    return least;
}

bool trial_of_shapes_alone(state_t *state, const baseline_t *baseline, size_t shapes) {
    answer_t *answer = &state->answer;
    model_t best;
    joint_power_t power;
    const size_t shape = best_alone(state, baseline, shapes, &best, &power);
    if (shape == shapes) {
        return true;
    }
    state_take(state, &best, &power);
    answer->family = baseline[shape].family;
    model_free(&answer->baseline);
    model_copy(&answer->baseline, &answer->model);
    const bool good =
        state_measure(state, &answer->model, &answer->nrmse_percent, &answer->held_out_percent) && verdict_look(state);
    answer->baseline_nrmse_percent = answer->nrmse_percent;
    answer->baseline_held_out_percent = answer->held_out_percent;
    answer->remainder.structured = false; /* it is another shape */
    return good;
}

/* The noise that a strong mode rings into the rests is none. */
static void hear_rests(const contest_winner_t *winner, question_t *question, const state_t *state) {
    failure_t refusal;
    noise_t noise;
    double *left = samples_column(&question->samples);
    if (question->noise.at_rest && !question->coarse &&
        samples_simulate(&question->samples, &winner->model, left, &refusal)) {
        samples_residual(&question->samples, left, left);
        if (noise_at_rest(&question->samples, left, state->line_hz, state->setting.lines, &noise)) {
            question->noise = noise;
        }
    }
    free(left);
}

/* The search from the winner, on the samples as the contest shared them out. Returns whether its answer stands. */
static bool try_winner(state_t *state, const baseline_t *bank, question_t *shared, const contest_winner_t *winner) {
    trial_t trial;
    const begin_t begin = {.model = &winner->model, .block = winner->block, .blocks = winner->blocks};
    bool better = false;
    prepare(&trial, state, shared, &bank->model, bank->family);
    hear_rests(winner, shared, &trial.state);
    if (try_shape(state, &trial, &begin)) {
        better = trial.state.answer.held_out_percent < sqrt(threshold.contest_worth) * state->answer.held_out_percent;
        keep_one(state, &trial, better);
    }
    return better;
}

/* A contest has a bank in the chain, whatever the hysteresis is. The first of a list is not tried. */
static void try_shapes_of_winner(state_t *state, const baseline_t *baseline, size_t shapes) {
    const family_t *bank = state->answer.family;
    baseline_t list[TRIALS_MOST_SHAPES];
    size_t count = 1;
    list[0] = baseline[0];
    for (size_t shape = 0; shape < shapes; shape++) {
        if (baseline[shape].family == bank) {
            list[0] = baseline[shape];
        } else {
            list[count++] = baseline[shape];
        }
    }
    try_others(state, list, count, true);
}

void trial_of_contest(state_t *state, const model_t *chain, const baseline_t *baseline, size_t shapes) {
    const answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    baseline_t bank, rough;
    contest_winner_t winner;
    failure_t refusal;
    bool won = false;
    if (!answer->remainder.structured || !question->shape.fitted || question->shape.whole ||
        excess(answer, state->power.held) < threshold.worth_contest ||
        !baseline_bank(question->recordings, question->samples.count, &bank, &rough, &refusal)) {
        return;
    }
    if (chain != NULL) {
        baseline_put_into(&bank, chain);
    }
    question_t *shared = question_share_ends(question);
    if (contest(&shared->samples, &state->setting, &answer->model, &bank.model, &winner)) {
        won = try_winner(state, &bank, shared, &winner);
        model_free(&winner.model);
    }
    if (!won) {
        question_free_shared(shared);
    } else if (chain == NULL) {
        try_shapes_of_winner(state, baseline, shapes);
    }
    baseline_free(&bank, 1);
    baseline_free(&rough, 1);
}

bool trial_of_first(state_t *state, const baseline_t *from) {
    trial_t first;
    prepare(&first, state, state->answer.question, &from->model, from->family);
    if (!try_shape(state, &first, NULL)) {
        *state->failure = first.refusal;
        return false;
    }
    state->answer = first.state.answer;
    state->power = first.state.power;
    return true;
}
