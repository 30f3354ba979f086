/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/review.h"
#include "belief/rivals.h"
#include "diagnosis/contest.h"
#include "diagnosis/delivered.h"
#include "diagnosis/evidence/electrical.h"
#include "diagnosis/findings.h"
#include "diagnosis/measured_columns.h"
#include "diagnosis/reconsider.h"
#include "thresholds/thresholds.h"
#include <math.h>

void review_begin(attempt_t *job, const model_t *chain) {
    diagnosis_t *d = job->diagnosis;
    model_t operated;
    chain_for_operator(chain, &operated);
    if (fitted_chain_open(&job->beside, &d->samples, &operated)) {
        shape_of(&job->beside, &job->setting, job->step_um, true, &d->shape);
    }
    model_free(&operated);
}

void review_close(attempt_t *job) {
    fitted_chain_close(&job->beside);
}

/* Whether the operator leaves nothing but noise, and no block says anything beside it. */
static bool is_only_shape(const diagnosis_t *d) {
    return d->shape.fitted && d->shape.whole && d->shape.silent;
}

/* Whether an operator leaves only noise, and the model clearly more. Where the drive never rests the noise was found
 * beside a model, and what that leaves counts as noise: so their errors are compared, too. */
static bool leaves_a_shape(const diagnosis_t *d, const shape_t *shape) {
    return shape->whole &&
           (d->remainder.structured || d->held_out_percent > threshold.clearly_more * shape->operator_percent);
}

/* The operator beside what was found. */
static void ask_after(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    if (d->findings > 0 && (is_only_shape(d) || d->remainder.structured || leaves_a_shape(d, &d->shape))) {
        shape_ask(&d->samples, &d->model, &job->setting, job->step_um, false, &d->shape_after);
    }
}

/* Whether a block says with its numbers what the operator needs many for. A lag on a path that is always travelled at
 * one speed is a function of the path, and a curve is one on any path: the operator imitates both. */
static bool is_worth_it(const attempt_t *job, size_t finding) {
    const diagnosis_t *d = job->diagnosis;
    shape_t without;
    model_t left_out;
    finding_left_out(d, &d->finding[finding], &left_out);
    shape_ask(&d->samples, &left_out, &job->setting, job->step_um, false, &without);
    model_free(&left_out);
    return d->shape_after.fitted &&
           (!without.fitted || d->shape_after.log_evidence > without.log_evidence + threshold.evidence_margin);
}

/* Takes out what is not, the latest first. So goes all that only comes near, beside one shape, where no block says
 * anything beside any. The model's error is not measured again. */
