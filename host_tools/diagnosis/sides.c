/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/sides.h"
#include "chain/catalogue.h"
#include "diagnosis/evidence/candidate.h"
#include "diagnosis/findings.h"
#include "diagnosis/reconsider.h"
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

static double lag_of(const diagnosis_t *d, const finding_t *finding) {
    const double number = d->model.block[finding_index(d, finding)].parameter[0].value[0];
    return finding->block->lag == LAG_DELAY ? number : 1.0 / (2.0 * M_PI * number);
}

electrical_change_t sides_change(const diagnosis_t *d, const finding_t *finding, column_t column) {
    electrical_change_t change = {0};
    const block_t *block = sides_block(finding->block);
    if (block != NULL && column_measured(&d->samples, column)) {
        model_t without, with;
        finding_left_out(d, finding, &without);
        model_copy(&with, block == finding->block ? &d->model : &without);
        if (block != finding->block) {
            add_lag(&with, block, lag_of(d, finding));
        }
        change = electrical_change(&d->samples, column, &without, &with);
        model_free(&without);
        model_free(&with);
    }
    return change;
}

bool sides_only_part(const electrical_change_t *change) {
    return change->part + threshold.deviations * change->sigma < threshold.nearly_all;
}

/* 2 log likelihood that the columns give the electronics of a model, compared with the baseline's. */
static double by_columns(const diagnosis_t *d, const model_t *model) {
    return electrical_preference(&d->samples, &d->baseline, model);
}

/* How much a proposal is preferred to the model, as 2 log likelihood. */
typedef struct {
    double position; /* by all samples of the position; by the held-out ones among them */
    double held_out;
    double columns;
} preference_t;

/* Fits the proposal except for some blocks (bits). */
static bool weigh(attempt_t *job, model_t *proposal, unsigned held_fast, joint_power_t *power,
                  preference_t *preference) {
    const diagnosis_t *d = job->diagnosis;
    const unsigned free_blocks = attempt_blocks_fitted(d, proposal) & ~held_fast;
    if (!joint_fit(&d->samples, &d->noise, proposal, free_blocks, ATTEMPT_ITERATIONS, power, job->failure)) {
        return false;
    }
    preference->held_out = (double)d->samples.held * log(job->power.held / power->held);
    preference->position = (double)d->samples.fitted * log(job->power.fitted / power->fitted) + preference->held_out;
    preference->columns = by_columns(d, proposal) - by_columns(d, &d->model);
    return true;
}

static void keep(attempt_t *job, model_t *proposal, const joint_power_t *power) {
    model_free(&job->diagnosis->model);
    job->diagnosis->model = *proposal;
    job->power = *power;
}

/* The finding is of the other block. */
static void rename_finding(diagnosis_t *d, finding_t *finding, const block_t *block, double margin) {
    finding_rename(d, finding, block, CONTRADICTED);
    finding->certainty = NAMED;
    finding->rivals = 0;
    finding->margin = margin;
}

static bool swap(attempt_t *job, finding_t *finding) {
    diagnosis_t *d = job->diagnosis;
    const block_t *block = other_side(finding->block);
    model_t proposal;
    joint_power_t power;
    preference_t preference;
    finding_left_out(d, finding, &proposal);
    add_lag(&proposal, block, lag_of(d, finding));
    const bool good = weigh(job, &proposal, 0, &power, &preference);
    if (good && preference.position + preference.columns > threshold.naming_margin) {
        rename_finding(d, finding, block, preference.position + preference.columns);
        keep(job, &proposal, &power);
    } else {
        model_free(&proposal);
    }
    return good;
}

