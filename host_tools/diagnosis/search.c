/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "search.h"
#include "catalogue.h"
#include "electrical.h"
#include "parallel.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Candidates whose best probe explains at least this part of what the best of all explains are refined; and then at
 * least this part, or so close, are fitted together with the hysteresis. */
static const double worth_refining = 0.2, worth_fitting = 0.5, close_likelihood = 60.0;
enum { MOST_REFINED = 8, MOST_FITTED = 4, FIT_ITERATIONS = 3, PROBES_AT_ONCE = 16 };
/* And at least this much: nothing below it is significant. */
static const double least_likelihood = 15.0;
const double search_least_size = 0.08;
/* What J leaves less than this part of is imitated: its size would be a matter of the model's last digits. */
static const double least_own_part = 1e-3;
/* Of a number, in 2 log likelihood: about the logarithm of the number of samples. */
const double search_number_price = 10.0;

/* Where a block goes in a chain: behind the last block of its place or an earlier one. */
static size_t place_in_chain(const model_t *model, const block_t *block) {
    size_t at = 0;
    while (at < model->blocks && model->block[at].block->place <= block->place) {
        at++;
    }
    return at;
}

/* The baseline with the block inserted; value: one number a parameter, arrays absent. */
static void insert_block(model_t *model, const model_t *baseline, const block_t *block, const double *value) {
    const size_t at = place_in_chain(baseline, block);
    model_block_t inserted;
    model_copy(model, baseline);
    model_append(model, block);
    inserted = model->block[model->blocks - 1];
    memmove(&model->block[at + 1], &model->block[at], (model->blocks - 1 - at) * sizeof model->block[0]);
    model->block[at] = inserted;
    for (size_t p = 0; p < block->parameters; p++) {
        if (!block->parameter[p].array) {
            model->block[at].parameter[p].value[0] = value[p];
        }
    }
}

static bool searched_in_proportion(const block_t *block, size_t parameter) {
    return (block->probe->searched >> parameter & 1U) != 0 && block->parameter[parameter].proportional;
}

/* A parameter that the effect is proportional to takes the amplitude that the linear test has found. */
static void start_from_amplitude(candidate_t *candidate) {
    const block_t *block = candidate->block;
    model_block_t *inserted = &candidate->model.block[candidate->at];
    for (size_t p = 0; p < block->parameters; p++) {
        const parameter_info_t *info = &block->parameter[p];
        double *value = inserted->parameter[p].value;
        if (searched_in_proportion(block, p)) {
            *value = fmax(info->low, fmin(info->high, *value * candidate->test.amplitude));
        }
    }
}

static void refine_candidate(const evidence_t *evidence, candidate_t *candidate) {
    start_from_amplitude(candidate);
    const double left = evidence_refine(evidence, &candidate->model, candidate->at);
    free(candidate->signature);
    candidate->signature = evidence_signature(evidence, &candidate->model, candidate->at);
    if (candidate->signature != NULL && isfinite(left)) {
        candidate->test = evidence_test(evidence, candidate->signature);
        candidate->likelihood = evidence_likelihood(evidence, left);
    } else { /* not even where it started: the chain refuses these numbers, or runs away */
        candidate->test = (evidence_test_t){0};
        candidate->likelihood = 0.0;
    }
}

double search_price(const block_t *block) {
    size_t numbers = 0;
    for (unsigned bits = block->probe->searched; bits != 0; bits >>= 1) {
        numbers += bits & 1U;
    }
    return search_number_price * (double)numbers;
}

/* 2 log likelihood that is left when each searched number has been paid for: one more makes any block fit better. */
static double merit(const candidate_t *candidate, size_t fitted, question_t question) {
    const double paid = search_price(candidate->block) - candidate->electrical;
    const double joint = candidate->joint ? -(double)fitted * log(candidate->power.fitted) : 0.0;
    /* Fitted with its own hysteresis, which may not be quite the right one, and beside all that J imitates: in the
     * middle. What is itself a shape has to prove itself with its own; and beside one that is far from linear in its
     * numbers, J says little. */
    const bool hint = hysteresis_far_from_linear(&candidate->model);
    return !candidate->joint                  ? candidate->likelihood - paid
           : question == ASK_EFFECTS && !hint ? 0.5 * (candidate->likelihood + joint) - paid
                                              : joint - paid;
}

static int by_merit(const void *one, const void *other) {
    const candidate_t *a = one, *b = other;
    if (a->joint != b->joint) {
        return a->joint ? -1 : 1;
    }
    return (a->merit < b->merit) - (a->merit > b->merit);
}

