/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "attempt.h"
#include "baseline.h"
#include "candidate_judgement.h"
#include "catalogue.h"
#include "findings.h"
#include "lattice.h"
#include "measured_columns.h"
#include "names.h"
#include "search.h"
#include "sides.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* 2 log likelihood by which a name has to win. 20: a factor of 22000. */
const double attempt_naming_margin = 20.0;
static const double same_signature = 0.95;
/* What the held-out samples have to say for it, in parts of what the others say, sample by sample. */
static const double least_support = 0.3;
const double attempt_least_support = 12.0;
static const double support_enough = 100.0;
/* Steps of the converter whose error is smaller than this part of the noise are nobody's concern. */
static const double least_steps = 0.1;
const double attempt_least_part_of_found = 0.1;
const double attempt_worth_explaining = 0.05;
/* Where the shape of the hysteresis is free, another one takes the place of a smaller curve: in parts of the noise. */
static const double least_curve = 3.0;
enum { BASELINE_ITERATIONS = 4 };

void attempt_advance(attempt_t *job) {
    job->left *= 0.85;
    progress_update(&job->progress, 1.0 - job->left);
}

bool attempt_measure(const attempt_t *job, const model_t *model, double *percent, double *held_out_percent) {
    const samples_t *samples = &job->diagnosis->samples;
    double *simulated = samples_column(samples);
    const bool good = samples_simulate(samples, model, simulated, job->failure);
    if (good) {
        *percent = samples_nrmse_percent(samples, SAMPLE_FITTED, simulated);
        *held_out_percent = samples_nrmse_percent(samples, SAMPLE_HELD_OUT, simulated);
    }
    free(simulated);
    return good;
}

unsigned attempt_blocks_found(const diagnosis_t *d, const model_t *model) {
    unsigned blocks = 0;
    for (size_t b = 0; b < model->blocks; b++) {
        const block_t *block = model->block[b].block;
        blocks |= block->probe != NULL && model_find(&d->baseline, block->name) == NULL ? 1U << b : 0U;
    }
    return blocks;
}

static void name(const evidence_t *evidence, const candidates_t *found, finding_t *finding) {
    const candidate_t *best = &found->candidate[0];
    *finding = (finding_t){.block = best->block,
                           .t = best->test.t,
                           .t_blocks = best->test.t_blocks,
                           .margin = HUGE_VAL,
                           .certainty = NAMED};
    for (size_t i = 1; i < found->count; i++) {
        const candidate_t *rival = &found->candidate[i];
        if (rival->signature == NULL) {
            continue;
        }
        const double margin = search_margin(found, i);
        finding->margin = fmin(finding->margin, margin);
        if (margin < attempt_naming_margin && finding->rivals < DIAGNOSIS_MOST_RIVALS) {
            finding->rival[finding->rivals++] = rival->block;
            if (finding->certainty == NAMED) {
                finding->certainty = ISOLATED;
            }
            if (strcmp(rival->block->probe->group, best->block->probe->group) != 0 &&
                fabs(evidence_cosine(evidence, best->signature, rival->signature)) < same_signature) {
                finding->certainty = DETECTED;
            }
        }
    }
}

/* Takes the candidate into the chain if the held-out samples support it. */
static bool accept(attempt_t *job, const candidate_t *candidate, finding_t *finding, bool *accepted) {
    diagnosis_t *d = job->diagnosis;
    const double share = fmin((double)d->samples.held / (double)d->samples.fitted, candidate->test.held_share);
    joint_power_t power;
    double ignored;
    model_t augmented;
    model_copy(&augmented, &candidate->model);
    *accepted = false;
    if (!joint_fit(&d->samples, &d->noise, &augmented, attempt_blocks_found(d, &augmented), ATTEMPT_ITERATIONS, &power,
                   job->failure) ||
        !attempt_measure(job, &d->model, &ignored, &finding->held_out_before_percent) ||
        !attempt_measure(job, &augmented, &ignored, &finding->held_out_after_percent)) {
        model_free(&augmented);
        return false;
    }
    finding->support = (double)d->samples.held * log(job->power.held / power.held);
    *accepted = finding->held_out_after_percent < finding->held_out_before_percent &&
                finding->support >
                    fmax(attempt_least_support, fmin(least_support * share * candidate->likelihood, support_enough));
    if (*accepted) {
        model_free(&d->model);
        d->model = augmented;
        d->finding[d->findings++] = *finding;
        job->power = power;
        job->found_um = hypot(job->found_um, candidate_own_um(candidate));
    } else {
        model_free(&augmented);
    }
    return true;
}

