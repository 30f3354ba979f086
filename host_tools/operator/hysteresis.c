/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/hysteresis.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "numerics/gauss_newton.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The search for a law takes so many samples, evenly spread. */
enum {
    OPEN_AT_ONCE = 128,
    SEARCHED_SAMPLES = 6000,
    LAW_LENGTHS = 7,
    LAW_POWERS = 2,
    LAW_STARTS = LAW_LENGTHS * LAW_POWERS,
    LAW_STEPS = 8
};
static const double shortest_law = 0.03, longest_law = 2.0;
/* The numbers of a law move by no more than this in a step. A step that is worth less, in natural units, is the last.
 */
static const double longest_step = 0.5, law_settled = 1.0;
/* The slowest rho that is looked for, in cycles a sample: 1/f noise that is as strong as the white noise there holds a
 * thousandth of its power. */
static const double slowest_rho = 1e-3;
static const double least_power = 0.3, most_power = 4.0;

/* What a fit is made of. */
typedef struct {
    const operator_path_t *paths;
    size_t count, longest;
    double *position_um; /* less its mean; outliers are pulled in */
    const unsigned char *use;
    size_t used;
} question_t;

/* The whitened equations of every `thin`-th used sample. */
static void equations_of(const question_t *q, const hysteresis_t *h, size_t thin, normal_equations_t *equations) {
    const size_t n = h->operator.columns;
    double *row = allocate(n + 1, sizeof(double)), *memory = pink_memory(&h->noise, n + 1);
    size_t used = 0;
    normal_equations_create(equations, n);
    for (hike_t hike = hike_begin(q->paths, q->count, h->turns); hike_on(&hike, &h->operator);) {
        const bool taken = q->use[hike.at] != 0 && used++ % thin == 0;
        if (taken || memory != NULL) {
            operator_row(&hike.walk, hike_level(&hike), row);
            row[n] = q->position_um[hike.at];
            pink_row(&h->noise, memory, n + 1, row, hike.k == 0);
        }
        if (taken) {
            normal_equations_add(equations, row, row[n]);
        }
    }
    normal_equations_finish(equations);
    free(row);
    free(memory);
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
    const question_t *question;
    const hysteresis_t *h;
    size_t thin;
    duhem_law_t law[LAW_STARTS];
    double gain[LAW_STARTS];
} law_scan_t;

static void scan_law(void *context, size_t index) {
    law_scan_t *scan = context;
    const question_t *q = scan->question;
    const hysteresis_t *h = scan->h;
    const size_t n = h->operator.columns;
    duhem_table_t *table = allocate(1, sizeof *table);
    double *row = allocate(n + 2, sizeof(double)), *products = allocate(n, sizeof(double)), square = 0.0, along = 0.0;
    double *memory = pink_memory(&h->noise, n + 2);
    size_t used = 0;
    duhem_state_t state;
    double before = 0.0;
    duhem_tabulate(&scan->law[index], table);
    for (hike_t hike = hike_begin(q->paths, q->count, h->turns); hike_on(&hike, &h->operator);) {
        const operator_path_t *path = &q->paths[hike.path];
        if (hike.k == 0) {
            duhem_begin(table, &state);
        } else if (h->turns && !isnan(path->way_v[hike.k])) {
            const double way = (path->way_v[hike.k] - h->operator.middle_v) / h->operator.half_v;
            duhem_move(table, &state, way - before);
            before = way;
        }
        if (hike.k > 0 && hike.walk.u != before) {
            duhem_move(table, &state, hike.walk.u - before);
        }
        before = hike.walk.u;
        const bool taken = q->use[hike.at] != 0 && used++ % scan->thin == 0;
        if (!taken && memory == NULL) {
            continue;
        }
        operator_row(&hike.walk, hike_level(&hike), row);
        row[n] = q->position_um[hike.at];
        row[n + 1] = duhem_value(table, &state);
        pink_row(&h->noise, memory, n + 2, row, hike.k == 0);
        if (taken) {
            const double left = row[n] - cblas_ddot((int)n, row, 1, h->evidence.weight, 1);
            cblas_daxpy((int)n, row[n + 1], row, 1, products, 1);
            square += row[n + 1] * row[n + 1];
            along += row[n + 1] * left;
        }
    }
    cblas_dtrsv(CblasRowMajor, CblasLower, CblasNoTrans, CblasNonUnit, (int)n, h->evidence.factor, (int)n, products, 1);
    const double beyond = square - cblas_ddot((int)n, products, 1, products, 1);
    scan->gain[index] = beyond > 1e-9 * square ? along * along / (2.0 * beyond * h->evidence.variance) : 0.0;
    free(row);
    free(products);
    free(table);
    free(memory);
}

