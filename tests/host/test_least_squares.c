/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Bounded least squares against its optimality conditions, computed here from the rows themselves. */
#include "base/parallel.h"
#include "numerics/column_factor.h"
#include "numerics/least_squares.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdio.h>

enum { MOST = 12, ROWS = 300 };

static const uint64_t seed = 42;

void setUp(void) {
}
void tearDown(void) {
}

/* A minimum of a convex problem with bounds is where every free gradient is 0 and every bound one pushes into its
 * bound. */
static void test_random_problems_meet_the_optimality_conditions(void) {
    random_t random = {seed};
    size_t bound_seen = 0, free_seen = 0;
    for (int problem = 0; problem < 500; problem++) {
        const size_t n = 1 + (size_t)(random_unit(&random) * MOST);
        static double rows[ROWS][MOST], values[ROWS];
        double x[MOST], lower[MOST], error = 0.0;
        bool bound[MOST];
        normal_equations_t equations;
        failure_t failure;
        normal_equations_create(&equations, n);
        for (size_t r = 0; r < ROWS; r++) { /* more than one block of rows; neighbouring columns are nearly equal */
            double common = random_normal(&random);
            values[r] = random_normal(&random);
            for (size_t i = 0; i < n; i++) {
                common += 0.1 * random_normal(&random);
                rows[r][i] = common * pow(10.0, (double)i - 6.0);
            }
            normal_equations_add(&equations, rows[r], values[r]);
        }
        normal_equations_finish(&equations);
        for (size_t i = 0; i < n; i++) {
            lower[i] = i == 0 ? -HUGE_VAL : random_normal(&random) > 0.0 ? 0.0 : -0.01;
        }
        TEST_ASSERT_TRUE_MESSAGE(solve_bounded(&equations, lower, x, bound, &failure), failure.text);
        for (size_t i = 0; i < n; i++) {
            double gradient = 0.0, length = 0.0;
            for (size_t r = 0; r < ROWS; r++) {
                double residual = values[r];
                for (size_t j = 0; j < n; j++) {
                    residual -= rows[r][j] * x[j];
                }
                gradient += rows[r][i] * residual;
                length += rows[r][i] * rows[r][i];
                error += i == 0 ? residual * residual : 0.0;
            }
            gradient /= sqrt(length) * sqrt((double)ROWS);
            /* The ridge of 1e-12 and rounding at a condition near 1e4 stay below 1e-7 of the data's unit size. */
            TEST_ASSERT_TRUE(x[i] >= lower[i]);
            TEST_ASSERT_TRUE(gradient < 1e-7);
            TEST_ASSERT_TRUE(bound[i] || gradient > -1e-7);
            TEST_ASSERT_TRUE(!bound[i] || x[i] == lower[i]);
            bound_seen += bound[i] ? 1 : 0;
            free_seen += bound[i] ? 0 : 1;
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-9 * ROWS, error, squared_error(&equations, x));
        normal_equations_free(&equations);
    }
    printf("seed %llu: %zu unknowns on a bound, %zu free\n", (unsigned long long)seed, bound_seen, free_seen);
    TEST_ASSERT_GREATER_THAN_UINT64(100, bound_seen);
    TEST_ASSERT_GREATER_THAN_UINT64(100, free_seen);
}

/* Two unknowns, inverted by hand. */
static void test_inverse_of_a_known_matrix(void) {
    const double rows[3][2] = {{1.0, 0.0}, {1.0, 1.0}, {1.0, 2.0}}; /* A'A = [3 3; 3 5], inverse [5 -3; -3 3] / 6 */
    const bool none[2] = {false, false}, second[2] = {false, true};
    double inverse[4];
    normal_equations_t equations;
    failure_t failure;
    normal_equations_create(&equations, 2);
    for (int r = 0; r < 3; r++) {
        normal_equations_add(&equations, rows[r], 1.0);
    }
    normal_equations_finish(&equations);
    TEST_ASSERT_TRUE(inverse_matrix(&equations, none, inverse, &failure));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 5.0 / 6.0, inverse[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -0.5, inverse[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -0.5, inverse[2]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5, inverse[3]);
    TEST_ASSERT_TRUE(inverse_matrix(&equations, second, inverse, &failure));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0 / 3.0, inverse[0]);
    for (int i = 1; i < 4; i++) {
        TEST_ASSERT_EQUAL_DOUBLE(0.0, inverse[i]);
    }
    normal_equations_free(&equations);
}

