/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/least_squares.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "numerics/gsl_errors.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_errno.h>
#include <gsl/gsl_linalg.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK_ROWS = 256 };
static const double ridge = 1e-12;

void normal_equations_create(normal_equations_t *equations, size_t unknowns) {
    *equations = (normal_equations_t){.unknowns = unknowns,
                                      .gram = allocate(unknowns * unknowns, sizeof(double)),
                                      .moment = allocate(unknowns, sizeof(double)),
                                      .block = allocate(BLOCK_ROWS * (unknowns + 1), sizeof(double))};
}

void normal_equations_free(normal_equations_t *equations) {
    free(equations->gram);
    free(equations->moment);
    free(equations->block);
    memset(equations, 0, sizeof *equations);
}

static void add_block(normal_equations_t *equations) {
    const int n = (int)equations->unknowns, rows = (int)equations->waiting;
    const double *values = equations->block + BLOCK_ROWS * equations->unknowns;
    if (rows == 0) {
        return;
    }
    cblas_dsyrk(CblasRowMajor, CblasUpper, CblasTrans, n, rows, 1.0, equations->block, n, 1.0, equations->gram, n);
    cblas_dgemv(CblasRowMajor, CblasTrans, rows, n, 1.0, equations->block, n, values, 1, 1.0, equations->moment, 1);
    equations->power += cblas_ddot(rows, values, 1, values, 1);
    equations->rows += equations->waiting;
    equations->waiting = 0;
}

void normal_equations_add(normal_equations_t *equations, const double *row, double value) {
    const size_t n = equations->unknowns;
    memcpy(equations->block + equations->waiting * n, row, n * sizeof(double));
    equations->block[BLOCK_ROWS * n + equations->waiting] = value;
    if (++equations->waiting == BLOCK_ROWS) {
        add_block(equations);
    }
}

void normal_equations_finish(normal_equations_t *equations) {
    const size_t n = equations->unknowns;
    add_block(equations);
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < i; j++) {
            equations->gram[i * n + j] = equations->gram[j * n + i];
        }
    }
}

typedef struct {
    const double *columns;
    size_t rows, n, known, parts;
    double *gram; /* of each part */
} products_t;

static void multiply_part(void *context, size_t part) {
    enum { AT_ONCE = 512 }; /* rows that stay in the cache */
    const products_t *p = context;
    const size_t end = parallel_part(p->rows, part + 1, p->parts);
    double *gram = p->gram + part * p->n * p->n;
    for (size_t row = parallel_part(p->rows, part, p->parts); row < end && !progress_cancelled(); row += AT_ONCE) {
        const int n = (int)p->n, rows = (int)p->rows, some = (int)(end - row < AT_ONCE ? end - row : AT_ONCE);
        if (p->known == 0) {
            cblas_dsyrk(CblasColMajor, CblasUpper, CblasTrans, n, some, 1.0, p->columns + row, rows, 1.0, gram, n);
        } else {
            cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, n, n - (int)p->known, some, 1.0, p->columns + row,
                        rows, p->columns + p->known * p->rows + row, rows, 1.0, gram + p->known * p->n, n);
        }
    }
}

void products_of_columns(const double *columns, size_t rows, size_t n, size_t known, double *gram) {
    if (known >= n) {
        return;
    }
    const size_t parts = parallel_parts((double)rows * (double)((n - known) * n));
    products_t products = {.columns = columns,
                           .rows = rows,
                           .n = n,
                           .known = known,
                           .parts = parts,
                           .gram = allocate(parts * n * n, sizeof(double))};
    parallel(parts, multiply_part, &products);
    for (size_t i = known; i < n; i++) {
        for (size_t j = 0; j <= i; j++) {
            double sum = 0.0;
            for (size_t part = 0; part < parts; part++) {
                sum += products.gram[(part * n + i) * n + j];
            }
            gram[i * n + j] = gram[j * n + i] = sum;
        }
    }
    free(products.gram);
}

