/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/hysteresis.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "operator/equations.h"
#include "operator/law_search.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The search for turns, noise and a law takes so many samples, evenly spread. */
enum { SEARCHED_SAMPLES = 6000 };
/* Below such a gain at rest no middle is taken out. */
static const double least_gain = 0.1;

/* Of the search for the noise's corner, a factor. */
#define WIDEST_STEP sqrt(10.0)

/* Evidence of the weights at this noise, or -HUGE_VAL. */
static double evidence_at(const operator_question_t *q, size_t thin, double rho, hysteresis_t *h) {
    failure_t ignored;
    pink_create(&h->noise, rho, q->longest);
    return equations_fit(q, thin, true, h, &ignored) ? h->evidence.log_evidence : -HUGE_VAL;
}

/* The likeliest rho near the one that it has, in steps that get smaller. best: evidence of that. */
static void improve_noise(const operator_question_t *q, size_t thin, double best, hysteresis_t *h) {
    double rho = h->noise.rho, factor = WIDEST_STEP;
    while (rho > 0.0 && factor > 1.3) {
        const double both[] = {rho * (1.0 / factor), rho * factor};
        equations_foresee(q, h, thin, both, 2);
        for (int up = 0; up < 2; up++) {
            const double beside = both[up], evidence = evidence_at(q, thin, beside, h);
            if (evidence > best) {
                best = evidence;
                rho = beside;
                break;
            }
        }
        factor = sqrt(factor);
    }
    pink_create(&h->noise, rho, q->longest);
}

/* The likeliest rho: from white. */
static void find_noise(const operator_question_t *q, size_t thin, hysteresis_t *h) {
    double best = evidence_at(q, thin, 0.0, h), rho = 0.0;
    double at = threshold.slowest_rho;
    const double decades[] = {at, at * 10.0, at * 10.0 * 10.0};
    equations_foresee(q, h, thin, decades, 3);
    while (at < 1.0) {
        const double evidence = evidence_at(q, thin, at, h);
        if (evidence > best + threshold.pink_worth) {
            best = evidence;
            rho = at;
        } else if (evidence < best) {
            break;
        }
        at *= 10.0;
    }
    pink_create(&h->noise, rho, q->longest);
    improve_noise(q, thin, best, h);
}

/* Whether the drive turned between its samples: what explains the position better. */
static bool find_turns(const operator_question_t *q, size_t thin, hysteresis_t *h, failure_t *failure) {
    const base_place_t both[] = {{true, h->noise.rho}, {false, h->noise.rho}};
    equations_prepare(q, h, thin, both, 2);
    h->turns = true;
    if (!equations_fit(q, thin, true, h, failure)) {
        return false;
    }
    const double with = h->evidence.log_evidence;
    h->turns = false;
    if (!equations_fit(q, thin, true, h, failure)) {
        return false;
    }
    h->turns = with >= h->evidence.log_evidence;
    return true;
}

/* Samples far outside the noise count as on its edge. Those that are not used may be far off because the used ones say
 * too little of them: they stay. */
static bool pull_outliers_in(operator_question_t *q, size_t thin, hysteresis_t *h, failure_t *failure) {
    if (!equations_fit(q, thin, true, h, failure)) {
        return false;
    }
    double *left = allocate(q->longest * q->data->count, sizeof(double));
    const double middle_um = h->middle_um;
    h->middle_um = 0.0;
    hysteresis_left(h, q->data->paths, q->data->count, q->position_um, NULL, left, NULL);
    h->middle_um = middle_um;
    const double most = threshold.edge_of_noise * sqrt(h->evidence.variance);
    size_t at = 0;
    h->outliers = 0;
    for (size_t i = 0; i < q->data->count; i++) {
        for (size_t k = 0; k < q->data->paths[i].samples; k++, at++) {
            if (q->data->use[at] != 0 && fabs(left[at]) > most) {
                q->position_um[at] -= left[at] - copysign(most, left[at]);
                h->outliers++;
            }
        }
    }
    free(left);
    return true;
}

/* Another law than it has, or none; the evidence follows with the next fit. */
static void take_law(hysteresis_t *h, bool has_law, const duhem_law_t *law) {
    operator_drop_law(&h->operator);
    if (has_law) {
        operator_set_law(&h->operator, law);
    }
}

/* Whether the operator with another law, found beside white noise, can be likelier than `evidence` with less 1/f noise
 * than rho: towards less it gets likelier, or it is so already. The evidence has one top over rho. */