/* Sums of 300 products in another order: a few roundings apart. */
static void test_columns_make_the_same_equations_as_rows(void) {
    enum { COLUMNS = 5 };
    static double columns[COLUMNS * ROWS], values[ROWS];
    random_t random = {seed};
    normal_equations_t by_rows, by_columns;
    normal_equations_create(&by_rows, COLUMNS);
    normal_equations_create(&by_columns, COLUMNS);
    for (size_t r = 0; r < ROWS; r++) {
        double row[COLUMNS];
        values[r] = random_normal(&random);
        for (size_t i = 0; i < COLUMNS; i++) {
            columns[i * ROWS + r] = row[i] = random_normal(&random);
        }
        normal_equations_add(&by_rows, row, values[r]);
    }
    normal_equations_finish(&by_rows);
    normal_equations_of_columns(&by_columns, columns, values, ROWS, 0);
    for (size_t i = 0; i < COLUMNS; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-10, by_rows.moment[i], by_columns.moment[i]);
        for (size_t j = 0; j < COLUMNS; j++) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-10, by_rows.gram[i * COLUMNS + j], by_columns.gram[i * COLUMNS + j]);
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, by_rows.power, by_columns.power);
    TEST_ASSERT_EQUAL(by_rows.rows, by_columns.rows);
    normal_equations_free(&by_rows);
    normal_equations_free(&by_columns);
}

/* So many rows that they are multiplied by parts: the same on one processor and on three, to the last bit; as many sums
 * of products, to rounding; and where some of the products are known they stay. */
static void test_parts_of_the_rows(void) {
    enum { COLUMNS = 9, MANY = 30000 };
    double *columns = allocate(COLUMNS * MANY, sizeof(double)), *values = allocate(MANY, sizeof(double));
    random_t random = {seed};
    normal_equations_t one, three, rest;
    normal_equations_create(&one, COLUMNS);
    normal_equations_create(&three, COLUMNS);
    normal_equations_create(&rest, COLUMNS);
    for (size_t k = 0; k < COLUMNS * MANY; k++) {
        columns[k] = random_normal(&random);
        values[k % MANY] = columns[k] + 0.1 * random_normal(&random);
    }
    parallel_limit(1);
    normal_equations_of_columns(&one, columns, values, MANY, 0);
    parallel_limit(3);
    normal_equations_of_columns(&three, columns, values, MANY, 0);
    parallel_limit(0);
    TEST_ASSERT_EQUAL_MEMORY(one.gram, three.gram, COLUMNS * COLUMNS * sizeof(double));
    for (size_t known = 1; known <= COLUMNS; known++) {
        for (size_t i = 0; i < COLUMNS * COLUMNS; i++) {
            rest.gram[i] = i / COLUMNS < known && i % COLUMNS < known ? -7.0 : 0.0;
        }
        normal_equations_of_columns(&rest, columns, values, MANY, known);
        for (size_t i = 0; i < COLUMNS; i++) {
            for (size_t j = 0; j < COLUMNS; j++) {
                double sum = 0.0;
                for (size_t k = 0; k < MANY; k++) {
                    sum += columns[i * MANY + k] * columns[j * MANY + k];
                }
                TEST_ASSERT_DOUBLE_WITHIN(1e-9, sum, one.gram[i * COLUMNS + j]); /* of 30000 */
                TEST_ASSERT_DOUBLE_WITHIN(1e-9, i < known && j < known ? -7.0 : sum, rest.gram[i * COLUMNS + j]);
            }
        }
    }
    normal_equations_free(&one);
    normal_equations_free(&three);
    normal_equations_free(&rest);
    free(columns);
    free(values);
}

/* A column that never moves must not spoil the others. */
static void test_a_column_of_zeros_is_harmless(void) {
    const double lower[2] = {0.0, 0.0};
    double x[2];
    normal_equations_t equations;
    failure_t failure;
    normal_equations_create(&equations, 2);
    for (int r = 1; r < 10; r++) {
        normal_equations_add(&equations, (const double[]){r, 0.0}, 3.0 * r);
    }
    normal_equations_finish(&equations);
    TEST_ASSERT_TRUE(solve_bounded(&equations, lower, x, NULL, &failure));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3.0, x[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, x[1]);
    normal_equations_free(&equations);
}

