/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/hysteresis.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "numerics/gauss_newton.h"
#include "operator/law_rows.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The search for a law takes so many samples, evenly spread. */
enum { SEARCHED_SAMPLES = 6000, LAW_LENGTHS = 7, LAW_POWERS = 2, LAW_STARTS = LAW_LENGTHS * LAW_POWERS, LAW_STEPS = 8 };
static const double shortest_law = 0.03, longest_law = 2.0;
/* The numbers of a law move by no more than this in a step. A step that is worth less, in natural units, is the last.
 */
static const double longest_step = 0.5, law_settled = 1.0;
static const double least_power = 0.3, most_power = 4.0;

/* What a fit is made of. */
typedef struct {
    const operator_path_t *paths;
    size_t count, longest;
    double *position_um; /* less its mean; outliers are pulled in */
    const unsigned char *use;
    size_t used;
    hysteresis_bases_t *bases;
} question_t;

static void base_close(hysteresis_base_t *base) {
    kept_rows_close(&base->rows);
    free(base->gram);
    base->gram = NULL;
}

void hysteresis_bases_close(hysteresis_bases_t *bases) {
    for (size_t i = 0; i < HYSTERESIS_BASES; i++) {
        base_close(&bases->base[i]);
    }
    *bases = (hysteresis_bases_t){0};
}

/* Of every `thin`-th used sample: those that are there, or new ones in the place of the oldest. */
static const hysteresis_base_t *base_of(const question_t *q, const hysteresis_t *h, size_t thin) {
    for (size_t i = 0; i < HYSTERESIS_BASES; i++) {
        const hysteresis_base_t *there = &q->bases->base[i];
        if (there->gram != NULL && there->turns == h->turns && there->rho == h->noise.rho && there->thin == thin) {
            return there;
        }
    }
    hysteresis_base_t *base = &q->bases->base[q->bases->made++ % HYSTERESIS_BASES];
    operator_t without_law = h->operator;
    operator_drop_law(&without_law);
    const size_t n = without_law.columns;
    const rows_wanted_t wanted = {.operator= & without_law,
                                  .paths = q->paths,
                                  .count = q->count,
                                  .turns = h->turns,
                                  .noise = &h->noise,
                                  .use = q->use,
                                  .thin = thin};
    base_close(base);
    *base = (hysteresis_base_t){
        .turns = h->turns, .rho = h->noise.rho, .thin = thin, .gram = allocate(n * n, sizeof(double))};
    kept_rows_open(&base->rows, &wanted);
    cblas_dsyrk(CblasRowMajor, CblasLower, CblasTrans, (int)n, (int)base->rows.rows, 1.0, base->rows.row, (int)n, 0.0,
                base->gram, (int)n);
    return base;
}

/* The position, whitened, in the base's rows. */
static double *values_of(const question_t *q, const hysteresis_t *h, const hysteresis_base_t *base) {
    double *value = allocate(base->rows.rows + 1, sizeof(double));
    kept_rows_whiten(&base->rows, q->paths, q->count, &h->noise, q->position_um, value, 1);
    return value;
}

static law_along_t along_of(const question_t *q, const hysteresis_t *h, const hysteresis_base_t *base) {
    return (law_along_t){.operator= & h->operator,
                         .paths = q->paths,
                         .count = q->count,
                         .turns = h->turns,
                         .noise = &h->noise,
                         .kept = &base->rows};
}

/* The columns of the law, behind the others: what they have in common with these, with themselves and the values. */
static void add_law(const question_t *q, const hysteresis_t *h, const hysteresis_base_t *base, const double *value,
                    normal_equations_t *equations) {
    const size_t n = equations->unknowns, before = base->rows.columns;
    const int all = (int)n, rows = (int)base->rows.rows, others = (int)before, law = OPERATOR_LAW;
    double *row = allocate(base->rows.rows * OPERATOR_LAW + 1, sizeof(double)), *last = equations->gram + before * n;
    const law_along_t along = along_of(q, h, base);
    law_rows(&along, row);
    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, law, others, rows, 1.0, row, law, base->rows.row, others, 0.0,
                last, all);
    cblas_dsyrk(CblasRowMajor, CblasLower, CblasTrans, law, rows, 1.0, row, law, 0.0, last + before, all);
    cblas_dgemv(CblasRowMajor, CblasTrans, rows, law, 1.0, row, law, value, 1, 0.0, equations->moment + before, 1);
    free(row);
}

