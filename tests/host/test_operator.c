/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The universal rate-independent operator: its columns, its noise, and its weights by evidence. */
#include "base/failure.h"
#include "operator/hysteresis.h"
#include "operator/turns.h"
#include "random.h"
#include "unity.h"
#include <gsl/gsl_blas.h>
#include <gsl/gsl_linalg.h>
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

/* A drive of two sines, 0 to 100 V. */
static double drive_at(double cycles) {
    return 50.0 + 32.0 * sin(2.0 * M_PI * cycles) + 18.0 * sin(2.0 * M_PI * 3.7 * cycles);
}

/* The operator's columns where the drive has come to after some cycles, with that many samples a cycle. */
static void columns_after(const operator_t *operator, double cycles, size_t per_cycle, double *row) {
    const double range_v[2] = {0.0, 100.0};
    operator_walk_t walk;
    operator_begin(&walk, operator, 0, drive_at(0.0), range_v);
    for (size_t k = 1; k <= (size_t)(cycles * (double)per_cycle); k++) {
        operator_move(&walk, drive_at((double)k / (double)per_cycle));
        operator_move(&walk, drive_at((double)k / (double)per_cycle)); /* a rest changes nothing */
    }
    operator_row(&walk, drive_at(cycles), row);
}

/* The same path in ten times as many samples. The extremes are then met better, by 1 / (8 samples^2) of the amplitude
 * times (2 pi)^2, 3.7^2 for the faster sine: 4e-6 of 50 V at 4000 a cycle. Columns bend by up to the degree's square,
 * and the shortest leak by 1 / 0.02: 100 times as much. */
static void test_columns_do_not_depend_on_the_rate(void) {
    const double range_v[2] = {0.0, 100.0};
    operator_t operator= {0};
    operator_create(&operator, range_v, 1);
    const duhem_law_t law = {.number = {log(0.3), 1.5, 0.1, 0.2}};
    operator_set_law(&operator, & law);
    double *slow = allocate(operator.columns, sizeof(double)), *fast = allocate(operator.columns, sizeof(double));
    columns_after(&operator, 4.25, 40000, slow);
    columns_after(&operator, 4.25, 4000, fast);
    for (size_t j = 0; j < operator.columns; j++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, fast[j], slow[j]);
    }
    free(slow);
    free(fast);
    operator_free(&operator);
}

/* Of the columns of a mirrored drive those of an odd group are the others' with their sign changed, and those of an
 * even group are the same; but for those of the past. Tolerance: rounding, of up to 4000 steps of columns that grow
 * to 10. */
static void test_a_group_is_odd_or_even(void) {
    enum { STEPS = 4000 };
    static const bool is_odd[GROUP_COUNT] = {
        [GROUP_CURVE_ODD] = true, [GROUP_SMALL_PLAYS] = true, [GROUP_PLAYS] = true,   [GROUP_BENDS + 1] = true,
        [GROUP_BENDS + 3] = true, [GROUP_BENDS + 5] = true,   [GROUP_LEAKS] = true,   [GROUP_PRODUCTS_ODD] = true,
        [GROUP_DRAWN_ODD] = true, [GROUP_PULLED] = true,      [GROUP_LAW_ODD] = true, [GROUP_LAW_NUMBERS] = true};
    const double range_v[2] = {0.0, 100.0};
    const duhem_law_t law = {.number = {log(0.3), 1.5, 0.1, 0.2}};
    operator_t operator= {0};
    operator_walk_t walk[2];
    operator_create(&operator, range_v, 1);
    operator_set_law(&operator, & law);
    double *row[2] = {allocate(operator.columns, sizeof(double)), allocate(operator.columns, sizeof(double))};
    size_t compared[2] = {0};
    for (int mirrored = 0; mirrored < 2; mirrored++) {
        double drive_v = 0.0;
        for (size_t k = 0; k <= STEPS; k++) {
            drive_v = mirrored != 0 ? 100.0 - drive_at((double)k / 1000.0) : drive_at((double)k / 1000.0);
            if (k == 0) {
                operator_begin(&walk[mirrored], &operator, 0, drive_v, range_v);
            }
            operator_move(&walk[mirrored], drive_v);
        }
        operator_row(&walk[mirrored], drive_v, row[mirrored]);
    }
    for (size_t j = 0; j < operator.columns; j++) {
        const operator_group_t group = operator_group(&operator, j);
        if (group != GROUP_FREE && group != GROUP_PAST_EXTREMES && group != GROUP_PAST_PATH) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, is_odd[group] ? -row[0][j] : row[0][j], row[1][j]);
            compared[is_odd[group]] += fabs(row[0][j]) > 1e-3 ? 1 : 0;
        }
    }
    TEST_ASSERT_TRUE_MESSAGE(compared[0] > 50 && compared[1] > 100, "most columns are 0, and this test says nothing");
    free(row[0]);
    free(row[1]);
    operator_free(&operator);
}

