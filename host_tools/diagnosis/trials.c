/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/trials.h"
#include "base/parallel.h"
#include "diagnosis/contest.h"
#include "diagnosis/evidence/candidate.h"
#include "diagnosis/findings.h"
#include "diagnosis/nuisance/hysteresis_numbers.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

enum { PROMISE_ITERATIONS = 8 };

static bool shape_found(const diagnosis_t *d) {
    for (size_t i = 0; i < d->findings; i++) {
        if (d->finding[i].shape) {
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
static double cost_of(const diagnosis_t *d, double held) {
    return raised(&d->samples, &d->model, shape_found(d) || (d->model_given && d->family != NULL), held) *
           (1.0 + (d->remainder.structured ? threshold.incomplete_handicap : 0.0));
}

/* The search from one shape. */
typedef struct {
    const model_t *from;
    attempt_t attempt;
    diagnosis_t diagnosis;
    failure_t refusal;
} trial_t;

/* The trial's answer takes the standing one's place if it is better. Frees the models of the other one, and returns its
 * samples. */
static samples_t keep_one(attempt_t *job, const trial_t *trial, bool better) {
    diagnosis_t worse = trial->diagnosis;
    if (better) {
        worse = *job->diagnosis;
        *job->diagnosis = trial->diagnosis;
        job->power = trial->attempt.power;
    }
    diagnosis_free_models(&worse);
    return worse.samples;
}

/* What all have in common is in `job`. */
static void prepare(trial_t *trial, const attempt_t *job, const model_t *from, const family_t *family) {
    trial->from = from;
    trial->attempt = *job;
    trial->attempt.diagnosis = &trial->diagnosis;
    trial->attempt.failure = &trial->refusal;
    trial->attempt.setting.line_hz = trial->attempt.line_hz;
    trial->attempt.found_um = 0.0;
    trial->diagnosis = (diagnosis_t){.recordings = job->diagnosis->recordings,
                                     .samples = job->diagnosis->samples,
                                     .noise = job->diagnosis->noise,
                                     .shape = job->diagnosis->shape,
                                     .model_given = job->diagnosis->model_given,
                                     .family = family};
}

/* The work goes on from where it is. */
static bool try_shape(attempt_t *job, trial_t *trial) {
    const bool good = attempt_from(&trial->attempt, trial->from);
    job->progress = trial->attempt.progress;
    job->left = trial->attempt.left;
    if (!good) {
        diagnosis_free_models(&trial->diagnosis);
    }
    return good;
}

/* The better answer stands. One of them may not apply. */
static void try_another(attempt_t *job, trial_t *trial) {
    if (try_shape(job, trial)) {
        const double cost = cost_of(&trial->diagnosis, trial->attempt.power.held);
        (void)keep_one(job, trial, cost < cost_of(job->diagnosis, job->power.held));
    }
}

void trial_without_the_first(attempt_t *job) {
    const diagnosis_t *d = job->diagnosis;
    if (!d->remainder.structured || d->findings == 0 || d->finding[0].in_readings ||
        d->finding[0].block->probe->shape || !hysteresis_numbers_few(hysteresis_numbers_count(&d->model))) {
        return;
    }
    trial_t again;
    prepare(&again, job, &d->given, d->family);
    again.attempt.without = d->finding[0].block;
    try_another(job, &again);
}

static bool found_like(const diagnosis_t *d, const block_t *block) {
    for (size_t f = 0; f < d->findings; f++) {
        if (block_same_group(d->finding[f].block, block)) {
            return true;
        }
    }
    return false;
}

/* Natural units, beside the universal operator. */
static double log_evidence_of(const attempt_t *job, const diagnosis_t *d) {
    shape_t shape;
    shape_ask(&d->samples, &d->model, &job->setting, job->step_um, false, &shape);
    return shape.fitted ? shape.log_evidence : -HUGE_VAL;
}

void trial_of_heard(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    trial_t trial;
    suspect_t heard;
    if (!d->remainder.structured || !d->shape.fitted || d->shape.silent || d->shape.loudest->probe->shape ||
        found_like(d, d->shape.loudest) || !loudest_of(&job->beside, &job->setting, &heard)) {
        return;
    }
    prepare(&trial, job, &d->given, d->family);
    if (!heard.block->probe->shape && !found_like(d, heard.block) && attempt_with(&trial.attempt, trial.from, &heard)) {
        const diagnosis_t *other = &trial.diagnosis;
        (void)keep_one(job, &trial,
                       other->held_out_percent < other->baseline_held_out_percent &&
                           2.0 * (log_evidence_of(job, other) - log_evidence_of(job, d)) > threshold.naming_margin);
    } else {
        diagnosis_free_models(&trial.diagnosis);
    }
    model_free(&heard.chain);
}

/* What a shape can be expected to leave of the held-out samples, by two measures of which the smaller one counts. */
typedef struct {
    const attempt_t *first; /* the answer from the first shape */
    const baseline_t *baseline;
    size_t from;    /* of the shapes, the first that may be tried */
    double *least;  /* of each shape */
    model_t *begin; /* of each: it as it was fitted beside what was found, without that, if that leaves the least */
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

static void remove_found(const diagnosis_t *d, bool curves_only, model_t *model) {
    for (size_t b = model->blocks; b-- > 0;) {
        const finding_t *finding = finding_of(d, model->block[b].block);
        if (finding != NULL && (finding->shape || !curves_only)) {
            model_remove(model, b);
        }
    }
}

/* What was found, but for curves, and this shape, fitted together. model: gets the shape, to be freed. */
static double left_beside_found(const attempt_t *first, const model_t *shape, model_t *model) {
    const diagnosis_t *d = first->diagnosis;
    joint_power_t power;
    failure_t refusal;
    chain_with_hysteresis_of(shape, &d->model, model);
    attempt_without_noise(model);
    remove_found(d, true, model);
    const bool good =
        joint_fit(&d->samples, &d->noise, model, attempt_blocks_fitted(d, model), PROMISE_ITERATIONS, &power, &refusal);
    remove_found(d, false, model);
    return good ? power.held : HUGE_VAL;
}

/* Beside the best probe of every block, and beside what was found, fitted. */
static void find_promise(void *context, size_t index) {
    const promises_t *promises = context;
    const size_t shape = promises->from + index;
    const baseline_t *baseline = &promises->baseline[shape];
    const diagnosis_t *d = promises->first->diagnosis;
    model_t model;
    const double beside_probes = baseline_says(&d->samples, &d->noise, baseline->held) ? baseline->held : HUGE_VAL;
    const double linear = raised(&d->samples, &baseline->model, shape_found(d), beside_probes);
    const double beside_found =
        raised(&d->samples, &baseline->model, false, left_beside_found(promises->first, &baseline->model, &model));
    promises->least[shape] = fmin(linear, beside_found);
    if (beside_found < linear) {
        promises->begin[shape] = model;
    } else {
        model_free(&model);
    }
}

bool trial_leaves_nothing(const attempt_t *job, const baseline_t *first) {
    const diagnosis_t *d = job->diagnosis;
    return !d->remainder.structured && !shape_found(d) && !first->many_numbers &&
           attempt_excess(d, job->power.held) < threshold.worth_another_shape;
}

/* Whether another shape may do better than the answer so far, by what that leaves and the other promises. */
static bool may_do_better(const attempt_t *job, double promise) {
    const diagnosis_t *d = job->diagnosis;
    const bool whole = !d->remainder.structured && !hysteresis_imitates_curves(&d->model) &&
                       attempt_excess(d, job->power.held) <= threshold.little_more;
    return promise <
           (whole ? 1.0 : threshold.promising_shape) * raised(&d->samples, &d->model, shape_found(d), job->power.held);
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

/* The most promising first, as long as they may do better than the best so far. */
void trials_of_others(attempt_t *job, const baseline_t *baseline, size_t shapes) {
    const diagnosis_t *d = job->diagnosis;
    double least[TRIALS_MOST_SHAPES];
    bool tried[TRIALS_MOST_SHAPES] = {false};
    model_t begin[TRIALS_MOST_SHAPES] = {0};
    const size_t symmetric = symmetric_one(baseline, shapes), from = symmetric == 0 ? 0 : 1;
    promises_t promises = {.first = job, .baseline = baseline, .from = from, .least = least, .begin = begin};
    parallel(shapes - from, find_promise, &promises);
    if (d->model_given && d->remainder.structured) {
        least[1] = 0.0; /* the one that a search without a model begins with is tried in any case */
    }
    /* A free plane that promises no more than a symmetric one. What it has and the others have not is that it imitates
     * curves. */
    const bool for_curves_only = remainder_knows_noise(&d->samples, &d->noise) && symmetric < shapes &&
                                 least[shapes - 1] > threshold.better_plane * least[symmetric];
    for (size_t next = most_promising(least, tried, shapes); next > 0; next = most_promising(least, tried, shapes)) {
        tried[next] = true;
        if (may_do_better(job, least[next]) &&
            !(next == shapes - 1 && for_curves_only && !shape_found(job->diagnosis))) {
            trial_t trial;
            prepare(&trial, job, &baseline[next].model, baseline[next].family);
            trial.attempt.begin = begin[next].blocks > 0 ? &begin[next] : NULL;
            try_another(job, &trial);
        }
    }
    for (size_t shape = 0; shape < shapes; shape++) {
        model_free(&begin[shape]);
    }
}

/* With the winner's hysteresis, the block of it only known. The noise that a strong mode rings into the rests is none.
 */
static void begin_from_winner(trial_t *trial, const contest_winner_t *winner, double *known_value, model_t *begin) {
    attempt_t *attempt = &trial->attempt;
    const diagnosis_t *d = &trial->diagnosis;
    failure_t refusal;
    noise_t noise;
    double *left = samples_column(&d->samples);
    candidate_value(&winner->model.block[winner->at], known_value);
    attempt->setting.known = winner->block;
    attempt->setting.known_value = known_value;
    model_copy(begin, &winner->model);
    model_remove(begin, winner->at);
    attempt->begin = begin;
    if (d->noise.at_rest && !attempt->coarse && samples_simulate(&d->samples, &winner->model, left, &refusal)) {
        samples_residual(&d->samples, left, left);
        if (noise_at_rest(&d->samples, left, attempt->line_hz, attempt->setting.lines, &noise)) {
            trial->diagnosis.noise = noise;
        }
    }
    free(left);
}

/* The search from the winner's hysteresis, on the samples as the contest shared them out. */
static void try_winner(attempt_t *job, const baseline_t *bank, const samples_t *shared,
                       const contest_winner_t *winner) {
    diagnosis_t *d = job->diagnosis;
    trial_t trial;
    model_t begin;
    double known_value[BLOCK_MAX_PARAMETERS];
    prepare(&trial, job, &bank->model, bank->family);
    trial.diagnosis.samples = *shared;
    begin_from_winner(&trial, winner, known_value, &begin);
    if (try_shape(job, &trial)) {
        const bool better = trial.diagnosis.held_out_percent < sqrt(threshold.contest_worth) * d->held_out_percent;
        free(keep_one(job, &trial, better).part);
    } else {
        free(shared->part);
    }
    model_free(&begin);
}

void trial_of_contest(attempt_t *job, const model_t *chain) {
    diagnosis_t *d = job->diagnosis;
    baseline_t bank, rough;
    contest_winner_t winner;
    failure_t refusal;
    if (!d->remainder.structured || !d->shape.fitted || d->shape.whole ||
        attempt_excess(d, job->power.held) < threshold.worth_contest ||
        !baseline_bank(d->recordings, d->samples.count, &bank, &rough, &refusal)) {
        return;
    }
    if (chain != NULL) {
        baseline_put_into(&bank, chain);
    }
    const samples_t shared = samples_share_ends(&d->samples);
    if (contest(&shared, &job->setting, &d->model, &bank.model, &winner)) {
        try_winner(job, &bank, &shared, &winner);
        model_free(&winner.model);
    } else {
        free(shared.part);
    }
    baseline_free(&bank, 1);
    baseline_free(&rough, 1);
}

bool trial_of_first(attempt_t *job, const baseline_t *from) {
    trial_t first;
    prepare(&first, job, &from->model, from->family);
    if (!try_shape(job, &first)) {
        *job->failure = first.refusal;
        return false;
    }
    *job->diagnosis = first.diagnosis;
    job->power = first.attempt.power;
    return true;
}