/* Keeps the best of a round for the outputs. */
static void remember(diagnosis_t *d, const candidates_t *found, outcome_t best) {
    enum { MOST = DIAGNOSIS_MOST_CONSIDERED / 10 };
    d->rounds++;
    for (size_t i = 0; i < found->count && i < MOST && d->considered < DIAGNOSIS_MOST_CONSIDERED; i++) {
        const candidate_t *c = &found->candidate[i];
        if (c->likelihood > 0.0) {
            d->consideration[d->considered++] =
                (considered_t){.block = c->block,
                               .round = d->rounds,
                               .likelihood = c->likelihood,
                               .t = c->test.t,
                               .t_blocks = c->test.t_blocks,
                               .outcome = candidate_contradicted(c)           ? CONTRADICTED
                                          : i == 0 || best == NOT_SIGNIFICANT ? best
                                                                              : LESS_LIKELY};
        }
    }
}

/* What the blocks that were tried in vain would have had to be like to be seen. */
static void note_unseen(diagnosis_t *d, const candidates_t *found) {
    for (size_t i = 0; i < found->count && d->unseen_count < DIAGNOSIS_MOST_UNSEEN; i++) {
        const candidate_t *c = &found->candidate[i];
        const double least_um = c->block->probe->shape && d->family != NULL ? least_curve * d->noise.rms_um : 0.0;
        const double smallest_um = fmax(c->smallest_um, least_um), larger = smallest_um / c->smallest_um;
        unseen_t unseen = {.block = c->block,
                           .testable = isfinite(c->smallest_um),
                           .smallest_um = smallest_um,
                           .parameter = c->block->parameters};
        for (size_t p = c->block->parameters; p-- > 0;) {
            if (c->block->parameter[p].proportional && c->smallest_value[p] != 0.0) {
                unseen.parameter = p;
                unseen.value = larger * c->smallest_value[p];
                unseen.testable = unseen.testable && fabs(unseen.value) <= c->block->parameter[p].high;
            }
        }
        d->unseen[d->unseen_count++] = unseen;
    }
}

double attempt_excess(const diagnosis_t *d, double held) {
    return held / ((double)d->samples.held * d->noise.sigma_um * d->noise.sigma_um) - 1.0;
}

/* One more block of those that the question is about, or none. */
static bool find_among(attempt_t *job, evidence_t *evidence, question_t question, bool *found_one) {
    diagnosis_t *d = job->diagnosis;
    const search_problem_t problem = {.evidence = evidence,
                                      .noise = &d->noise,
                                      .baseline = &d->model,
                                      .setting = &job->setting,
                                      .without = job->without};
    candidates_t found;
    finding_t finding;
    bool good = true;
    evidence_ask(evidence, question);
    search(&problem, &found);
    attempt_advance(job);
    d->tested += found.tested;
    const bool significant_one = found.count > 0 && candidate_convinces(job, evidence, &found);
    if (significant_one) {
        name(evidence, &found, &finding);
        finding.shape = question != ASK_EFFECTS;
        good = accept(job, &found.candidate[0], &finding, found_one);
    }
    remember(d, &found, !significant_one ? NOT_SIGNIFICANT : *found_one ? TAKEN : NOT_SUPPORTED);
    if (!*found_one && question != ASK_ANYTHING) {
        note_unseen(d, &found);
    }
    candidates_free(&found);
    return good;
}