/* Sampled 17 times a period, a sine's extremes are up to 1.7 % of its amplitude beyond the samples. */
static void test_turns_of_a_sine(void) {
    enum { SAMPLES = 400 };
    double value[SAMPLES], way[SAMPLES];
    size_t turns = 0;
    for (size_t k = 0; k < SAMPLES; k++) {
        value[k] = sin(2.0 * M_PI * (double)k / 17.3 + 0.4);
    }
    turns_find(value, SAMPLES, way);
    for (size_t k = 0; k < SAMPLES; k++) {
        if (!isnan(way[k])) {
            turns++;
            /* The quartic's error, (2 pi / 17.3)^5 / 5! times the product of the distances to its samples: at most 3.6
             * within the inner ones. */
            TEST_ASSERT_DOUBLE_WITHIN(2e-4, 1.0, fabs(way[k]));
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT64(40, turns); /* 46 there are; where a sample is on it nothing lies beyond */
}

/* A triangle's corners are where its sides meet; on stairs and in white noise there are none. */
static void test_turns_of_corners(void) {
    enum { SAMPLES = 300 };
    double value[SAMPLES], way[SAMPLES];
    size_t turns = 0;
    for (size_t k = 0; k < SAMPLES; k++) {
        value[k] = 2.0 * fabs(2.0 * ((double)k / 31.7 - floor((double)k / 31.7 + 0.5))) - 1.0;
    }
    turns_find(value, SAMPLES, way);
    for (size_t k = 0; k < SAMPLES; k++) {
        if (!isnan(way[k])) {
            turns++;
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, fabs(way[k]));
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT64(14, turns); /* of 18 */
    for (size_t k = 0; k < SAMPLES; k++) {
        value[k] = (double)(k / 20 % 3);
    }
    turns_find(value, SAMPLES, way);
    for (size_t k = 0; k < SAMPLES; k++) {
        TEST_ASSERT_TRUE(isnan(way[k]));
    }
}

/* power 1, no knots: dh/dw = (1 - h) / length, which is an exponential; in one step as in many. */
static void test_a_duhem_law_is_exact_for_any_step(void) {
    const duhem_law_t law = {.number = {log(0.25), 1.0}};
    duhem_table_t *table = allocate(1, sizeof *table);
    duhem_state_t one, many;
    duhem_tabulate(&law, table);
    duhem_begin(table, &one);
    duhem_begin(table, &many);
    const double way[] = {0.3, -0.5, 0.1, -0.07, 1.1};
    double h = 0.0;
    for (size_t i = 0; i < sizeof way / sizeof way[0]; i++) {
        const double end = copysign(1.0, way[i]);
        h = end + (h - end) * exp(-fabs(way[i]) / 0.25);
        duhem_move(table, &one, way[i]);
        for (int part = 0; part < 50; part++) {
            duhem_move(table, &many, way[i] / 50.0);
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, h, duhem_value(table, &one));
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, duhem_value(table, &one), duhem_value(table, &many));
    }
    free(table);
}

/* The ladder's gain over frequency: sqrt(f / (f + rho)) within a fifth, from five times its lower end on. Two sections
 * a decade ripple by that much at the corner; a filter that is wrong by a fifth at some frequencies is as good as the
 * noise is known there. */
static void test_the_ladder_whitens_one_over_f(void) {
    pink_t pink;
    const double rho = 0.02;
    pink_create(&pink, rho, 20000);
    double f = 5.0 / 20000;
    while (f < 0.4) {
        double gain = 1.0;
        for (size_t i = 0; i < pink.sections; i++) {
            const double c = cos(2.0 * M_PI * f), z = pink.zero[i], p = pink.pole[i];
            gain *= (1.0 - 2.0 * z * c + z * z) / (1.0 - 2.0 * p * c + p * p);
        }
        const double wanted = f / (f + rho), scale = sqrt(gain / wanted);
        TEST_ASSERT_DOUBLE_WITHIN(0.2, 1.0, scale);
        f *= 1.5;
    }
}

enum { ROWS = 60, WIDTH = 9, GROUPS = 3 };

/* Log likelihood of y under N(0, variance + sum over columns of x x' / precision), with column 0 free: precision 1e-9.
 */
static double direct_evidence(double x[ROWS][WIDTH], const double *y, const size_t *group, const double *precision,
                              double variance, const double *open_row, double *open) {
    gsl_matrix *c = gsl_matrix_calloc(ROWS, ROWS);
    gsl_vector *v = gsl_vector_alloc(ROWS);
    double prior = 0.0;
    gsl_vector *cross = gsl_vector_calloc(ROWS), *solved = gsl_vector_alloc(ROWS);
    for (size_t j = 0; j < WIDTH; j++) {
        const double size = 1.0 / precision[group[j]];
        prior += open_row[j] * open_row[j] * size;
        for (size_t a = 0; a < ROWS; a++) {
            gsl_vector_set(cross, a, gsl_vector_get(cross, a) + open_row[j] * x[a][j] * size);
            for (size_t b = 0; b < ROWS; b++) {
                gsl_matrix_set(c, a, b, gsl_matrix_get(c, a, b) + x[a][j] * x[b][j] * size);
            }
        }
    }
    for (size_t a = 0; a < ROWS; a++) {
        gsl_matrix_set(c, a, a, gsl_matrix_get(c, a, a) + variance);
        gsl_vector_set(v, a, y[a]);
    }
    gsl_linalg_cholesky_decomp1(c);
    double log_likelihood = -0.5 * ROWS * log(2.0 * M_PI), product;
    for (size_t a = 0; a < ROWS; a++) {
        log_likelihood -= log(gsl_matrix_get(c, a, a));
    }
    gsl_linalg_cholesky_solve(c, v, solved);
    gsl_blas_ddot(v, solved, &product);
    log_likelihood -= 0.5 * product;
    gsl_linalg_cholesky_solve(c, cross, solved);
    gsl_blas_ddot(cross, solved, &product);
    *open = (prior - product) / variance;
    gsl_matrix_free(c);
    gsl_vector_free(v);
    gsl_vector_free(cross);
    gsl_vector_free(solved);
    return log_likelihood;
}

static void test_evidence_agrees_with_a_direct_computation(void) {
    static const size_t group[WIDTH] = {1, 1, 1, 1, 1, 2, 2, 2, 2};
    double x[ROWS][WIDTH], y[ROWS], new_row[WIDTH], row[WIDTH], open, direct_open;
    normal_equations_t equations;
    group_evidence_t e;
    failure_t failure;
    normal_equations_create(&equations, WIDTH);
    for (size_t k = 0; k < ROWS; k++) {
        y[k] = 0.1 * random_normal(&rng);
        for (size_t j = 0; j < WIDTH; j++) {
            x[k][j] = random_normal(&rng);
            y[k] += j < 5 ? x[k][j] : 0.02 * x[k][j];
        }
        normal_equations_add(&equations, x[k], y[k]);
    }
    normal_equations_finish(&equations);
    TEST_ASSERT_TRUE(group_evidence_fit(&equations, group, GROUPS, 0.0, NULL, &e, &failure));
    for (size_t j = 0; j < WIDTH; j++) {
        row[j] = new_row[j] = random_normal(&rng);
    }
    const double direct = direct_evidence(x, y, group, e.precision, e.variance, new_row, &direct_open);
    group_evidence_open(&e, row, 1, &open);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6 * fabs(direct), direct, e.log_evidence);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, direct_open, open);
    TEST_ASSERT_DOUBLE_WITHIN(1.0, 5.0, e.determined[1]);
    TEST_ASSERT_DOUBLE_WITHIN(0.04, 0.1, sqrt(e.variance)); /* 60 rows: to a tenth, four times */
    /* It is a maximum: no precision a tenth away is likelier. */
    for (size_t g = 1; g < GROUPS; g++) {
        for (int up = 0; up < 2; up++) {
            double precision[GROUPS];
            memcpy(precision, e.precision, sizeof precision);
            precision[g] *= up != 0 ? 1.3 : 1.0 / 1.3;
            TEST_ASSERT_TRUE(direct_evidence(x, y, group, precision, e.variance, new_row, &direct_open) <
                             direct + 0.01); /* it ends when a round gains less than a thousandth */
        }
    }
    group_evidence_free(&e);
    normal_equations_free(&equations);
}

