/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/judgement/names.h"
#include "base/parallel.h"
#include "chain/catalogue.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/evidence/electrical.h"
#include "diagnosis/evidence/probing.h"
#include "diagnosis/judgement/no_physics.h"
#include "diagnosis/judgement/reconsider.h"
#include "diagnosis/nuisance/hysteresis_numbers.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

/* A chain with one of the group's blocks in the finding's place. */
typedef struct {
    const block_t *block;
    model_t model;
    joint_power_t power;
    double likelihood; /* 2 log, but for what all of the group have in common */
} reading_t;

/* Fits everything that was found together with it. */
static void fit(const state_t *state, const model_t *without, reading_t *reading) {
    const answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    failure_t refusal;
    reading->likelihood = -HUGE_VAL;
    if (joint_fit(&question->samples, &question->noise, &reading->model, blocks_fitted(answer, &reading->model),
                  FIT_ITERATIONS, &reading->power, &refusal)) {
        reading->likelihood = -(double)question->samples.fitted * log(reading->power.fitted) -
                              (double)question->samples.held * log(reading->power.held) -
                              candidate_price(reading->block) +
                              electrical_likelihood(&question->samples, without, &reading->model, reading->block);
    }
}

/* What the readings of a finding are made from. */
typedef struct {
    const state_t *state;
    search_problem_t problem; /* its baseline: the chain without the finding */
    double least;             /* 2 log likelihood beyond the nuisance subspace, below which a block cannot be it */
    reading_t *reading;
} anew_t;

/* The least that another block has to explain; everything, where the nuisance subspace says little. */
static double least_of_others(const evidence_t *evidence, const model_t *model, const block_t *block) {
    const size_t at = (size_t)(model_find(model, block->name) - model->block);
    double *signature = evidence_signature(evidence, model, at), own = 0.0;
    if (signature != NULL && !hysteresis_far_from_linear(model)) {
        own = evidence_likelihood(evidence, 1.0 - evidence_test(evidence, signature).explained);
    }
    free(signature);
    return own > threshold.cannot_be_likelihood
               ? fmin(threshold.cannot_be_part * own, own - threshold.cannot_be_likelihood)
               : -HUGE_VAL;
}

/* Another block's best numbers, in the finding's place. */
static void read_anew(void *context, size_t index) {
    const anew_t *anew = context;
    const model_t *without = anew->problem.baseline;
    reading_t *reading = &anew->reading[index];
    candidate_t candidate;
    reading->likelihood = -HUGE_VAL;
    if (index > 0) { /* the first one is the finding's own */
        if (!probe_block(&anew->problem, reading->block, &candidate)) {
            model_copy(&reading->model, without);
            return;
        }
        candidate_refine(&anew->problem, &candidate);
        const bool possible = candidate.likelihood >= anew->least;
        model_copy(&reading->model, &candidate.model);
        candidate_free(&candidate);
        if (!possible) {
            return;
        }
    }
    fit(anew->state, without, reading);
}

/* Whether a block can be it: one of its group that is looked for by itself, or, where it leaves more than noise, a
 * richer form of it. */
static bool can_take_place(const block_t *block, const block_t *of, bool only_noise) {
    return probe_is_first(block->probe)
               ? block_same_group(block, of)
               : block->probe != NULL && !only_noise && probe_may_replace(block->probe, of->probe->group);
}

/* The finding's own block, and every other one that can stand there. Returns how many. */
static size_t list_others(const finding_t *finding, const model_t *without, bool only_noise, reading_t *reading) {
    size_t count = 1;
    reading[0] = (reading_t){.block = finding->block};
    for (size_t i = 0; i < catalogue_count; i++) {
        const block_t *block = catalogue[i];
        if (block != finding->block && can_take_place(block, finding->block, only_noise) &&
            model_find(without, block->name) == NULL) {
            reading[count++] = (reading_t){.block = block};
        }
    }
    return count;
}

static void take(state_t *state, finding_t *finding, reading_t *reading) {
    answer_t *answer = &state->answer;
    finding_rename(answer, finding, reading->block, LESS_LIKELY);
    model_t model;
    model_copy(&model, &reading->model);
    state_take(state, &model, &reading->power);
}

/* Whether any number of the finding differs significantly from none, as the model now is. */
static bool is_determined(state_t *state, const finding_t *finding) {
    failure_t refusal;
    return findings_errors(&state->answer, &refusal) && finding_determined(&state->answer, finding);
}

