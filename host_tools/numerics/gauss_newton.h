/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Nonlinear least squares: the Gauss-Newton method, with steps that are shortened (line search) or damped
 * (Levenberg-Marquardt) until the sum of squares falls. The problem holds its unknowns, derivatives and normal
 * equations; the driver decides which step is taken and when to stop.
 *
 *     each iteration:  linearise;  solve, move;  while that does not help: back, shorten or damp, move again;  keep
 *
 * The driver is modelled on GSL's multifit_nlinear, which stores the whole Jacobian and allows neither bounds nor
 * unknowns at which the simulation fails. Numerical Recipes, chapter 15.5; Madsen, Nielsen, Tingleff: Methods for
 * non-linear least squares problems (2004), algorithms 2.4 and 3.16.
 */
#ifndef GAUSS_NEWTON_H
#define GAUSS_NEWTON_H

#include <stdbool.h>
#include <stddef.h>

/** The callbacks of a problem. `context` is the first argument of each; `step` has one element per unknown. */
typedef struct {
    void *context;
    size_t unknowns;
    /** Computes derivatives and normal equations at the present unknowns. May update *cost. false: not possible, and
     * this iteration takes no step. */
    bool (*linearise)(void *context, double *cost);
    /** Solves the normal equations for the step, with damping times their diagonal added to it. false: no solution. */
    bool (*solve)(void *context, double damping, double *step);
    /** Moves the unknowns by this fraction of the step from their values at `linearise`. Returns the sum of squares
     * there, or HUGE_VAL where the model cannot be simulated. */
    double (*move)(void *context, const double *step, double part);
    /** Undoes the last move, which was rejected. */
    void (*back)(void *context, const double *step, double part);
    /** The last move was accepted. NULL: nothing to do. */
    void (*keep)(void *context);
    /** After each iteration: whether the search ends. before, now: the sums of squares. */
    bool (*ends)(void *context, bool improved, double before, double now);
} gauss_newton_problem_t;

/** How the search is tuned. */
typedef struct {
    size_t most_iterations;
    size_t most_trials; /**< moves in one iteration */
    double worth;       /**< a move is accepted if the sum of squares falls below this fraction of its value; 1: any */
    double shorten;     /**< factor between successive fractions of the step in the line search; 1: no line search */
    /** Damping of the first step; its factors after a rejected and after an accepted move; its range, outside of which
     * no step is tried. All 0: no damping. */
    double first_damping, raise_damping, lower_damping, least_damping, most_damping;
} gauss_newton_tunables_t;

typedef enum {
    GAUSS_NEWTON_ENDED, /**< problem->ends returned true */
    GAUSS_NEWTON_LIMIT  /**< most_iterations */
} gauss_newton_end_t;

/** *cost: in, the sum of squares at the start, finite; out, at the end of the search. It never rises, unless
 * `linearise` raises it. */
gauss_newton_end_t gauss_newton(const gauss_newton_problem_t *problem, const gauss_newton_tunables_t *tunables,
                                double *cost);

#endif
