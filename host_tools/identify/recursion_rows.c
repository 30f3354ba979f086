/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/recursion_rows.h"
#include <gsl/gsl_math.h>
#include <string.h>

double recursion_input_before(const recursion_problem_t *problem, size_t k) {
    const double drive = problem->recording->column[COLUMN_DRIVE][k > 0 ? k - 1 : 0];
    return (drive - problem->drive.offset) / problem->drive.amplitude;
}

recursion_rows_t recursion_rows_begin(const recursion_problem_t *problem, const double *shape) {
    problem->basis.open(problem->basis.state, shape);
    return (recursion_rows_t){.problem = problem,
                              .angle_step =
                                  2.0 * M_PI * problem->drive.frequency_hz / problem->recording->sample_rate_hz};
}

void recursion_rows_step(recursion_rows_t *rows, double *row) {
    const recursion_problem_t *problem = rows->problem;
    const size_t columns = problem->basis.columns;
    const double angle = problem->drive.phase + rows->angle_step * ((double)rows->sample - 1.0);
    recursion_harmonics(recursion_input_before(problem, rows->sample), angle, row + columns);
    row[columns + RECURSION_HARMONICS] = 1.0;
    problem->basis.step(problem->basis.state, recursion_input_before(problem, ++rows->sample), row);
}

static double predict(const recursion_estimate_t *estimate, size_t columns, const double *row) {
    double sum = estimate->offset_um;
    for (size_t i = 0; i < columns; i++) {
        sum += estimate->weight[i] * row[i];
    }
    for (size_t i = 0; i < RECURSION_HARMONICS; i++) {
        sum += estimate->harmonic[i] * row[columns + i];
    }
    return sum;
}

void recursion_judge(const recursion_problem_t *problem, recursion_estimate_t *estimate) {
    const double *y = problem->recording->column[COLUMN_DISPLACEMENT], *c = estimate->feedback;
    double row[RECURSION_ROW], past[RECURSION_FEEDBACK] = {0.0}, one_step = 0.0, simulated = 0.0, power = 0.0;
    recursion_rows_t rows = recursion_rows_begin(problem, estimate->shape);
    for (size_t k = 0; k < problem->to; k++) {
        const double bend = c[0] + estimate->bilinear * recursion_input_before(problem, k);
        recursion_rows_step(&rows, row);
        const double sum = predict(estimate, problem->basis.columns, row);
        const double own = sum + bend * past[0] + c[1] * past[1] + c[2] * past[2];
        past[2] = past[1];
        past[1] = past[0];
        past[0] = own;
        if (k >= problem->from) {
            one_step += gsl_pow_2(sum + bend * y[k - 1] + c[1] * y[k - 2] + c[2] * y[k - 3] - y[k]);
            simulated += gsl_pow_2(own - y[k]);
            power += gsl_pow_2(y[k]);
        }
    }
    const double samples = (double)(problem->to - problem->from);
    estimate->one_step_rms_um = sqrt(one_step / samples);
    /* A thousand times the displacement is no simulation any more. */
    estimate->simulated_rms_um = simulated < 1e6 * power ? sqrt(simulated / samples) : HUGE_VAL;
}

void recursion_take(const recursion_problem_t *problem, const double *x, recursion_estimate_t *estimate) {
    const size_t columns = problem->basis.columns;
    memcpy(estimate->weight, x, columns * sizeof(double));
    memcpy(estimate->harmonic, x + columns, sizeof estimate->harmonic);
    estimate->offset_um = x[columns + RECURSION_HARMONICS];
}