void normal_equations_of_columns(normal_equations_t *equations, const double *columns, const double *values,
                                 size_t rows, size_t known) {
    const size_t n = equations->unknowns;
    products_of_columns(columns, rows, n, known, equations->gram);
    cblas_dgemv(CblasColMajor, CblasTrans, (int)rows, (int)n, 1.0, columns, (int)rows, values, 1, 0.0,
                equations->moment, 1);
    equations->power = cblas_ddot((int)rows, values, 1, values, 1);
    equations->rows = rows;
}

void normal_equations_penalise(normal_equations_t *equations, const double *row, double weight) {
    const size_t n = equations->unknowns;
    for (size_t i = 0; i < n; i++) {
        if (row[i] != 0.0) {
            cblas_daxpy((int)n, weight * row[i], row, 1, equations->gram + i * n, 1);
        }
    }
}

bool fit_columns(const double *columns, const double *values, size_t rows, size_t unknowns, const double *lower,
                 double *x, failure_t *failure) {
    double *unbounded = allocate(unknowns, sizeof(double));
    normal_equations_t equations;
    for (size_t i = 0; i < unknowns; i++) {
        unbounded[i] = -HUGE_VAL;
    }
    normal_equations_create(&equations, unknowns);
    normal_equations_of_columns(&equations, columns, values, rows, 0);
    const bool good = solve_bounded(&equations, lower != NULL ? lower : unbounded, x, NULL, failure);
    normal_equations_free(&equations);
    free(unbounded);
    return good;
}

double squared_error(const normal_equations_t *equations, const double *x) {
    const size_t n = equations->unknowns;
    double error = equations->power;
    for (size_t i = 0; i < n; i++) {
        error += x[i] * (cblas_ddot((int)n, equations->gram + i * n, 1, x, 1) - 2.0 * equations->moment[i]);
    }
    return fmax(error, 0.0);
}

/* The free unknowns, scaled to a unit diagonal, and the Cholesky factor of their part of the Gram matrix. */
typedef struct {
    size_t count;
    size_t *index;
    double *scale;
    gsl_matrix *factor;
} free_part_t;

static void free_part_free(free_part_t *part) {
    free(part->index);
    free(part->scale);
    if (part->factor != NULL) {
        gsl_matrix_free(part->factor);
    }
}

static bool factorise(const normal_equations_t *equations, const bool *bound, free_part_t *part, failure_t *failure) {
    const size_t n = equations->unknowns;
    *part = (free_part_t){.index = allocate(n, sizeof(size_t)), .scale = allocate(n, sizeof(double))};
    for (size_t i = 0; i < n; i++) {
        if (!bound[i]) {
            const double diagonal = equations->gram[i * n + i];
            part->index[part->count] = i;
            part->scale[part->count++] = diagonal > 0.0 ? 1.0 / sqrt(diagonal) : 1.0;
        }
    }
    if (part->count == 0) {
        return true;
    }
    part->factor = gsl_matrix_alloc(part->count, part->count);
    for (size_t i = 0; i < part->count; i++) {
        for (size_t j = 0; j < part->count; j++) {
            const double element =
                equations->gram[part->index[i] * n + part->index[j]] * part->scale[i] * part->scale[j];
            gsl_matrix_set(part->factor, i, j, element + (i == j ? ridge : 0.0));
        }
    }
    gsl_returns_errors();
    if (gsl_linalg_cholesky_decomp1(part->factor) != GSL_SUCCESS) {
        free_part_free(part);
        fail(failure, "the least squares problem is singular: the recording does not determine the parameters");
        return false;
    }
    return true;
}

bool solve_free(const normal_equations_t *equations, const bool *bound, const double *x, double *solution,
                failure_t *failure) {
    const size_t n = equations->unknowns;
    free_part_t part;
    if (!factorise(equations, bound, &part, failure)) {
        return false;
    }
    memcpy(solution, x, n * sizeof(double));
    if (part.count > 0) {
        gsl_vector *right = gsl_vector_alloc(part.count);
        for (size_t i = 0; i < part.count; i++) {
            double value = equations->moment[part.index[i]];
            for (size_t j = 0; j < n; j++) {
                value -= bound[j] ? equations->gram[part.index[i] * n + j] * x[j] : 0.0;
            }
            gsl_vector_set(right, i, value * part.scale[i]);
        }
        gsl_linalg_cholesky_svx(part.factor, right);
        for (size_t i = 0; i < part.count; i++) {
            solution[part.index[i]] = gsl_vector_get(right, i) * part.scale[i];
        }
        gsl_vector_free(right);
    }
    free_part_free(&part);
    return true;
}

