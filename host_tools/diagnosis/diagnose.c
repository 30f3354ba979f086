/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnose.h"
#include "baseline.h"
#include "catalogue.h"
#include "hysteresis_refit.h"
#include "lines.h"
#include "progress.h"
#include "remainder.h"
#include <gsl/gsl_cdf.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Chance of one false finding in a diagnosis, over all signatures that are tried in it. */
static const double false_alarm = 1e-3;
/* The same for the standard error from the scatter over blocks, of which there are few. */
static const double block_false_alarm = 0.05;
/* 2 log likelihood by which a name has to win. 20: a factor of 22000. */
static const double naming_margin = 20.0;
/* More than noise remains only if the held-out error shows it. */
static const double worth_mentioning = 1.1;
/* Of the held-out error: what another shape of the hysteresis has to come below to be taken, and if it would take the
 * place of a block that was found. */
static const double worth_another_shape = 0.85, worth_another_shape_than_a_block = 0.97;
static const double same_signature = 0.95;
/* Root mean square of what a finding explains beyond the model, in parts of the noise: below it, a model that is not
 * quite right is as likely a reason. */
static const double least_size = 0.08;
/* What the held-out samples have to say for it, in parts of what the others say, sample by sample. */
static const double least_support = 0.3;
static const double support_at_least = 12.0, support_enough = 100.0;

enum { MOST_ROUNDS = 4 };
/* Another round is worth it while the noise falls by more than this. */
static const double settled_noise = 0.998;

typedef struct {
    const recording_t *recordings;
    size_t count;
    diagnosis_t *diagnosis;
    failure_t *failure;
    probe_setting_t setting;
    double line_hz[LINES_MOST];
    progress_t progress;
    double left; /* of the work, by a guess: nobody knows how many rounds it takes */
} job_t;

static void advance(job_t *job) {
    job->left *= 0.8;
    progress_update(&job->progress, 1.0 - job->left);
}

static void describe(job_t *job) {
    probe_setting_t *s = &job->setting;
    double volts[2], micrometres[2];
    recordings_range(job->recordings, job->count, COLUMN_DRIVE, volts);
    recordings_range(job->recordings, job->count, COLUMN_DISPLACEMENT, micrometres);
    *s = (probe_setting_t){.drive_low_v = volts[0],
                           .drive_high_v = volts[1],
                           .displacement_low_um = micrometres[0],
                           .displacement_high_um = micrometres[1],
                           .sample_rate_hz = job->recordings[0].sample_rate_hz,
                           .line_hz = job->line_hz};
    for (size_t i = 0; i < job->count; i++) {
        const recording_t *r = &job->recordings[i];
        const double *drive = r->column[COLUMN_DRIVE];
        for (size_t k = 1; k < r->samples; k++) {
            s->largest_rate_v_per_s = fmax(s->largest_rate_v_per_s, fabs(drive[k] - drive[k - 1]) * r->sample_rate_hz);
        }
        s->longest_s = fmax(s->longest_s, (double)r->samples / r->sample_rate_hz);
    }
}

/* NRMSE of a model over the samples that are (not) held out, worst recording. */
static bool measure(const job_t *job, const model_t *model, bool held, double *percent) {
    *percent = 0.0;
    for (size_t i = 0; i < job->count; i++) {
        const recording_t *r = &job->recordings[i];
        const double *measured = r->column[COLUMN_DISPLACEMENT];
        double *position = allocate(r->samples, sizeof(double)), squares = 0.0, low = HUGE_VAL, high = -HUGE_VAL;
        size_t used = 0;
        if (!chain_simulate(model, r, 0, position, job->failure)) {
            free(position);
            return false;
        }
        for (size_t k = first_that_counts(model, r); k < r->samples; k++) {
            low = fmin(low, measured[k]);
            high = fmax(high, measured[k]);
            if (held_out(r->samples, k) == held) {
                squares += (measured[k] - position[k]) * (measured[k] - position[k]);
                used++;
            }
        }
        *percent = fmax(*percent, 100.0 * sqrt(squares / (double)used) / (high - low));
        free(position);
    }
    return true;
}