/* How small it could be and still be seen. */
static void note_smallest(const evidence_t *evidence, const candidate_t *trial, double sigma_um, candidate_t *best) {
    const evidence_test_t *test = &trial->test;
    if (test->own_part > least_own_part && test->own_um > 0.0) {
        const double amplitude = search_least_size * sigma_um / test->own_um;
        const double smallest = amplitude * samples_rms(evidence_samples(evidence), trial->signature);
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

static void sort(search_t *found, question_t question) {
    for (size_t i = 0; i < found->count; i++) {
        found->candidate[i].merit = merit(&found->candidate[i], found->fitted, question);
    }
    qsort(found->candidate, found->count, sizeof(candidate_t), by_merit);
}

/* Whether the effect is proportional to a number that cannot be below 0. */
static bool never_negative(const block_t *block) {
    for (size_t p = 0; p < block->parameters; p++) {
        if (searched_in_proportion(block, p) && block->parameter[p].low >= 0.0) {
            return true;
        }
    }
    return false;
}

/* Looking for one block. */
typedef struct {
    const evidence_t *evidence;
    const model_t *baseline;
    const probe_setting_t *setting;
    const block_t *block;
    double sigma_um;
    candidate_t best; /* block: NULL while no probe could be simulated */
    size_t tested;
    size_t first, some; /* of the block's probes, those that are tried together */
    candidate_t *trial;
    double (*value)[BLOCK_MAX_PARAMETERS];
} block_search_t;

/* Signature of a probe; NULL: it cannot be simulated. */
static void simulate_probe(void *context, size_t index) {
    const block_search_t *s = context;
    candidate_t *trial = &s->trial[index];
    *trial = (candidate_t){.block = s->block, .at = place_in_chain(s->baseline, s->block)};
    insert_block(&trial->model, s->baseline, s->block, s->value[index]);
    trial->signature = evidence_signature(s->evidence, &trial->model, trial->at);
}

/* The tests of those that could be simulated. */
static void test_probes(block_search_t *s) {
    double *signature[PROBES_AT_ONCE];
    evidence_test_t test[PROBES_AT_ONCE];
    size_t count = 0;
    for (size_t i = 0; i < s->some; i++) {
        if (s->trial[i].signature != NULL) {
            signature[count++] = s->trial[i].signature;
        }
    }
    evidence_tests(s->evidence, count, signature, test);
    for (size_t i = s->some; i-- > 0;) {
        candidate_t *trial = &s->trial[i];
        if (trial->signature != NULL) {
            trial->test = test[--count];
            trial->likelihood = trial->test.amplitude < 0.0 && never_negative(s->block)
                                    ? 0.0
                                    : evidence_likelihood(s->evidence, 1.0 - trial->test.explained);
        }
    }
}

/* Whether the effect grows with one of the numbers that are searched: then a probe of any size is as good a start. */
static bool grows_with_a_number(const block_t *block) {
    for (size_t p = 0; p < block->parameters; p++) {
        if (searched_in_proportion(block, p)) {
            return true;
        }
    }
    return false;
}

/* How good a start it is for the refinement, which begins with the probe as it is: as good as the likelihood that it
 * has then, or a part of what it would have with its amplitude. */
static double promise(const evidence_t *evidence, const candidate_t *trial) {
    const double a = trial->test.amplitude, part = 0.25 * trial->likelihood;
    return grows_with_a_number(trial->block) || a == 0.0
               ? trial->likelihood
               : fmax(part, evidence_likelihood(evidence, 1.0 - trial->test.explained * (2.0 * a - 1.0) / (a * a)));
}

static void keep_best(block_search_t *s, candidate_t *trial, candidate_t *smallest) {
    if (trial->signature != NULL) {
        note_smallest(s->evidence, trial, s->sigma_um, smallest);
        s->tested++;
    }
    if (trial->signature != NULL &&
        (s->best.block == NULL || promise(s->evidence, trial) > promise(s->evidence, &s->best))) {
        const candidate_t worse = s->best;
        s->best = *trial;
        *trial = worse;
    }
    free(trial->signature);
    model_free(&trial->model);
}

/* The next ones of a block's probes: their values. */
static void take_probes(block_search_t *s) {
    const block_t *block = s->block;
    for (s->some = 0; s->some < PROBES_AT_ONCE; s->some++) {
        double *value = s->value[s->some];
        for (size_t p = 0; p < block->parameters; p++) {
            value[p] = block->parameter[p].optional ? block->parameter[p].default_value : 0.0;
        }
        if (!block->probe->probe(s->setting, s->first + s->some, value)) {
            return;
        }
    }
}

/* The best of a block's probes. */
static void probe_block(void *context, size_t index) {
    block_search_t *s = &((block_search_t *)context)[index];
    candidate_t smallest = {.smallest_um = HUGE_VAL};
    s->trial = allocate(PROBES_AT_ONCE, sizeof *s->trial);
    s->value = allocate(PROBES_AT_ONCE, sizeof *s->value);
    for (take_probes(s); s->some > 0; take_probes(s)) {
        parallel(s->some, simulate_probe, s);
        test_probes(s);
        for (size_t i = 0; i < s->some; i++) {
            keep_best(s, &s->trial[i], &smallest);
        }
        s->first += s->some;
    }
    s->best.smallest_um = smallest.smallest_um;
    memcpy(s->best.smallest_value, smallest.smallest_value, sizeof s->best.smallest_value);
    free(s->trial);
    free(s->value);
}

static bool asked(const probe_t *probe, question_t question) {
    return question == ASK_ANYTHING || probe->shape == (question == ASK_SHAPES);
}

void search_probes(const evidence_t *evidence, const noise_t *noise, const model_t *baseline,
                   const probe_setting_t *setting, const block_t *without, search_t *found) {
    const question_t question = evidence_question(evidence);
    block_search_t *block = allocate(catalogue_count, sizeof *block);
    size_t blocks = 0;
    for (size_t i = 0; i < catalogue_count; i++) {
        if (catalogue[i] != without && catalogue[i]->probe != NULL && asked(catalogue[i]->probe, question) &&
            model_find(baseline, catalogue[i]->name) == NULL) {
            block[blocks++] = (block_search_t){.evidence = evidence,
                                               .baseline = baseline,
                                               .setting = setting,
                                               .block = catalogue[i],
                                               .sigma_um = noise->sigma_um};
        }
    }
    parallel(blocks, probe_block, block);
    *found = (search_t){.candidate = allocate(catalogue_count, sizeof(candidate_t)),
                        .fitted = evidence_samples(evidence)->fitted};
    for (size_t i = 0; i < blocks; i++) {
        found->tested += block[i].tested;
        if (block[i].best.block != NULL) {
            found->candidate[found->count++] = block[i].best;
        }
    }
    free(block);
    sort(found, question);
}

/* What the refinement and the fit of a search's candidates take. */
typedef struct {
    const evidence_t *evidence;
    const noise_t *noise;
    const model_t *baseline;
    const probe_setting_t *setting;
    search_t *found;
    size_t chosen[MOST_REFINED]; /* of its candidates */
} choice_t;

static void refine_chosen(void *context, size_t index) {
    const choice_t *choice = context;
    candidate_t *candidate = &choice->found->candidate[choice->chosen[index]];
    refine_candidate(choice->evidence, candidate);
    candidate->electrical = electrical_likelihood(evidence_samples(choice->evidence), choice->baseline,
                                                  &candidate->model, candidate->block);
}

static void fit_chosen(void *context, size_t index) {
    const choice_t *choice = context;
    candidate_t *candidate = &choice->found->candidate[choice->chosen[index]];
    failure_t refusal;
    candidate->joint = joint_fit(evidence_samples(choice->evidence), choice->noise, &candidate->model,
                                 1U << candidate->at, FIT_ITERATIONS, &candidate->power, &refusal);
}

/* The best probe first: what it comes to says which others are worth it. */
static void refine_best(choice_t *choice) {
    const search_t *found = choice->found;
    size_t count = 0;
    for (size_t i = 0; i < found->count && i < MOST_REFINED; i++) {
        const double likelihood = found->candidate[i].likelihood;
        if (likelihood > fmax(least_likelihood, worth_refining * found->candidate[0].likelihood)) {
            choice->chosen[i == 0 ? 0 : count++] = i;
            if (i == 0) {
                refine_chosen(choice, 0);
            }
        }
    }
    parallel(count, refine_chosen, choice);
}

static void fit_best(choice_t *choice) {
    const search_t *found = choice->found;
    const double best = found->count > 0 ? found->candidate[0].likelihood : 0.0;
    size_t count = 0;
    for (size_t i = 0; i < found->count && i < MOST_FITTED; i++) {
        const double likelihood = found->candidate[i].likelihood;
        if (likelihood > least_likelihood && (evidence_question(choice->evidence) == ASK_ANYTHING ||
                                              likelihood > fmin(worth_fitting * best, best - close_likelihood))) {
            choice->chosen[count++] = i;
        }
    }
    parallel(count, fit_chosen, choice);
}

/* Whether the best one could be confused with it: one of its group, or what explains about as much beyond J. */
static bool to_be_compared(const candidate_t *best, const candidate_t *rival) {
    return rival->likelihood > least_likelihood &&
           (strcmp(rival->block->probe->group, best->block->probe->group) == 0 ||
            rival->likelihood > best->likelihood - close_likelihood);
}

/* What the best one can be confused with is judged as it is. */
static void fit_rivals(choice_t *choice) {
    const search_t *found = choice->found;
    size_t count = 0;
    for (size_t i = 1; i < found->count && found->candidate[0].joint && count < MOST_REFINED; i++) {
        const candidate_t *rival = &found->candidate[i];
        if (!rival->joint && to_be_compared(&found->candidate[0], rival)) {
            choice->chosen[count++] = i;
        }
    }
    parallel(count, fit_chosen, choice);
}

bool search_block(const evidence_t *evidence, const noise_t *noise, const model_t *baseline,
                  const probe_setting_t *setting, const block_t *block, candidate_t *found) {
    block_search_t one = {
        .evidence = evidence, .baseline = baseline, .setting = setting, .block = block, .sigma_um = noise->sigma_um};
    probe_block(&one, 0);
    *found = one.best;
    if (found->block == NULL) {
        return false;
    }
    refine_candidate(evidence, found);
    return true;
}

/* The candidate of a block that was fitted, by name; the number of candidates if there is none. */
static size_t fitted_candidate(const search_t *found, const char *name) {
    size_t i = 0;
    while (i < found->count && !(found->candidate[i].joint && strcmp(found->candidate[i].block->name, name) == 0)) {
        i++;
    }
    return i;
}

/* Sum of squares that a candidate leaves together with another block, all numbers fitted; HUGE_VAL if it cannot be. */
static double left_together(const choice_t *choice, const candidate_t *candidate, const block_t *other) {
    model_t pair;
    joint_power_t power;
    failure_t refusal;
    candidate_t lag;
    double left = HUGE_VAL;
    if (search_block(choice->evidence, choice->noise, choice->baseline, choice->setting, other, &lag)) {
        const size_t at = place_in_chain(&candidate->model, other);
        double value[BLOCK_MAX_PARAMETERS] = {0.0};
        for (size_t p = 0; p < other->parameters; p++) {
            const parameter_t *parameter = &lag.model.block[lag.at].parameter[p];
            value[p] = parameter->count > 0 ? parameter->value[0] : 0.0;
        }
        insert_block(&pair, &candidate->model, other, value);
        const unsigned blocks = 1U << at | 1U << (candidate->at + (at <= candidate->at ? 1 : 0));
        if (joint_fit(evidence_samples(choice->evidence), choice->noise, &pair, blocks, 2 * FIT_ITERATIONS, &power,
                      &refusal)) {
            left = power.fitted;
        }
        model_free(&pair);
        candidate_free(&lag);
    }
    return left;
}

/* Where two blocks together explain more than the best one, which is nearly both of them, the first of the two is the
 * best one; the other one follows. */
static void prefer_together(choice_t *choice) {
    search_t *found = choice->found;
    const char *const *names = found->count > 0 ? found->candidate[0].block->probe->together : NULL;
    if (names == NULL || names[0] == NULL || !found->candidate[0].joint ||
        model_find(choice->baseline, names[1]) != NULL) {
        return;
    }
    const size_t first = fitted_candidate(found, names[0]);
    if (first < found->count) {
        const candidate_t best = found->candidate[0];
        const double left = left_together(choice, &found->candidate[first], catalogue_find(names[1]));
        if ((double)found->fitted * log(best.power.fitted / left) > 3.0 * search_number_price) {
            found->candidate[0] = found->candidate[first];
            found->candidate[first] = best;
        }
    }
}

void search(const evidence_t *evidence, const noise_t *noise, const model_t *baseline, const probe_setting_t *setting,
            const block_t *without, search_t *found) {
    const question_t question = evidence_question(evidence);
    choice_t choice = {.evidence = evidence, .noise = noise, .baseline = baseline, .setting = setting, .found = found};
    search_probes(evidence, noise, baseline, setting, without, found);
    refine_best(&choice);
    sort(found, question);
    fit_best(&choice);
    sort(found, question);
    fit_rivals(&choice);
    sort(found, question);
    prefer_together(&choice);
}

double search_margin(const search_t *found, size_t other) {
    const candidate_t *one = &found->candidate[0], *two = &found->candidate[other];
    if (one->joint && !two->joint && to_be_compared(one, two)) {
        return HUGE_VAL; /* no hysteresis fits together with it */
    }
    return one->joint == two->joint ? one->merit - two->merit
                                    : one->likelihood + one->electrical - two->likelihood - two->electrical;
}

void candidate_free(candidate_t *candidate) {
    free(candidate->signature);
    model_free(&candidate->model);
}

void search_free(search_t *found) {
    for (size_t i = 0; i < found->count; i++) {
        candidate_free(&found->candidate[i]);
    }
    free(found->candidate);
}
