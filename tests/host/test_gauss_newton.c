/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The driver of nonlinear least squares on published problems, by short steps and by damped ones:
 *
 *   Misra1a, NIST Statistical Reference Datasets (lower difficulty): y = b1 (1 - exp(-b2 x)), 14 observations, both of
 *            the institute's starts, certified to 11 digits
 *   Rosenbrock's function as a sum of two squares (More, Garbow, Hillstrom 1981, problem 1): minimum 0 at (1, 1)
 */
#include "base/failure.h"
#include "numerics/gauss_newton.h"
#include "unity.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { UNKNOWNS = 2, MOST_ROWS = 14 };

typedef struct {
    size_t rows;
    void (*residual)(const double x[UNKNOWNS], double *residual);
    void (*jacobian)(const double x[UNKNOWNS], double jacobian[][UNKNOWNS]);
    double x[UNKNOWNS], start[UNKNOWNS];
    double gram[UNKNOWNS][UNKNOWNS], moment[UNKNOWNS];
    double settled; /* of the sum of squares, relative */
    size_t iterations, moves, backs, kept;
    double least; /* so far; no iteration may end above it */
} problem_t;

static const double misra_y[] = {10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02,
                                 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78};
static const double misra_x[] = {77.6,  114.9, 141.1, 190.8, 239.9, 289.0, 332.8,
                                 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0};

static void misra(const double b[UNKNOWNS], double *residual) {
    for (size_t i = 0; i < MOST_ROWS; i++) {
        residual[i] = misra_y[i] - b[0] * (1.0 - exp(-b[1] * misra_x[i]));
    }
}

/* Of the model: the step is that of moment = J' residual. */
static void misra_jacobian(const double b[UNKNOWNS], double jacobian[][UNKNOWNS]) {
    for (size_t i = 0; i < MOST_ROWS; i++) {
        const double falls = exp(-b[1] * misra_x[i]);
        jacobian[i][0] = 1.0 - falls;
        jacobian[i][1] = b[0] * misra_x[i] * falls;
    }
}

static void rosenbrock(const double x[UNKNOWNS], double *residual) {
    residual[0] = -10.0 * (x[1] - x[0] * x[0]);
    residual[1] = -(1.0 - x[0]);
}

static void rosenbrock_jacobian(const double x[UNKNOWNS], double jacobian[][UNKNOWNS]) {
    jacobian[0][0] = -20.0 * x[0];
    jacobian[0][1] = 10.0;
    jacobian[1][0] = -1.0;
    jacobian[1][1] = 0.0;
}

static double cost_of(const problem_t *p) {
    double residual[MOST_ROWS], sum = 0.0;
    p->residual(p->x, residual);
    for (size_t i = 0; i < p->rows; i++) {
        sum += residual[i] * residual[i];
    }
    return isfinite(sum) ? sum : HUGE_VAL;
}

static bool linearise(void *context, double *cost) {
    problem_t *p = context;
    double residual[MOST_ROWS], jacobian[MOST_ROWS][UNKNOWNS];
    (void)cost;
    p->residual(p->x, residual);
    p->jacobian(p->x, jacobian);
    memcpy(p->start, p->x, sizeof p->x);
    memset(p->gram, 0, sizeof p->gram);
    memset(p->moment, 0, sizeof p->moment);
    for (size_t i = 0; i < p->rows; i++) {
        for (size_t a = 0; a < UNKNOWNS; a++) {
            p->moment[a] += jacobian[i][a] * residual[i];
            for (size_t b = 0; b < UNKNOWNS; b++) {
                p->gram[a][b] += jacobian[i][a] * jacobian[i][b];
            }
        }
    }
    return true;
}

static bool solve(void *context, double damping, double *step) {
    const problem_t *p = context;
    const double a = p->gram[0][0] * (1.0 + damping), b = p->gram[0][1], d = p->gram[1][1] * (1.0 + damping);
    const double determinant = a * d - b * b;
    step[0] = (d * p->moment[0] - b * p->moment[1]) / determinant;
    step[1] = (a * p->moment[1] - b * p->moment[0]) / determinant;
    return determinant > 0.0;
}

static double move(void *context, const double *step, double part) {
    problem_t *p = context;
    p->moves++;
    for (size_t i = 0; i < UNKNOWNS; i++) {
        p->x[i] = p->start[i] + part * step[i];
    }
    return cost_of(p);
}

static void back(void *context, const double *step, double part) {
    problem_t *p = context;
    (void)step;
    (void)part;
    p->backs++;
    memcpy(p->x, p->start, sizeof p->x);
}

static void keep(void *context) {
    ((problem_t *)context)->kept++;
}

static bool ends(void *context, bool improved, double before, double now) {
    problem_t *p = context;
    p->iterations++;
    TEST_ASSERT_TRUE(now <= p->least && now <= before);
    TEST_ASSERT_TRUE(now == cost_of(p)); /* the unknowns stand where the cost is of */
    p->least = now;
    return !improved || before - now <= p->settled * before;
}

static const gauss_newton_tunables_t shortened = {
    .most_iterations = 200, .most_trials = 40, .worth = 1.0, .shorten = 0.3};