static bool take_out_imitated(attempt_t *job, bool *dropped) {
    const diagnosis_t *d = job->diagnosis;
    const bool nothing_speaks = is_only_shape(d) && d->verdict == UNKNOWN_PHYSICS;
    for (size_t f = d->findings; f-- > 0;) {
        if (!d->finding[f].in_readings && (nothing_speaks || !is_worth_it(job, f))) {
            if (!reconsider_take_out(job, f, SUPERFLUOUS)) {
                return false;
            }
            *dropped = true;
            shape_ask(&d->samples, &d->model, &job->setting, job->step_um, false, &job->diagnosis->shape_after);
        }
    }
    return true;
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
 * little. Only a strong finding can tell. Within a group a block may fail only because its form is too narrow: creep
 * that is free below 10 ms is nearer to a dielectric loss than to the catalogue's creep. */
static bool can_be(const attempt_t *job, const finding_t *finding, const model_t *left_out, const block_t *block) {
    const diagnosis_t *d = job->diagnosis;
    const bool strong =
        finding->held_out_after_percent < sqrt(threshold.contest_worth) * finding->held_out_before_percent;
    return !strong || leaves_a_shape(d, &d->shape_after) || block_same_group(block, finding->block) ||
           model_find(left_out, block->name) != NULL ||
           contest_stands(&d->samples, &job->setting, &d->model, left_out, block);
}

/* Blocks that are worth as much in the finding's place, beside a hysteresis of any shape, are what it can be confused
 * with. Those that the chain has already are not. */
static void add_rivals(attempt_t *job, finding_t *finding) {
    const diagnosis_t *d = job->diagnosis;
    rivals_t rivals = {0};
    fitted_chain_t fitted;
    model_t left_out, without;
    const size_t before = finding->rivals;
    finding_left_out(d, finding, &left_out);
    chain_for_operator(&left_out, &without);
    if (without.blocks == job->beside.imitation.chain.blocks) { /* the same: the search only adds blocks */
        rivals_of(&job->beside, &job->setting, finding->block, &rivals);
    } else if (fitted_chain_open(&fitted, &d->samples, &without)) {
        rivals_of(&fitted, &job->setting, finding->block, &rivals);
        fitted_chain_close(&fitted);
    }
    for (size_t r = 0; r < rivals.count && finding->rivals < DIAGNOSIS_MOST_RIVALS; r++) {
        if (!finding_has_rival(finding, rivals.rival[r]) && can_be(job, finding, &left_out, rivals.rival[r])) {
            finding_add_rival(finding, rivals.rival[r]);
        }
    }
    model_free(&left_out);
    model_free(&without);
    if (finding->rivals == before) {
        return;
    }
    finding->margin = fmin(finding->margin, fmax(0.0, 2.0 * (rivals.gain - rivals.best_gain)));
    finding_at_most(finding, rivals_are_of_its_group(finding) ? ISOLATED : DETECTED);
}

/* Where voltage or current was measured, sides.h has settled the lags: these columns say more than the position. */
static void ask_for_rivals(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    if (column_measured(&d->samples, COLUMN_VOLTAGE) || column_measured(&d->samples, COLUMN_CURRENT)) {
        return;
    }
    for (size_t f = 0; f < d->findings; f++) {
        if (!d->finding[f].in_readings && !d->finding[f].shape) {
            add_rivals(job, &d->finding[f]);
        }
    }
}

bool review_end(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    bool goes;
    d->shape_after = d->shape;
    if (!measured_columns_have_it(d, &goes, job->failure)) {
        return false;
    }
    if (goes) {
        return true;
    }
    if (!d->shape.fitted) {
        return true;
    }
    bool good = true, dropped = false;
    ask_after(job);
    if (is_only_shape(d) || leaves_a_shape(d, &d->shape_after)) {
        good = take_out_imitated(job, &dropped);
    }
    if (good && dropped) {
        good = findings_errors(d, job->failure) &&
               attempt_measure(job, &d->model, &d->nrmse_percent, &d->held_out_percent);
    }
    /* Blocks that only come near, and an operator, may together explain what is neither: a gain that steps is nearly a
     * drift. That stays unknown. One that was heard explains where the operator alone does not. What no finding is left
     * for stays unknown, too, though a block speaks beside the operator. */
    const bool near_only = d->verdict == UNKNOWN_PHYSICS && d->findings > 0 && (d->shape.whole || !d->finding[0].heard);
    if (good && d->shape_after.whole && !near_only && (is_only_shape(d) || d->findings > 0)) {
        d->another_shape = leaves_a_shape(d, &d->shape_after);
        for (size_t f = 0; f < d->findings; f++) {
            finding_t *finding = &d->finding[f];
            const bool may_be_bend = finding->shape && d->another_shape;
            finding->certainty = may_be_bend && finding->settled == NAMED ? ISOLATED : finding->settled;
        }
        d->remainder.structured = false;
        d->verdict = d->findings == 0 ? NOTHING_MISSING : EXPLAINED;
    } else if (good && dropped && d->findings == 0) {
        d->verdict = UNKNOWN_PHYSICS;
    }
    if (good) {
        ask_for_rivals(job);
    }
    return good;
}

/* The plain model in the place of both, if it leaves less of the held-out samples, by the measure of the others. */
static bool take_plain(attempt_t *job, const model_t *plain, double delivered) {
    diagnosis_t *d = job->diagnosis;
    double percent, held_out_percent;
    if (!attempt_measure(job, plain, &percent, &held_out_percent)) {
        return false;
    }
    if (held_out_percent < d->held_out_percent) {
        model_free(&d->baseline);
        model_free(&d->model);
        model_copy(&d->baseline, plain);
        model_copy(&d->model, plain);
        d->family = family_find("prandtl_ishlinskii");
        d->baseline_delivered_percent = d->delivered_percent = delivered;
        d->baseline_nrmse_percent = d->nrmse_percent = percent;
        d->baseline_held_out_percent = d->held_out_percent = held_out_percent;
    }
    return true;
}

bool review_delivered(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    model_t plain[2];
    double *percent[2] = {&d->line_percent, &d->plays_percent};
    const size_t plays[2] = {0, DELIVERED_PLAYS};
    bool good = true;
    d->baseline_delivered_percent = delivered_percent(&d->samples, &d->baseline);
    d->delivered_percent = delivered_percent(&d->samples, &d->model);
    for (size_t i = 0; i < 2; i++) {
        const bool fitted = delivered_plain(&d->samples, plays[i], &plain[i]);
        *percent[i] = fitted ? delivered_percent(&d->samples, &plain[i]) : HUGE_VAL;
        if (good && fitted && !d->model_given && d->findings == 0) {
            good = take_plain(job, &plain[i], *percent[i]);
        }
        if (fitted) {
            model_free(&plain[i]);
        }
    }
    d->another_shape = d->another_shape || (!d->remainder.structured && leaves_a_shape(d, &d->shape_after));
    return good;
}
