/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/question/baseline.h"
#include "base/parallel.h"
#include "chain/catalogue.h"
#include "diagnosis/evidence/search.h"
#include "diagnosis/evidence/shape_judgement.h"
#include "diagnosis/noise/lines.h"
#include "diagnosis/nuisance/hysteresis_numbers.h"
#include "diagnosis/nuisance/past_choice.h"
#include "diagnosis/nuisance/smooth_bank.h"
#include "diagnosis/nuisance/smooth_plane.h"
#include "identify/fit.h"
#include "numerics/basis.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Fitted with so many operators, or intervals of a plane, and then turned into smooth ones (smooth_bank.h,
 * smooth_plane.h) of few numbers: few enough to be fitted again often. */
enum { BANK, BOUC_WEN, SYMMETRIC_PLANE, PLANE, SHAPES };
static const struct {
    const char *family;
    size_t operators;
    bool many_numbers;
} shapes[SHAPES] = {[BANK] = {"prandtl_ishlinskii", 24, false},
                    [BOUC_WEN] = {"bouc_wen", 0, false},
                    [SYMMETRIC_PLANE] = {"preisach", 14, false},
                    [PLANE] = {"preisach", 14, true}};
enum { FIT_ITERATIONS = 4 };
_Static_assert((int)SHAPES == (int)BASELINE_SHAPES, "room for all shapes");

static bool fit_family(size_t shape, const recording_t *recordings, size_t count, baseline_t *baseline,
                       failure_t *failure) {
    const fit_options_t options = {.operators = shapes[shape].operators};
    fit_report_t report;
    *baseline = (baseline_t){.many_numbers = shapes[shape].many_numbers, .family = family_find(shapes[shape].family)};
    if (!fit_recordings(baseline->family, recordings, count, &options, &baseline->model, &report, failure)) {
        return false;
    }
    fit_report_free(&report);
    return true;
}

static void copy_of(baseline_t *copy, const baseline_t *baseline) {
    *copy = *baseline;
    model_copy(&copy->model, &baseline->model);
}

bool baseline_bank(const recording_t *recordings, size_t count, baseline_t *bank, baseline_t *rough,
                   failure_t *failure) {
    if (!fit_family(BANK, recordings, count, rough, failure)) {
        return false;
    }
    copy_of(bank, rough);
    if (!smooth_bank_from(&bank->model.block[hysteresis_index(&bank->model)], failure)) {
        baseline_free(bank, 1);
        baseline_free(rough, 1);
        return false;
    }
    return true;
}

void baseline_free(baseline_t *baseline, size_t count) {
    for (size_t i = 0; i < count; i++) {
        model_free(&baseline[i].model);
    }
}

size_t baseline_lines(const samples_t *samples, const double *residual, double *line_hz) {
    const size_t longest = samples_longest(samples);
    const size_t from = samples->from[longest];
    return find_lines(residual + samples->begin[longest] + from, samples->recordings[longest].samples - from,
                      samples->recordings[longest].sample_rate_hz, line_hz);
}

/* The signature of each block's best probe. Returns how many. */
static size_t best_signatures(const samples_t *samples, const noise_t *noise, const probe_setting_t *setting,
                              const model_t *model, double **signature, failure_t *failure) {
    evidence_t *evidence = evidence_open(model, samples, noise, failure);
    const search_problem_t problem = {.evidence = evidence, .noise = noise, .baseline = model, .setting = setting};
    size_t count = 0;
    for (int asked = 0; evidence != NULL && asked < 2; asked++) {
        candidates_t found;
        evidence_ask(evidence, asked == 0 ? ASK_EFFECTS : ASK_SHAPES);
        search_probes(&problem, &found);
        for (size_t i = 0; i < found.count; i++) {
            signature[count++] = found.candidate[i].signature;
            found.candidate[i].signature = NULL;
        }
        candidates_free(&found);
    }
    evidence_close(evidence);
    return count;
}

typedef struct {
    const samples_t *samples;
    basis_t basis;
    basis_queue_t queue;
} rich_t;

/* Samples that do not count are 0 in a column, whatever it is there. `counted` may be the column itself. */
static void blank(const samples_t *samples, const double *column, double *counted) {
    for (size_t k = 0; k < samples->all; k++) {
        counted[k] = samples->part[k] == SAMPLE_LEFT_OUT ? 0.0 : column[k];
    }
}

static void add_rich(void *context, const double *column, nuisance_layer_t layer) {
    (void)layer;
    rich_t *rich = context;
    blank(rich->samples, column, basis_queue_next(&rich->queue));
}