/* Moves x towards the solution as far as the bounds allow, and adds the bounds it meets to the active set. Returns true
 * if it met none. */
static bool move_within_bounds(size_t n, const double *lower, const double *solution, double *x, bool *bound) {
    double way = 1.0;
    bool whole = true;
    for (size_t i = 0; i < n; i++) {
        if (!bound[i] && solution[i] < lower[i]) {
            way = fmin(way, (x[i] - lower[i]) / (x[i] - solution[i]));
            whole = false;
        }
    }
    for (size_t i = 0; i < n; i++) {
        if (!bound[i]) {
            x[i] += way * (solution[i] - x[i]);
            if (!whole && solution[i] < lower[i] && x[i] <= lower[i] + 1e-12 * fabs(solution[i] - lower[i])) {
                x[i] = lower[i];
                bound[i] = true;
            }
        }
    }
    return whole;
}

/* The bound unknown with the largest gradient away from its bound, or n. Gradients are compared in units of scaled
 * columns. */
static size_t most_wanted(const normal_equations_t *equations, const double *x, const bool *bound) {
    const size_t n = equations->unknowns;
    const double tolerance = 1e-9 * sqrt(equations->power);
    double largest = tolerance;
    size_t wanted = n;
    for (size_t i = 0; i < n; i++) {
        if (bound[i] && equations->gram[i * n + i] > 0.0) {
            const double gradient = (equations->moment[i] - cblas_ddot((int)n, equations->gram + i * n, 1, x, 1)) /
                                    sqrt(equations->gram[i * n + i]);
            if (gradient > largest) {
                largest = gradient;
                wanted = i;
            }
        }
    }
    return wanted;
}

static bool active_set(const normal_equations_t *equations, const double *lower, double *x, bool *bound,
                       double *solution, failure_t *failure) {
    const size_t n = equations->unknowns;
    size_t freed = n;
    for (size_t i = 0; i < n;
         i++) { /* everything starts free, on the bound: what must stay there is bound in the first moves */
        x[i] = isfinite(lower[i]) ? lower[i] : 0.0;
        bound[i] = false;
    }
    for (size_t turn = 0; turn < 10 * n + 10; turn++) {
        size_t wanted;
        do {
            if (!progress_go_on(failure) || !solve_free(equations, bound, x, solution, failure)) {
                return false;
            }
        } while (!move_within_bounds(n, lower, solution, x, bound));
        wanted = most_wanted(equations, x, bound);
        if (wanted == n || wanted == freed) { /* the one just freed went straight back: what is left is rounding */
            return true;
        }
        bound[wanted] = false;
        freed = wanted;
    }
    return fail(failure, "the least squares problem did not converge");
}

bool solve_bounded(const normal_equations_t *equations, const double *lower, double *x, bool *bound,
                   failure_t *failure) {
    double *solution = allocate(equations->unknowns, sizeof(double));
    bool *own_bound = allocate(equations->unknowns, sizeof(bool));
    const bool solved = active_set(equations, lower, x, own_bound, solution, failure);
    if (bound != NULL) {
        memcpy(bound, own_bound, equations->unknowns * sizeof(bool));
    }
    free(solution);
    free(own_bound);
    return solved;
}

bool inverse_matrix(const normal_equations_t *equations, const bool *bound, double *inverse, failure_t *failure) {
    const size_t n = equations->unknowns;
    free_part_t part;
    memset(inverse, 0, n * n * sizeof(double));
    if (!factorise(equations, bound, &part, failure)) {
        return false;
    }
    if (part.count > 0) {
        gsl_linalg_cholesky_invert(part.factor);
        for (size_t i = 0; i < part.count; i++) {
            for (size_t j = 0; j < part.count; j++) {
                inverse[part.index[i] * n + part.index[j]] =
                    gsl_matrix_get(part.factor, i, j) * part.scale[i] * part.scale[j];
            }
        }
    }
    free_part_free(&part);
    return true;
}
