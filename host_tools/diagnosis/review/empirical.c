/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/review/empirical.h"
#include "base/parallel.h"
#include "chain/catalogue.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/columns/measured_columns.h"
#include "diagnosis/evidence/probing.h"
#include "diagnosis/judgement/candidate_judgement.h"
#include "diagnosis/judgement/verdict.h"
#include "diagnosis/noise/drive_lines.h"
#include "diagnosis/question/baseline.h"
#include "diagnosis/review/delivered.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

/* A line may be this one of what is periodic, where others hide the rest: the period is then tried as often as longer.
 */
enum { HARMONICS = 3 };

/* A chain with a term, or without one, fitted. */
typedef struct {
    const block_t *block; /* NULL: the chain as it is, fitted again for comparison */
    size_t harmonic;      /* that the lines are taken for */
    model_t model;
    joint_power_t power;
    double percent, held_out_percent, delivered_percent;
    bool good;
} term_t;

typedef struct {
    const state_t *state;
    const search_problem_t *problem; /* from the chain as it is */
    term_t *term;
} terms_t;

/* The lines of what the chain leaves now, but for those of the drive: what follows it is no tone. */
static bool find_tones(const state_t *state, probe_setting_t *setting, double line_hz[LINES_MOST]) {
    const answer_t *answer = &state->answer;
    const samples_t *samples = &answer->question->samples;
    double *residual = samples_column(samples);
    const bool good = samples_simulate(samples, &answer->model, residual, state->failure);
    setting->lines = 0;
    setting->line_hz = line_hz;
    if (good) {
        double found_hz[LINES_MOST];
        samples_residual(samples, residual, residual);
        const size_t longest = samples_longest(samples), found = baseline_lines(samples, residual, found_hz);
        const recording_t *recording = &samples->recordings[longest];
        for (size_t i = 0; i < found; i++) {
            if (!drive_has_line(recording, samples->from[longest], recording->samples, found_hz[i])) {
                line_hz[setting->lines++] = found_hz[i];
            }
        }
    }
    free(residual);
    return good;
}

/* Where its fit begins: the best of its probes, refined beside the hysteresis as it is, or the only one. false: it has
 * none. */
static bool begin(const terms_t *terms, const term_t *term, model_t *model, size_t *at) {
    const block_t *block = term->block;
    probe_setting_t setting = *terms->problem->setting;
    search_problem_t own = *terms->problem;
    const search_problem_t *problem = &own;
    setting.harmonic = term->harmonic;
    own.setting = &setting;
    double value[BLOCK_MAX_PARAMETERS];
    candidate_t best;
    if (!candidate_probe(block, problem->setting, 1, value)) {
        if (!candidate_probe(block, problem->setting, 0, value)) {
            return false;
        }
        *at = candidate_insert(model, problem->baseline, block, value);
        return true;
    }
    if (!probe_block(problem, block, &best)) {
        return false;
    }
    candidate_refine(problem, &best);
    model_copy(model, &best.model);
    *at = best.at;
    candidate_free(&best);
    return true;
}

/* What a fit of this chain moves beside its hysteresis: all that was found, terms as well; not those of a given chain.
 */
static unsigned all_fitted(const answer_t *answer, const model_t *model) {
    unsigned blocks = blocks_fitted(answer, model);
    for (size_t b = 0; b < model->blocks; b++) {
        const block_t *block = model->block[b].block;
        blocks |= block->empirical != NULL && finding_of(answer, block) != NULL ? 1U << b : 0U;
    }
    return blocks;
}

/* First the term and the hysteresis, then what was found as well: numbers that are not those of any effect may hold up
 * a fit of them all. */
static bool fit_together(const state_t *state, const block_t *block, unsigned blocks, term_t *term) {
    const answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    failure_t refusal;
    return (block == NULL || joint_fit(&question->samples, &question->noise, &term->model, blocks, FIT_ITERATIONS,
                                       &term->power, &refusal)) &&
           joint_fit(&question->samples, &question->noise, &term->model, blocks | all_fitted(answer, &term->model),
                     FIT_ITERATIONS, &term->power, &refusal);
}

