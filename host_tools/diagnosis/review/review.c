/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/review/review.h"
#include "base/parallel.h"
#include "belief/rivals.h"
#include "chain/catalogue.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/columns/measured_columns.h"
#include "diagnosis/evidence/electrical.h"
#include "diagnosis/judgement/reconsider.h"
#include "diagnosis/judgement/verdict.h"
#include "diagnosis/nuisance/past_choice.h"
#include "diagnosis/review/delivered.h"
#include "diagnosis/review/taken_out.h"
#include "diagnosis/search/contest.h"
#include "thresholds/thresholds.h"
#include <math.h>

/* Whether the operator leaves nothing but noise, and no block says anything beside it. */
static bool is_only_shape(const answer_t *answer) {
    const question_t *question = answer->question;
    return question->shape.fitted && question->shape.whole && question->shape.silent;
}

/* Whether that is all that is missing: nothing was found, and beside the operator only curves speak. A hysteresis
 * bends, too, which the operator's many numbers say at a higher price than a curve's few. */
static bool is_bent_shape(const answer_t *answer) {
    const question_t *question = answer->question;
    return answer->findings == 0 && question->shape.fitted && question->shape.whole && question->shape.bends;
}

/* Whether an operator leaves only noise, and the model clearly more. Where the drive never rests the noise was found
 * beside a model, and what that leaves counts as noise: so their errors are compared, too. */
static bool leaves_a_shape(const answer_t *answer, const shape_t *shape) {
    return shape->whole && (answer->remainder.structured ||
                            answer->held_out_percent > threshold.clearly_more * shape->operator_percent);
}

/* Where voltage or current was measured, sides.h has settled the lags: these columns say more than the position. */
static bool may_have_rivals(const state_t *state, const finding_t *finding) {
    const samples_t *samples = &state->answer.question->samples;
    return !finding->in_readings && !finding->shape && !column_measured(samples, COLUMN_VOLTAGE) &&
           !column_measured(samples, COLUMN_CURRENT);
}

/* Whether the chain without the finding is the one that the question has asked about: the search only adds blocks. */
static bool is_only_addition(const state_t *state, const finding_t *finding) {
    model_t left_out, without;
    finding_left_out(&state->answer, finding, &left_out);
    chain_for_operator(&left_out, &without);
    const bool is = without.blocks == state->beside->imitation.chain.blocks;
    model_free(&left_out);
    model_free(&without);
    return is;
}

static bool is_strong(const finding_t *finding) {
    return finding->held_out_after_percent < sqrt(threshold.contest_worth) * finding->held_out_before_percent;
}

/* Its numbers, for rivals_of. */
static const model_block_t *strong_numbers(const answer_t *answer, const finding_t *finding) {
    return is_strong(finding) ? model_find(&answer->model, finding->block->name) : NULL;
}

/* What a review asks the operator for, where two processors have something to do. Beside what was found, and without
 * each finding, the latest first: where one goes, what is left of them was fitted for nothing. The fit without a curve
 * is needed only if the operator leaves nothing. */
static void fit_what_is_asked(const state_t *state) {
    const answer_t *answer = &state->answer;
    model_t chain[KEPT_CHAINS];
    size_t count = 0;
    model_copy(&chain[count++], &answer->model);
    for (size_t f = answer->findings; f-- > 0 && count < KEPT_CHAINS;) {
        if (!answer->finding[f].in_readings && !answer->finding[f].shape) {
            finding_left_out(answer, &answer->finding[f], &chain[count++]);
        }
    }
    state_fit_beside(state, chain, count);
    for (size_t i = 0; i < count; i++) {
        model_free(&chain[i]);
    }
}

/* Rivals that were looked for before it is known that their finding stays. */
typedef struct {
    const block_t *block; /* of the finding; NULL: none were */
    rivals_t rivals;
} early_rivals_t;

/* Two tasks. The first writes the chains that are kept, the second what it finds, and the rows of `beside`. */
typedef struct {
    const state_t *state;
    const finding_t *finding;
    early_rivals_t *early;
} asked_t;

static void ask_at_once(void *context, size_t index) {
    const asked_t *asked = context;
    if (index == 0) {
        fit_what_is_asked(asked->state);
    } else {
        asked->early->block = asked->finding->block;
        rivals_of(asked->state->beside, &asked->state->setting, asked->finding->block,
                  strong_numbers(&asked->state->answer, asked->finding), &asked->early->rivals);
    }
}