/* A group of which one column says something and three large ones nothing. With a little less prior the large ones lose
 * more than the one gains: out of use is a hill. With much less that is the other way round. */
static void test_a_group_comes_back_from_out_of_use(void) {
    enum { LARGE = 6, OF_LARGE = 10, OTHER = 2 };
    static const size_t group[WIDTH] = {1, 1, 1, 1, 1, 2, 2, 2, 2};
    static const double nothing[WIDTH] = {0.0};
    double x[ROWS][WIDTH] = {{0.0}}, y[ROWS] = {0.0}, ignored;
    normal_equations_t equations;
    group_evidence_t e, again;
    failure_t failure;
    normal_equations_create(&equations, WIDTH);
    for (size_t k = 0; k < ROWS; k++) {
        const bool large = k < OF_LARGE;
        for (size_t j = large ? LARGE : 0; j < (large ? WIDTH : LARGE); j++) {
            x[k][j] = (large ? 30.0 : 1.0) * random_normal(&rng);
            y[k] += large ? 0.0 : (j < 5 ? 1.0 : 0.3) * x[k][j];
        }
        y[k] += large ? 0.0 : 0.1 * random_normal(&rng);
        normal_equations_add(&equations, x[k], y[k]);
    }
    normal_equations_finish(&equations);
    TEST_ASSERT_TRUE(group_evidence_fit(&equations, group, GROUPS, 0.0, NULL, &e, &failure));
    /* Out of use: a weight of 0.3 has a millionth of its prior's variance. */
    double out[GROUPS] = {0.0, e.precision[1], 1e9}, less[GROUPS] = {0.0, e.precision[1], 1e8};
    const double variance = 0.1;
    const double at_out = direct_evidence(x, y, group, out, variance, nothing, &ignored);
    TEST_ASSERT_TRUE(at_out > direct_evidence(x, y, group, less, variance, nothing, &ignored)); /* it is a hill */
    TEST_ASSERT_TRUE(e.log_evidence > at_out + 10.0);                                           /* and a lower one */
    const double there = e.precision[OTHER];
    e.precision[OTHER] = out[OTHER];
    e.determined[OTHER] = 1e-3;
    e.variance = variance;
    TEST_ASSERT_TRUE(group_evidence_fit(&equations, group, GROUPS, 0.0, &e, &again, &failure));
    /* Both ended where a round gains a thousandth. */
    TEST_ASSERT_DOUBLE_WITHIN(0.01, e.log_evidence, again.log_evidence);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 0.0, log(again.precision[OTHER] / there));
    group_evidence_free(&e);
    group_evidence_free(&again);
    normal_equations_free(&equations);
}

