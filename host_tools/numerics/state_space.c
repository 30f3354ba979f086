/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/state_space.h"
#include "base/failure.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_linalg.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { HANKEL = 40 };

state_space_t state_space_identity(void) {
    return (state_space_t){.d = 1.0};
}

bool state_space_is_identity(const state_space_t *filter) {
    return filter->states == 0 && filter->ahead == 0 && filter->d == 1.0;
}

bool state_space_cascade(const state_space_t *first, const state_space_t *second, state_space_t *both) {
    const size_t n = first->states, all = n + second->states;
    if (all > STATE_SPACE_MOST || first->ahead + second->ahead > STATE_SPACE_AHEAD) {
        return false;
    }
    *both = (state_space_t){.states = all, .ahead = first->ahead + second->ahead, .d = first->d * second->d};
    for (size_t i = 0; i < n; i++) {
        memcpy(both->a[i], first->a[i], n * sizeof(double));
        both->b[i] = first->b[i];
        both->c[i] = second->d * first->c[i];
    }
    for (size_t i = 0; i < second->states; i++) {
        for (size_t j = 0; j < n; j++) {
            both->a[n + i][j] = second->b[i] * first->c[j];
        }
        memcpy(both->a[n + i] + n, second->a[i], second->states * sizeof(double));
        both->b[n + i] = second->b[i] * first->d;
        both->c[n + i] = second->c[i];
    }
    return true;
}

/* (1 - A)^-1 b. */
static void steady_states(const state_space_t *filter, double *state) {
    const size_t n = filter->states;
    if (n == 0) {
        return;
    }
    double matrix[STATE_SPACE_MOST * STATE_SPACE_MOST];
    size_t order[STATE_SPACE_MOST];
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            matrix[i * n + j] = (i == j ? 1.0 : 0.0) - filter->a[i][j];
        }
    }
    int sign;
    gsl_matrix_view view = gsl_matrix_view_array(matrix, n, n);
    gsl_permutation permutation = {.size = n, .data = order};
    const gsl_vector_const_view b = gsl_vector_const_view_array(filter->b, n);
    gsl_vector_view x = gsl_vector_view_array(state, n);
    (void)gsl_linalg_LU_decomp(&view.matrix, &permutation, &sign);
    (void)gsl_linalg_LU_solve(&view.matrix, &permutation, &b.vector, &x.vector);
}

double state_space_gain_at_rest(const state_space_t *filter) {
    double state[STATE_SPACE_MOST] = {0.0};
    steady_states(filter, state);
    return filter->d + cblas_ddot((int)filter->states, filter->c, 1, state, 1);
}

/* States whose sums grow side by side. */
enum { ABREAST = 4 };
_Static_assert((int)STATE_SPACE_MOST % (int)ABREAST == 0, "no state is beyond the last of them");

/* A filter that is stepped, with its matrix column by column: each state's sum has the order of its row. */
typedef struct {
    const state_space_t *filter;
    double column[STATE_SPACE_MOST][STATE_SPACE_MOST], state[STATE_SPACE_MOST];
} stepped_t;

/* With all states 0. */
static stepped_t stepped_begin(const state_space_t *filter) {
    stepped_t stepped = {.filter = filter};
    for (size_t i = 0; i < filter->states; i++) {
        for (size_t j = 0; j < filter->states; j++) {
            stepped.column[j][i] = filter->a[i][j];
        }
    }
    return stepped;
}

/* One sample: returns the output. */
static double step(stepped_t *stepped, double x) {
    const state_space_t *filter = stepped->filter;
    const size_t n = filter->states;
    double next[STATE_SPACE_MOST], y = filter->d * x;
    for (size_t i = 0; i < n; i++) {
        y += filter->c[i] * stepped->state[i];
    }
    for (size_t from = 0; from < n; from += ABREAST) {
        double sum[ABREAST];
        for (size_t i = 0; i < ABREAST; i++) {
            sum[i] = filter->b[from + i] * x;
        }
        for (size_t j = 0; j < n; j++) {
            const double *column = stepped->column[j] + from, now = stepped->state[j];
            for (size_t i = 0; i < ABREAST; i++) {
                sum[i] += column[i] * now;
            }
        }
        memcpy(next + from, sum, sizeof sum);
    }
    memcpy(stepped->state, next, n * sizeof(double));
    return y;
}

