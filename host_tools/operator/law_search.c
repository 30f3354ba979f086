/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/law_search.h"
#include "base/parallel.h"
#include "numerics/gauss_newton.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>

enum { LAW_LENGTHS = 7, LAW_POWERS = 2, LAW_STARTS = LAW_LENGTHS * LAW_POWERS, LAW_STEPS = 8 };
static const double shortest_law = 0.03, longest_law = 2.0;
/* The numbers of a law move by no more than this in a step. A step that is worth less, in natural units, is the last.
 */
static const double longest_step = 0.5, law_settled = 1.0;
static const double least_power = 0.3, most_power = 4.0;

/* The gain in evidence of one law's h, as a signature beyond the operator without a law. */
typedef struct {
    const hysteresis_t *h;
    const hysteresis_base_t *base;
    law_along_t along;
    double *left; /* of the values, by the operator without a law */
    duhem_law_t law[LAW_STARTS];
    double gain[LAW_STARTS];
} law_scan_t;

static void scan_law(void *context, size_t index) {
    law_scan_t *scan = context;
    const hysteresis_t *h = scan->h;
    const int n = (int)h->operator.columns, rows = (int)scan->base->rows.rows;
    duhem_table_t *table = allocate(1, sizeof *table);
    double *value = allocate(scan->base->rows.rows + 1, sizeof(double)),
           *products = allocate(h->operator.columns, sizeof(double));
    duhem_tabulate(&scan->law[index], table);
    law_rows_of(&scan->along, table, value);
    cblas_dgemv(CblasRowMajor, CblasTrans, rows, n, 1.0, scan->base->rows.row, n, value, 1, 0.0, products, 1);
    const double square = cblas_ddot(rows, value, 1, value, 1), along = cblas_ddot(rows, value, 1, scan->left, 1);
    cblas_dtrsv(CblasRowMajor, CblasLower, CblasNoTrans, CblasNonUnit, n, h->evidence.factor, n, products, 1);
    const double beyond = square - cblas_ddot(n, products, 1, products, 1);
    scan->gain[index] = beyond > 1e-9 * square ? along * along / (2.0 * beyond * h->evidence.variance) : 0.0;
    free(value);
    free(products);
    free(table);
}

static bool best_start(const operator_question_t *q, const hysteresis_t *h, size_t thin, duhem_law_t *law) {
    const hysteresis_base_t *base = equations_base(q, h, thin);
    const int n = (int)h->operator.columns;
    law_scan_t scan = {
        .h = h, .base = base, .along = equations_along(q, h, base), .left = equations_values(q, h, base)};
    size_t best = 0;
    cblas_dgemv(CblasRowMajor, CblasNoTrans, (int)base->rows.rows, n, -1.0, base->rows.row, n, h->evidence.weight, 1,
                1.0, scan.left, 1);
    for (size_t i = 0; i < LAW_STARTS; i++) {
        const double part = (double)(i % LAW_LENGTHS) / (LAW_LENGTHS - 1);
        scan.law[i].number[0] = log(shortest_law * pow(longest_law / shortest_law, part));
        const size_t power = 1 + i / LAW_LENGTHS;
        scan.law[i].number[1] = (double)power;
    }
    parallel(LAW_STARTS, scan_law, &scan);
    free(scan.left);
    for (size_t i = 1; i < LAW_STARTS; i++) {
        best = scan.gain[i] > scan.gain[best] ? i : best;
    }
    *law = scan.law[best];
    return scan.gain[best] > threshold.law_worth;
}

/* The search for a law's numbers. A fit at `law` comes before each step. */
typedef struct {
    const operator_question_t *question;
    size_t thin;
    hysteresis_t *h;
    duhem_law_t law, kept;
} law_search_t;

/* Minus the evidence of the law, all weights marginalised. HUGE_VAL: it cannot be fitted. */
static double cost_of_law(law_search_t *search) {
    failure_t ignored;
    operator_set_law(&search->h->operator, & search->law);
    return equations_fit(search->question, search->thin, false, search->h, &ignored) ? -search->h->evidence.log_evidence
                                                                                     : HUGE_VAL;
}

/* The tangents are columns of every fit. */
static bool tangents_are_there(void *context, double *cost) {
    (void)context;
    (void)cost;
    return true;
}

static void keep_within(double number, double low, double high, double *step) {
    *step = fmax(low, fmin(high, number + *step)) - number;
}

/* What the evidence says of the tangents moves the law's numbers. */
static bool step_of_law(void *context, double damping, double *step) {
    const law_search_t *search = context;
    const double *weight = search->h->evidence.weight + operator_law_column(&search->h->operator);
    (void)damping;
    for (size_t i = 0; i < DUHEM_NUMBERS && weight[LAW_H] != 0.0; i++) {
        step[i] = fmax(-longest_step, fmin(longest_step, weight[OPERATOR_LAW_CURVES + i] / weight[LAW_H]));
    }
    keep_within(search->law.number[0], log(shortest_law / 2.0), log(2.0 * longest_law), &step[0]);
    keep_within(search->law.number[1], least_power, most_power, &step[1]);
    return weight[LAW_H] != 0.0;
}

static double move_law(void *context, const double *step, double part) {
    law_search_t *search = context;
    search->kept = search->law;
    for (size_t i = 0; i < DUHEM_NUMBERS; i++) {
        search->law.number[i] += part * step[i];
    }
    return cost_of_law(search);
}

static void move_law_back(void *context, const double *step, double part) {
    law_search_t *search = context;
    (void)step;
    (void)part;
    search->law = search->kept;
}

static bool law_ends(void *context, bool improved, double before, double now) {
    (void)context;
    return !improved || before - now < law_settled;
}

static void improve_law(const operator_question_t *q, size_t thin, hysteresis_t *h, duhem_law_t *law) {
    static const gauss_newton_tunables_t tunables = {
        .most_iterations = LAW_STEPS, .most_trials = 3, .worth = 1.0, .shorten = 1.0 / 3.0};
    law_search_t search = {.question = q, .thin = thin, .h = h, .law = *law};
    const gauss_newton_problem_t problem = {.context = &search,
                                            .unknowns = DUHEM_NUMBERS,
                                            .linearise = tangents_are_there,
                                            .solve = step_of_law,
                                            .move = move_law,
                                            .back = move_law_back,
                                            .ends = law_ends};
    double cost = cost_of_law(&search);
    if (isfinite(cost)) {
        (void)gauss_newton(&problem, &tunables, &cost);
    }
    *law = search.law;
}

bool law_search(const operator_question_t *q, size_t thin, hysteresis_t *h, failure_t *failure) {
    duhem_law_t law;
    if (!equations_fit(q, thin, true, h, failure)) {
        return false;
    }
    const double without = h->evidence.log_evidence;
    if (!equations_fit(q, thin, false, h, failure)) {
        return false;
    }
    if (best_start(q, h, thin, &law)) {
        improve_law(q, thin, h, &law);
        operator_set_law(&h->operator, & law);
        if (!equations_fit(q, thin, true, h, failure)) {
            return false;
        }
        if (h->evidence.log_evidence < without + threshold.law_worth) {
            operator_drop_law(&h->operator);
        }
    }
    return true;
}
