/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/diagnose.h"
#include "diagnosis/baseline.h"
#include "diagnosis/empirical.h"
#include "diagnosis/question.h"
#include "diagnosis/review.h"
#include "diagnosis/stages.h"
#include "diagnosis/trials.h"
#include "diagnosis/unseen.h"
#include <string.h>

/* What stands for itself whatever hysteresis the answer has. */
typedef struct {
    model_t chain;
    double nrmse_percent, held_out_percent, fitted_held_out_percent;
} as_given_t;

struct diagnosing {
    attempt_t job;
    const model_t *given; /* NULL: none */
    const recording_t *recordings;
    size_t count;
    /* The first one is what the search begins with: the given chain, or of the bank and the others the one that fits
     * best. */
    baseline_t shape[TRIALS_MOST_SHAPES], rough;
    size_t shapes; /* that are filled */
    as_given_t as_given;
};

static bool take_samples(diagnosing_t *all) {
    baseline_t *first = &all->shape[0];
    all->shapes = 1;
    if (all->given != NULL) {
        model_copy(&first->model, all->given);
        attempt_without_noise(&first->model);
    } else if (!baseline_bank(all->recordings, all->count, first, &all->rough, all->job.failure)) {
        all->shapes = 0;
        return false;
    }
    return question_begin(&all->job, &first->model, all->recordings, all->count);
}

static bool take_noise(diagnosing_t *all) {
    return question_noise(&all->job, &all->shape[0].model);
}

static bool choose_shape(diagnosing_t *all) {
    attempt_t *job = &all->job;
    const diagnosis_t *d = job->diagnosis;
    return all->given != NULL || (baseline_shapes(&d->samples, &d->noise, &job->setting, all->shape, &all->rough,
                                                  &all->shapes, job->failure) &&
                                  (d->noise.at_rest || take_noise(all))); /* with a better model, better */
}

static bool imitate(diagnosing_t *all) {
    review_begin(&all->job, &all->shape[0].model);
    question_noise_beside(&all->job);
    return true;
}

static void note_given(const diagnosis_t *d, as_given_t *given) {
    *given = (as_given_t){.nrmse_percent = d->given_nrmse_percent,
                          .held_out_percent = d->given_held_out_percent,
                          .fitted_held_out_percent = d->baseline_held_out_percent};
    model_copy(&given->chain, &d->given);
}

/* Takes what note_given has copied. */
static void put_given(diagnosis_t *d, as_given_t *given) {
    model_free(&d->given);
    d->given = given->chain;
    given->chain = (model_t){0};
    d->given_nrmse_percent = given->nrmse_percent;
    d->given_held_out_percent = given->held_out_percent;
    d->own_shape_held_out_percent = given->fitted_held_out_percent;
    if (d->family != NULL && d->verdict == NOTHING_MISSING) {
        d->verdict = EXPLAINED;
    }
}

static bool search_from_first(diagnosing_t *all) {
    const bool good = trial_of_first(&all->job, &all->shape[0]);
    if (good && all->given != NULL) {
        note_given(all->job.diagnosis, &all->as_given);
    }
    return good;
}

/* The given chain with hystereses of other shapes, behind the given one. */
static void shapes_beside_given(diagnosing_t *all) {
    attempt_t *job = &all->job;
    const diagnosis_t *d = job->diagnosis;
    failure_t refusal;
    size_t shapes = 1;
    if (!baseline_bank(d->recordings, d->samples.count, &all->shape[1], &all->rough, &refusal)) {
        return;
    }
    baseline_shapes(&d->samples, &d->noise, &job->setting, all->shape + 1, &all->rough, &shapes, &refusal);
    for (size_t i = 1; i <= shapes; i++) {
        baseline_put_into(&all->shape[i], &all->shape[0].model);
    }
    all->shapes = 1 + shapes;
}

static bool search_from_others(diagnosing_t *all) {
    if (!trial_leaves_nothing(&all->job, &all->shape[0])) {
        if (all->given != NULL) {
            shapes_beside_given(all);
        }
        trials_of_others(&all->job, all->shape, all->shapes);
    }
    return true;
}

