/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/group_evidence.h"
#include "base/progress.h"
#include "operator/evidence_range.h"
#include "operator/evidence_step.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_blas.h>
#include <gsl/gsl_linalg.h>
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_ROUNDS = 100 };
/* A precision for free columns, and for the round-off of the equations, in parts of the mean square of a column. */
static const double nearly_free = 1e-11;
/* Numbers of a group that the data determine, below which it counts as out of use. */
static const double barely_used = 0.1;
/* Of what another hill is worth, in natural units: for less none is climbed. What an evidence decides takes 10 of them
 * and more. */
static const double worth_a_jump = 0.5;

static double dot(const double *a, const double *b, size_t count) {
    return cblas_ddot((int)count, a, 1, b, 1);
}

/* L L' = X'X + variance diag(precision); false where that is not positive. */
static bool factorise(const normal_equations_t *equations, const size_t *group, group_evidence_t *e) {
    const size_t n = e->columns;
    memcpy(e->factor, equations->gram, n * n * sizeof(double));
    for (size_t j = 0; j < n; j++) {
        e->factor[j * n + j] += e->variance * e->precision[group[j]] +
                                nearly_free * fmax(equations->gram[j * n + j], (double)equations->rows * 1e-6);
    }
    gsl_matrix_view matrix = gsl_matrix_view_array(e->factor, n, n);
    return gsl_linalg_cholesky_decomp1(&matrix.matrix) == 0;
}

static void solve(const normal_equations_t *equations, group_evidence_t *e) {
    const size_t n = e->columns;
    memcpy(e->weight, equations->moment, n * sizeof(double));
    cblas_dtrsv(CblasRowMajor, CblasLower, CblasNoTrans, CblasNonUnit, (int)n, e->factor, (int)n, e->weight, 1);
    cblas_dtrsv(CblasRowMajor, CblasLower, CblasTrans, CblasNonUnit, (int)n, e->factor, (int)n, e->weight, 1);
}

static double misfit(const normal_equations_t *equations, const group_evidence_t *e, double *room) {
    const size_t n = e->columns;
    cblas_dsymv(CblasRowMajor, CblasLower, (int)n, 1.0, equations->gram, (int)n, e->weight, 1, 0.0, room, 1);
    return fmax(equations->power - 2.0 * dot(e->weight, equations->moment, n) + dot(e->weight, room, n), 0.0);
}

/* Weights, misfit and evidence of a place; false where its equations cannot be solved. */
static bool evaluate(evidence_work_t *work, const evidence_place_t *at, group_evidence_t *e) {
    const double rows = (double)work->equations->rows;
    memcpy(e->precision, at->precision, sizeof e->precision);
    e->variance = at->variance;
    if (!factorise(work->equations, work->group, e)) {
        return false;
    }
    solve(work->equations, e);
    work->misfit = misfit(work->equations, e, work->diagonal);
    double sum = -work->misfit / (2.0 * e->variance) - 0.5 * rows * log(2.0 * M_PI * e->variance);
    for (size_t j = 0; j < e->columns; j++) {
        const double precision = e->precision[work->group[j]];
        sum -= 0.5 * precision * e->weight[j] * e->weight[j] + log(e->factor[j * e->columns + j] / sqrt(e->variance));
    }
    for (size_t g = 1; g < e->groups; g++) {
        sum += 0.5 * (double)work->count[g] * log(e->precision[g]);
    }
    e->log_evidence = sum;
    return true;
}

/* A group of which the start knows nothing begins like a new one. */
static void begin_with(const group_evidence_t *start, group_evidence_t *e, bool find_variance) {
    for (size_t g = 1; g < e->groups; g++) {
        if (start->determined[g] > 0.0) {
            e->precision[g] = start->precision[g];
        }
    }
    if (find_variance) {
        e->variance = start->variance;
    }
}