void state_space_column(const state_space_t *filter, double *value, size_t samples) {
    if (samples == 0 || state_space_is_identity(filter)) {
        return;
    }
    stepped_t stepped = stepped_begin(filter);
    steady_states(filter, stepped.state);
    cblas_dscal((int)filter->states, value[0], stepped.state, 1);
    const double last = value[samples - 1];
    for (size_t k = 0; k < samples + filter->ahead; k++) {
        const double y = step(&stepped, k < samples ? value[k] : last);
        if (k >= filter->ahead) {
            value[k - filter->ahead] = y;
        }
    }
}

/* The largest error of its step response, in parts of the largest value of this one. */
static double step_error(const state_space_t *filter, const double *response, size_t length) {
    stepped_t stepped = stepped_begin(filter);
    double has = 0.0, wanted = 0.0, worst = 0.0, largest = 0.0;
    for (size_t k = 0; k < length; k++) {
        has += step(&stepped, k == 0 ? 1.0 : 0.0);
        wanted += response[k];
        worst = fmax(worst, fabs(has - wanted));
        largest = fmax(largest, fabs(wanted));
    }
    return isfinite(has) && largest > 0.0 ? worst / largest : HUGE_VAL;
}

/* The impulse response as a matrix of its values at i + j, taken apart: U S V'. */
typedef struct {
    size_t size;
    double u[HANKEL * HANKEL], v[HANKEL * HANKEL], s[HANKEL], later[HANKEL * HANKEL]; /* later: at i + j + 1 */
} hankel_t;

static void take_apart(hankel_t *hankel, const double *response) {
    const size_t n = hankel->size;
    double room[HANKEL];
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            hankel->u[i * n + j] = response[1 + i + j];
            hankel->later[i * n + j] = response[2 + i + j];
        }
    }
    gsl_matrix_view u = gsl_matrix_view_array(hankel->u, n, n), v = gsl_matrix_view_array(hankel->v, n, n);
    gsl_vector_view s = gsl_vector_view_array(hankel->s, n), work = gsl_vector_view_array(room, n);
    (void)gsl_linalg_SV_decomp(&u.matrix, &v.matrix, &s.vector, &work.vector);
}

/* Balanced: A = S^-1/2 U' later V S^-1/2, b the first column of S^1/2 V', c the first row of U S^1/2. */
static void realise(const hankel_t *hankel, size_t states, state_space_t *filter) {
    const size_t n = hankel->size;
    double half[HANKEL * STATE_SPACE_MOST], all[STATE_SPACE_MOST * STATE_SPACE_MOST];
    const int size = (int)n, m = (int)states;
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, size, m, size, 1.0, hankel->later, size, hankel->v, size,
                0.0, half, m);
    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, m, m, size, 1.0, hankel->u, size, half, m, 0.0, all, m);
    filter->states = states;
    for (size_t i = 0; i < states; i++) {
        const double root = sqrt(hankel->s[i]);
        for (size_t j = 0; j < states; j++) {
            filter->a[i][j] = all[i * states + j] / (root * sqrt(hankel->s[j]));
        }
        filter->b[i] = root * hankel->v[i];
        filter->c[i] = root * hankel->u[i];
    }
}

double state_space_realise(const double *response, size_t length, size_t ahead, size_t most, double tolerance,
                           state_space_t *filter) {
    const size_t room = length / 2 > 0 ? length / 2 - 1 : 0;
    hankel_t *hankel = allocate(1, sizeof *hankel);
    state_space_t one = {.ahead = ahead, .d = length > 0 ? response[0] : 1.0};
    double best = step_error(&one, response, length);
    *filter = one;
    hankel->size = room < HANKEL ? room : HANKEL;
    if (hankel->size > 0) {
        take_apart(hankel, response);
    }
    for (size_t states = 1; best > tolerance && states <= most && states <= hankel->size; states++) {
        if (!(hankel->s[states - 1] > 0.0)) {
            break;
        }
        realise(hankel, states, &one);
        const double error = step_error(&one, response, length);
        if (error < best) {
            best = error;
            *filter = one;
        }
    }
    free(hankel);
    return best;
}

