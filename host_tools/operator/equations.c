/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/equations.h"
#include "base/oldest_place.h"
#include "base/parallel.h"
#include "base/progress.h"
#include <gsl/gsl_cblas.h>
#include <stdlib.h>
#include <string.h>

/* Its index; HYSTERESIS_BASES: not there. */
static size_t find_base(const hysteresis_bases_t *bases, const base_place_t *place, size_t thin) {
    size_t i = 0;
    while (i < HYSTERESIS_BASES && !(bases->base[i].there && bases->base[i].turns == place->turns &&
                                     bases->base[i].rho == place->rho && bases->base[i].thin == thin)) {
        i++;
    }
    return i;
}

/* Room for what is not there of these, in the place of the oldest that are not among them; it is still to be made.
 * Returns how many. */
static size_t take_room(hysteresis_bases_t *bases, size_t thin, const base_place_t *place, size_t count,
                        hysteresis_base_t **taken) {
    bool wanted[HYSTERESIS_BASES + 1] = {false};
    size_t made = 0;
    for (size_t i = 0; i < count; i++) {
        wanted[find_base(bases, &place[i], thin)] = true;
    }
    for (size_t i = 0; i < count; i++) {
        if (find_base(bases, &place[i], thin) == HYSTERESIS_BASES) {
            taken[made] = &bases->base[oldest_place(&bases->made, HYSTERESIS_BASES, wanted)];
            hysteresis_base_close(taken[made]);
            *taken[made++] =
                (hysteresis_base_t){.there = true, .turns = place[i].turns, .rho = place[i].rho, .thin = thin};
        }
    }
    return made;
}

/* Rows at these, which have the same turns, in one walk. */
static void make_rows(const operator_question_t *q, const hysteresis_t *h, hysteresis_base_t *const *base,
                      size_t count) {
    operator_t without_law = h->operator;
    pink_t noise[ROWS_MOST_NOISES];
    const pink_t *noises[ROWS_MOST_NOISES];
    kept_rows_t *rows[ROWS_MOST_NOISES];
    operator_drop_law(&without_law);
    for (size_t i = 0; i < count; i++) {
        pink_create(&noise[i], base[i]->rho, q->longest);
        noises[i] = &noise[i];
        rows[i] = &base[i]->rows;
    }
    const rows_wanted_t wanted = {.operator= & without_law,
                                  .paths = q->data->paths,
                                  .count = q->data->count,
                                  .turns = base[0]->turns,
                                  .behind = &q->behind,
                                  .offsets_behind = h->offsets_behind,
                                  .use = q->data->use,
                                  .thin = base[0]->thin};
    kept_rows_open_each(rows, &wanted, noises, count);
}

static void make_products(hysteresis_base_t *base) {
    const int n = (int)base->rows.columns;
    base->gram = allocate(base->rows.columns * base->rows.columns, sizeof(double));
    cblas_dsyrk(CblasRowMajor, CblasLower, CblasTrans, n, (int)base->rows.rows, 1.0, base->rows.row, n, 0.0, base->gram,
                n);
}

static void make_products_of(void *context, size_t index) {
    hysteresis_base_t *const *base = context;
    make_products(base[index]);
}

void equations_foresee(const operator_question_t *q, const hysteresis_t *h, size_t thin, const double *rho,
                       size_t count) {
    base_place_t place[ROWS_MOST_NOISES];
    hysteresis_base_t *base[ROWS_MOST_NOISES];
    for (size_t i = 0; i < count; i++) {
        place[i] = (base_place_t){h->turns, rho[i]};
    }
    const size_t made = take_room(q->bases, thin, place, count, base);
    if (made > 0) {
        make_rows(q, h, base, made);
        parallel(made, make_products_of, base);
    }
}

/* What is made at once: each task writes its own. */
typedef struct {
    const operator_question_t *question;
    const hysteresis_t *hysteresis; /* its operator, and where its offsets are added */
    hysteresis_base_t *base[HYSTERESIS_BASES];
} making_t;

static void make_base(void *context, size_t index) {
    const making_t *making = context;
    make_rows(making->question, making->hysteresis, &making->base[index], 1);
    make_products(making->base[index]);
}

void equations_prepare(const operator_question_t *q, const hysteresis_t *h, size_t thin, const base_place_t *place,
                       size_t count) {
    making_t making = {.question = q, .hysteresis = h};
    parallel(take_room(q->bases, thin, place, count, making.base), make_base, &making);
}

const hysteresis_base_t *equations_base(const operator_question_t *q, const hysteresis_t *h, size_t thin) {
    const base_place_t place = {h->turns, h->noise.rho};
    const size_t there = find_base(q->bases, &place, thin);
    if (there == HYSTERESIS_BASES) {
        equations_prepare(q, h, thin, &place, 1);
    }
    return &q->bases->base[find_base(q->bases, &place, thin)];
}