static bool can_leave_less(const operator_question_t *q, size_t thin, double rho, double evidence, hysteresis_t *h) {
    const double here = evidence_at(q, thin, rho, h);
    return here > evidence || evidence_at(q, thin, rho / WIDEST_STEP, h) > here;
}

/* A law is sought beside several noises at once: each task writes its own fit. */
typedef struct {
    const operator_question_t *question;
    size_t thin;
    hysteresis_t *fit[2];
    bool good[2];
    failure_t failure[2];
} law_searches_t;

static void search_law(void *context, size_t index) {
    law_searches_t *searches = context;
    searches->good[index] =
        law_search(searches->question, searches->thin, searches->fit[index], &searches->failure[index]);
}

/* Beside the noises of two fits. */
static bool search_laws(const operator_question_t *q, size_t thin, hysteresis_t *one, hysteresis_t *other,
                        failure_t *failure) {
    const base_place_t both[] = {{one->turns, one->noise.rho}, {other->turns, other->noise.rho}};
    law_searches_t searches = {.question = q, .thin = thin, .fit = {one, other}};
    equations_prepare(q, one, thin, both, 2); /* before they share it */
    parallel(2, search_law, &searches);
    for (size_t i = 0; i < 2; i++) {
        if (!searches.good[i]) {
            *failure = searches.failure[i];
            return false;
        }
    }
    return true;
}

/* A fit of the same, without a law, that begins beside white noise; to be freed but for its position. */
static hysteresis_t beside_white_noise(const operator_question_t *q, const hysteresis_t *h) {
    hysteresis_t white = *h;
    white.operator.table = NULL;
    operator_drop_law(&white.operator);
    white.group = NULL;
    white.evidence = (group_evidence_t){0};
    pink_create(&white.noise, 0.0, q->longest);
    return white;
}

/* Whether the law that was found beside white noise stands: with the noise sought again beside it, it is likelier and
 * leaves less 1/f noise. */
static bool stands_beside_less(const operator_question_t *q, size_t thin, hysteresis_t *h, hysteresis_t *white) {
    const double rho = h->noise.rho, evidence = evidence_at(q, thin, rho, h);
    if (!white->operator.has_law || !can_leave_less(q, thin, rho, evidence, white)) {
        return false;
    }
    find_noise(q, thin, white);
    return white->noise.rho < rho && evidence_at(q, thin, white->noise.rho, white) > evidence;
}

/* Without a law what only a law explains is taken for 1/f noise, and beside that noise no law may be worth anything. So
 * one is sought beside white noise, too, and the noise again beside it. */
static bool find_law(const operator_question_t *q, size_t thin, hysteresis_t *h, failure_t *failure) {
    if (h->noise.rho <= 0.0) {
        return law_search(q, thin, h, failure);
    }
    hysteresis_t white = beside_white_noise(q, h);
    const bool good = search_laws(q, thin, h, &white, failure);
    if (good && stands_beside_less(q, thin, h, &white)) {
        const hysteresis_t other = *h;
        *h = white;
        white = other;
    }
    white.position_um = NULL; /* they share it */
    hysteresis_free(&white);
    return good;
}

/* A search takes one of so many used samples. */
static size_t search_every(const operator_question_t *q) {
    return q->used / SEARCHED_SAMPLES + 1;
}

/* The fit that counts, after those of the search. */
static bool fit_at_last(const operator_question_t *q, hysteresis_t *h, failure_t *failure) {
    group_evidence_forget_unused(&h->evidence);
    return equations_fit(q, q->data->thin, true, h, failure);
}

/* Turns, law and the spectrum of the noise. */
static void take_all_but_weights(const operator_question_t *q, const hysteresis_t *like, hysteresis_t *h) {
    h->turns = like->turns;
    pink_create(&h->noise, like->noise.rho, q->longest);
    take_law(h, like->operator.has_law, &like->operator.law);
}

static bool fit_roughly(operator_question_t *q, const hysteresis_t *like, hysteresis_t *h, failure_t *failure) {
    take_all_but_weights(q, like, h);
    return equations_fit(q, search_every(q), true, h, failure);
}

/* The spectrum is improved. */
static bool fit_like(operator_question_t *q, const hysteresis_t *like, hysteresis_t *h, failure_t *failure) {
    const size_t search = search_every(q);
    take_all_but_weights(q, like, h);
    const double at = like->noise.rho, around[] = {at, at * (1.0 / WIDEST_STEP), at * WIDEST_STEP};
    equations_foresee(q, h, search, around, at > 0.0 ? 3 : 0);
    if (!pull_outliers_in(q, search, h, failure)) {
        return false;
    }
    if (like->noise.rho > 0.0) {
        improve_noise(q, search, evidence_at(q, search, like->noise.rho, h), h);
    }
    return fit_at_last(q, h, failure);
}

