/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/evidence/searched.h"
#include <gsl/gsl_linalg.h>
#include <math.h>

/* Small enough for a frequency that is to stay in step over the whole recording. */
static const double nudge = 1e-5, damping = 1e-6;

static bool has_joined(const model_block_t *block, size_t parameter) {
    const parameter_info_t *info = &block->block->parameter[parameter];
    const parameter_t *number = &block->parameter[parameter];
    return info->array ? number->count == 1 : number->value[0] != info->default_value;
}

bool number_is_searched(const model_block_t *block, size_t parameter) {
    return is_searched(block->block, parameter) ||
           ((block_search(block->block)->joins >> parameter & 1U) != 0 && has_joined(block, parameter));
}

double searched_low(const block_t *block, size_t parameter) {
    const double low = block->parameter[parameter].low;
    return (block_search(block)->positive >> parameter & 1U) != 0 ? fmax(0.0, low) : low;
}

void searched_open(searched_t *searched, model_t *model, size_t at, double held_s) {
    const block_t *block = model->block[at].block;
    *searched = (searched_t){.held_s = block->lag == LAG_DELAY ? held_s : 0.0};
    for (size_t p = 0; p < block->parameters; p++) {
        if (number_is_searched(&model->block[at], p)) {
            double *number = model->block[at].parameter[p].value;
            const size_t i = searched->count++;
            searched->parameter[i] = &model->block[at].parameter[p];
            searched->number[i] = number;
            searched->low[i] = searched_low(block, p);
            searched->high[i] = block->parameter[p].high;
            if (p < sizeof block_search(block)->most / sizeof(double) && block_search(block)->most[p] > 0.0) {
                searched->high[i] = fmin(searched->high[i], block_search(block)->most[p]);
            }
            searched->logarithmic[i] = block->parameter[p].low >= 0.0 && *number > 0.0;
            searched->scale[i] = *number != 0.0 ? fabs(*number) : 0.01;
        }
    }
}

static double changed(const searched_t *searched, size_t i, double by) {
    const double number = *searched->number[i];
    const double value = searched->logarithmic[i] ? number * exp(by) : number + by * searched->scale[i];
    return fmax(searched->low[i], fmin(searched->high[i], value));
}

double searched_nudge(const searched_t *searched, size_t i, const model_t *model, size_t at, model_t *nudged) {
    const double least = searched->held_s > 0.0 ? log1p(searched->held_s / *searched->number[i]) : nudge;
    const double by = *searched->number[i] < searched->high[i] ? least : -least;
    const size_t p = (size_t)(searched->parameter[i] - model->block[at].parameter);
    model_copy(nudged, model);
    *nudged->block[at].parameter[p].value = changed(searched, i, by);
    return by;
}

double searched_unit(const searched_t *searched, size_t i) {
    return searched->logarithmic[i] ? *searched->number[i] : searched->scale[i];
}

void searched_move(searched_t *searched, const double *step, double part) {
    for (size_t i = 0; i < searched->count; i++) {
        const double most = searched->logarithmic[i] ? 1.0 : HUGE_VAL;
        searched->kept[i] = *searched->number[i];
        *searched->number[i] = changed(searched, i, part * fmax(-most, fmin(most, step[i])));
    }
}

void searched_back(searched_t *searched) {
    for (size_t i = 0; i < searched->count; i++) {
        *searched->number[i] = searched->kept[i];
    }
}

void searched_solve(size_t n, const double *gram, const double *moment, double *step) {
    gsl_matrix *a = gsl_matrix_alloc(n, n);
    gsl_vector *b = gsl_vector_alloc(n), *x = gsl_vector_calloc(n);
    gsl_permutation *permutation = gsl_permutation_alloc(n);
    int sign;
    for (size_t i = 0; i < n; i++) {
        const double own = gram[i * n + i];
        for (size_t j = 0; j < n; j++) {
            gsl_matrix_set(a, i, j, own > 0.0 ? gram[i * n + j] : 0.0);
        }
        gsl_matrix_set(a, i, i, own > 0.0 ? own * (1.0 + damping) : 1.0);
        gsl_vector_set(b, i, own > 0.0 ? moment[i] : 0.0);
    }
    gsl_linalg_LU_decomp(a, permutation, &sign);
    if (gsl_linalg_LU_det(a, sign) != 0.0) {
        gsl_linalg_LU_solve(a, permutation, b, x);
    }
    for (size_t i = 0; i < n; i++) {
        step[i] = isfinite(gsl_vector_get(x, i)) ? gsl_vector_get(x, i) : 0.0;
    }
    gsl_permutation_free(permutation);
    gsl_matrix_free(a);
    gsl_vector_free(b);
    gsl_vector_free(x);
}