/* What is left of a signal is orthogonal to the columns under the weights, its square is what their white products
 * leave, and a column that others make up, or of zeros, has no part in it. The columns' lengths are 10 powers of ten
 * apart. */
static void test_a_factor_of_columns_that_make_each_other_up(void) {
    enum { COLUMNS = 6, MADE_UP = 3, ZEROS = 4 };
    static double values[COLUMNS][ROWS], y[ROWS], left[ROWS], weight[ROWS];
    const double *column[COLUMNS];
    double x[COLUMNS] = {0.0}, square = 0.0, square_left = 0.0, explained = 0.0;
    random_t random = {seed};
    printf("seed %u\n", (unsigned)seed);
    for (size_t r = 0; r < ROWS; r++) {
        weight[r] = r % 7 == 0 ? 0.0 : random_unit(&random);
        y[r] = random_normal(&random);
        for (size_t c = 0; c < COLUMNS; c++) {
            values[c][r] = pow(10.0, 2.0 * (double)c - 5.0) * random_normal(&random);
        }
        values[MADE_UP][r] = values[0][r] - 0.3 * values[2][r];
        values[ZEROS][r] = 0.0;
        left[r] = y[r];
        square += weight[r] * y[r] * y[r];
    }
    for (size_t c = 0; c < COLUMNS; c++) {
        column[c] = values[c];
        for (size_t r = 0; r < ROWS; r++) {
            x[c] += weight[r] * values[c][r] * y[r];
        }
    }
    column_factor_t factor;
    column_factor_make(&factor, column, COLUMNS, weight, ROWS);
    column_factor_whiten(&factor, x, 1, COLUMNS);
    for (size_t c = 0; c < COLUMNS; c++) {
        explained += x[c] * x[c];
        TEST_ASSERT_EQUAL(c != MADE_UP && c != ZEROS, column_factor_has(&factor, c));
    }
    column_factor_solve(&factor, x);
    columns_add(column, COLUMNS, x, -1.0, ROWS, left);
    TEST_ASSERT_DOUBLE_WITHIN(1e-100, 0.0, x[MADE_UP]); /* 1 over the pivot that stands for no column, squared */
    TEST_ASSERT_DOUBLE_WITHIN(1e-100, 0.0, x[ZEROS]);
    for (size_t c = 0; c < COLUMNS; c++) {
        double product = 0.0, length = 0.0;
        for (size_t r = 0; r < ROWS; r++) {
            product += weight[r] * values[c][r] * left[r];
            length += weight[r] * values[c][r] * values[c][r];
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, product / sqrt(fmax(length, 1e-300) * square)); /* rounding of 300 sums */
    }
    for (size_t r = 0; r < ROWS; r++) {
        square_left += weight[r] * left[r] * left[r];
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-12 * square, square - explained, square_left);
    column_factor_free(&factor);
}

/* What BLAS calls for arguments that it does not take, here in its place; numpy's makes an exception of it. */
int xerbla_(const char *routine, const int *argument, int length);
static int refused;

int xerbla_(const char *routine, const int *argument, int length) {
    printf("%.*s refuses argument %d\n", length, routine, *argument);
    refused++;
    return 0;
}

/* A look that is cancelled goes on without columns for a moment. */
static void test_a_factor_of_no_columns(void) {
    column_factor_t factor;
    const double none = 0.0;
    double signal[1] = {7.0};
    cblas_dtrsv(CblasRowMajor, CblasLower, CblasTrans, CblasNonUnit, 0, &none, 0, signal, 1);
    TEST_ASSERT_EQUAL_MESSAGE(1, refused, "BLAS does not call what stands here");
    column_factor_make(&factor, NULL, 0, NULL, ROWS);
    column_factor_whiten(&factor, signal, 1, 0);
    column_factor_solve(&factor, signal);
    TEST_ASSERT_EQUAL_DOUBLE(7.0, signal[0]);
    TEST_ASSERT_EQUAL(1, refused);
    column_factor_free(&factor);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_factor_of_no_columns);
    RUN_TEST(test_random_problems_meet_the_optimality_conditions);
    RUN_TEST(test_inverse_of_a_known_matrix);
    RUN_TEST(test_columns_make_the_same_equations_as_rows);
    RUN_TEST(test_parts_of_the_rows);
    RUN_TEST(test_a_column_of_zeros_is_harmless);
    RUN_TEST(test_a_factor_of_columns_that_make_each_other_up);
    return UNITY_END();
}
