/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Orthonormal columns: what they explain and what they leave, of one vector and of many. */
#include "base/failure.h"
#include "base/parallel.h"
#include "numerics/basis.h"
#include "random.h"
#include "unity.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

/* Of a few of them, and of all that there is. */
static void test_what_is_projected_is_orthogonal(void) {
    enum { ROWS = 400, COLUMNS = 30 };
    basis_t basis;
    double x[ROWS], kept[ROWS], share[COLUMNS];
    basis_open(&basis, ROWS, COLUMNS);
    for (size_t j = 0; j < COLUMNS; j++) {
        for (size_t k = 0; k < ROWS; k++) { /* nearly the same, which takes care */
            x[k] = kept[k] = 1.0 + 1e-3 * random_normal(&rng) + (double)j;
        }
        basis_add(&basis, x, 1);
        TEST_ASSERT_EQUAL_UINT64(j + 1, basis.columns);
        cblas_dscal(ROWS, -3.0, kept, 1); /* once more in another size: nothing new */
        basis_add(&basis, kept, 1);
        TEST_ASSERT_EQUAL_UINT64(j + 1, basis.columns);
    }
    memset(x, 0, sizeof x);
    basis_add(&basis, x, 1);
    TEST_ASSERT_EQUAL_UINT64(COLUMNS, basis.columns);
    for (size_t k = 0; k < ROWS; k++) {
        x[k] = 1e6 + random_normal(&rng);
    }
    const double before = cblas_dnrm2(ROWS, x, 1);
    basis_project(&basis, x, 1);
    basis_shares(&basis, x, 1, ROWS, share);
    for (size_t j = 0; j < COLUMNS; j++) {
        const double *column = basis.column + j * ROWS;
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, cblas_dnrm2(ROWS, column, 1));
        TEST_ASSERT_DOUBLE_WITHIN(1e-13 * before, 0.0, share[j]);
        for (size_t i = 0; i < j; i++) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, cblas_ddot(ROWS, column, 1, basis.column + i * ROWS, 1));
        }
    }
    for (size_t k = 0; k < ROWS; k++) { /* full: nothing is written behind the end */
        x[k] = random_normal(&rng);
    }
    basis_add(&basis, x, 1);
    TEST_ASSERT_EQUAL_UINT64(COLUMNS, basis.columns);
    basis_close(&basis);
}

/* Many at a time come to what one after the other comes to, to rounding: what is left of them, their shares, and which
 * ones say nothing new, of the block's own too. */
static void test_some_vectors_at_a_time_are_the_same(void) {
    enum { ROWS = 500, KNOWN = 12, ADDED = 9, DEPENDENT = 4 };
    static double known[KNOWN * ROWS], x[ADDED * ROWS], alone[ADDED * ROWS], share[ADDED * ROWS];
    basis_t some, one;
    basis_open(&some, ROWS, KNOWN + ADDED);
    basis_open(&one, ROWS, KNOWN + ADDED);
    for (size_t k = 0; k < KNOWN * ROWS; k++) {
        known[k] = random_normal(&rng);
    }
    for (size_t i = 0; i < ADDED; i++) {
        for (size_t k = 0; k < ROWS; k++) {
            x[i * ROWS + k] = i == DEPENDENT ? x[k] - 2.0 * x[ROWS + k] + known[k]
                                             : 100.0 * known[i * ROWS + k] + random_normal(&rng);
        }
    }
    memcpy(alone, x, sizeof x);
    for (size_t j = 0; j < KNOWN; j++) { /* basis_add changes them */
        double first[ROWS], second[ROWS];
        memcpy(first, known + j * ROWS, sizeof first);
        memcpy(second, known + j * ROWS, sizeof second);
        basis_add(&some, first, 1);
        basis_add(&one, second, 1);
    }
    basis_shares(&some, x, ADDED, ROWS, share);
    for (size_t i = 0; i < ADDED; i++) {
        for (size_t j = 0; j < KNOWN; j++) {
            const double own = cblas_ddot(ROWS, some.column + j * ROWS, 1, x + i * ROWS, 1);
            TEST_ASSERT_DOUBLE_WITHIN(1e-12 * cblas_dnrm2(ROWS, x + i * ROWS, 1), own, share[i * ROWS + j]);
        }
    }
    basis_add(&some, x, ADDED);
    for (size_t i = 0; i < ADDED; i++) {
        basis_add(&one, alone + i * ROWS, 1);
    }
    TEST_ASSERT_EQUAL_UINT64(KNOWN + ADDED - 1, some.columns);
    TEST_ASSERT_EQUAL_UINT64(KNOWN + ADDED - 1, one.columns);
    for (size_t j = 0; j < some.columns; j++) {
        for (size_t k = 0; k < ROWS; k++) { /* 1e-16, 100 times larger in what was taken out, and a few of these */
            TEST_ASSERT_DOUBLE_WITHIN(1e-11, one.column[j * ROWS + k], some.column[j * ROWS + k]);
        }
    }
    basis_close(&some);
    basis_close(&one);
}

