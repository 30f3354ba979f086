/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/columns/sides.h"
#include "chain/catalogue.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/evidence/candidate.h"
#include "diagnosis/judgement/reconsider.h"
#include "numerics/golden_section.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LAG_STEPS = 24 };
/* How far from where it begins a lag in the voltage may be. */
static const double lag_range = 8.0;

/* NULL: it has no twin. */
static const block_t *other_side(const block_t *block) {
    return block->twin != NULL ? catalogue_find(block->twin) : NULL;
}

const block_t *sides_block(const block_t *block) {
    return block->place == PLACE_ELECTRONICS ? block : other_side(block);
}

/* The one parameter of a low pass, its cutoff in Hz, or of a delay, in s. */
static double number_of_lag(const block_t *block, double seconds) {
    return block->lag == LAG_DELAY ? seconds : 1.0 / (2.0 * M_PI * seconds);
}

/* A low pass or a delay, by the time that it takes: in front of the others in the electronics, behind them in the
 * sensor. */
static void add_lag(model_t *model, const block_t *block, double seconds) {
    model_block_t *added = model_append(model, block);
    *added->parameter[0].value = number_of_lag(block, seconds);
    if (block->place == PLACE_ELECTRONICS) {
        const model_block_t first = *added;
        memmove(&model->block[1], &model->block[0], (model->blocks - 1) * sizeof model->block[0]);
        model->block[0] = first;
    }
}

static double lag_of(const answer_t *answer, const finding_t *finding) {
    const double number = answer->model.block[finding_index(answer, finding)].parameter[0].value[0];
    return finding->block->lag == LAG_DELAY ? number : 1.0 / (2.0 * M_PI * number);
}

electrical_change_t sides_change(const answer_t *answer, const finding_t *finding, column_t column) {
    const question_t *question = answer->question;
    electrical_change_t change = {0};
    const block_t *block = sides_block(finding->block);
    if (block != NULL && column_measured(&question->samples, column)) {
        model_t without, with;
        finding_left_out(answer, finding, &without);
        model_copy(&with, block == finding->block ? &answer->model : &without);
        if (block != finding->block) {
            add_lag(&with, block, lag_of(answer, finding));
        }
        change = electrical_change(&question->samples, column, &without, &with);
        model_free(&without);
        model_free(&with);
    }
    return change;
}

/* 2 log likelihood that the columns give the electronics of a model, compared with the baseline's. */
static double by_columns(const answer_t *answer, const model_t *model) {
    return electrical_preference(&answer->question->samples, &answer->baseline, model);
}

/* How much a proposal is preferred to the model, as 2 log likelihood. */
typedef struct {
    double position; /* by all samples of the position; by the held-out ones among them */
    double held_out;
    double columns;
} preference_t;

/* Fits the proposal except for some blocks (bits). */
static bool weigh(state_t *state, model_t *proposal, unsigned held_fast, joint_power_t *power,
                  preference_t *preference) {
    const answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    const unsigned free_blocks = blocks_fitted(answer, proposal) & ~held_fast;
    if (!joint_fit(&question->samples, &question->noise, proposal, free_blocks, FIT_ITERATIONS, power,
                   state->failure)) {
        return false;
    }
    preference->held_out = (double)question->samples.held * log(state->power.held / power->held);
    preference->position =
        (double)question->samples.fitted * log(state->power.fitted / power->fitted) + preference->held_out;
    preference->columns = by_columns(answer, proposal) - by_columns(answer, &answer->model);
    return true;
}

/* The finding is of the other block. */
static void rename_finding(answer_t *answer, finding_t *finding, const block_t *block, double margin) {
    finding_rename(answer, finding, block, CONTRADICTED);
    finding->certainty = NAMED;
    finding->rivals = 0;
    finding->margin = margin;
}

static bool swap(state_t *state, finding_t *finding) {
    answer_t *answer = &state->answer;
    const block_t *block = other_side(finding->block);
    model_t proposal;
    joint_power_t power;
    preference_t preference;
    finding_left_out(answer, finding, &proposal);
    add_lag(&proposal, block, lag_of(answer, finding));
    const bool good = weigh(state, &proposal, 0, &power, &preference);
    if (good && preference.position + preference.columns > threshold.naming_margin) {
        rename_finding(answer, finding, block, preference.position + preference.columns);
        state_take(state, &proposal, &power);
    } else {
        model_free(&proposal);
    }
    return good;
}