static bool fit_all(operator_question_t *q, hysteresis_t *h, failure_t *failure) {
    const size_t search = search_every(q);
    if (!find_turns(q, search, h, failure)) {
        return false;
    }
    find_noise(q, search, h);
    return pull_outliers_in(q, search, h, failure) && find_law(q, search, h, failure) && fit_at_last(q, h, failure);
}

static bool lets_constants_through(const state_space_t *behind) {
    return fabs(state_space_gain_at_rest(behind)) >= least_gain;
}

/* Range of the drive along all paths, samples, and the middle that is taken out of the position before. */
static void count_samples(operator_question_t *q, double range_v[2], double *middle_um) {
    const hysteresis_data_t *data = q->data;
    const double gain = state_space_gain_at_rest(&q->behind);
    double sum = 0.0;
    size_t at = 0;
    memcpy(range_v, data->paths[0].range_v, 2 * sizeof(double));
    for (size_t i = 0; i < data->count; i++) {
        range_v[0] = fmin(range_v[0], data->paths[i].range_v[0]);
        range_v[1] = fmax(range_v[1], data->paths[i].range_v[1]);
        q->longest = data->paths[i].samples > q->longest ? data->paths[i].samples : q->longest;
        for (size_t k = 0; k < data->paths[i].samples; k++, at++) {
            q->used += data->use[at] != 0 ? 1 : 0;
            sum += data->use[at] != 0 ? data->position_um[at] : 0.0;
        }
    }
    *middle_um = q->used > 0 && lets_constants_through(&q->behind) ? sum / (double)q->used / gain : 0.0;
    q->position_um = allocate(at, sizeof(double));
    for (size_t k = 0; k < at; k++) {
        q->position_um[k] = data->position_um[k] - gain * *middle_um;
    }
}

/* roughly: like is not NULL. */
static bool fit(const hysteresis_data_t *data, const hysteresis_t *like, bool roughly, hysteresis_bases_t *bases,
                hysteresis_t *h, failure_t *failure) {
    operator_question_t *q = allocate(1, sizeof *q);
    double range[2];
    memset(h, 0, sizeof *h);
    q->data = data;
    q->bases = bases;
    q->behind = h->behind = data->behind != NULL ? *data->behind : state_space_identity();
    count_samples(q, range, &h->middle_um);
    h->position_um = q->position_um;
    h->offsets_behind = !lets_constants_through(&q->behind);
    bool good = q->used > 0 && range[1] > range[0];
    if (!good) {
        (void)fail(failure, "a drive that never moves, or no samples: no hysteresis shows");
    } else {
        operator_create(&h->operator, range, data->count);
        good = roughly        ? fit_roughly(q, like, h, failure)
               : like != NULL ? fit_like(q, like, h, failure)
                              : fit_all(q, h, failure);
        const double offset_um = state_space_gain_at_rest(&q->behind) * h->middle_um;
        for (size_t i = 0, at = 0; i < data->count; i++) {
            for (size_t k = 0; k < data->paths[i].samples; k++) {
                h->position_um[at++] += offset_um;
            }
        }
    }
    if (!good) {
        hysteresis_free(h);
    }
    free(q);
    return good;
}

bool hysteresis_fit(const hysteresis_data_t *data, const hysteresis_t *like, hysteresis_bases_t *bases, hysteresis_t *h,
                    failure_t *failure) {
    return fit(data, like, false, bases, h, failure);
}

bool hysteresis_fit_roughly(const hysteresis_data_t *data, const hysteresis_t *like, hysteresis_bases_t *bases,
                            hysteresis_t *h, failure_t *failure) {
    return fit(data, like, true, bases, h, failure);
}

void hysteresis_predict(const hysteresis_t *h, const operator_path_t *paths, size_t count, double *position_um) {
    double *row = allocate(h->operator.columns, sizeof(double)), value = 0.0, level_v = HUGE_VAL, u = HUGE_VAL;
    operator_folded_t folded;
    operator_fold(&h->operator, h->evidence.weight, &folded);
    for (hike_t hike = hike_begin(paths, count, h->turns); hike_on(&hike, &h->operator);) {
        const bool moved = hike.k == 0 || hike.walk.u != u || hike_level(&hike) != level_v || hike_turned(&hike);
        if (moved) {
            u = hike.walk.u;
            level_v = hike_level(&hike);
            value = h->middle_um + operator_value(&folded, &hike.walk, level_v, row) -
                    (h->offsets_behind ? h->evidence.weight[operator_offset_column(hike.walk.recording)] : 0.0);
        }
        position_um[hike.at] = value;
    }
    free(row);
}

