/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Families `modified_play` (paper 001) and `truncated_modified_play`, which is it without the bilinear gain: one
 * sinusoidal recording, one set of numbers. docs/MODELS.md, section 9.
 */
#include "catalogue.h"
#include "play_plane.h"
#include "recursion_fit.h"
#include <math.h>

enum { DIVISIONS = 10 };
/* The drive's own weight is at least this part of that of the cells. The inverse divides by it. */
static const double least_direct = 0.1;

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

/* Every cell brings its part of the drive with it, so that weights of 0 and more keep direct_um above least_direct. */
static void step(void *memory, double u, double *column) {
    basis_state_t *state = memory;
    const size_t cells = play_plane_cells(state->plane.divisions);
    play_plane_step(&state->plane, u, column + 1);
    column[0] = u;
    for (size_t i = 1; i <= cells; i++) {
        column[i] += least_direct * u;
    }
}

static void append(model_t *model, const recursion_problem_t *problem, const recursion_estimate_t *estimate) {
    const size_t cells = problem->basis.columns - 1;
    double direct = estimate->weight[0];
    model_block_t *block = model_append(model, &block_modified_play);
    for (size_t i = 1; i <= cells; i++) {
        direct += least_direct * estimate->weight[i];
    }
    recursion_set(block, problem, estimate);
    model_set(block, "direct_um", direct);
    model_set_array(block, "cells_um", cells, estimate->weight + 1, NULL);
}

static bool fit_with(const family_job_t *job, const char *name, bool bilinear, model_t *model, family_notes_t *notes,
                     failure_t *failure) {
    const size_t divisions = job->operators > 0 ? job->operators : DIVISIONS;
    double lower[RECURSION_FIT_COLUMNS] = {0.0};
    recursion_problem_t problem;
    recursion_estimate_t one_step, simulation;
    if (divisions < 2 || divisions > PLAY_PLANE_MAX) {
        return fail(failure, "family %s has 2 to %d divisions", name, PLAY_PLANE_MAX);
    }
    if (!recursion_problem(job, name, &problem, failure)) {
        return false;
    }
    basis_state_t state = {.plane = {.divisions = divisions}, .rate_hz = problem.recording->sample_rate_hz};
    problem.bilinear = bilinear;
    problem.basis = (recursion_basis_t){
        .columns = 1 + play_plane_cells(divisions), .lower = lower, .open = open, .step = step, .state = &state};
    if (!recursion_fit_one_step(&problem, &one_step, failure) ||
        !recursion_fit_simulation(&problem, &simulation, failure)) {
        return false;
    }
    model_create(model, problem.recording->sample_rate_hz);
    append(model, &problem, &simulation);
    recursion_note(notes, &one_step, &simulation);
    return true;
}

static bool fit(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    return fit_with(job, "modified_play", true, model, notes, failure);
}

static bool fit_truncated(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    return fit_with(job, "truncated_modified_play", false, model, notes, failure);
}

const family_t family_truncated_modified_play = {.name = "truncated_modified_play",
                                                 .text = "modified play without its bilinear gain; one sine",
                                                 .fit = fit_truncated};

const family_t family_modified_play = {.name = "modified_play",
                                       .text = "plane of plays, recursion, harmonics, bilinear gain; one sine",
                                       .fit = fit,
                                       .without = &family_truncated_modified_play};