static bool noise_of_rich_model(const samples_t *samples, const model_t *model, const probe_setting_t *setting,
                                noise_t *noise, failure_t *failure) {
    const nuisance_options_t options = {.past = true,
                                        .plays = true,
                                        .shapes = true,
                                        .trends = true,
                                        .line_hz = setting->line_hz,
                                        .lines = setting->lines};
    const noise_t white = {.sigma_um = 1.0, .rms_um = 1.0};
    rich_t rich = {.samples = samples};
    double **signature = allocate(catalogue_count, sizeof *signature), *left = samples_column(samples);
    signals_t signals;
    const bool good = signals_open(&signals, samples, model, failure);
    if (good) {
        const size_t signatures = best_signatures(samples, &white, setting, model, signature, failure);
        basis_open(&rich.basis, samples->all, nuisance_most(&signals, &options) + signatures);
        basis_queue_open(&rich.queue, &rich.basis);
        nuisance(&signals, &options, add_rich, &rich);
        for (size_t i = 0; i < signatures; i++) {
            add_rich(&rich, signature[i], NUISANCE_TRENDS);
            free(signature[i]);
        }
        basis_queue_close(&rich.queue);
        samples_residual(samples, signals.simulated, left);
        blank(samples, left, left);
        basis_project(&rich.basis, left, 1);
        noise_of(samples, &rich.basis, left, noise);
        basis_close(&rich.basis);
        signals_close(&signals);
    }
    free(signature);
    free(left);
    return good;
}

bool baseline_noise(const samples_t *samples, const model_t *model, const probe_setting_t *setting, noise_t *noise,
                    failure_t *failure) {
    noise_t between;
    if (noise_at_rest(samples, NULL, setting->line_hz, setting->lines, noise)) {
        return true;
    }
    if (!noise_of_rich_model(samples, model, setting, noise, failure)) {
        return false;
    }
    /* Either may have something in it that is no noise. */
    if (setting->seen.passes != NULL &&
        noise_between_passes(samples, setting->seen.passes, setting->line_hz, setting->lines, &between) &&
        between.rms_um < noise->rms_um) {
        *noise = between;
    }
    return true;
}

/* Few numbers first: a table imitates much. Then the better one. */
static int by_promise(const void *one, const void *other) {
    const baseline_t *a = one, *b = other;
    if (a->many_numbers != b->many_numbers) {
        return a->many_numbers ? 1 : -1;
    }
    return (a->held > b->held) - (a->held < b->held);
}

bool baseline_says(const samples_t *samples, const noise_t *noise, double held) {
    return held < threshold.noise_known_by_shapes * (double)samples->held * noise->sigma_um * noise->sigma_um;
}

/* Where the best one says nothing, the bank comes first, which is linear in its numbers, unless it is far behind. */
static void prefer_bank(const samples_t *samples, const noise_t *noise, baseline_t *baseline, size_t count) {
    const double least = baseline[0].held;
    for (size_t i = 1; i < count && !baseline_says(samples, noise, least); i++) {
        if (baseline[i].family == family_find(shapes[BANK].family) &&
            baseline[i].held < threshold.shape_far_behind * least) {
            const baseline_t bank = baseline[i];
            memmove(&baseline[1], &baseline[0], i * sizeof bank);
            baseline[0] = bank;
            return;
        }
    }
}

static void leave_out_hopeless(baseline_t *baseline, size_t *count) {
    size_t kept = 0;
    double least = HUGE_VAL;
    for (size_t i = 0; i < *count; i++) {
        least = fmin(least, baseline[i].held);
    }
    for (size_t i = 0; i < *count; i++) {
        if (baseline[i].held < threshold.hopeless_shape * least) {
            baseline[kept++] = baseline[i];
        } else {
            model_free(&baseline[i].model);
        }
    }
    *count = kept;
}

/* What all shapes are judged by, and what comes of each. */
typedef struct {
    const samples_t *samples;
    const noise_t *noise;
    double **signature;
    size_t signatures;
    baseline_t *rough, plane; /* fitted, and not smooth */
    baseline_t shape[SHAPES];
    bool good[SHAPES];
} judgement_t;

/* What that leaves of the samples it is fitted to. */
static double fit_hysteresis(const judgement_t *job, baseline_t *baseline) {
    joint_power_t power;
    failure_t refusal;
    return joint_fit(job->samples, job->noise, &baseline->model, 0, FIT_ITERATIONS, &power, &refusal) ? power.fitted
                                                                                                      : HUGE_VAL;
}

static void judge(const judgement_t *job, baseline_t *baseline) {
    baseline->held =
        shape_judgement(job->samples, job->noise, &baseline->model, job->signature, job->signatures, true).held;
}

/* With this past, and no other. */
static double left_of_judged(void *context, const samples_t *samples, model_t *model) {
    const judgement_t *job = context;
    return shape_judgement(samples, job->noise, model, job->signature, job->signatures, false).fitted;
}

/* Beside the signatures its numbers go where the search begins. If from there no fit finds back (numbers of Bouc-Wen
 * may end where gamma = beta, and no further), they stay where they were. left: as they are. */