/* The finding that stands for the second lag: what it explains of what the chain leaves without it. */
static bool describe(state_t *state, const model_t *proposal, finding_t *added) {
    const answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    double ignored;
    evidence_t *evidence = evidence_open(&answer->model, &question->samples, &question->noise, state->failure);
    if (evidence == NULL) {
        return false;
    }
    double *change = samples_change(&question->samples, proposal, &answer->model, state->failure);
    const bool good = change != NULL &&
                      state_measure(state, &answer->model, &ignored, &added->held_out_before_percent) &&
                      state_measure(state, proposal, &ignored, &added->held_out_after_percent);
    if (good) {
        const evidence_test_t test = evidence_test(evidence, change);
        added->t = test.t;
        added->t_blocks = test.t_blocks;
    }
    free(change);
    evidence_close(evidence);
    return good;
}

typedef struct {
    const samples_t *samples;
    model_t *model;
    size_t at; /* of the lag before the voltage */
} lag_search_t;

static bool left_by_lag(void *context, double log_number, double *left) {
    const lag_search_t *search = context;
    *search->model->block[search->at].parameter[0].value = exp(log_number);
    *left = electrical_left(search->samples, COLUMN_VOLTAGE, search->model);
    return true;
}

/* The lag before the voltage as the voltage has it. Returns the block, as a bit. */
static unsigned set_by_voltage(const answer_t *answer, model_t *model, const block_t *before) {
    lag_search_t search = {&answer->question->samples, model, 0};
    while (model->block[search.at].block != before) {
        search.at++;
    }
    double *number = model->block[search.at].parameter[0].value;
    double log_number = log(*number);
    golden_section(left_by_lag, &search, log_number - log(lag_range), log_number + log(lag_range), LAG_STEPS,
                   &log_number);
    *number = exp(log_number);
    return 1U << search.at;
}

/* Takes out what stood in for the second lag, and now would not be large enough beside the two. */
static bool tidy(state_t *state, const block_t *before, unsigned spared) {
    answer_t *answer = &state->answer;
    model_t again;
    joint_power_t power;
    preference_t ignored;
    if (!reconsider_superfluous(
            state, threshold.least_part_of_found * state->found_um / answer->question->noise.sigma_um, spared)) {
        return false;
    }
    model_copy(&again, &answer->model);
    const bool good = weigh(state, &again, set_by_voltage(answer, &again, before), &power, &ignored);
    if (good) {
        state_take(state, &again, &power);
    } else {
        model_free(&again);
    }
    return good;
}

/* Two lags, one before the voltage and one behind it. */
typedef struct {
    const block_t *before, *behind;
} pair_t;

/* Lags that a catalogue may have; more are not paired. */
enum { MOST_PAIRS = 16 };

static bool may_be_before(const block_t *block) {
    return block->lag != LAG_NONE && block->place == PLACE_ELECTRONICS;
}

static bool may_be_behind(const block_t *block) {
    return block->lag == LAG_DELAY || (block->lag != LAG_NONE && block->place != PLACE_ELECTRONICS);
}

/* All pairs of the catalogue: first those of low passes, then those with a delay. Returns how many. */
static size_t list_pairs(pair_t pair[MOST_PAIRS]) {
    size_t count = 0;
    for (int delays = 0; delays < 2; delays++) {
        for (size_t i = 0; i < catalogue_count * catalogue_count && count < MOST_PAIRS; i++) {
            const block_t *before = catalogue[i / catalogue_count], *behind = catalogue[i % catalogue_count];
            const bool delay = before->lag == LAG_DELAY || behind->lag == LAG_DELAY;
            if (before != behind && may_be_before(before) && may_be_behind(behind) && delay == (delays == 1)) {
                pair[count++] = (pair_t){before, behind};
            }
        }
    }
    return count;
}

typedef struct {
    const pair_t *pair; /* NULL: none is preferred */
    model_t model;
    joint_power_t power;
    preference_t preference;
} proposal_t;

/* The findings that are lags. */
typedef struct {
    size_t count;
    finding_t *finding[DIAGNOSIS_MOST_FINDINGS];
} lags_t;

static void find_lags(answer_t *answer, lags_t *lags) {
    *lags = (lags_t){0};
    for (size_t f = 0; f < answer->findings; f++) {
        if (answer->finding[f].block->lag != LAG_NONE) {
            lags->finding[lags->count++] = &answer->finding[f];
        }
    }
}

static void without_lags(const answer_t *answer, const lags_t *lags, model_t *without) {
    model_copy(without, &answer->model);
    for (size_t b = without->blocks; b-- > 0;) {
        for (size_t l = 0; l < lags->count; l++) {
            if (without->block[b].block == lags->finding[l]->block) {
                model_remove(without, b);
                break;
            }
        }
    }
}

/* The lags as a pair, if that is preferred to the best so far. That before the voltage is what the voltage says and
 * stays so: from the position the two can hardly be told apart. The other one begins with the rest of it. */