/* The likeliest one but those that are out, from one on; its own index if there is no other. */
static size_t next_best(const reading_t *reading, size_t count, const bool *out, size_t best) {
    size_t next = best;
    for (size_t i = 0; i < count; i++) {
        const bool in = !out[i] && isfinite(reading[i].likelihood);
        next = in && (next == best || reading[i].likelihood > reading[next].likelihood) ? i : next;
    }
    return next;
}

/* Takes the best reading; or, where two numbers of that take each other's place so that none of them is known (a creep
 * that begins when the recording ends), the next one that has its numbers. Returns which. */
static size_t take_determined(state_t *state, finding_t *finding, reading_t *reading, size_t count, size_t best) {
    bool *out = allocate(count, sizeof *out);
    size_t taken = best;
    take(state, finding, &reading[best]);
    while (!is_determined(state, finding)) {
        out[taken] = true;
        const size_t next = next_best(reading, count, out, best);
        if (next == best) { /* none has */
            take(state, finding, &reading[best]);
            taken = best;
            break;
        }
        take(state, finding, &reading[next]);
        taken = next;
    }
    free(out);
    return taken;
}

/* Of the group, those that are nearly as likely; others stay what they were. */
static void list_rivals(finding_t *finding, const reading_t *reading, size_t count, size_t best) {
    const finding_t before = *finding;
    finding->rivals = 0;
    for (size_t r = 0; r < before.rivals; r++) {
        if (!block_same_group(before.rival[r], finding->block)) {
            finding_add_rival(finding, before.rival[r]);
        }
    }
    const bool outside = finding->rivals > 0;
    finding->margin = HUGE_VAL;
    for (size_t i = 0; i < count; i++) {
        const double margin = reading[best].likelihood - reading[i].likelihood;
        if (i != best) {
            const bool contradicted = reading[i].power.held < reading[best].power.held;
            finding->margin = fmin(finding->margin, margin);
            if (margin < (contradicted ? threshold.naming_margin_if_contradicted : threshold.naming_margin)) {
                finding_add_rival(finding, reading[i].block);
            }
        }
    }
    finding->certainty = finding->rivals == 0 ? NAMED : outside && before.certainty == DETECTED ? DETECTED : ISOLATED;
}

/* With more the hysteresis is not quite right, and fits of everything together decide by what that leaves: held-out
 * samples then have to agree. */
static bool leaves_only_noise(const state_t *state) {
    return excess(&state->answer, state->power.held) < threshold.worth_explaining;
}

/* A richer form only where it completes the answer, by the measure of what only comes near: beside a hysteresis of a
 * wrong shape it would take a part of that error, and no more. */
static bool can_stand(const answer_t *answer, const reading_t *own, const reading_t *reading) {
    const probe_t *probe = reading->block->probe;
    const double most = probe->extends ? threshold.extended_leaves_too_much : threshold.leaves_too_much;
    return probe_is_first(probe) ||
           (excess(answer, reading->power.held) < most * excess(answer, own->power.held) &&
            !no_physics(&answer->question->samples, model_find(&reading->model, reading->block->name)));
}

static bool settle(state_t *state, finding_t *finding) {
    answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    const bool only_noise = leaves_only_noise(state);
    probe_setting_t setting = state->setting;
    double value[BLOCK_MAX_PARAMETERS];
    reading_t *reading = allocate(catalogue_count, sizeof *reading);
    model_t without;
    candidate_value(model_find(&answer->model, finding->block->name), value);
    setting.replaced = finding->block;
    setting.replaced_value = value;
    finding_left_out(answer, finding, &without);
    const size_t count = list_others(finding, &without, only_noise, reading);
    model_copy(&reading[0].model, &answer->model);
    evidence_t *evidence = evidence_open(&without, &question->samples, &question->noise, state->failure);
    if (evidence != NULL) {
        anew_t anew = {
            .state = state,
            .problem = {.evidence = evidence, .noise = &question->noise, .baseline = &without, .setting = &setting},
            .reading = reading};
        size_t best = 0;
        evidence_ask(evidence, finding->block->probe->shape ? ASK_SHAPES : finding->shape ? ASK_ANYTHING : ASK_EFFECTS);
        anew.least = least_of_others(evidence, &answer->model, finding->block);
        parallel(count, read_anew, &anew);
        for (size_t i = 1; i < count; i++) {
            reading[i].likelihood = can_stand(answer, &reading[0], &reading[i]) ? reading[i].likelihood : -HUGE_VAL;
            best = (only_noise || reading[i].power.held < reading[0].power.held) &&
                           reading[i].likelihood > reading[best].likelihood
                       ? i
                       : best;
        }
        if (isfinite(reading[best].likelihood)) {
            best = take_determined(state, finding, reading, count, best);
            if (only_noise || best > 0) {
                list_rivals(finding, reading, count, best);
            }
        }
    }
    const bool good = evidence != NULL;
    evidence_close(evidence);
    for (size_t i = 0; i < (good ? count : 1); i++) {
        model_free(&reading[i].model);
    }
    free(reading);
    model_free(&without);
    return good;
}