/* Three groups whose columns are nearly mixtures of the first one's: they can stand for each other. A step with a wrong
 * second derivative stays beside the top. */
static void test_evidence_is_at_the_top_where_groups_are_alike(void) {
    enum { COLUMNS = 40, EACH = 10, OF_IT = 400 };
    size_t group[COLUMNS];
    double mixture[COLUMNS][EACH], row[COLUMNS], determined = 0.0;
    normal_equations_t equations;
    group_evidence_t e;
    failure_t failure;
    normal_equations_create(&equations, COLUMNS);
    for (size_t j = 0; j < COLUMNS; j++) {
        group[j] = 1 + j / EACH;
        for (size_t i = 0; i < EACH; i++) {
            mixture[j][i] = random_normal(&rng) / sqrt(EACH);
        }
    }
    for (size_t k = 0; k < OF_IT; k++) {
        double y = 0.3 * random_normal(&rng);
        for (size_t j = 0; j < COLUMNS; j++) {
            row[j] = (j < EACH ? 1.0 : 0.03) * random_normal(&rng);
            for (size_t i = 0; j >= EACH && i < EACH; i++) {
                row[j] += mixture[j][i] * row[i];
            }
            y += j % EACH < 5 ? row[j] : 0.0;
        }
        normal_equations_add(&equations, row, y);
    }
    normal_equations_finish(&equations);
    TEST_ASSERT_TRUE(group_evidence_fit(&equations, group, 5, 0.0, NULL, &e, &failure));
    /* Where its slopes by the precisions and the variance are none: half of these differences. A settled evidence is
     * 0.001 from the top, with a curvature of at most half of what is determined: 0.02 of the root of that. */
    for (size_t g = 1; g < 5; g++) {
        double square = 0.0;
        for (size_t j = 0; j < COLUMNS; j++) {
            square += group[j] == g ? e.weight[j] * e.weight[j] : 0.0;
        }
        determined += e.determined[g];
        TEST_ASSERT_DOUBLE_WITHIN(0.1, e.determined[g], e.precision[g] * square);
    }
    double misfit = equations.power;
    for (size_t i = 0; i < COLUMNS; i++) {
        misfit -= 2.0 * e.weight[i] * equations.moment[i];
        for (size_t j = 0; j < COLUMNS; j++) {
            misfit += e.weight[i] * e.weight[j] * equations.gram[i * COLUMNS + j];
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.2, OF_IT - determined, misfit / e.variance);
    group_evidence_free(&e);
    normal_equations_free(&equations);
}

/* Rows made together are those made one by one, and weights folded into them give the same output. The tolerances are
 * rounding: of a sum of 300 products of about 1, and of 7 Chebyshev polynomials whose coefficients are up to 64. */
static void test_rows_together_are_the_rows_one_by_one(void) {
    enum { FEW_ROWS = 11 };
    const double range_v[2] = {0.0, 100.0};
    operator_t operator= {0};
    operator_walk_t walk;
    operator_folded_t folded;
    operator_create(&operator, range_v, 2);
    const size_t n = operator.columns;
    double *weight = allocate(n, sizeof(double)), *one = allocate(n, sizeof(double)),
           *room = allocate(n, sizeof(double)), *rows = allocate(FEW_ROWS * n, sizeof(double)), level_v[FEW_ROWS],
           value[FEW_ROWS];
    for (size_t j = 0; j < n; j++) {
        weight[j] = random_normal(&rng);
    }
    operator_fold(&operator, weight, &folded);
    operator_begin(&walk, &operator, 1, drive_at(0.0), range_v);
    for (size_t r = 0; r < FEW_ROWS; r++) {
        level_v[r] = drive_at(0.13 * (double)r);
        operator_move(&walk, level_v[r]);
        operator_row_but_bends(&walk, level_v[r], rows + r * n);
        value[r] = operator_value(&folded, &walk, level_v[r], room);
    }
    operator_bends(&operator, rows, FEW_ROWS);
    operator_begin(&walk, &operator, 1, drive_at(0.0), range_v);
    for (size_t r = 0; r < FEW_ROWS; r++) {
        operator_move(&walk, level_v[r]);
        operator_row(&walk, level_v[r], one);
        for (size_t j = 0; j < n; j++) {
            TEST_ASSERT_EQUAL_DOUBLE(one[j], rows[r * n + j]);
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-11, cblas_ddot((int)n, one, 1, weight, 1), value[r]);
    }
    free(weight);
    free(one);
    free(room);
    free(rows);
}

/* The filter as states and as a ladder. Tolerance: the shares sum up to a thousandth of their size at frequency 0, so
 * rounding of 1e-16 is up to 1e-13, over 1000 samples. */
static void test_the_ladder_as_states(void) {
    enum { MANY = 1000 };
    static double value[MANY];
    pink_t pink;
    pink_create(&pink, 0.02, 100000);
    double *ladder = pink_memory(&pink), wanted[MANY];
    for (size_t k = 0; k < MANY; k++) {
        value[k] = wanted[k] = random_normal(&rng) + 2.0;
        pink_value(&pink, ladder, &wanted[k], k == 0);
    }
    const state_space_t states = pink_states(&pink);
    state_space_column(&states, value, MANY);
    for (size_t k = 0; k < MANY; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-10, wanted[k], value[k]);
    }
    free(ladder);
}

int main(void) {
    rng = random_start("operator", 20261123);
    UNITY_BEGIN();
    RUN_TEST(test_columns_do_not_depend_on_the_rate);
    RUN_TEST(test_a_group_is_odd_or_even);
    RUN_TEST(test_turns_of_a_sine);
    RUN_TEST(test_turns_of_corners);
    RUN_TEST(test_a_duhem_law_is_exact_for_any_step);
    RUN_TEST(test_the_ladder_whitens_one_over_f);
    RUN_TEST(test_rows_together_are_the_rows_one_by_one);
    RUN_TEST(test_the_ladder_as_states);
    RUN_TEST(test_evidence_agrees_with_a_direct_computation);
    RUN_TEST(test_a_group_comes_back_from_out_of_use);
    RUN_TEST(test_evidence_is_at_the_top_where_groups_are_alike);
    return UNITY_END();
}