/* The finding that stands for the second lag: what it explains of what the chain leaves without it. */
static bool describe(attempt_t *job, const model_t *proposal, finding_t *added) {
    const diagnosis_t *d = job->diagnosis;
    double ignored;
    evidence_t *evidence = evidence_open(&d->model, &d->samples, &d->noise, job->failure);
    if (evidence == NULL) {
        return false;
    }
    double *change = samples_change(&d->samples, proposal, &d->model, job->failure);
    const bool good = change != NULL && attempt_measure(job, &d->model, &ignored, &added->held_out_before_percent) &&
                      attempt_measure(job, proposal, &ignored, &added->held_out_after_percent);
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
static unsigned set_by_voltage(const diagnosis_t *d, model_t *model, const block_t *before) {
    lag_search_t search = {&d->samples, model, 0};
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
static bool tidy(attempt_t *job, const block_t *before, unsigned spared) {
    diagnosis_t *d = job->diagnosis;
    model_t again;
    joint_power_t power;
    preference_t ignored;
    if (!reconsider_superfluous(job, threshold.least_part_of_found * job->found_um / d->noise.sigma_um, spared)) {
        return false;
    }
    model_copy(&again, &d->model);
    const bool good = weigh(job, &again, set_by_voltage(d, &again, before), &power, &ignored);
    if (good) {
        keep(job, &again, &power);
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

static void find_lags(diagnosis_t *d, lags_t *lags) {
    *lags = (lags_t){0};
    for (size_t f = 0; f < d->findings; f++) {
        if (d->finding[f].block->lag != LAG_NONE) {
            lags->finding[lags->count++] = &d->finding[f];
        }
    }
}

static void without_lags(const diagnosis_t *d, const lags_t *lags, model_t *without) {
    model_copy(without, &d->model);
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
static bool propose(attempt_t *job, const lags_t *lags, double part, const pair_t *pair, proposal_t *best) {
    const diagnosis_t *d = job->diagnosis;
    double seconds = 0.0;
    proposal_t proposal = {.pair = pair};
    for (size_t l = 0; l < lags->count; l++) {
        seconds += lag_of(d, lags->finding[l]);
    }
    without_lags(d, lags, &proposal.model);
    if (model_find(&proposal.model, pair->before->name) != NULL ||
        model_find(&proposal.model, pair->behind->name) != NULL) {
        model_free(&proposal.model);
        return true;
    }
    add_lag(&proposal.model, pair->behind, seconds * (1.0 - part));
    add_lag(&proposal.model, pair->before, seconds * part);
    const unsigned held_fast = set_by_voltage(d, &proposal.model, pair->before);
    const bool good = weigh(job, &proposal.model, held_fast, &proposal.power, &proposal.preference);
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
static bool take_pair(attempt_t *job, const lags_t *lags, proposal_t *best) {
    diagnosis_t *d = job->diagnosis;
    const double margin = best->preference.position + best->preference.columns;
    const block_t *before = best->pair->before, *behind = best->pair->behind;
    finding_t *first = lags->finding[0];
    const block_t *one =
        first->block == before || (lags->count == 2 && lags->finding[1]->block == behind) ? before : behind;
    const block_t *other = one == before ? behind : before;
    unsigned spared = 1U << (first - d->finding);
    if (lags->count == 1) {
        finding_t added = {.block = other, .certainty = NAMED, .margin = margin, .support = best->preference.held_out};
        if (!describe(job, &best->model, &added)) {
            return false;
        }
        spared |= 1U << d->findings;
        findings_add(d, &added);
        finding_considered_taken(d, other);
    } else {
        spared |= 1U << (lags->finding[1] - d->finding);
        if (lags->finding[1]->block != other) {
            rename_finding(d, lags->finding[1], other, margin);
        }
    }
    if (first->block != one) {
        rename_finding(d, first, one, margin);
    }
    keep(job, &best->model, &best->power);
    return tidy(job, before, spared);
}

static bool split(attempt_t *job, const lags_t *lags, double part) {
    pair_t pairs[MOST_PAIRS];
    const size_t count = list_pairs(pairs);
    proposal_t best = {0};
    bool good = true;
    for (size_t i = 0; good && i < count; i++) {
        good = propose(job, lags, part, &pairs[i], &best);
    }
    if (best.pair != NULL && !(good && take_pair(job, lags, &best))) {
        good = false;
    }
    return good;
}

/* Whether the voltage shows some of a lag, but not all. */
static bool shows_a_part(const electrical_change_t *change) {
    return change->measured && change->part - threshold.deviations * change->sigma > threshold.hardly_any &&
           sides_only_part(change);
}

static bool settle(attempt_t *job, finding_t *finding) {
    diagnosis_t *d = job->diagnosis;
    const size_t findings = d->findings;
    const electrical_change_t voltage = sides_change(d, finding, COLUMN_VOLTAGE);
    const lags_t alone = {1, {finding}};
    if (shows_a_part(&voltage) && findings < DIAGNOSIS_MOST_FINDINGS && !split(job, &alone, voltage.part)) {
        return false;
    }
    const block_t *other = other_side(finding->block);
    if (d->findings > findings || other == NULL || model_find(&d->model, other->name) != NULL) {
        return true;
    }
    const electrical_change_t change = voltage.measured ? voltage : sides_change(d, finding, COLUMN_CURRENT);
    const change_verdict_t verdict = electrical_verdict(&change);
    const bool contradicted = finding->block->place == PLACE_ELECTRONICS
                                  ? verdict == CHANGE_ABSENT
                                  : verdict == CHANGE_PRESENT && !sides_only_part(&change);
    return !contradicted || swap(job, finding);
}

bool sides_settle(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    lags_t lags;
    bool good = true;
    find_lags(d, &lags);
    if (lags.count == 2 && column_measured(&d->samples, COLUMN_VOLTAGE)) {
        return split(job, &lags, 0.5);
    }
    for (size_t l = 0; good && l < lags.count; l++) {
        good = settle(job, lags.finding[l]);
    }
    return good;
}