static const gauss_newton_tunables_t damped = {.most_iterations = 200,
                                               .most_trials = 40,
                                               .worth = 1.0,
                                               .shorten = 1.0,
                                               .first_damping = 1e-3,
                                               .raise_damping = 10.0,
                                               .lower_damping = 0.1,
                                               .least_damping = 1e-12,
                                               .most_damping = 1e9};

static gauss_newton_end_t run(problem_t *p, const gauss_newton_tunables_t *tunables, double *cost) {
    const gauss_newton_problem_t problem = {p, UNKNOWNS, linearise, solve, move, back, keep, ends};
    *cost = p->least = cost_of(p);
    return gauss_newton(&problem, tunables, cost);
}

static problem_t misra_from(double b1, double b2) {
    return (problem_t){
        .rows = MOST_ROWS, .residual = misra, .jacobian = misra_jacobian, .x = {b1, b2}, .settled = 1e-14};
}

static problem_t rosenbrock_from(double x, double y) {
    return (problem_t){.rows = 2, .residual = rosenbrock, .jacobian = rosenbrock_jacobian, .x = {x, y}};
}

void setUp(void) {
}
void tearDown(void) {
}

/* The search ends where the sum of squares falls by 1e-14 of itself: its root in the numbers, 1e-7, and some digits
 * more, since the last step of a quadratic convergence was taken. */
static void test_misra1a_has_the_certified_numbers(void) {
    static const double start[][UNKNOWNS] = {{500.0, 1e-4}, {250.0, 5e-4}};
    static const gauss_newton_tunables_t *const ways[] = {&shortened, &damped};
    for (size_t s = 0; s < 2; s++) {
        for (size_t w = 0; w < 2; w++) {
            problem_t p = misra_from(start[s][0], start[s][1]);
            double cost;
            TEST_ASSERT_EQUAL_INT(GAUSS_NEWTON_ENDED, run(&p, ways[w], &cost));
            TEST_ASSERT_DOUBLE_WITHIN(1e-7 * 2.3894212918e+02, 2.3894212918e+02, p.x[0]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-7 * 5.5015643181e-04, 5.5015643181e-04, p.x[1]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9 * 1.2455138894e-01, 1.2455138894e-01, cost);
        }
    }
}

static void test_rosenbrock_comes_down_its_valley(void) {
    static const gauss_newton_tunables_t *const ways[] = {&shortened, &damped};
    for (size_t w = 0; w < 2; w++) {
        problem_t p = rosenbrock_from(-1.2, 1.0);
        double cost;
        TEST_ASSERT_EQUAL_INT(GAUSS_NEWTON_ENDED, run(&p, ways[w], &cost));
        TEST_ASSERT_TRUE(cost < 1e-20); /* both residuals are exact near their zero */
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, p.x[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, p.x[1]);
        TEST_ASSERT_TRUE(p.backs > 0); /* whole steps alone lead up at first */
        TEST_ASSERT_EQUAL_UINT64(p.moves, p.backs + p.kept);
    }
}

static void test_the_limit_is_told_and_what_was_reached_stays(void) {
    problem_t p = rosenbrock_from(-1.2, 1.0);
    gauss_newton_tunables_t two = damped;
    double cost;
    const double first = cost_of(&p);
    two.most_iterations = 2;
    TEST_ASSERT_EQUAL_INT(GAUSS_NEWTON_LIMIT, run(&p, &two, &cost));
    TEST_ASSERT_EQUAL_UINT64(2, p.iterations);
    TEST_ASSERT_TRUE(cost < first && cost == cost_of(&p));
}

/* A move has to be worth it: with a factor that no step reaches, nothing moves. */
static void test_what_is_not_worth_it_is_taken_back(void) {
    problem_t p = misra_from(250.0, 5e-4);
    gauss_newton_tunables_t demanding = shortened;
    double cost;
    demanding.worth = 1e-9;
    demanding.most_trials = 3;
    const double first = cost_of(&p);
    TEST_ASSERT_EQUAL_INT(GAUSS_NEWTON_ENDED, run(&p, &demanding, &cost));
    TEST_ASSERT_TRUE(cost == first && p.x[0] == 250.0 && p.x[1] == 5e-4);
    TEST_ASSERT_EQUAL_UINT64(3, p.backs);
    TEST_ASSERT_EQUAL_UINT64(0, p.kept);
}

static bool solve_nothing(void *context, double damping, double *step) {
    (void)context;
    (void)damping;
    (void)step;
    return false;
}

static void test_equations_without_a_solution_move_nothing(void) {
    problem_t p = misra_from(250.0, 5e-4);
    const gauss_newton_problem_t problem = {&p, UNKNOWNS, linearise, solve_nothing, move, back, keep, ends};
    double cost = p.least = cost_of(&p);
    TEST_ASSERT_EQUAL_INT(GAUSS_NEWTON_ENDED, gauss_newton(&problem, &damped, &cost));
    TEST_ASSERT_EQUAL_UINT64(0, p.moves);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_misra1a_has_the_certified_numbers);
    RUN_TEST(test_rosenbrock_comes_down_its_valley);
    RUN_TEST(test_the_limit_is_told_and_what_was_reached_stays);
    RUN_TEST(test_what_is_not_worth_it_is_taken_back);
    RUN_TEST(test_equations_without_a_solution_move_nothing);
    return UNITY_END();
}