static bool find_one(attempt_t *job, bool *found_one) {
    diagnosis_t *d = job->diagnosis;
    evidence_t *evidence = evidence_open(&d->model, &d->samples, &d->noise, job->failure);
    bool good = evidence != NULL;
    *found_one = false;
    attempt_advance(job);
    if (good) {
        d->unseen_count = 0;
        job->setting.lines = baseline_lines(&d->samples, evidence_residual(evidence), job->line_hz);
    }
    for (question_t question = ASK_EFFECTS; good && !*found_one && question <= ASK_ANYTHING; question++) {
        if (question != ASK_ANYTHING || attempt_excess(d, job->power.held) > attempt_worth_explaining) {
            good = find_among(job, evidence, question, found_one);
        }
    }
    evidence_close(evidence);
    return good;
}

/* The model without a finding, fitted again. */
static bool fit_without(attempt_t *job, const finding_t *finding, model_t *without, joint_power_t *power) {
    const diagnosis_t *d = job->diagnosis;
    finding_left_out(d, finding, without);
    attempt_advance(job);
    if (!joint_fit(&d->samples, &d->noise, without, attempt_blocks_found(d, without), ATTEMPT_ITERATIONS, power,
                   job->failure)) {
        model_free(without);
        return false;
    }
    return true;
}

/* The finding goes, and its model with it. */
static void drop(attempt_t *job, size_t finding, outcome_t why, model_t *without, const joint_power_t *power) {
    diagnosis_t *d = job->diagnosis;
    finding_considered_gone(d, d->finding[finding].block, why);
    memmove(&d->finding[finding], &d->finding[finding + 1], (d->findings - finding - 1) * sizeof d->finding[0]);
    d->findings--;
    model_free(&d->model);
    d->model = *without;
    job->power = *power;
}

bool attempt_take_out(attempt_t *job, size_t finding, outcome_t why) {
    model_t without;
    joint_power_t power;
    const bool good = fit_without(job, &job->diagnosis->finding[finding], &without, &power);
    if (good) {
        drop(job, finding, why, &without, &power);
    }
    return good;
}

bool attempt_reconsider(attempt_t *job, double least_size, unsigned spared) {
    diagnosis_t *d = job->diagnosis;
    const double least = least_size * least_size * (double)d->samples.fitted;
    for (size_t f = d->findings; f-- > 0 && d->findings > 1;) {
        model_t without;
        joint_power_t power;
        if ((spared >> f & 1U) != 0) {
            continue;
        }
        if (!fit_without(job, &d->finding[f], &without, &power)) {
            return false;
        }
        if ((double)d->samples.fitted * log(power.fitted / job->power.fitted) < least ||
            (double)d->samples.held * log(power.held / job->power.held) < attempt_least_support) {
            drop(job, f, SUPERFLUOUS, &without, &power);
        } else {
            model_free(&without);
        }
    }
    return true;
}

/* Standard errors; and takes out the findings, the latest first, of which no number is told from nothing. */
static bool find_errors(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    bool settled = false;
    while (!settled) {
        size_t f = d->findings;
        if (!findings_errors(d, job->failure)) {
            return false;
        }
        while (f > 0 && finding_determined(d, &d->finding[f - 1])) {
            f--;
        }
        settled = f == 0;
        if (!settled) {
            if (!attempt_take_out(job, f - 1, SUPERFLUOUS)) {
                return false;
            }
        }
    }
    return true;
}