static bool propose(state_t *state, const lags_t *lags, double part, const pair_t *pair, proposal_t *best) {
    const answer_t *answer = &state->answer;
    double seconds = 0.0;
    proposal_t proposal = {.pair = pair};
    for (size_t l = 0; l < lags->count; l++) {
        seconds += lag_of(answer, lags->finding[l]);
    }
    without_lags(answer, lags, &proposal.model);
    if (model_find(&proposal.model, pair->before->name) != NULL ||
        model_find(&proposal.model, pair->behind->name) != NULL) {
        model_free(&proposal.model);
        return true;
    }
    add_lag(&proposal.model, pair->behind, seconds * (1.0 - part));
    add_lag(&proposal.model, pair->before, seconds * part);
    const unsigned held_fast = set_by_voltage(answer, &proposal.model, pair->before);
    const bool good = weigh(state, &proposal.model, held_fast, &proposal.power, &proposal.preference);
    const preference_t *p = &proposal.preference;
    if (good && p->held_out > threshold.least_support &&
        p->position > threshold.naming_margin + threshold.number_price && p->columns > 0.0 &&
        (best->pair == NULL || p->position + p->columns > best->preference.position + best->preference.columns)) {
        if (best->pair != NULL) {
            model_free(&best->model);
        }
        *best = proposal;
    } else {
        model_free(&proposal.model);
    }
    return good;
}

/* One finding, or two, become the pair. */
static bool take_pair(state_t *state, const lags_t *lags, proposal_t *best) {
    answer_t *answer = &state->answer;
    const double margin = best->preference.position + best->preference.columns;
    const block_t *before = best->pair->before, *behind = best->pair->behind;
    finding_t *first = lags->finding[0];
    const block_t *one =
        first->block == before || (lags->count == 2 && lags->finding[1]->block == behind) ? before : behind;
    const block_t *other = one == before ? behind : before;
    unsigned spared = 1U << (first - answer->finding);
    if (lags->count == 1) {
        finding_t added = {.block = other, .certainty = NAMED, .margin = margin, .support = best->preference.held_out};
        if (!describe(state, &best->model, &added)) {
            return false;
        }
        spared |= 1U << answer->findings;
        findings_add(answer, &added);
        finding_considered_taken(answer, other);
    } else {
        spared |= 1U << (lags->finding[1] - answer->finding);
        if (lags->finding[1]->block != other) {
            rename_finding(answer, lags->finding[1], other, margin);
        }
    }
    if (first->block != one) {
        rename_finding(answer, first, one, margin);
    }
    state_take(state, &best->model, &best->power);
    return tidy(state, before, spared);
}

static bool split(state_t *state, const lags_t *lags, double part) {
    pair_t pairs[MOST_PAIRS];
    const size_t count = list_pairs(pairs);
    proposal_t best = {0};
    bool good = true;
    for (size_t i = 0; good && i < count; i++) {
        good = propose(state, lags, part, &pairs[i], &best);
    }
    if (best.pair != NULL && !(good && take_pair(state, lags, &best))) {
        good = false;
    }
    return good;
}

/* Whether the voltage shows some of a lag, but not all. */
static bool shows_a_part(const electrical_change_t *change) {
    return change->measured && change->part - threshold.deviations * change->sigma > threshold.hardly_any &&
           electrical_only_part(change);
}

static bool settle(state_t *state, finding_t *finding) {
    answer_t *answer = &state->answer;
    const size_t findings = answer->findings;
    const electrical_change_t voltage = sides_change(answer, finding, COLUMN_VOLTAGE);
    const lags_t alone = {1, {finding}};
    if (shows_a_part(&voltage) && findings < DIAGNOSIS_MOST_FINDINGS && !split(state, &alone, voltage.part)) {
        return false;
    }
    const block_t *other = other_side(finding->block);
    if (answer->findings > findings || other == NULL || model_find(&answer->model, other->name) != NULL) {
        return true;
    }
    const electrical_change_t change = voltage.measured ? voltage : sides_change(answer, finding, COLUMN_CURRENT);
    const change_verdict_t verdict = electrical_verdict(&change);
    const bool contradicted = finding->block->place == PLACE_ELECTRONICS
                                  ? verdict == CHANGE_ABSENT
                                  : verdict == CHANGE_PRESENT && !electrical_only_part(&change);
    return !contradicted || swap(state, finding);
}

bool sides_settle(state_t *state) {
    answer_t *answer = &state->answer;
    lags_t lags;
    bool good = true;
    find_lags(answer, &lags);
    if (lags.count == 2 && column_measured(&answer->question->samples, COLUMN_VOLTAGE)) {
        return split(state, &lags, 0.5);
    }
    for (size_t l = 0; good && l < lags.count; l++) {
        good = settle(state, lags.finding[l]);
    }
    return good;
}