void hysteresis_add_offsets(const hysteresis_t *h, const operator_path_t *paths, size_t count, double *position_um) {
    for (size_t i = 0, at = 0; h->offsets_behind && i < count; i++) {
        for (size_t k = 0; k < paths[i].samples; k++) {
            position_um[at++] += h->evidence.weight[operator_offset_column(i)];
        }
    }
}

typedef struct {
    const group_evidence_t *evidence;
    double *open;
} open_job_t;

static void take_open(void *context, double *row, const size_t *sample, size_t rows) {
    const open_job_t *job = context;
    double part[STATE_SPACE_ROWS];
    group_evidence_open(job->evidence, row, rows, part);
    for (size_t i = 0; i < rows; i++) {
        job->open[sample[i]] = part[i];
    }
}

/* Rows at these samples, each one of them. */
static rows_wanted_t rows_of(const hysteresis_t *h, const operator_path_t *paths, size_t count,
                             const unsigned char *use) {
    return (rows_wanted_t){.operator= & h->operator,
                           .paths = paths,
                           .count = count,
                           .turns = h->turns,
                           .behind = &h->behind,
                           .offsets_behind = h->offsets_behind,
                           .noise = &h->noise,
                           .use = use,
                           .thin = 1};
}

void hysteresis_left(const hysteresis_t *h, const operator_path_t *paths, size_t count, const double *position_um,
                     const unsigned char *use, double *left, double *open) {
    double *memory = pink_memory(&h->noise);
    hysteresis_predict(h, paths, count, left);
    for (size_t i = 0, at = 0; i < count; at += paths[i++].samples) {
        state_space_column(&h->behind, left + at, paths[i].samples);
    }
    hysteresis_add_offsets(h, paths, count, left);
    for (size_t i = 0, at = 0; i < count; i++) {
        for (size_t k = 0; k < paths[i].samples; k++, at++) {
            left[at] = position_um[at] - left[at];
            pink_value(&h->noise, memory, &left[at], k == 0);
            if (open != NULL) {
                open[at] = 0.0;
            }
        }
    }
    free(memory);
    if (open != NULL) {
        rows_wanted_t wanted = rows_of(h, paths, count, use);
        wanted.unused = true;
        rows_stream(&wanted, take_open, &(open_job_t){.evidence = &h->evidence, .open = open});
    }
}

void hysteresis_rows_open(hysteresis_rows_t *rows, const hysteresis_t *h, const operator_path_t *paths, size_t count,
                          const unsigned char *use, size_t thin) {
    rows_wanted_t wanted = rows_of(h, paths, count, use);
    wanted.thin = thin;
    *rows = (hysteresis_rows_t){.hysteresis = h, .paths = paths, .count = count};
    kept_rows_open(&rows->kept, &wanted);
}

void hysteresis_rows_close(hysteresis_rows_t *rows) {
    kept_rows_close(&rows->kept);
    *rows = (hysteresis_rows_t){0};
}

void hysteresis_beyond(const hysteresis_rows_t *rows, size_t columns, const double *const *column, double *product) {
    const hysteresis_t *h = rows->hysteresis;
    const size_t n = h->operator.columns;
    const double variance = h->evidence.variance;
    if (progress_cancelled()) {
        memset(product, 0, columns * columns * sizeof(double));
        return;
    }
    double *white = allocate(rows->kept.rows * columns, sizeof(double)), *along = allocate(n * columns, sizeof(double));
    for (size_t i = 0; i < columns; i++) {
        kept_rows_whiten(&rows->kept, rows->paths, rows->count, &h->noise, column[i], white + i, columns);
    }
    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)n, (int)columns, (int)rows->kept.rows, 1.0,
                rows->kept.row, (int)n, white, (int)columns, 0.0, along, (int)columns);
    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)columns, (int)columns, (int)rows->kept.rows, 1.0, white,
                (int)columns, white, (int)columns, 0.0, product, (int)columns);
    cblas_dtrsm(CblasRowMajor, CblasLeft, CblasLower, CblasNoTrans, CblasNonUnit, (int)n, (int)columns, 1.0,
                h->evidence.factor, (int)n, along, (int)columns);
    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)columns, (int)columns, (int)n, -1.0 / variance, along,
                (int)columns, along, (int)columns, 1.0 / variance, product, (int)columns);
    free(white);
    free(along);
}