void state_space_rows_open(state_space_rows_t *rows, const state_space_t *filter, size_t columns) {
    const size_t n = filter->states;
    *rows = (state_space_rows_t){.states = n, .columns = columns};
    double column[STATE_SPACE_MOST], line[STATE_SPACE_MOST]; /* A^k b, c A^k */
    memcpy(column, filter->b, sizeof column);
    memcpy(line, filter->c, sizeof line);
    rows->response[0] = filter->d;
    for (size_t i = 0; i < n; i++) {
        rows->power[i][i] = 1.0;
    }
    for (size_t k = 0; k < STATE_SPACE_ROWS; k++) {
        double next_column[STATE_SPACE_MOST] = {0.0}, next_line[STATE_SPACE_MOST] = {0.0},
               power[STATE_SPACE_MOST][STATE_SPACE_MOST] = {{0.0}};
        if (k + 1 < STATE_SPACE_ROWS) {
            rows->response[k + 1] = cblas_ddot((int)n, filter->c, 1, column, 1);
        }
        for (size_t i = 0; i < n; i++) {
            rows->by_state[k][i] = line[i];
            rows->fed[i][STATE_SPACE_ROWS - 1 - k] = column[i];
            for (size_t j = 0; j < n; j++) {
                next_column[i] += filter->a[i][j] * column[j];
                next_line[j] += line[i] * filter->a[i][j];
                for (size_t l = 0; l < n; l++) {
                    power[i][j] += filter->a[i][l] * rows->power[l][j];
                }
            }
        }
        memcpy(column, next_column, sizeof column);
        memcpy(line, next_line, sizeof line);
        memcpy(rows->power, power, sizeof power);
    }
    steady_states(filter, rows->steady);
    if (n > 0) {
        rows->memory = allocate(n * columns, sizeof(double));
        rows->next = allocate(n * columns, sizeof(double));
    }
}

void state_space_rows_close(state_space_rows_t *rows) {
    free(rows->memory);
    free(rows->next);
    *rows = (state_space_rows_t){0};
}

static void begin_memory(state_space_rows_t *rows, const double *row) {
    for (size_t i = 0; i < rows->states; i++) {
        for (size_t j = 0; j < rows->columns; j++) {
            rows->memory[i * rows->columns + j] = rows->steady[i] * row[j];
        }
    }
}

void state_space_rows(state_space_rows_t *rows, const double *row, size_t count, bool first, const size_t *taken,
                      size_t some, double *filtered) {
    double by_row[STATE_SPACE_ROWS * STATE_SPACE_ROWS], by_state[STATE_SPACE_ROWS * STATE_SPACE_MOST];
    const int n = (int)rows->columns, r = (int)count, m = (int)rows->states, c = (int)some;
    if (first) {
        begin_memory(rows, row);
    }
    for (size_t t = 0; t < some; t++) {
        for (size_t k = 0; k < count; k++) {
            by_row[t * count + k] = k <= taken[t] ? rows->response[taken[t] - k] : 0.0;
        }
        memcpy(by_state + t * rows->states, rows->by_state[taken[t]], rows->states * sizeof(double));
    }
    if (some > 0) {
        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, c, n, r, 1.0, by_row, r, row, n, 0.0, filtered, n);
    }
    if (m == 0) {
        return;
    }
    if (some > 0) {
        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, c, n, m, 1.0, by_state, m, rows->memory, n, 1.0,
                    filtered, n);
    }
    if (count == STATE_SPACE_ROWS) { /* fewer are a recording's last */
        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, m, n, r, 1.0, rows->fed[0], STATE_SPACE_ROWS, row, n,
                    0.0, rows->next, n);
        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, m, n, m, 1.0, rows->power[0], STATE_SPACE_MOST,
                    rows->memory, n, 1.0, rows->next, n);
        double *memory = rows->memory;
        rows->memory = rows->next;
        rows->next = memory;
    }
}