static bool best_start(const question_t *q, const hysteresis_t *h, size_t thin, duhem_law_t *law) {
    law_scan_t scan = {.question = q, .h = h, .thin = thin};
    size_t best = 0;
    for (size_t i = 0; i < LAW_STARTS; i++) {
        const double part = (double)(i % LAW_LENGTHS) / (LAW_LENGTHS - 1);
        scan.law[i].number[0] = log(shortest_law * pow(longest_law / shortest_law, part));
        const size_t power = 1 + i / LAW_LENGTHS;
        scan.law[i].number[1] = (double)power;
    }
    parallel(LAW_STARTS, scan_law, &scan);
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

/* Leaves the operator with a law where that is worth it. */
static bool find_law(const question_t *q, size_t thin, hysteresis_t *h, failure_t *failure) {
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

/* The likeliest rho: from white, in steps that get smaller. */
static void find_noise(const question_t *q, size_t thin, hysteresis_t *h) {
    double best = evidence_at(q, thin, 0.0, h), rho = 0.0;
    double at = slowest_rho;
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
    double factor = sqrt(10.0);
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
                    size_t thin, hysteresis_t *h, failure_t *failure) {
    question_t q = {.paths = paths, .count = count, .use = use};
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
    const bool good = fit_all(&q, thin, h, failure);
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
    const size_t n = h->operator.columns;
    double *row = allocate(n, sizeof(double));
    for (hike_t hike = hike_begin(paths, count, h->turns); hike_on(&hike, &h->operator);) {
        operator_row(&hike.walk, hike_level(&hike), row);
        position_um[hike.at] = h->middle_um + cblas_ddot((int)n, row, 1, h->evidence.weight, 1);
    }
    free(row);
}

/* Rows that wait for their share of what is open. */
typedef struct {
    const group_evidence_t *evidence;
    size_t waiting, sample[OPEN_AT_ONCE];
    double *row, part[OPEN_AT_ONCE], *open;
} open_queue_t;

static void open_take(open_queue_t *queue) {
    if (queue->waiting > 0) {
        group_evidence_open(queue->evidence, queue->row, queue->waiting, queue->part);
    }
    for (size_t i = 0; i < queue->waiting; i++) {
        queue->open[queue->sample[i]] = queue->part[i];
    }
    queue->waiting = 0;
}

void hysteresis_left(const hysteresis_t *h, const operator_path_t *paths, size_t count, const double *position_um,
                     const unsigned char *use, double *left, double *open) {
    const size_t n = h->operator.columns;
    double *row = allocate(n + 1, sizeof(double)), *memory = pink_memory(&h->noise, n + 1);
    open_queue_t queue = {.evidence = &h->evidence, .open = open, .row = allocate(OPEN_AT_ONCE * n, sizeof(double))};
    for (hike_t hike = hike_begin(paths, count, h->turns); hike_on(&hike, &h->operator);) {
        operator_row(&hike.walk, hike_level(&hike), row);
        row[n] = position_um[hike.at] - h->middle_um;
        pink_row(&h->noise, memory, n + 1, row, hike.k == 0);
        left[hike.at] = row[n] - cblas_ddot((int)n, row, 1, h->evidence.weight, 1);
        if (open != NULL) {
            open[hike.at] = 0.0;
        }
        if (open != NULL && use[hike.at] == 0) {
            memcpy(queue.row + queue.waiting * n, row, n * sizeof(double));
            queue.sample[queue.waiting++] = hike.at;
            if (queue.waiting == OPEN_AT_ONCE) {
                open_take(&queue);
            }
        }
    }
    open_take(&queue);
    free(queue.row);
    free(row);
    free(memory);
}

void hysteresis_rows_open(hysteresis_rows_t *rows, const hysteresis_t *h, const operator_path_t *paths, size_t count,
                          const unsigned char *use, size_t thin) {
    const size_t n = h->operator.columns;
    size_t used = 0, all = 0;
    for (size_t i = 0; i < count; i++) {
        all += paths[i].samples;
    }
    for (size_t k = 0; k < all; k++) {
        used += use[k] != 0 ? 1 : 0;
    }
    const size_t most = (used + thin - 1) / thin;
    *rows = (hysteresis_rows_t){.hysteresis = h,
                                .paths = paths,
                                .count = count,
                                .row = allocate(most * n, sizeof(double)),
                                .sample = allocate(most, sizeof(size_t))};
    double *row = allocate(n, sizeof(double)), *memory = pink_memory(&h->noise, n);
    used = 0;
    for (hike_t hike = hike_begin(paths, count, h->turns); hike_on(&hike, &h->operator);) {
        const bool taken = use[hike.at] != 0 && used++ % thin == 0;
        if (taken || memory != NULL) {
            operator_row(&hike.walk, hike_level(&hike), row);
            pink_row(&h->noise, memory, n, row, hike.k == 0);
        }
        if (taken) {
            memcpy(rows->row + rows->rows * n, row, n * sizeof(double));
            rows->sample[rows->rows++] = hike.at;
        }
    }
    free(row);
    free(memory);
}

void hysteresis_rows_close(hysteresis_rows_t *rows) {
    free(rows->row);
    free(rows->sample);
    *rows = (hysteresis_rows_t){0};
}

/* A column whitened, of these rows: picked[row * columns]. */
static void whiten_column(const hysteresis_rows_t *rows, const double *column, size_t columns, double *picked) {
    const pink_t *noise = &rows->hysteresis->noise;
    double *memory = pink_memory(noise, 1);
    for (size_t i = 0, at = 0, r = 0; i < rows->count; i++) {
        for (size_t k = 0; k < rows->paths[i].samples; k++, at++) {
            double value = column[at];
            pink_row(noise, memory, 1, &value, k == 0);
            if (r < rows->rows && rows->sample[r] == at) {
                picked[r++ * columns] = value;
            }
        }
    }
    free(memory);
}

void hysteresis_beyond(const hysteresis_rows_t *rows, size_t columns, const double *const *column, double *product) {
    const hysteresis_t *h = rows->hysteresis;
    const size_t n = h->operator.columns;
    const double variance = h->evidence.variance;
    if (progress_cancelled()) {
        memset(product, 0, columns * columns * sizeof(double));
        return;
    }
    double *white = allocate(rows->rows * columns, sizeof(double)), *along = allocate(n * columns, sizeof(double));
    for (size_t i = 0; i < columns; i++) {
        whiten_column(rows, column[i], columns, white + i);
    }
    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)n, (int)columns, (int)rows->rows, 1.0, rows->row, (int)n,
                white, (int)columns, 0.0, along, (int)columns);
    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)columns, (int)columns, (int)rows->rows, 1.0, white,
                (int)columns, white, (int)columns, 0.0, product, (int)columns);
    cblas_dtrsm(CblasRowMajor, CblasLeft, CblasLower, CblasNoTrans, CblasNonUnit, (int)n, (int)columns, 1.0,
                h->evidence.factor, (int)n, along, (int)columns);
    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)columns, (int)columns, (int)n, -1.0 / variance, along,
                (int)columns, along, (int)columns, 1.0 / variance, product, (int)columns);
    free(white);
    free(along);
}