/* The operator beside what was found. */
static void ask_after(state_t *state, early_rivals_t *early) {
    answer_t *answer = &state->answer;
    asked_t asked = {.state = state, .early = early};
    if (answer->findings == 0) {
        return;
    }
    for (size_t f = 0; f < answer->findings; f++) {
        if (may_have_rivals(state, &answer->finding[f]) && probe_is_first(answer->finding[f].block->probe) &&
            is_only_addition(state, &answer->finding[f])) {
            asked.finding = &answer->finding[f];
        }
    }
    parallel(asked.finding != NULL ? 2 : 1, ask_at_once, &asked);
    state_ask_shape(state, &answer->model, &answer->shape_after);
}

/* The operator beside all that was found but this. */
static shape_t shape_without(const state_t *state, const finding_t *finding) {
    model_t left_out;
    shape_t shape;
    finding_left_out(&state->answer, finding, &left_out);
    state_ask_shape(state, &left_out, &shape);
    model_free(&left_out);
    return shape;
}

/* Whether a block says with its numbers what the operator needs many for. A lag on a path that is always travelled at
 * one speed is a function of the path, and a curve is one on any path: the operator imitates both, on samples that no
 * fit saw, too. What is only called noise of 1/f without the block, as a drift may be, it does not imitate: then there
 * is more of that noise without it. */
static bool is_worth_it(const state_t *state, size_t finding) {
    const answer_t *answer = &state->answer;
    if (!answer->shape_after.fitted) {
        return false;
    }
    const shape_t without = shape_without(state, &answer->finding[finding]);
    return !without.fitted || answer->shape_after.log_evidence > without.log_evidence + threshold.evidence_margin ||
           (without.rho_hz > answer->shape_after.rho_hz &&
            without.operator_percent > threshold.clearly_more * answer->shape_after.operator_percent);
}

/* Takes out what is not, the latest first; what was worth it beside that has to be so without. So goes all that only
 * comes near, beside one shape, where no block says anything beside any. The model's error is not measured again. */
static bool take_out_imitated(state_t *state, bool *dropped) {
    const answer_t *answer = &state->answer;
    const bool nothing_speaks = is_only_shape(answer) && answer->verdict == UNKNOWN_PHYSICS;
    for (size_t f = answer->findings; f-- > 0;) {
        if (!answer->finding[f].in_readings && (nothing_speaks || !is_worth_it(state, f))) {
            if (!reconsider_take_out(state, f, SUPERFLUOUS)) {
                return false;
            }
            *dropped = true;
            state_ask_shape(state, &answer->model, &state->answer.shape_after);
            f = answer->findings;
        }
    }
    return true;
}

/* A curve that only comes near, beside an error that nothing explains, is no finding: the hysteresis has bends, too.
 * The latest first. */
static bool take_out_curves(state_t *state, bool *dropped) {
    const answer_t *answer = &state->answer;
    for (size_t f = answer->findings; answer->verdict == UNKNOWN_PHYSICS && f-- > 0;) {
        if (answer->finding[f].shape) {
            if (!reconsider_take_out(state, f, A_BEND)) {
                return false;
            }
            *dropped = true;
        }
    }
    return true;
}

static bool measure_again(state_t *state) {
    answer_t *answer = &state->answer;
    return findings_errors(answer, state->failure) &&
           state_measure(state, &answer->model, &answer->nrmse_percent, &answer->held_out_percent);
}

static bool rivals_are_of_its_group(const finding_t *finding) {
    for (size_t r = 0; r < finding->rivals; r++) {
        if (!block_same_group(finding->rival[r], finding->block)) {
            return false;
        }
    }
    return true;
}

/* Whether a block of another group, in the finding's place and fitted together with the hysteresis, leaves about as
 * little. Only a strong finding can tell, and only where the model has the hysteresis' shape. Within a group a block
 * may fail only because its form is too narrow: creep that goes on below 1 ms is nearer to a dielectric loss than to
 * the catalogue's creep. Lags have nothing but their forms to tell them by. */
static bool can_be(const state_t *state, bool strong, const finding_t *finding, const model_t *left_out,
                   const block_t *block) {
    const answer_t *answer = &state->answer;
    const bool lags = block->lag != LAG_NONE && finding->block->lag != LAG_NONE;
    return !strong || (block_same_group(block, finding->block) && !lags) || model_find(left_out, block->name) != NULL ||
           contest_stands(&answer->question->samples, &state->setting, &answer->model, left_out, block);
}