static bool search_without_first(diagnosing_t *all) {
    trial_without_the_first(&all->job);
    return true;
}

static bool search_strong(diagnosing_t *all) {
    trial_of_contest(&all->job, all->given != NULL ? &all->shape[0].model : NULL);
    return true;
}

static bool take_heard(diagnosing_t *all) {
    trial_of_heard(&all->job);
    return true;
}

static bool review(diagnosing_t *all) {
    const bool good = review_end(&all->job);
    if (all->given != NULL) {
        put_given(all->job.diagnosis, &all->as_given);
    }
    return good;
}

static bool limits(diagnosing_t *all) {
    return unseen_complete(&all->job);
}

static bool deliver(diagnosing_t *all) {
    return review_delivered(&all->job);
}

static bool describe_unknown(diagnosing_t *all) {
    return empirical_describe(&all->job);
}

const stage_t diagnosis_stages[] = {
    {"samples", "which samples count, and which are held out of every fit", "noise/samples.h", take_samples},
    {"noise", "from rests, or from what a rich model leaves", "noise/noise.h", take_noise},
    {"first shape", "of the hystereses of few numbers the one that leaves least beside every block's best probe",
     "baseline.h", choose_shape},
    {"universal operator",
     "in the hysteresis' place: what it leaves, which blocks speak beside it, and the noise again", "belief/shape.h",
     imitate},
    {"search", "block after block, until none convinces; then which stay, their names and their sides", "attempt.h",
     search_from_first},
    {"other shapes",
     "the same from other hystereses, where more than noise is left or a curve was found; the best stands", "trials.h",
     search_from_others},
    {"without the first", "the same without the block that came first, where structure is left", "trials.h",
     search_without_first},
    {"strong effects", "the same from the hysteresis that is best beside one strong effect, where much is left",
     "contest.h", search_strong},
    {"heard", "a block that speaks beside the operator, and was not found, takes the answer's place if it is likelier",
     "trials.h", take_heard},
    {"review", "findings are weighed beside the operator: what is only shape goes, and rivals are added", "review.h",
     review},
    {"detection limits", "of what was not found", "unseen.h", limits},
    {"delivered", "the error that the written model has when it is simulated; plain models beside it", "delivered.h",
     deliver},
    {"unknown physics", "an empirical term, where structure is left and no block explains it", "empirical.h",
     describe_unknown},
};
const size_t diagnosis_stage_count = sizeof diagnosis_stages / sizeof diagnosis_stages[0];

bool diagnose(const model_t *given, const recording_t *recordings, size_t count, diagnosis_t *diagnosis,
              failure_t *failure) {
    diagnosing_t all = {.job = {.diagnosis = diagnosis, .failure = failure, .left = 1.0},
                        .given = given,
                        .recordings = recordings,
                        .count = count};
    bool good = true;
    memset(diagnosis, 0, sizeof *diagnosis);
    diagnosis->model_given = given != NULL;
    progress_begin(&all.job.progress, "diagnosing");
    for (size_t s = 0; good && s < diagnosis_stage_count; s++) {
        good = diagnosis_stages[s].run(&all);
    }
    review_close(&all.job);
    baseline_free(all.shape, all.shapes);
    baseline_free(&all.rough, 1);
    model_free(&all.as_given.chain);
    progress_end(&all.job.progress);
    if (!progress_go_on(failure) || !good) {
        diagnosis_free(diagnosis);
        return false;
    }
    return true;
}

void diagnosis_free_models(diagnosis_t *diagnosis) {
    model_free(&diagnosis->given);
    model_free(&diagnosis->baseline);
    model_free(&diagnosis->model);
}

void diagnosis_free(diagnosis_t *diagnosis) {
    samples_close(&diagnosis->samples);
    free(diagnosis->recordings);
    diagnosis->recordings = NULL;
    diagnosis_free_models(diagnosis);
}