/* Significant by both standard errors, corrected for the number of signatures tried. */
static bool significant(const evidence_t *evidence, const candidate_t *candidate, size_t tested) {
    const double z = gsl_cdf_ugaussian_Qinv(0.5 * false_alarm / (double)tested);
    const double z_blocks = gsl_cdf_tdist_Qinv(0.5 * block_false_alarm / (double)tested, 20.0);
    return fabs(candidate->test.t) > z && fabs(candidate->test.t_blocks) > z_blocks &&
           candidate->test.amplitude > 0.5 && candidate->test.amplitude < 2.0 &&
           candidate->test.own_um > least_size * evidence_noise_um(evidence);
}

static void name(const evidence_t *evidence, const search_t *found, finding_t *finding) {
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
        const double margin = best->likelihood - rival->likelihood;
        finding->margin = fmin(finding->margin, margin);
        if (margin < naming_margin && finding->rivals < DIAGNOSIS_MOST_RIVALS) {
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

/* Fits the bank and the blocks that were found in turn, each with evidence around where the model then stands. */
static bool settle(job_t *job, model_t *model) {
    const diagnosis_t *d = job->diagnosis;
    double before = HUGE_VAL;
    for (int round = 0; round < MOST_ROUNDS; round++) {
        evidence_t *evidence;
        double noise;
        if (!hysteresis_refit(model, job->recordings, job->count, job->failure)) {
            return false;
        }
        evidence = evidence_open(model, job->recordings, job->count, false, job->failure);
        if (evidence == NULL) {
            return false;
        }
        advance(job);
        noise = evidence_noise_um(evidence);
        for (size_t i = 0; i < model->blocks && noise < settled_noise * before; i++) {
            const block_t *block = model->block[i].block;
            if (block->probe != NULL && model_find(&d->baseline, block->name) == NULL) {
                polish(evidence, model, block);
            }
        }
        evidence_close(evidence);
        if (noise >= settled_noise * before) {
            return true;
        }
        before = noise;
    }
    return hysteresis_refit(model, job->recordings, job->count, job->failure);
}

/* Takes the candidate into the chain if the held-out samples support it. */
static bool accept(job_t *job, const evidence_t *evidence, const candidate_t *candidate, finding_t *finding,
                   bool *accepted) {
    diagnosis_t *d = job->diagnosis;
    const double share = evidence_held_out_share(evidence);
    model_t augmented;
    model_copy(&augmented, &candidate->model);
    *accepted = false;
    if (!settle(job, &augmented) || !measure(job, &d->model, true, &finding->held_out_before_percent) ||
        !measure(job, &augmented, true, &finding->held_out_after_percent)) {
        model_free(&augmented);
        return false;
    }
    *accepted =
        evidence_held_out(evidence, &d->model, &augmented, &finding->support) &&
        finding->support > fmax(support_at_least, fmin(least_support * share * candidate->likelihood, support_enough));
    if (*accepted) {
        model_free(&d->model);
        d->model = augmented;
        d->finding[d->findings++] = *finding;
    } else {
        model_free(&augmented);
    }
    return true;
}

/* Keeps the best of a round for the outputs. */
static void remember(diagnosis_t *d, const search_t *found, outcome_t best) {
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
                               .outcome = i == 0 || best == NOT_SIGNIFICANT ? best : LESS_LIKELY};
        }
    }
}

/* One more block, or none. */
static bool find_one(job_t *job, bool shapes, bool *found_one) {
    diagnosis_t *d = job->diagnosis;
    evidence_t *evidence = evidence_open(&d->model, job->recordings, job->count, !shapes, job->failure);
    search_t found;
    finding_t finding;
    bool good = true;
    *found_one = false;
    if (evidence == NULL) {
        return false;
    }
    job->setting.lines = evidence_lines(evidence, job->line_hz);
    advance(job);
    search(evidence, &d->model, &job->setting, shapes, &found);
    advance(job);
    d->tested += found.tested;
    const bool significant_one = found.count > 0 && significant(evidence, &found.candidate[0], found.tested);
    if (significant_one) {
        name(evidence, &found, &finding);
        good = accept(job, evidence, &found.candidate[0], &finding, found_one);
    }
    remember(d, &found, !significant_one ? NOT_SIGNIFICANT : *found_one ? TAKEN : NOT_SUPPORTED);
    d->noise_percent =
        100.0 * evidence_noise_um(evidence) / (job->setting.displacement_high_um - job->setting.displacement_low_um);
    search_free(&found);
    evidence_close(evidence);
    return good;
}