/* One round. True where another one would gain next to nothing. */
static bool improve(evidence_work_t *work, group_evidence_t *e, bool *good) {
    const double before = e->log_evidence;
    evidence_place_t fixed, newton;
    const bool near = evidence_fixed_point(work, e, &fixed) < threshold.evidence_near_top;
    bool moved = false;
    if (near) {
        evidence_newton(work, e, &newton);
        moved = evaluate(work, &newton, e) && e->log_evidence > before - threshold.evidence_settled;
    }
    *good = moved || evaluate(work, &fixed, e);
    return near && fabs(e->log_evidence - before) < threshold.evidence_settled;
}

/* To a place on another hill that is better. False: there is none. */
static bool jump(evidence_work_t *work, group_evidence_t *e, bool *good) {
    evidence_place_t next;
    (void)evidence_fixed_point(work, e, &next);
    const bool better = evidence_elsewhere(work, e, &next) > worth_a_jump;
    *good = !better || evaluate(work, &next, e);
    return better;
}

bool group_evidence_fit(const normal_equations_t *equations, const size_t *group, size_t groups, double variance,
                        const group_evidence_t *start, group_evidence_t *e, failure_t *failure) {
    const size_t n = equations->unknowns;
    double trace[EVIDENCE_MOST_GROUPS] = {0};
    if (equations->rows == 0) {
        return fail(failure, "no samples to fit");
    }
    *e = (group_evidence_t){.columns = n, .groups = groups};
    e->weight = allocate(n, sizeof(double));
    e->factor = allocate(n * n, sizeof(double));
    evidence_work_t work = {.equations = equations, .group = group, .find_variance = variance <= 0.0};
    work.inverse = allocate(n * n, sizeof(double));
    work.covariance = allocate(n * n, sizeof(double));
    work.diagonal = allocate(n, sizeof(double));
    for (size_t j = 0; j < n; j++) {
        work.count[group[j]]++;
        trace[group[j]] += equations->gram[j * n + j];
    }
    const double power = fmax(equations->power, 1e-300);
    e->variance = variance > 0.0 ? variance : 1e-4 * power / (double)equations->rows;
    for (size_t g = 1; g < groups; g++) { /* at first each group may explain a hundredth of everything */
        e->precision[g] = fmax(trace[g], 1e-300) / (0.01 * power);
    }
    e->precision[EVIDENCE_LEFT_OUT] = evidence_switched_off * fmax(trace[EVIDENCE_LEFT_OUT], 1e-300) / power;
    if (start != NULL && start->columns > 0) {
        begin_with(start, e, work.find_variance);
    }
    evidence_place_t first;
    evidence_here(e, &first);
    bool good = evaluate(&work, &first, e), settled = false;
    for (int round = 0; good && !settled && round < MOST_ROUNDS; round++) {
        settled = improve(&work, e, &good);
        settled = settled && good && !jump(&work, e, &good);
        good = good && !progress_cancelled();
    }
    free(work.inverse);
    free(work.covariance);
    free(work.diagonal);
    if (!good) {
        group_evidence_free(e);
        return fail(failure, "the equations of the hysteresis cannot be solved");
    }
    return true;
}

void group_evidence_forget_unused(group_evidence_t *e) {
    for (size_t g = 1; g < e->groups; g++) {
        e->determined[g] = e->determined[g] > barely_used ? e->determined[g] : 0.0;
    }
}

void group_evidence_free(group_evidence_t *e) {
    free(e->weight);
    free(e->factor);
    *e = (group_evidence_t){0};
}

void group_evidence_open(const group_evidence_t *e, double *row, size_t rows, double *part) {
    const int n = (int)e->columns;
    cblas_dtrsm(CblasRowMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, (int)rows, n, 1.0, e->factor, n, row,
                n);
    for (size_t i = 0; i < rows; i++) {
        part[i] = dot(row + i * e->columns, row + i * e->columns, e->columns);
    }
}