/* Blocks that are worth as much in the finding's place, beside a hysteresis of any shape, are what it can be confused
 * with. Those that the chain has already are not. */
static void add_rivals(state_t *state, const early_rivals_t *early, finding_t *finding) {
    const answer_t *answer = &state->answer;
    rivals_t rivals = {0};
    model_t left_out;
    const size_t before = finding->rivals;
    const bool strong = is_strong(finding);
    const bool other_shape = leaves_a_shape(answer, &answer->shape_after);
    finding_left_out(answer, finding, &left_out);
    if (!probe_is_first(finding->block->probe)) {
        fitted_chain_t *fitted = state_fitted(state, &left_out);
        if (fitted != NULL) {
            rivals_elsewhere(fitted, &state->setting, model_find(&answer->model, finding->block->name), &rivals);
        }
    } else if (early->block == finding->block) {
        rivals = early->rivals;
    } else {
        fitted_chain_t *fitted = is_only_addition(state, finding) ? state->beside : state_fitted(state, &left_out);
        if (fitted != NULL) {
            rivals_of(fitted, &state->setting, finding->block, strong_numbers(answer, finding), &rivals);
        }
    }
    for (size_t r = 0; r < rivals.count && finding->rivals < DIAGNOSIS_MOST_RIVALS; r++) {
        if (!finding_has_rival(finding, rivals.rival[r]) &&
            can_be(state, strong && !other_shape, finding, &left_out, rivals.rival[r])) {
            finding_add_rival(finding, rivals.rival[r]);
        }
    }
    model_free(&left_out);
    if (finding->rivals == before) {
        return;
    }
    finding->margin = fmin(finding->margin, fmax(0.0, 2.0 * (rivals.gain - rivals.best_gain)));
    finding_at_most(finding, rivals_are_of_its_group(finding) ? ISOLATED : DETECTED);
}

static void ask_for_rivals(state_t *state, const early_rivals_t *early) {
    answer_t *answer = &state->answer;
    for (size_t f = 0; f < answer->findings; f++) {
        if (may_have_rivals(state, &answer->finding[f])) {
            add_rivals(state, early, &answer->finding[f]);
        }
    }
}

/* The hysteresis itself, bent: what is a curve of it and what one of the sensor, no recording of the position tells. */
static void add_bends(const answer_t *answer, finding_t *finding) {
    for (size_t i = 0; i < catalogue_count; i++) {
        const block_t *block = catalogue[i];
        if (block != finding->block && block->modifies_hysteresis && block->probe != NULL &&
            block_same_group(block, finding->block) && model_find(&answer->model, block->name) == NULL) {
            finding_add_rival(finding, block);
        }
    }
}

static bool found_a_curve(const answer_t *answer) {
    bool found = false;
    for (size_t f = 0; f < answer->findings; f++) {
        found = found || answer->finding[f].shape;
    }
    return found;
}

bool review_end(state_t *state) {
    answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    bool goes;
    answer->shape_after = question->shape;
    if (!measured_columns_have_it(answer, &goes, state->failure)) {
        return false;
    }
    if (goes) {
        return true;
    }
    if (!question->shape.fitted) {
        return true;
    }
    bool good = true, dropped = false;
    early_rivals_t early = {0};
    ask_after(state, &early);
    if (is_only_shape(answer) || answer->shape_after.whole) {
        good = take_out_imitated(state, &dropped);
    }
    good = good && (!dropped || measure_again(state));
    /* A curve that only comes near, and an operator, may together explain what is neither. What no finding is left for
     * stays unknown where a block that is no curve speaks beside the operator. */
    const bool near = answer->verdict == UNKNOWN_PHYSICS;
    if (good && answer->shape_after.whole && !(near && found_a_curve(answer)) &&
        (is_only_shape(answer) || is_bent_shape(answer) || answer->findings > 0)) {
        /* Of what only comes near, the operator has to leave no more than noise that was found otherwise. */
        const bool partly =
            near && answer->findings > 0 &&
            !shape_within_noise(&answer->shape_after, &question->samples, question->step_um, question->noise.rms_um);
        answer->another_shape = leaves_a_shape(answer, &answer->shape_after);
        for (size_t f = 0; f < answer->findings; f++) {
            finding_t *finding = &answer->finding[f];
            const bool may_be_bend = finding->shape && (answer->another_shape || question->shape.whole ||
                                                        shape_without(state, finding).whole);
            finding->certainty = finding->settled;
            if (partly && !finding->in_readings) {
                finding_at_most(finding, ISOLATED);
            }
            if (may_be_bend) {
                finding_at_most(finding, ISOLATED);
                add_bends(answer, finding);
            }
        }
        answer->remainder.structured = false;
        answer->verdict = answer->findings == 0 ? NOTHING_MISSING : partly ? PARTLY_EXPLAINED : EXPLAINED;
    } else if (good && dropped && answer->findings == 0) {
        answer->verdict = UNKNOWN_PHYSICS;
    }
    bool curves = false;
    good = good && take_out_curves(state, &curves) && (!curves || (measure_again(state) && verdict_look(state)));
    if (good) {
        const early_rivals_t none = {0};
        ask_for_rivals(state, dropped || curves ? &none : &early);
    }
    return good;
}