static void fit(void *context, size_t index) {
    const terms_t *terms = context;
    term_t *term = &terms->term[index];
    state_t own = *terms->state;
    failure_t refusal;
    size_t at = 0;
    own.failure = &refusal;
    if (term->block == NULL) {
        model_copy(&term->model, terms->problem->baseline);
    } else if (!begin(terms, term, &term->model, &at)) {
        return;
    }
    term->good = fit_together(&own, term->block, term->block != NULL ? 1U << at : 0U, term) &&
                 state_measure(&own, &term->model, &term->percent, &term->held_out_percent);
    term->delivered_percent = delivered_percent(&own.answer.question->samples, &term->model);
}

static void free_terms(term_t *term, size_t count) {
    for (size_t i = 0; i < count; i++) {
        model_free(&term[i].model);
    }
    free(term);
}

/* All terms that the chain does not have, fitted; before them the chain without one, as it is or fitted again,
 * whichever leaves less of the held-out samples. */
static bool fit_terms(state_t *state, term_t *term, size_t *count) {
    const answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    evidence_t *evidence = evidence_open(&answer->model, &question->samples, &question->noise, state->failure);
    probe_setting_t setting = state->setting;
    double line_hz[LINES_MOST];
    const search_problem_t problem = {
        .evidence = evidence, .noise = &question->noise, .baseline = &answer->model, .setting = &setting};
    terms_t terms = {.state = state, .problem = &problem, .term = term};
    *count = 1;
    if (evidence == NULL || !find_tones(state, &setting, line_hz)) {
        evidence_close(evidence);
        return false;
    }
    evidence_ask(evidence, ASK_ANYTHING);
    for (size_t i = 0; i < catalogue_count; i++) {
        if (catalogue[i]->empirical != NULL && model_find(&answer->model, catalogue[i]->name) == NULL) {
            for (size_t harmonic = 1; harmonic <= (catalogue[i]->own_clock ? HARMONICS : 1); harmonic++) {
                term[*count].harmonic = harmonic;
                term[(*count)++].block = catalogue[i];
            }
        }
    }
    parallel(*count, fit, &terms);
    evidence_close(evidence);
    state_advance(state);
    joint_power_t as_it_is;
    if (!joint_power(&question->samples, &question->noise, &answer->model, &as_it_is, state->failure)) {
        return false;
    }
    if (!term[0].good || answer->held_out_percent < term[0].held_out_percent) {
        term[0].power = as_it_is;
        term[0].held_out_percent = answer->held_out_percent;
    }
    term[0].delivered_percent = answer->delivered_percent;
    return true;
}

static double noise_square(const answer_t *answer) {
    return isfinite(answer->noise_percent) ? answer->noise_percent * answer->noise_percent : 0.0;
}

/* Square of the error of the held-out samples beyond the noise; all of it where that is not known. */
static double missing(const answer_t *answer, const term_t *term) {
    return term->held_out_percent * term->held_out_percent - noise_square(answer);
}

static double support(const answer_t *answer, const term_t *without, const term_t *with) {
    return (double)answer->question->samples.held * log(without->power.held / with->power.held);
}

static bool is_worth_it(const answer_t *answer, const term_t *without, const term_t *with) {
    const double before = missing(answer, without);
    return with->good && before > threshold.worth_explaining * noise_square(answer) &&
           missing(answer, with) < (1.0 - threshold.much_of_it) * before &&
           support(answer, without, with) > threshold.least_support &&
           with->delivered_percent < without->delivered_percent;
}