static bool has_others(const block_t *block, bool only_noise) {
    for (size_t i = 0; i < catalogue_count; i++) {
        if (catalogue[i] != block && can_take_place(catalogue[i], block, only_noise)) {
            return true;
        }
    }
    return false;
}

static bool found_beside(const answer_t *answer, const finding_t *finding, const block_t *rival) {
    for (size_t f = 0; f < answer->findings; f++) {
        if (&answer->finding[f] != finding && !answer->finding[f].in_readings &&
            block_same_group(answer->finding[f].block, rival)) {
            return true;
        }
    }
    return false;
}

/* Rivals of which one has been found, too, are none: both are there. */
static void forget_found(const answer_t *answer, finding_t *finding) {
    const finding_t before = *finding;
    finding->rivals = 0;
    for (size_t r = 0; r < before.rivals; r++) {
        if (!found_beside(answer, finding, before.rival[r])) {
            finding_add_rival(finding, before.rival[r]);
        }
    }
    finding->certainty = finding->rivals > 0 || before.rivals == 0 ? before.certainty : NAMED;
}

/* What came before the recording may look like an effect that is small beside another one (probe_t.doubtful): a creep
 * goes on, for an unknown number of decades of time, and that looks like a drift which settles. */
static void doubt(answer_t *answer, finding_t *finding) {
    const question_t *question = answer->question;
    const probe_t *probe = finding->block->probe;
    if (probe == NULL || probe->doubtful.beside == NULL || finding->rivals == DIAGNOSIS_MOST_RIVALS) {
        return;
    }
    const model_block_t *found = model_find(&answer->model, finding->block->name);
    const model_block_t *other = model_find(&answer->model, probe->doubtful.beside);
    if (found == NULL || other == NULL) {
        return;
    }
    double range_um[2];
    recordings_range(question->recordings, question->samples.count, COLUMN_DISPLACEMENT, range_um);
    const double part_of_range = *model_parameter(other, probe->doubtful.part_of_range)->value;
    const double past_um = part_of_range * (range_um[1] - range_um[0]);
    if (fabs(*model_parameter(found, probe->doubtful.size_um)->value) < past_um) {
        finding_add_rival(finding, other->block);
        finding_at_most(finding, ISOLATED);
    }
}

static void add_rival_named(const answer_t *answer, finding_t *finding, const char *name) {
    if (model_find(&answer->model, name) == NULL) {
        finding_add_rival(finding, catalogue_find(name));
        finding_at_most(finding, ISOLATED);
    }
}

/* A relaxation that begins as fast as can be seen may have begun before, and what begins when the recording nearly ends
 * may be a drift. */
static void doubt_times(const answer_t *answer, finding_t *finding) {
    const probe_t *probe = finding->block->probe;
    const model_block_t *found = model_find(&answer->model, finding->block->name);
    if (probe == NULL || probe->times.from_s == NULL || found == NULL) {
        return;
    }
    const parameter_t *from = model_parameter(found, probe->times.from_s);
    const parameter_info_t *info = &found->block->parameter[from - found->parameter];
    const double rate_hz = samples_fastest_hz(&answer->question->samples);
    const double fastest_s = fmax(info->low, threshold.fast_samples / rate_hz);
    double time_s[2];
    if (*from->value <= fastest_s * (1.0 + threshold.same_time)) {
        add_rival_named(answer, finding, probe->times.faster);
    }
    if (!finding_times(answer, finding, time_s) || log10(time_s[1] / time_s[0]) < threshold.least_decades) {
        add_rival_named(answer, finding, probe->times.slower);
    }
}

bool names_settle(state_t *state) {
    answer_t *answer = &state->answer;
    bool good = true, richer = false;
    for (size_t f = 0; f < answer->findings; f++) {
        forget_found(answer, &answer->finding[f]);
    }
    for (size_t f = 0; good && f < answer->findings; f++) {
        if (!answer->finding[f].in_readings && has_others(answer->finding[f].block, leaves_only_noise(state))) {
            state_advance(state);
            good = settle(state, &answer->finding[f]);
            richer = richer || !probe_is_first(answer->finding[f].block->probe);
        }
    }
    good = good && (!richer || reconsider_superfluous(state, threshold.least_size, 0));
    for (size_t f = 0; f < answer->findings; f++) {
        doubt(answer, &answer->finding[f]);
        doubt_times(answer, &answer->finding[f]);
    }
    return good;
}