static void judge_and_keep_way(const judgement_t *job, baseline_t *baseline, double left) {
    if (!hysteresis_far_from_linear(&baseline->model)) {
        judge(job, baseline);
        return;
    }
    baseline_t judged, fitted;
    copy_of(&judged, baseline);
    judge(job, &judged);
    copy_of(&fitted, &judged);
    const bool finds_back = fit_hysteresis(job, &fitted) <= threshold.gone_astray * left;
    baseline_free(&fitted, 1);
    baseline->held = judged.held;
    baseline_free(finds_back ? baseline : &judged, 1);
    if (finds_back) {
        *baseline = judged;
    }
}

/* At its best, with its past. Where the recordings do not determine the memory they begin with, that is weighed beside
 * what may be missing, since a drift looks like another past. Elsewhere the hysteresis forgets its past, but what is
 * slow begins with the position that it had then; of several recordings each had its own, and the model has one. */
static void settle(judgement_t *job, baseline_t *baseline) {
    double left;
    if (job->samples->past_matters) {
        choose_past(job->samples, left_of_judged, job, &baseline->model);
        left = fit_hysteresis(job, baseline);
    } else {
        left = fit_hysteresis(job, baseline);
        if (job->samples->count == 1) {
            choose_past(job->samples, left_of_beginning, NULL, &baseline->model);
        }
    }
    judge_and_keep_way(job, baseline, left);
}

/* A few operators with gaps between them are no smooth bank. */
static void choose_bank(judgement_t *job) {
    baseline_t *bank = &job->shape[BANK];
    if (job->samples->past_matters) {
        choose_past(job->samples, left_of_judged, job, &bank->model);
        choose_past(job->samples, left_of_judged, job, &job->rough->model);
    }
    fit_hysteresis(job, job->rough);
    judge(job, bank);
    judge(job, job->rough);
    if (job->rough->held < threshold.bank_of_any_thresholds * bank->held) {
        const baseline_t smooth = *bank;
        *bank = *job->rough;
        *job->rough = smooth;
    }
}

static void find_bouc_wen(judgement_t *job) {
    failure_t refusal;
    job->good[BOUC_WEN] =
        fit_family(BOUC_WEN, job->samples->recordings, job->samples->count, &job->shape[BOUC_WEN], &refusal);
    if (job->good[BOUC_WEN]) {
        settle(job, &job->shape[BOUC_WEN]);
    }
}

static void smooth_plane(void *context, size_t index) {
    judgement_t *job = context;
    const size_t shape = index == 0 ? SYMMETRIC_PLANE : PLANE;
    baseline_t *plane = &job->shape[shape];
    double drive_range_v[2];
    failure_t refusal;
    copy_of(plane, &job->plane);
    plane->many_numbers = shapes[shape].many_numbers;
    recordings_range(job->samples->recordings, job->samples->count, COLUMN_DRIVE, drive_range_v);
    job->good[shape] = smooth_plane_from(&plane->model.block[hysteresis_index(&plane->model)], drive_range_v,
                                         shape == SYMMETRIC_PLANE, &refusal);
    if (!job->good[shape]) {
        model_free(&plane->model);
    } else {
        settle(job, plane);
    }
}

static void find_planes(judgement_t *job) {
    failure_t refusal;
    if (fit_family(PLANE, job->samples->recordings, job->samples->count, &job->plane, &refusal)) {
        parallel(2, smooth_plane, job);
        baseline_free(&job->plane, 1);
    }
}

static void find_shape(void *context, size_t index) {
    static void (*const find[])(judgement_t *) = {find_planes, find_bouc_wen, choose_bank}; /* the longest first */
    find[index](context);
}

bool baseline_shapes(const samples_t *samples, const noise_t *noise, const probe_setting_t *setting,
                     baseline_t baseline[BASELINE_SHAPES], baseline_t *rough, size_t *count, failure_t *failure) {
    judgement_t job = {.samples = samples,
                       .noise = noise,
                       .signature = allocate(catalogue_count, sizeof(double *)),
                       .rough = rough,
                       .shape = {[BANK] = baseline[0]},
                       .good = {[BANK] = true}};
    job.signatures = best_signatures(samples, noise, setting, &baseline[0].model, job.signature, failure);
    parallel(3, find_shape, &job);
    *count = 0;
    for (size_t shape = 0; shape < SHAPES; shape++) {
        if (job.good[shape]) {
            baseline[(*count)++] = job.shape[shape];
        }
    }
    qsort(baseline, *count, sizeof(baseline_t), by_promise);
    leave_out_hopeless(baseline, count);
    prefer_bank(samples, noise, baseline, *count);
    for (size_t i = 0; i < job.signatures; i++) {
        free(job.signature[i]);
    }
    free(job.signature);
    return job.signatures > 0 || fail(failure, "no block of the catalogue can be simulated in the model");
}
