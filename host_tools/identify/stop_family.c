/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "chain/catalogue.h"
#include "elements/stop_bank.h"
#include "identify/initial_memory.h"
#include "identify/stop_fit.h"
#include "numerics/golden_section.h"
#include <math.h>
#include <stdlib.h>

/* Four stops, as the source takes (000, section 6). */
enum { DEFAULT_OPERATORS = 4, SEARCH_STEPS = 24 };
/* A tenth of the stroke lost per newton would be no mount for a piezo stack. */
static const double largest_compliance = 0.1;
/* Below this part of the largest, the search has found its lower end. */
static const double no_compliance = 1e-4;

typedef struct {
    stop_problem_t problem;
    int tried;
    failure_t *failure;
} search_t;

static bool rms_at(void *context, double compliance_per_n, double *rms_v) {
    search_t *search = context;
    stop_fit_t fit = {0};
    progress_update(search->problem.job->progress, (double)search->tried++ / (SEARCH_STEPS + 2));
    if (!stop_fit(&search->problem, compliance_per_n, &fit, search->failure)) {
        return false;
    }
    *rms_v = fit.rms_v;
    return true;
}

/* The forces of the recordings, and whether they differ. */
static bool read_preloads(const family_job_t *job, double *preload_n, bool *differ, failure_t *failure) {
    *differ = false;
    for (size_t i = 0; i < job->count; i++) {
        if (!recording_preload(&job->recordings[i], &preload_n[i], failure)) {
            return false;
        }
        *differ = *differ || preload_n[i] != preload_n[0];
    }
    return true;
}

/* Initial memory of the spring, estimated as that of the play bank that is its inverse. */
static void find_initial_memory(const family_job_t *job, const stop_problem_t *problem, const stop_fit_t *fit,
                                model_block_t *spring, family_notes_t *notes) {
    const stop_bank_t bank = {problem->operators, fit->weight[0], fit->weight + 1, fit->threshold_um};
    double weight[STOP_FIT_MAX_OPERATORS + 1], threshold_v[STOP_FIT_MAX_OPERATORS];
    double memory_v[STOP_FIT_MAX_OPERATORS], memory_um[STOP_FIT_MAX_OPERATORS];
    play_bank_t play = {.weight = weight, .threshold = threshold_v};
    linear_fit_t inverse = {.operators = problem->operators, .weight = weight};
    const play_basis_t basis = {.operators = problem->operators, .threshold_v = threshold_v};
    stop_bank_to_play(&bank, &play);
    for (size_t i = 0; i <= problem->operators; i++) {
        inverse.offset_um -= fit->offset_v * weight[i];
    }
    const size_t end = play_memory_determined(&basis, &job->recordings[0], job->train_to[0]);
    if (end == 0) {
        return;
    }
    estimate_initial_memory(&basis, &inverse, &job->recordings[0], end, memory_v);
    for (size_t i = 0; i < problem->operators; i++) {
        memory_v[i] -= fit->offset_v;
    }
    stop_bank_memory(&bank, memory_v, memory_um);
    model_set_array(spring, "initial_memory_um", problem->operators, memory_um, NULL);
    family_note(notes, "initial memory estimated from the samples that depend on it");
}

static void make_model(const family_job_t *job, const block_t *block, const stop_problem_t *problem,
                       const stop_fit_t *fit, double compliance_per_n, model_t *model) {
    model_create(model, recordings_fastest_hz(job->recordings, job->count));
    model_block_t *spring = model_append(model, block);
    model_set(spring, "offset_v", fit->offset_v);
    model_set_array(spring, "weights", problem->operators + 1, fit->weight, NULL);
    model_set_array(spring, "thresholds_um", problem->operators, fit->threshold_um, NULL);
    if (problem->inertial) {
        model_set(spring, "damping_v_s_per_um", fit->damping);
        model_set(spring, "mass_v_s2_per_um", fit->mass);
    }
    if (compliance_per_n > 0.0) {
        model_set(model_append(model, &block_preload), "compliance_per_n", compliance_per_n);
    }
}

static void tell(const stop_problem_t *problem, const stop_fit_t *fit, family_notes_t *notes) {
    double stiffness = 0.0;
    family_note(notes, "rms error of the drive %.4g V over the training part", fit->rms_v);
    if (!problem->inertial) {
        return;
    }
    for (size_t i = 0; i <= problem->operators; i++) {
        stiffness += fit->weight[i];
    }
    if (fit->smoothing > 1) {
        family_note(notes, "drive, position and their derivatives smoothed alike over four times %zu samples",
                    fit->smoothing);
    }
    if (fit->mass > 0.0) {
        family_note(notes, "mass and spring (all stops holding) make a mode at %.4g Hz",
                    sqrt(stiffness / fit->mass) / (2.0 * acos(-1.0)));
    } else {
        family_note(notes, "mass rests on 0: the stroke does not grow with the frequency as inertia makes it grow");
    }
    if (!(fit->damping > 0.0)) {
        family_note(notes, "damping rests on 0: the loop does not widen with the frequency");
    }
}

bool stop_family_fit(const family_job_t *job, const block_t *block, bool inertial, model_t *model,
                     family_notes_t *notes, failure_t *failure) {
    double *preload_n = allocate(job->count, sizeof(double)), compliance_per_n = 0.0;
    search_t search = {.problem = {.job = job,
                                   .preload_n = preload_n,
                                   .operators = job->operators > 0 ? job->operators : DEFAULT_OPERATORS,
                                   .inertial = inertial},
                       .failure = failure};
    stop_fit_t fit = {0};
    bool differ = false, good;
    if (search.problem.operators > STOP_FIT_MAX_OPERATORS) {
        good = fail(failure, "a stop form has at most %d operators", STOP_FIT_MAX_OPERATORS);
    } else {
        good = read_preloads(job, preload_n, &differ, failure) &&
               (!differ || golden_section(rms_at, &search, 0.0, largest_compliance, SEARCH_STEPS, &compliance_per_n));
    }
    if (compliance_per_n < no_compliance * largest_compliance) {
        compliance_per_n = 0.0;
    }
    good = good && stop_fit(&search.problem, compliance_per_n, &fit, failure);
    if (good) {
        make_model(job, block, &search.problem, &fit, compliance_per_n, model);
        tell(&search.problem, &fit, notes);
        if (job->count == 1) {
            find_initial_memory(job, &search.problem, &fit, &model->block[0], notes);
        }
        if (differ && compliance_per_n == 0.0) {
            family_note(notes, "the recordings are under different preloads, but no stroke is lost to them");
        }
    }
    free(preload_n);
    return good;
}
