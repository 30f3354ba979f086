/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/recursion_fit.h"
#include "identify/recursion_rows.h"
#include "numerics/least_squares.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MOST_SAMPLES = 6000, MOST_WARM_UP = 3000 };
/* What may be left of the drive besides its sine, of its amplitude. */
static const double drive_left = 0.02;

bool recursion_problem(const family_job_t *job, const char *family, recursion_problem_t *problem, failure_t *failure) {
    const recording_t *recording = &job->recordings[0];
    const size_t train_to = job->train_to[0];
    memset(problem, 0, sizeof *problem);
    problem->recording = recording;
    problem->progress = job->progress;
    if (job->count != 1) {
        return fail(failure, "family %s needs one recording: its numbers belong to one frequency", family);
    }
    if (!sine_fit(recording->column[COLUMN_DRIVE], train_to, recording->sample_rate_hz, &problem->drive, failure)) {
        return fail_in(failure, "%s: family %s needs a sinusoidal drive", recording->name, family);
    }
    if (!(problem->drive.rms <= drive_left * problem->drive.amplitude)) {
        return fail(failure,
                    "%s: family %s needs a sinusoidal drive; %.2g %% of this one's amplitude is no sine of %.6g Hz",
                    recording->name, family, 100.0 * problem->drive.rms / problem->drive.amplitude,
                    problem->drive.frequency_hz);
    }
    const double period = recording->sample_rate_hz / problem->drive.frequency_hz;
    problem->from =
        (size_t)fmax(fmax(RECURSION_FEEDBACK, ceil(period)), fmin(MOST_WARM_UP, floor((double)train_to / 3.0)));
    problem->to = (size_t)fmin((double)train_to, (double)problem->from + fmax(MOST_SAMPLES, 2.0 * period));
    if ((double)(problem->to - problem->from) < 0.99 * period || problem->from >= train_to) {
        return fail(failure, "%s: family %s needs two periods; the training part has %.2g of its %.6g Hz",
                    recording->name, family, (double)train_to / period, problem->drive.frequency_hz);
    }
    return true;
}

bool recursion_fit_one_step(const recursion_problem_t *problem, recursion_estimate_t *estimate, failure_t *failure) {
    const size_t own = problem->basis.columns + RECURSION_AFTER,
                 unknowns = own + RECURSION_FEEDBACK + (problem->bilinear ? 1 : 0);
    const double *y = problem->recording->column[COLUMN_DISPLACEMENT];
    double row[RECURSION_ROW], x[RECURSION_ROW], lower[RECURSION_ROW];
    normal_equations_t equations;
    memset(estimate, 0, sizeof *estimate);
    memcpy(estimate->shape, problem->basis.shape_start, sizeof estimate->shape);
    normal_equations_create(&equations, unknowns);
    recursion_rows_t rows = recursion_rows_begin(problem, estimate->shape);
    for (size_t k = 0; k < problem->to; k++) {
        recursion_rows_step(&rows, row);
        if (k >= problem->from) { /* a period into the recording: there are three samples before it */
            for (size_t i = 0; i < RECURSION_FEEDBACK; i++) {
                row[own + i] = y[k - 1 - i];
            }
            row[own + RECURSION_FEEDBACK] = recursion_input_before(problem, k) * y[k - 1];
            normal_equations_add(&equations, row, y[k]);
        }
    }
    normal_equations_finish(&equations);
    for (size_t i = 0; i < unknowns; i++) {
        lower[i] = -HUGE_VAL;
    }
    const bool good = solve_bounded(&equations, lower, x, NULL, failure);
    if (good) {
        recursion_take(problem, x, estimate);
        memcpy(estimate->feedback, x + own, sizeof estimate->feedback);
        estimate->bilinear = problem->bilinear ? x[own + RECURSION_FEEDBACK] : 0.0;
        recursion_judge(problem, estimate);
    }
    normal_equations_free(&equations);
    return good;
}

void recursion_set(model_block_t *block, const recursion_problem_t *problem, const recursion_estimate_t *estimate) {
    model_set(block, "center_v", problem->drive.offset);
    model_set(block, "half_range_v", problem->drive.amplitude);
    model_set_array(block, "feedback", RECURSION_FEEDBACK, estimate->feedback, NULL);
    model_set(block, "bilinear_gain", estimate->bilinear);
    model_set_array(block, "harmonics_um", RECURSION_HARMONICS, estimate->harmonic, NULL);
    model_set(block, "frequency_hz", problem->drive.frequency_hz);
    model_set(block, "phase_rad", problem->drive.phase);
    model_set(block, "offset_um", estimate->offset_um);
}

/* JSON has no infinity. */
static void set_fact(model_t *model, const char *key, double value) {
    if (isfinite(value)) {
        json_object_set_new(model->fit, key, json_real(value));
    }
}

void recursion_report(model_t *model, family_notes_t *notes, const recursion_estimate_t *one_step,
                      const recursion_estimate_t *estimate) {
    char simulated[40] = "runs away";
    model->fit = json_object();
    set_fact(model, "simulated_rms_um", estimate->simulated_rms_um);
    set_fact(model, "one_step_rms_um", estimate->one_step_rms_um);
    set_fact(model, "least_squares_one_step_rms_um", one_step->one_step_rms_um);
    set_fact(model, "least_squares_simulated_rms_um", one_step->simulated_rms_um);
    if (isfinite(one_step->simulated_rms_um)) {
        snprintf(simulated, sizeof simulated, "leaves %.4g um", one_step->simulated_rms_um);
    }
    family_note(notes, "fitted as a simulation: leaves %.4g um rms, %.4g um when it is given the measured positions",
                estimate->simulated_rms_um, estimate->one_step_rms_um);
    family_note(notes, "fitted to predict one step, as recursive least squares do: %.4g um rms, but simulated it %s",
                one_step->one_step_rms_um, simulated);
}