/* Neighbours that differ by 1e-5 of their length, each from the one before, beside a known one that is a part of all of
 * them: what rounding leaves of it in one must not grow from neighbour to neighbour. And then nothing new. */
static void test_neighbours_that_are_nearly_the_same(void) {
    enum { ROWS = 500, COLUMNS = 16 };
    static double x[COLUMNS * ROWS];
    double known[ROWS];
    basis_t basis;
    basis_open(&basis, ROWS, COLUMNS + 1);
    for (size_t k = 0; k < ROWS; k++) {
        known[k] = random_normal(&rng);
        for (size_t i = 0; i < COLUMNS; i++) {
            const double neighbour = i > 0 ? x[(i - 1) * ROWS + k] : known[k];
            x[i * ROWS + k] = neighbour + (i > 0 ? 1e-5 : 1.0) * random_normal(&rng);
        }
        x[(COLUMNS - 1) * ROWS + k] = x[3 * ROWS + k] - 2.0 * x[7 * ROWS + k] + x[11 * ROWS + k] - known[k];
    }
    basis_add(&basis, known, 1);
    basis_add(&basis, x, COLUMNS);
    TEST_ASSERT_EQUAL_UINT64(COLUMNS, basis.columns);
    for (size_t j = 0; j < basis.columns; j++) {
        for (size_t i = 0; i <= j; i++) {
            const double product = cblas_ddot(ROWS, basis.column + j * ROWS, 1, basis.column + i * ROWS, 1);
            TEST_ASSERT_DOUBLE_WITHIN(1e-13, i == j ? 1.0 : 0.0, product);
        }
    }
    basis_close(&basis);
}

/* So many rows that products are made by parts of them: the same on one processor and on three, to the last bit, and
 * what one product of each column with each vector gives, to rounding. And vectors that wait are added as they came. */
static void test_parts_of_the_rows(void) {
    enum { ROWS = 40000, KNOWN = 20, VECTORS = 19 };
    double *x = allocate(VECTORS * ROWS, sizeof(double)), *again = allocate(VECTORS * ROWS, sizeof(double)),
           *share = allocate(VECTORS * ROWS, sizeof(double)), *other = allocate(VECTORS * ROWS, sizeof(double));
    basis_t basis[2];
    for (size_t k = 0; k < VECTORS * ROWS; k++) {
        x[k] = random_normal(&rng);
    }
    for (int b = 0; b < 2; b++) {
        basis_queue_t queue;
        parallel_limit(b == 0 ? 1 : 3);
        basis_open(&basis[b], ROWS, KNOWN + VECTORS);
        basis_queue_open(&queue, &basis[b]);
        for (size_t j = 0; j < KNOWN; j++) {
            double *next = basis_queue_next(&queue);
            for (size_t k = 0; k < ROWS; k++) {
                next[k] = cos((double)j * (double)k * 1e-3) + 0.1 * x[(KNOWN - 1 - j) % VECTORS * ROWS + k];
            }
        }
        basis_queue_close(&queue);
        TEST_ASSERT_EQUAL_UINT64(KNOWN, basis[b].columns);
    }
    TEST_ASSERT_EQUAL_MEMORY(basis[0].column, basis[1].column, KNOWN * ROWS * sizeof(double));
    memcpy(again, x, VECTORS * ROWS * sizeof(double));
    parallel_limit(1);
    basis_shares(&basis[0], x, VECTORS, ROWS, share);
    basis_project(&basis[0], x, VECTORS);
    parallel_limit(3);
    basis_shares(&basis[1], again, VECTORS, ROWS, other);
    basis_project(&basis[1], again, VECTORS);
    parallel_limit(0);
    TEST_ASSERT_EQUAL_MEMORY(x, again, VECTORS * ROWS * sizeof(double));
    for (size_t i = 0; i < VECTORS; i++) {
        for (size_t j = 0; j < KNOWN; j++) {
            const double *column = basis[0].column + j * ROWS;
            TEST_ASSERT_EQUAL_DOUBLE(share[i * ROWS + j], other[i * ROWS + j]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-11, 0.0,
                                      cblas_ddot(ROWS, column, 1, x + i * ROWS, 1)); /* of 200, its length */
            cblas_daxpy(ROWS, share[i * ROWS + j], column, 1, again + i * ROWS, 1);
            TEST_ASSERT_DOUBLE_WITHIN(1e-11, share[i * ROWS + j],
                                      cblas_ddot(ROWS, column, 1, again + i * ROWS, 1)); /* back again */
        }
    }
    basis_close(&basis[0]);
    basis_close(&basis[1]);
    free(x);
    free(again);
    free(share);
    free(other);
}

int main(void) {
    rng = random_start("diagnosis_basis", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_what_is_projected_is_orthogonal);
    RUN_TEST(test_neighbours_that_are_nearly_the_same);
    RUN_TEST(test_some_vectors_at_a_time_are_the_same);
    RUN_TEST(test_parts_of_the_rows);
    return UNITY_END();
}