/* Whether more than noise remains, and the verdict. */
static bool look_at_the_rest(job_t *job) {
    diagnosis_t *d = job->diagnosis;
    evidence_t *evidence = evidence_open(&d->model, job->recordings, job->count, true, job->failure);
    if (evidence == NULL) {
        return false;
    }
    d->remainder = evidence_remainder(evidence);
    d->remainder.structured = d->remainder.structured && d->held_out_percent > worth_mentioning * d->noise_percent;
    evidence_close(evidence);
    if (d->findings == 0) {
        d->verdict = d->remainder.structured ? UNKNOWN_PHYSICS : NOTHING_MISSING;
    } else {
        d->verdict = d->remainder.structured ? PARTLY_EXPLAINED : EXPLAINED;
    }
    return true;
}

bool diagnose(const model_t *baseline, const recording_t *recordings, size_t count, diagnosis_t *diagnosis,
              failure_t *failure) {
    job_t job = {.recordings = recordings, .count = count, .diagnosis = diagnosis, .failure = failure, .left = 1.0};
    bool found = true, good;
    progress_begin(&job.progress, "diagnosing");
    memset(diagnosis, 0, sizeof *diagnosis);
    describe(&job);
    model_copy(&diagnosis->model, baseline);
    good = hysteresis_refit(&diagnosis->model, recordings, count, failure);
    model_copy(&diagnosis->baseline, &diagnosis->model);
    good = good && measure(&job, &diagnosis->model, false, &diagnosis->baseline_nrmse_percent) &&
           measure(&job, &diagnosis->model, true, &diagnosis->baseline_held_out_percent);
    while (good && found && diagnosis->findings < DIAGNOSIS_MOST_FINDINGS) {
        good = find_one(&job, false, &found);
        if (good && !found) {
            good = find_one(&job, true, &found);
        }
    }
    good = good && measure(&job, &diagnosis->model, false, &diagnosis->nrmse_percent) &&
           measure(&job, &diagnosis->model, true, &diagnosis->held_out_percent);
    good = good && look_at_the_rest(&job);
    progress_end(&job.progress);
    if (!good) {
        diagnosis_free(diagnosis);
    }
    return good;
}

/* Whether something was found that another shape of the hysteresis can imitate. */
static bool shape_found(const diagnosis_t *d) {
    for (size_t i = 0; i < d->findings; i++) {
        if (d->finding[i].block->probe->shape) {
            return true;
        }
    }
    return false;
}

/* How far below this diagnosis' held-out error another shape's has to be. */
static double worth_of_another_shape(const diagnosis_t *d) {
    return shape_found(d) ? worth_another_shape_than_a_block : worth_another_shape;
}

bool diagnose_recordings(const recording_t *recordings, size_t count, diagnosis_t *diagnosis, failure_t *failure) {
    for (size_t shape = 0; shape < baseline_shapes(); shape++) {
        const family_t *family;
        model_t baseline;
        diagnosis_t other;
        failure_t refusal;
        bool good;
        if (shape > 0 && !diagnosis->remainder.structured && !shape_found(diagnosis)) {
            break; /* nothing left for another shape */
        }
        good = baseline_fit(shape, recordings, count, &baseline, &family, shape == 0 ? failure : &refusal);
        if (good) {
            good = diagnose(&baseline, recordings, count, &other, shape == 0 ? failure : &refusal);
            model_free(&baseline);
        }
        if (!good && shape == 0) {
            return false;
        }
        if (!good) {
            continue; /* a shape that does not apply */
        }
        other.family = family;
        if (shape == 0) {
            *diagnosis = other;
        } else if (other.held_out_percent < worth_of_another_shape(diagnosis) * diagnosis->held_out_percent) {
            diagnosis_free(diagnosis);
            *diagnosis = other;
        } else {
            diagnosis_free(&other);
        }
    }
    return true;
}

void diagnosis_free(diagnosis_t *diagnosis) {
    model_free(&diagnosis->baseline);
    model_free(&diagnosis->model);
}