/* A past for the model that is written, where it begins with one that it does not deliver by: beside what was taken out
 * of the errors, any past did. Not if that costs the samples that count something. */
static bool choose_past_to_deliver(state_t *state, model_t *model, double *delivered, double *percent,
                                   double *held_out_percent) {
    const samples_t *samples = &state->answer.question->samples;
    model_t with;
    double told, held_out;
    if (!(*delivered > threshold.clearly_more * fmax(*percent, *held_out_percent))) {
        return true;
    }
    model_copy(&with, model);
    bool good = true;
    if (choose_past_by_error(samples, delivered_percent, *delivered, &with)) {
        good = state_measure(state, &with, &told, &held_out);
        if (good && held_out < threshold.clearly_more * *held_out_percent) {
            const model_t before = *model;
            *model = with;
            with = before;
            *percent = told;
            *held_out_percent = held_out;
            *delivered = delivered_percent(samples, model);
        }
    }
    model_free(&with);
    return good;
}

/* A plain model in the baseline's place, if it delivers less; and, where nothing was found, in the model's. */
static bool take_plain(state_t *state, const model_t *plain, double delivered) {
    answer_t *answer = &state->answer;
    double percent, held_out_percent;
    if (!(delivered < answer->baseline_delivered_percent)) {
        return true;
    }
    if (!state_measure(state, plain, &percent, &held_out_percent)) {
        return false;
    }
    /* What it delivers may be more in the beginning alone, where no memory is right; then it is the better model. */
    if (held_out_percent > threshold.clearly_more * answer->baseline_held_out_percent) {
        return true;
    }
    model_free(&answer->baseline);
    model_copy(&answer->baseline, plain);
    answer->baseline_delivered_percent = delivered;
    answer->baseline_nrmse_percent = percent;
    answer->baseline_held_out_percent = held_out_percent;
    if (answer->findings == 0) {
        model_free(&answer->model);
        model_copy(&answer->model, plain);
        answer->family = family_find("prandtl_ishlinskii");
        answer->delivered_percent = delivered;
        answer->nrmse_percent = percent;
        answer->held_out_percent = held_out_percent;
    }
    return true;
}

/* What the models deliver that the diagnosis would write. */
static bool measure_delivered(state_t *state) {
    answer_t *answer = &state->answer;
    const samples_t *samples = &answer->question->samples;
    answer->baseline_delivered_percent = delivered_percent(samples, &answer->baseline);
    if (!choose_past_to_deliver(state, &answer->baseline, &answer->baseline_delivered_percent,
                                &answer->baseline_nrmse_percent, &answer->baseline_held_out_percent)) {
        return false;
    }
    answer->delivered_percent = delivered_percent(samples, &answer->model);
    return choose_past_to_deliver(state, &answer->model, &answer->delivered_percent, &answer->nrmse_percent,
                                  &answer->held_out_percent);
}

bool review_delivered(state_t *state) {
    answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    double *percent[2] = {&answer->line_percent, &answer->plays_percent};
    const size_t plays[2] = {0, DELIVERED_PLAYS};
    bool good = measure_delivered(state);
    for (size_t i = 0; i < 2; i++) {
        model_t plain;
        const bool fitted = delivered_plain(&question->samples, plays[i], &plain);
        *percent[i] = fitted ? delivered_percent(&question->samples, &plain) : HUGE_VAL;
        if (good && fitted && !question->model_given) {
            good = take_plain(state, &plain, *percent[i]);
        }
        if (fitted) {
            model_free(&plain);
        }
    }
    answer->another_shape =
        answer->another_shape || (!answer->remainder.structured && leaves_a_shape(answer, &answer->shape_after));
    return good &&
           (!question->samples.past_matters || taken_out_past_percent(answer, &answer->past_percent, state->failure));
}
