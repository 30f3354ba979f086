/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Families `modified_play` (paper 001) and `truncated_modified_play`, the same without the bilinear gain: one set of
 * parameters from one sinusoidal recording. docs/MODELS.md, section 9.
 */
#include "identify/families/modified_play.h"
#include "chain/catalogue.h"
#include "elements/play_plane.h"
#include "identify/recursion_fit.h"
#include <math.h>

enum { DIVISIONS = 10 };

typedef struct {
    play_plane_t plane;
    double rate_hz;
} basis_state_t;

/* The paper's list of unknowns, (40), has no alpha and beta: the envelope stays 0. */
static void open(void *memory, const double *shape) {
    basis_state_t *state = memory;
    (void)shape;
    play_plane_open(&state->plane, state->plane.divisions, 0.0, 0.0, state->rate_hz);
}

static void step(void *memory, double u, double *column) {
    basis_state_t *state = memory;
    column[0] = u;
    play_plane_step(&state->plane, u, column + 1);
}

static void append(model_t *model, const recursion_problem_t *problem, const recursion_estimate_t *estimate) {
    model_block_t *block = model_append(model, &block_modified_play);
    recursion_set(block, problem, estimate);
    model_set(block, "direct_um", estimate->weight[0]);
    model_set_array(block, "cells_um", problem->basis.columns - 1, estimate->weight + 1, NULL);
}

typedef enum { ONE_STEP, SIMULATION, INVERTIBLE_SIMULATION } estimate_kind_t;

static bool fit_with(const family_job_t *job, const char *name, bool bilinear, estimate_kind_t kind, model_t *model,
                     family_notes_t *notes, failure_t *failure) {
    const size_t divisions = job->operators > 0 ? job->operators : DIVISIONS;
    static const double lower[RECURSION_FIT_COLUMNS] = {0.0};
    recursion_problem_t problem;
    recursion_estimate_t one_step, estimate;
    if (divisions < 2 || divisions > PLAY_PLANE_MAX) {
        return fail(failure, "family %s has 2 to %d divisions", name, PLAY_PLANE_MAX);
    }
    if (!recursion_problem(job, name, &problem, failure)) {
        return false;
    }
    basis_state_t state = {.plane = {.divisions = divisions}, .rate_hz = problem.recording->sample_rate_hz};
    problem.bilinear = bilinear;
    problem.invertible = kind == INVERTIBLE_SIMULATION;
    problem.basis = (recursion_basis_t){
        .columns = 1 + play_plane_cells(divisions), .lower = lower, .open = open, .step = step, .state = &state};
    if (!recursion_fit_one_step(&problem, &one_step, failure) ||
        (kind != ONE_STEP && !recursion_fit_simulation(&problem, &estimate, failure))) {
        return false;
    }
    if (kind == ONE_STEP) {
        estimate = one_step;
    }
    model_create(model, problem.recording->sample_rate_hz);
    append(model, &problem, &estimate);
    recursion_report(model, notes, &one_step, &estimate);
    return true;
}

static bool fit_truncated_modified_play(const family_job_t *job, model_t *model, family_notes_t *notes,
                                        failure_t *failure) {
    return fit_with(job, "truncated_modified_play", false, INVERTIBLE_SIMULATION, model, notes, failure);
}

const family_t family_truncated_modified_play = {.name = "truncated_modified_play",
                                                 .order = 110,
                                                 .text = "modified play without its bilinear gain; one sine",
                                                 .fit = fit_truncated_modified_play,
                                                 .one_sine = true};

static bool fit_modified_play(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    return fit_with(job, "modified_play", true, INVERTIBLE_SIMULATION, model, notes, failure);
}

const family_t family_modified_play = {.name = "modified_play",
                                       .order = 100,
                                       .text = "plane of plays, recursion, harmonics, bilinear gain; one sine",
                                       .fit = fit_modified_play,
                                       .without = &family_truncated_modified_play,
                                       .one_sine = true};

static bool fit_free_modified_play(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    return fit_with(job, "free_modified_play", true, SIMULATION, model, notes, failure);
}

const family_t family_free_modified_play = {.name = "free_modified_play",
                                            .text = "modified play with weights of any sign; one sine",
                                            .fit = fit_free_modified_play,
                                            .one_sine = true};

static bool fit_free_truncated_modified_play(const family_job_t *job, model_t *model, family_notes_t *notes,
                                             failure_t *failure) {
    return fit_with(job, "free_truncated_modified_play", false, SIMULATION, model, notes, failure);
}

const family_t family_free_truncated_modified_play = {.name = "free_truncated_modified_play",
                                                      .text = "the same without its bilinear gain; one sine",
                                                      .fit = fit_free_truncated_modified_play,
                                                      .one_sine = true};

static bool fit_one_step_modified_play(const family_job_t *job, model_t *model, family_notes_t *notes,
                                       failure_t *failure) {
    return fit_with(job, "one_step_modified_play", true, ONE_STEP, model, notes, failure);
}

const family_t family_one_step_modified_play = {.name = "one_step_modified_play",
                                                .text = "modified play by recursive least squares; one sine",
                                                .fit = fit_one_step_modified_play,
                                                .one_sine = true};