bool equations_take_rows(hysteresis_bases_t *bases, const hysteresis_t *h, size_t thin, kept_rows_t *rows) {
    const base_place_t place = {h->turns, h->noise.rho};
    const size_t there = find_base(bases, &place, thin);
    if (h->operator.has_law || there == HYSTERESIS_BASES) {
        return false;
    }
    *rows = bases->base[there].rows;
    bases->base[there].rows = (kept_rows_t){0};
    hysteresis_base_close(&bases->base[there]);
    return true;
}

double *equations_values(const operator_question_t *q, const hysteresis_t *h, const hysteresis_base_t *base) {
    double *value = allocate(base->rows.rows + 1, sizeof(double));
    kept_rows_whiten(&base->rows, q->data->paths, q->data->count, &h->noise, q->position_um, value, 1);
    return value;
}

law_along_t equations_along(const operator_question_t *q, const hysteresis_t *h, const hysteresis_base_t *base) {
    return (law_along_t){.operator= & h->operator,
                         .paths = q->data->paths,
                         .count = q->data->count,
                         .turns = h->turns,
                         .behind = &q->behind,
                         .noise = &h->noise,
                         .kept = &base->rows};
}

/* The columns of the law, behind the others: what they have in common with these, with themselves and the values. */
static void add_law(const operator_question_t *q, const hysteresis_t *h, const hysteresis_base_t *base,
                    const double *value, normal_equations_t *equations) {
    const size_t n = equations->unknowns, before = base->rows.columns;
    const int all = (int)n, rows = (int)base->rows.rows, others = (int)before, law = OPERATOR_LAW;
    double *row = allocate(base->rows.rows * OPERATOR_LAW + 1, sizeof(double)), *last = equations->gram + before * n;
    const law_along_t along = equations_along(q, h, base);
    law_rows(&along, row);
    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, law, others, rows, 1.0, row, law, base->rows.row, others, 0.0,
                last, all);
    cblas_dsyrk(CblasRowMajor, CblasLower, CblasTrans, law, rows, 1.0, row, law, 0.0, last + before, all);
    cblas_dgemv(CblasRowMajor, CblasTrans, rows, law, 1.0, row, law, value, 1, 0.0, equations->moment + before, 1);
    free(row);
}

/* The whitened equations of every `thin`-th used sample. */
static void equations_of(const operator_question_t *q, const hysteresis_t *h, size_t thin,
                         normal_equations_t *equations) {
    const size_t n = h->operator.columns;
    const hysteresis_base_t *base = equations_base(q, h, thin);
    const size_t before = base->rows.columns;
    const int rows = (int)base->rows.rows, others = (int)before;
    double *value = equations_values(q, h, base);
    normal_equations_create(equations, n);
    for (size_t i = 0; i < before; i++) {
        memcpy(equations->gram + i * n, base->gram + i * before, (i + 1) * sizeof(double));
    }
    cblas_dgemv(CblasRowMajor, CblasTrans, rows, others, 1.0, base->rows.row, others, value, 1, 0.0, equations->moment,
                1);
    if (n > before) {
        add_law(q, h, base, value, equations);
    }
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < i; j++) {
            equations->gram[j * n + i] = equations->gram[i * n + j];
        }
    }
    equations->power = cblas_ddot(rows, value, 1, value, 1);
    equations->rows = base->rows.rows;
    free(value);
}

/* Whether a law takes a group's place: the search for one goes without it, for a leak is a law, and many of them are
 * nearly any. */
static bool is_like_a_law(operator_group_t group) {
    return group == GROUP_LEAKS || group == GROUP_PRODUCTS || group == GROUP_PRODUCTS_ODD;
}

static void set_groups(hysteresis_t *h, bool leaks) {
    h->group = reallocate(h->group, h->operator.columns, sizeof(size_t));
    for (size_t j = 0; j < h->operator.columns; j++) {
        const operator_group_t group = operator_group(&h->operator, j);
        h->group[j] = leaks || !is_like_a_law(group) ? (size_t)group : EVIDENCE_LEFT_OUT;
    }
}

bool equations_fit(const operator_question_t *q, size_t thin, bool leaks, hysteresis_t *h, failure_t *failure) {
    normal_equations_t equations;
    group_evidence_t evidence;
    set_groups(h, leaks);
    equations_of(q, h, thin, &equations);
    const bool good = progress_go_on(failure) &&
                      group_evidence_fit(&equations, h->group, GROUP_COUNT, 0.0, &h->evidence, &evidence, failure);
    normal_equations_free(&equations);
    if (good) {
        group_evidence_free(&h->evidence);
        h->evidence = evidence;
    }
    return good;
}