/* The term becomes a finding. false: its numbers have no standard errors, and all is as it was. */
static bool take(state_t *state, const term_t *without, term_t *with) {
    answer_t *answer = &state->answer;
    const model_t before = answer->model;
    failure_t refusal;
    answer->model = with->model;
    findings_add(answer, &(finding_t){.block = with->block,
                                      .certainty = DETECTED,
                                      .settled = DETECTED,
                                      .margin = HUGE_VAL,
                                      .support = support(answer, without, with),
                                      .held_out_before_percent = without->held_out_percent,
                                      .held_out_after_percent = with->held_out_percent});
    if (!findings_errors(answer, &refusal)) {
        findings_remove(answer, answer->findings - 1);
        with->model = answer->model;
        answer->model = before;
        return false;
    }
    with->model = before;
    answer->nrmse_percent = with->percent;
    answer->held_out_percent = with->held_out_percent;
    answer->delivered_percent = with->delivered_percent;
    return true;
}

/* One more term, or none. */
static bool add_term(state_t *state, bool *added) {
    size_t count = 0, best = 0;
    const answer_t *answer = &state->answer;
    term_t *term = allocate(HARMONICS * catalogue_count + 1, sizeof *term);
    const bool good = fit_terms(state, term, &count);
    for (size_t i = 1; good && i < count; i++) {
        if (is_worth_it(answer, &term[0], &term[i]) &&
            (best == 0 || term[i].held_out_percent < term[best].held_out_percent)) {
            best = i;
        }
    }
    *added = best > 0 && take(state, &term[0], &term[best]);
    free_terms(term, count);
    return good;
}

/* What is no response to a drive is taken out of the chain and of the findings, and put back behind those that name an
 * effect. */
typedef struct {
    model_t model; /* its blocks; may be empty */
    finding_t finding[DIAGNOSIS_MOST_FINDINGS];
    size_t findings;
} aside_t;

static void put_aside(answer_t *answer, aside_t *aside) {
    model_t all = answer->model;
    aside->findings = 0;
    for (size_t f = 0; f < answer->findings;) {
        if (answer->finding[f].in_readings) {
            aside->finding[aside->findings++] = answer->finding[f];
            findings_remove(answer, f);
        } else {
            f++;
        }
    }
    model_copy(&answer->model, &all);
    model_without_noise(&answer->model);
    aside->model = all;
}

static void put_back(answer_t *answer, aside_t *aside) {
    const size_t named = findings_named(answer);
    for (size_t f = 0; f < aside->findings; f++) {
        findings_insert(answer, named + f, &aside->finding[f]);
    }
    for (size_t b = 0; b < aside->model.blocks; b++) {
        const model_block_t *block = &aside->model.block[b];
        if (block->block->readings != READINGS_AS_THEY_ARE) {
            model_block_t *added = model_append(&answer->model, block->block);
            for (size_t p = 0; p < block->block->parameters; p++) {
                model_set_array(added, block->block->parameter[p].name, block->parameter[p].count,
                                block->parameter[p].value, block->parameter[p].sigma);
            }
        }
    }
    model_free(&aside->model);
}

/* The noise is no more than what is left. */
static void tell(state_t *state) {
    answer_t *answer = &state->answer;
    if (isfinite(answer->noise_percent)) {
        answer->noise_percent = fmin(answer->noise_percent, fmax(answer->nrmse_percent, answer->held_out_percent));
    }
    answer->delivered_percent = delivered_percent(&answer->question->samples, &answer->model);
}

bool empirical_describe(state_t *state) {
    answer_t *answer = &state->answer;
    aside_t aside;
    bool good = true, added = true, any = false, measured;
    if ((answer->verdict != UNKNOWN_PHYSICS && answer->verdict != PARTLY_EXPLAINED) || !answer->remainder.structured) {
        return true;
    }
    if (!measured_columns_have_it(answer, &measured, state->failure) || measured) {
        return measured;
    }
    put_aside(answer, &aside);
    const remainder_t before = answer->remainder;
    for (size_t i = 0; good && added && answer->remainder.structured && i < EMPIRICAL_MOST &&
                       answer->findings + aside.findings < DIAGNOSIS_MOST_FINDINGS;
         i++) {
        good = add_term(state, &added);
        any = any || added;
        good = good && (!added || verdict_look(state));
    }
    if (!any) {
        answer->remainder = before;
    }
    answer->remainder.structured = true;
    put_back(answer, &aside);
    if (any) {
        tell(state);
    }
    return good;
}