/* The whitened equations of every `thin`-th used sample. */
static void equations_of(const question_t *q, const hysteresis_t *h, size_t thin, normal_equations_t *equations) {
    const size_t n = h->operator.columns;
    const hysteresis_base_t *base = base_of(q, h, thin);
    const size_t before = base->rows.columns;
    const int rows = (int)base->rows.rows, others = (int)before;
    double *value = values_of(q, h, base);
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
    return group == GROUP_LEAKS || group == GROUP_PRODUCTS;
}

static void set_groups(hysteresis_t *h, bool leaks) {
    h->group = reallocate(h->group, h->operator.columns, sizeof(size_t));
    for (size_t j = 0; j < h->operator.columns; j++) {
        const operator_group_t group = operator_group(&h->operator, j);
        h->group[j] = leaks || !is_like_a_law(group) ? (size_t)group : EVIDENCE_LEFT_OUT;
    }
}

/* Replaces the weights. */
static bool fit_weights(const question_t *q, size_t thin, bool leaks, hysteresis_t *h, failure_t *failure) {
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

/* The gain in evidence of one law's h, as a signature beyond the operator without a law. */
typedef struct {
    const hysteresis_t *h;
    const hysteresis_base_t *base;
    law_along_t along;
    double *left; /* of the values, by the operator without a law */
    duhem_law_t law[LAW_STARTS];
    double gain[LAW_STARTS];
} law_scan_t;

static void scan_law(void *context, size_t index) {
    law_scan_t *scan = context;
    const hysteresis_t *h = scan->h;
    const int n = (int)h->operator.columns, rows = (int)scan->base->rows.rows;
    duhem_table_t *table = allocate(1, sizeof *table);
    double *value = allocate(scan->base->rows.rows + 1, sizeof(double)),
           *products = allocate(h->operator.columns, sizeof(double));
    duhem_tabulate(&scan->law[index], table);
    law_rows_of(&scan->along, table, value);
    cblas_dgemv(CblasRowMajor, CblasTrans, rows, n, 1.0, scan->base->rows.row, n, value, 1, 0.0, products, 1);
    const double square = cblas_ddot(rows, value, 1, value, 1), along = cblas_ddot(rows, value, 1, scan->left, 1);
    cblas_dtrsv(CblasRowMajor, CblasLower, CblasNoTrans, CblasNonUnit, n, h->evidence.factor, n, products, 1);
    const double beyond = square - cblas_ddot(n, products, 1, products, 1);
    scan->gain[index] = beyond > 1e-9 * square ? along * along / (2.0 * beyond * h->evidence.variance) : 0.0;
    free(value);
    free(products);
    free(table);
}

static bool best_start(const question_t *q, const hysteresis_t *h, size_t thin, duhem_law_t *law) {
    const hysteresis_base_t *base = base_of(q, h, thin);
    const int n = (int)h->operator.columns;
    law_scan_t scan = {.h = h, .base = base, .along = along_of(q, h, base), .left = values_of(q, h, base)};
    size_t best = 0;
    cblas_dgemv(CblasRowMajor, CblasNoTrans, (int)base->rows.rows, n, -1.0, base->rows.row, n, h->evidence.weight, 1,
                1.0, scan.left, 1);
    for (size_t i = 0; i < LAW_STARTS; i++) {
        const double part = (double)(i % LAW_LENGTHS) / (LAW_LENGTHS - 1);
        scan.law[i].number[0] = log(shortest_law * pow(longest_law / shortest_law, part));
        const size_t power = 1 + i / LAW_LENGTHS;
        scan.law[i].number[1] = (double)power;
    }
    parallel(LAW_STARTS, scan_law, &scan);
    free(scan.left);
    for (size_t i = 1; i < LAW_STARTS; i++) {
        best = scan.gain[i] > scan.gain[best] ? i : best;
    }
    *law = scan.law[best];
    return scan.gain[best] > threshold.law_worth;
}

/* The search for a law's numbers. A fit at `law` comes before each step. */
typedef struct {
    const question_t *question;
    size_t thin;
    hysteresis_t *h;
    duhem_law_t law, kept;
} law_search_t;

/* Minus the evidence of the law, all weights marginalised. HUGE_VAL: it cannot be fitted. */
static double cost_of_law(law_search_t *search) {
    failure_t ignored;
    operator_set_law(&search->h->operator, & search->law);
    return fit_weights(search->question, search->thin, false, search->h, &ignored) ? -search->h->evidence.log_evidence
                                                                                   : HUGE_VAL;
}

/* The tangents are columns of every fit. */
static bool tangents_are_there(void *context, double *cost) {
    (void)context;
    (void)cost;
    return true;
}

static void keep_within(double number, double low, double high, double *step) {
    *step = fmax(low, fmin(high, number + *step)) - number;
}

/* What the evidence says of the tangents moves the law's numbers. */
static bool step_of_law(void *context, double damping, double *step) {
    const law_search_t *search = context;
    const double *weight = search->h->evidence.weight + operator_law_column(&search->h->operator);
    (void)damping;
    for (size_t i = 0; i < DUHEM_NUMBERS && weight[0] != 0.0; i++) {
        step[i] = fmax(-longest_step, fmin(longest_step, weight[4 + i] / weight[0]));
    }
    keep_within(search->law.number[0], log(shortest_law / 2.0), log(2.0 * longest_law), &step[0]);
    keep_within(search->law.number[1], least_power, most_power, &step[1]);
    return weight[0] != 0.0;
}

static double move_law(void *context, const double *step, double part) {
    law_search_t *search = context;
    search->kept = search->law;
    for (size_t i = 0; i < DUHEM_NUMBERS; i++) {
        search->law.number[i] += part * step[i];
    }
    return cost_of_law(search);
}

static void move_law_back(void *context, const double *step, double part) {
    law_search_t *search = context;
    (void)step;
    (void)part;
    search->law = search->kept;
}

static bool law_ends(void *context, bool improved, double before, double now) {
    (void)context;
    return !improved || before - now < law_settled;
}

static void improve_law(const question_t *q, size_t thin, hysteresis_t *h, duhem_law_t *law) {
    static const gauss_newton_tunables_t tunables = {
        .most_iterations = LAW_STEPS, .most_trials = 3, .worth = 1.0, .shorten = 1.0 / 3.0};
    law_search_t search = {.question = q, .thin = thin, .h = h, .law = *law};
    const gauss_newton_problem_t problem = {.context = &search,
                                            .unknowns = DUHEM_NUMBERS,
                                            .linearise = tangents_are_there,
                                            .solve = step_of_law,
                                            .move = move_law,
                                            .back = move_law_back,
                                            .ends = law_ends};
    double cost = cost_of_law(&search);
    if (isfinite(cost)) {
        (void)gauss_newton(&problem, &tunables, &cost);
    }
    *law = search.law;
}

/* Leaves the operator with a law where that is worth it, beside this noise. */
static bool find_law_beside(const question_t *q, size_t thin, hysteresis_t *h, failure_t *failure) {
    duhem_law_t law;
    if (!fit_weights(q, thin, true, h, failure)) {
        return false;
    }
    const double without = h->evidence.log_evidence;
    if (!fit_weights(q, thin, false, h, failure)) {
        return false;
    }
    if (best_start(q, h, thin, &law)) {
        improve_law(q, thin, h, &law);
        operator_set_law(&h->operator, & law);
        if (!fit_weights(q, thin, true, h, failure)) {
            return false;
        }
        if (h->evidence.log_evidence < without + threshold.law_worth) {
            operator_drop_law(&h->operator);
        }
    }
    return true;
}

/* Evidence of the weights at this noise, or -HUGE_VAL. */
static double evidence_at(const question_t *q, size_t thin, double rho, hysteresis_t *h) {
    failure_t ignored;
    pink_create(&h->noise, rho, q->longest);
    return fit_weights(q, thin, true, h, &ignored) ? h->evidence.log_evidence : -HUGE_VAL;
}

/* The likeliest rho near the one that it has, in steps that get smaller. best: evidence of that. */
static void improve_noise(const question_t *q, size_t thin, double best, hysteresis_t *h) {
    double rho = h->noise.rho, factor = sqrt(10.0);
    while (rho > 0.0 && factor > 1.3) {
        for (int up = 0; up < 2; up++) {
            const double beside = rho * (up != 0 ? factor : 1.0 / factor), evidence = evidence_at(q, thin, beside, h);
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
static void find_noise(const question_t *q, size_t thin, hysteresis_t *h) {
    double best = evidence_at(q, thin, 0.0, h), rho = 0.0;
    double at = threshold.slowest_rho;
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
static bool find_turns(const question_t *q, size_t thin, hysteresis_t *h, failure_t *failure) {
    h->turns = true;
    if (!fit_weights(q, thin, true, h, failure)) {
        return false;
    }
    const double with = h->evidence.log_evidence;
    h->turns = false;
    if (!fit_weights(q, thin, true, h, failure)) {
        return false;
    }
    h->turns = with >= h->evidence.log_evidence;
    return true;
}

/* Samples far outside the noise count as on its edge. */
static bool pull_outliers_in(question_t *q, size_t thin, hysteresis_t *h, failure_t *failure) {
    if (!fit_weights(q, thin, true, h, failure)) {
        return false;
    }
    double *left = allocate(q->longest * q->count, sizeof(double));
    const double middle_um = h->middle_um;
    h->middle_um = 0.0;
    hysteresis_left(h, q->paths, q->count, q->position_um, NULL, left, NULL);
    h->middle_um = middle_um;
    const double most = threshold.edge_of_noise * sqrt(h->evidence.variance);
    size_t at = 0;
    h->outliers = 0;
    for (size_t i = 0; i < q->count; i++) {
        for (size_t k = 0; k < q->paths[i].samples; k++, at++) {
            if (fabs(left[at]) > most) {
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

/* Without a law what only a law explains is taken for 1/f noise, and beside that noise no law may be worth anything. So
 * one is sought beside white noise, too, and the noise again beside it. It stands if it is likelier and leaves less 1/f
 * noise. */
static bool find_law(const question_t *q, size_t thin, hysteresis_t *h, failure_t *failure) {
    if (!find_law_beside(q, thin, h, failure)) {
        return false;
    }
    const pink_t pink = h->noise;
    if (pink.rho <= 0.0) {
        return true;
    }
    const double evidence = evidence_at(q, thin, pink.rho, h);
    const bool has_law = h->operator.has_law;
    const duhem_law_t law = h->operator.law;
    group_evidence_t kept = h->evidence; /* where the next fit begins */
    h->evidence = (group_evidence_t){0};
    take_law(h, false, NULL);
    pink_create(&h->noise, 0.0, q->longest);
    const bool good = find_law_beside(q, thin, h, failure);
    bool stands = false;
    if (good && h->operator.has_law) {
        find_noise(q, thin, h);
        stands = h->noise.rho < pink.rho && evidence_at(q, thin, h->noise.rho, h) > evidence;
    }
    if (!stands) {
        group_evidence_t other = h->evidence;
        h->evidence = kept;
        kept = other;
        take_law(h, has_law, &law);
        h->noise = pink;
    }
    group_evidence_free(&kept);
    return good;
}

/* Turns, law and the spectrum of the noise as another fit has them, the latter improved. */
static bool fit_like(question_t *q, size_t thin, const hysteresis_t *like, hysteresis_t *h, failure_t *failure) {
    const size_t search = q->used / SEARCHED_SAMPLES + 1;
    h->turns = like->turns;
    pink_create(&h->noise, like->noise.rho, q->longest);
    take_law(h, like->operator.has_law, &like->operator.law);
    if (!pull_outliers_in(q, search, h, failure)) {
        return false;
    }
    if (like->noise.rho > 0.0) {
        improve_noise(q, search, evidence_at(q, search, like->noise.rho, h), h);
    }
    return fit_weights(q, thin, true, h, failure);
}

static bool fit_all(question_t *q, size_t thin, hysteresis_t *h, failure_t *failure) {
    const size_t search = q->used / SEARCHED_SAMPLES + 1;
    if (!find_turns(q, search, h, failure)) {
        return false;
    }
    find_noise(q, search, h);
    return pull_outliers_in(q, search, h, failure) && find_law(q, search, h, failure) &&
           fit_weights(q, thin, true, h, failure);
}

bool hysteresis_fit(const operator_path_t *paths, size_t count, const double *position_um, const unsigned char *use,
                    size_t thin, const hysteresis_t *like, hysteresis_bases_t *bases, hysteresis_t *h,
                    failure_t *failure) {
    question_t q = {.paths = paths, .count = count, .use = use, .bases = bases};
    double range[2] = {paths[0].range_v[0], paths[0].range_v[1]}, sum = 0.0;
    size_t at = 0;
    memset(h, 0, sizeof *h);
    for (size_t i = 0; i < count; i++) {
        range[0] = fmin(range[0], paths[i].range_v[0]);
        range[1] = fmax(range[1], paths[i].range_v[1]);
        q.longest = paths[i].samples > q.longest ? paths[i].samples : q.longest;
        for (size_t k = 0; k < paths[i].samples; k++, at++) {
            q.used += use[at] != 0 ? 1 : 0;
            sum += use[at] != 0 ? position_um[at] : 0.0;
        }
    }
    if (q.used == 0 || range[1] <= range[0]) {
        return fail(failure, "a drive that never moves, or no samples: no hysteresis shows");
    }
    h->middle_um = sum / (double)q.used;
    q.position_um = allocate(at, sizeof(double));
    for (size_t k = 0; k < at; k++) {
        q.position_um[k] = position_um[k] - h->middle_um;
    }
    operator_create(&h->operator, range, count);
    const bool good = like != NULL ? fit_like(&q, thin, like, h, failure) : fit_all(&q, thin, h, failure);
    h->position_um = q.position_um;
    for (size_t k = 0; k < at; k++) {
        h->position_um[k] += h->middle_um;
    }
    if (!good) {
        hysteresis_free(h);
    }
    return good;
}

void hysteresis_free(hysteresis_t *h) {
    operator_free(&h->operator);
    group_evidence_free(&h->evidence);
    free(h->group);
    free(h->position_um);
    h->group = NULL;
    h->position_um = NULL;
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
            value = h->middle_um + operator_value(&folded, &hike.walk, level_v, row);
        }
        position_um[hike.at] = value;
    }
    free(row);
}

typedef struct {
    const group_evidence_t *evidence;
    double *open;
} open_job_t;

static void take_open(void *context, double *row, const size_t *sample, size_t rows) {
    const open_job_t *job = context;
    double part[PINK_ROWS];
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
                           .noise = &h->noise,
                           .use = use,
                           .thin = 1};
}

void hysteresis_left(const hysteresis_t *h, const operator_path_t *paths, size_t count, const double *position_um,
                     const unsigned char *use, double *left, double *open) {
    double *memory = pink_memory(&h->noise, 1);
    hysteresis_predict(h, paths, count, left);
    for (size_t i = 0, at = 0; i < count; i++) {
        for (size_t k = 0; k < paths[i].samples; k++, at++) {
            left[at] = position_um[at] - left[at];
            pink_row(&h->noise, memory, 1, &left[at], k == 0);
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