/* A converter's steps show in the readings themselves. */
static void find_steps(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    const double step = job->step_um, error_um = step / sqrt(12.0);
    if (step > 0.0 && error_um > least_steps * d->noise.rms_um && d->findings < DIAGNOSIS_MOST_FINDINGS) {
        const double each = lattice_likelihood_per_sample();
        const double t = sqrt(each * (double)d->samples.fitted);
        model_block_t *block = model_append(&d->model, &block_quantisation);
        model_set(block, "step_um", step);
        block->parameter[0].sigma = allocate(1, sizeof(double));
        *block->parameter[0].sigma = job->step_sigma_um;
        d->finding[d->findings++] = (finding_t){.block = &block_quantisation,
                                                .t = t,
                                                .t_blocks = t,
                                                .certainty = NAMED,
                                                .in_readings = true,
                                                .margin = HUGE_VAL,
                                                .support = each * (double)d->samples.held,
                                                .held_out_before_percent = d->held_out_percent,
                                                .held_out_after_percent = d->held_out_percent};
    }
}

void attempt_without_noise(model_t *model) {
    for (size_t b = model->blocks; b-- > 0;) {
        if (model->block[b].block == &block_sensor_noise || model->block[b].block == &block_quantisation) {
            model_remove(model, b);
        }
    }
}

/* Blocks that leave so much of what was missing, and structure in it, are not what is missing but what comes nearest to
 * it. In parts of the square. */
static const double leaves_too_much = 1.0 / 12.0;

static bool comes_near_only(const attempt_t *job, double missing) {
    const diagnosis_t *d = job->diagnosis;
    return attempt_blocks_found(d, &d->model) != 0 && attempt_excess(d, job->power.held) > leaves_too_much * missing;
}

static void judge(attempt_t *job, double missing) {
    diagnosis_t *d = job->diagnosis;
    if (!d->remainder.structured) {
        d->verdict = d->findings == 0 ? NOTHING_MISSING : EXPLAINED;
    } else if (d->findings > 0 && !comes_near_only(job, missing)) {
        d->verdict = PARTLY_EXPLAINED;
    } else {
        d->verdict = UNKNOWN_PHYSICS;
        for (size_t f = 0; f < d->findings; f++) {
            if (!d->finding[f].in_readings) {
                d->finding[f].certainty = DETECTED;
            }
        }
    }
}

/* Whether more than noise remains, and the verdict. missing: what the baseline left, attempt_excess. */
static bool look_at_the_rest(attempt_t *job, double missing) {
    diagnosis_t *d = job->diagnosis;
    double *simulated = samples_column(&d->samples);
    model_t smooth;
    model_copy(&smooth, &d->model);
    attempt_without_noise(&smooth);
    double *change = samples_change(&d->samples, &smooth, &d->baseline, job->failure);
    const bool good = change != NULL && samples_simulate(&d->samples, &smooth, simulated, job->failure);
    if (good) {
        d->remainder = remainder_of(&d->samples, &d->noise, simulated, change, job->step_um / sqrt(12.0));
        judge(job, missing);
    }
    model_free(&smooth);
    free(simulated);
    free(change);
    return good;
}

bool attempt_from(attempt_t *job, const model_t *given) {
    diagnosis_t *d = job->diagnosis;
    bool found = true, good;
    model_copy(&d->given, given);
    model_copy(&d->model, given);
    good = joint_fit(&d->samples, &d->noise, &d->model, 0, BASELINE_ITERATIONS, &job->power, job->failure);
    model_copy(&d->baseline, &d->model);
    const double missing = attempt_excess(d, job->power.held);
    good = good && attempt_measure(job, &d->given, &d->given_nrmse_percent, &d->given_held_out_percent) &&
           attempt_measure(job, &d->baseline, &d->baseline_nrmse_percent, &d->baseline_held_out_percent);
    while (good && found && d->findings < DIAGNOSIS_MOST_FINDINGS) {
        good = find_one(job, &found);
    }
    good = good && attempt_reconsider(job, candidate_least_size, 0) && names_settle(job) && sides_settle(job) &&
           find_errors(job) && temperature_settle(job) &&
           attempt_measure(job, &d->model, &d->nrmse_percent, &d->held_out_percent);
    if (good) {
        d->noise_percent =
            100.0 * d->noise.rms_um / (job->setting.displacement_high_um - job->setting.displacement_low_um);
        find_steps(job);
        good = look_at_the_rest(job, missing);
    }
    return good;
}
