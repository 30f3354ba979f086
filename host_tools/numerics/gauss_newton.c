/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/gauss_newton.h"
#include "base/failure.h"
#include "base/progress.h"
#include <math.h>
#include <stdlib.h>

/* Whether a move was accepted; otherwise the unknowns are as before. */
static bool improve(const gauss_newton_problem_t *p, const gauss_newton_tunables_t *t, double *step, double *damping,
                    double *cost) {
    double part = 1.0;
    bool solved = p->solve(p->context, *damping, step);
    for (size_t trial = 0; solved && trial < t->most_trials && !progress_cancelled(); trial++) {
        const double tried = p->move(p->context, step, part);
        if (tried < t->worth * *cost) {
            *cost = tried;
            *damping = fmax(t->lower_damping * *damping, t->least_damping);
            if (p->keep != NULL) {
                p->keep(p->context);
            }
            return true;
        }
        p->back(p->context, step, part);
        part *= t->shorten;
        if (t->first_damping > 0.0) {
            *damping *= t->raise_damping;
            solved = *damping <= t->most_damping && p->solve(p->context, *damping, step);
        }
    }
    return false;
}

gauss_newton_end_t gauss_newton(const gauss_newton_problem_t *problem, const gauss_newton_tunables_t *tunables,
                                double *cost) {
    double *step = allocate(problem->unknowns, sizeof(double)), damping = tunables->first_damping;
    gauss_newton_end_t end = GAUSS_NEWTON_LIMIT;
    for (size_t i = 0; end == GAUSS_NEWTON_LIMIT && i < tunables->most_iterations && !progress_cancelled(); i++) {
        const double before = *cost;
        const bool improved =
            problem->linearise(problem->context, cost) && improve(problem, tunables, step, &damping, cost);
        if (problem->ends(problem->context, improved, before, *cost)) {
            end = GAUSS_NEWTON_ENDED;
        }
    }
    free(step);
    return end;
}
