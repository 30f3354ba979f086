/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/evidence/evidence.h"
#include "base/parallel.h"
#include "diagnosis/evidence/searched.h"
#include "diagnosis/noise/held_out.h"
#include "numerics/basis.h"
#include "numerics/gauss_newton.h"
#include <gsl/gsl_cblas.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A column of which the nuisance subspace leaves less than this part is imitated. */
static const double imitated = 1e-6;
/* Of a square, what rounding makes of it where a basis has taken nearly all; and the part of what is looked for that
 * may be rounding. */
static const double rounding = 1e-13, rounding_at_most = 1e-4;
/* A derivative of whose square the nuisance subspace leaves no more than this part is imitated: what is left of it is
 * rounding, and so would be a step. */
static const double imitated_square = 1e-10;

struct evidence {
    const samples_t *samples;
    noise_t noise;
    signals_t signals;
    double *raw;           /* displacement - simulation, a column */
    size_t rows;           /* samples that are fitted */
    basis_t basis;         /* the nuisance subspace, whitened */
    size_t columns_for[3]; /* of it, by question */
    ask_t question;
    double *residual; /* whitened, beyond the nuisance subspace */
    double power;     /* of the residual */
};

/* Whitened, and only the samples that are fitted. */
static void take_rows(const evidence_t *e, const double *column, double *rows) {
    noise_whiten_fitted(&e->noise, e->samples, column, rows);
}

static double square_of(const evidence_t *e, const double *x) {
    return cblas_ddot((int)e->rows, x, 1, x, 1);
}

/* Columns of one layer that wait for their place in the basis. */
typedef struct {
    evidence_t *evidence;
    nuisance_layer_t layer;
    basis_queue_t queue;
} waiting_t;

static void add_waiting(waiting_t *waiting) {
    evidence_t *e = waiting->evidence;
    basis_queue_add(&waiting->queue);
    e->columns_for[ASK_EFFECTS] = e->basis.columns;
    e->columns_for[ASK_SHAPES] = waiting->layer <= NUISANCE_PLAYS ? e->basis.columns : e->columns_for[ASK_SHAPES];
    e->columns_for[ASK_ANYTHING] = waiting->layer <= NUISANCE_OWN ? e->basis.columns : e->columns_for[ASK_ANYTHING];
}

static void add_to_basis(void *context, const double *column, nuisance_layer_t layer) {
    waiting_t *waiting = context;
    if (layer != waiting->layer) {
        add_waiting(waiting);
    }
    waiting->layer = layer;
    take_rows(waiting->evidence, column, basis_queue_next(&waiting->queue));
}

static void fill_basis(evidence_t *e) {
    const nuisance_options_t options = {.past = true, .plays = true, .shapes = true};
    waiting_t waiting = {.evidence = e, .layer = NUISANCE_OWN};
    basis_open(&e->basis, e->rows, nuisance_most(&e->signals, &options));
    basis_queue_open(&waiting.queue, &e->basis);
    nuisance(&e->signals, &options, add_to_basis, &waiting);
    add_waiting(&waiting);
    basis_queue_close(&waiting.queue);
}

void evidence_ask(evidence_t *e, ask_t question) {
    e->question = question;
    e->basis.columns = e->columns_for[question];
    take_rows(e, e->raw, e->residual);
    basis_project(&e->basis, e->residual, 1);
    e->power = square_of(e, e->residual);
}

evidence_t *evidence_open(const model_t *baseline, const samples_t *samples, const noise_t *noise, failure_t *failure) {
    evidence_t *e = allocate(1, sizeof *e);
    *e = (evidence_t){.samples = samples, .noise = *noise, .rows = samples->fitted};
    if (!signals_open(&e->signals, samples, baseline, failure)) {
        free(e);
        return NULL;
    }
    e->raw = samples_column(samples);
    e->residual = allocate(e->rows, sizeof(double));
    fill_basis(e);
    samples_residual(samples, e->signals.simulated, e->raw);
    evidence_ask(e, ASK_EFFECTS);
    return e;
}

void evidence_close(evidence_t *e) {
    if (e != NULL) {
        signals_close(&e->signals);
        free(e->raw);
        basis_close(&e->basis);
        free(e->residual);
        free(e);
    }
}

ask_t evidence_question(const evidence_t *e) {
    return e->question;
}

const samples_t *evidence_samples(const evidence_t *e) {
    return e->samples;
}

const double *evidence_residual(const evidence_t *e) {
    return e->raw;
}

double evidence_sigma_um(const evidence_t *e) {
    return sqrt(e->power / (double)(e->rows - e->basis.columns));
}

double evidence_likelihood(const evidence_t *e, double part) {
    return part > 0.0 ? -(double)e->rows * log(part) : HUGE_VAL;
}

double *evidence_signature(const evidence_t *e, const model_t *altered, size_t at) {
    double *signature = samples_column(e->samples);
    if (!signals_altered(&e->signals, altered, stage_of(altered, at), signature)) {
        free(signature);
        return NULL;
    }
    cblas_daxpy((int)e->samples->all, -1.0, e->signals.simulated, 1, signature, 1);
    return signature;
}

/* Sum over blocks of time of the square of sum x (residual - a x): what the amplitude's variance is without assuming
 * that neighbours are independent. */
static double scatter(const evidence_t *e, const double *x, double amplitude) {
    double sum = 0.0;
    const size_t length = e->rows / HELD_OUT_BLOCKS + 1;
    for (size_t begin = 0; begin < e->rows; begin += length) {
        double block = 0.0;
        for (size_t k = begin; k < begin + length && k < e->rows; k++) {
            block += x[k] * (e->residual[k] - amplitude * x[k]);
        }
        sum += block * block;
    }
    return sum;
}

/* x: the signature's rows beyond the nuisance subspace; before: their square with what the nuisance subspace imitates.
 */
static void test_beyond(const evidence_t *e, const double *x, double before, evidence_test_t *test) {
    const double square = square_of(e, x), product = cblas_ddot((int)e->rows, x, 1, e->residual, 1);
    if (square > imitated * imitated * before) {
        const double degrees = (double)(e->rows - e->basis.columns - 1), explained = product * product / square;
        test->amplitude = product / square;
        test->t = product / sqrt(square * (e->power - explained) / degrees);
        test->t_blocks = product / sqrt(scatter(e, x, test->amplitude));
        test->own_um = sqrt(square / (double)e->rows);
        test->own_part = sqrt(square / before);
        test->explained = explained / e->power;
    }
}

static void test_some(const evidence_t *e, size_t count, double *const *signature, evidence_test_t *test) {
    double *x = allocate(count * e->rows, sizeof(double)), before[BASIS_AT_ONCE], *white = samples_column(e->samples);
    for (size_t i = 0; i < count; i++) {
        double *rows = x + i * e->rows;
        noise_whiten(&e->noise, e->samples, signature[i], white);
        samples_pick(e->samples, SAMPLE_FITTED, white, rows);
        before[i] = square_of(e, rows);
        const double held = samples_square(e->samples, SAMPLE_HELD_OUT, white);
        test[i] = (evidence_test_t){.held_share = before[i] > 0.0 ? held / before[i] : 0.0};
    }
    basis_project(&e->basis, x, count);
    for (size_t i = 0; i < count; i++) {
        test_beyond(e, x + i * e->rows, before[i], &test[i]);
    }
    free(white);
    free(x);
}

void evidence_tests(const evidence_t *e, size_t count, double *const *signature, evidence_test_t *test) {
    for (size_t i = 0; i < count; i += BASIS_AT_ONCE) {
        test_some(e, count - i < BASIS_AT_ONCE ? count - i : BASIS_AT_ONCE, signature + i, test + i);
    }
}

evidence_test_t evidence_test(const evidence_t *e, double *signature) {
    evidence_test_t test;
    evidence_tests(e, 1, &signature, &test);
    return test;
}

double evidence_beside(const evidence_t *e, const double *signature, double amplitude, const double *found,
                       double part) {
    enum { STRETCHES = 8 * HELD_OUT_BLOCKS };
    double *x = allocate(2 * e->rows, sizeof(double)), *y = x + e->rows, sum = 0.0;
    const size_t length = e->rows / STRETCHES + 1;
    take_rows(e, signature, x);
    take_rows(e, found, y);
    basis_project(&e->basis, x, 2);
    for (size_t begin = 0; begin < e->rows; begin += length) {
        const int rows = (int)(e->rows - begin < length ? e->rows - begin : length);
        const double own = amplitude * amplitude * cblas_ddot(rows, x + begin, 1, x + begin, 1);
        sum += own > part * part * cblas_ddot(rows, y + begin, 1, y + begin, 1) ? own : 0.0;
    }
    free(x);
    return sqrt(sum / (double)e->rows);
}

double evidence_cosine(const evidence_t *e, const double *one, const double *other) {
    double *x = allocate(2 * e->rows, sizeof(double)), *y = x + e->rows;
    take_rows(e, one, x);
    take_rows(e, other, y);
    basis_project(&e->basis, x, 2);
    const double cosine = cblas_ddot((int)e->rows, x, 1, y, 1) / sqrt(square_of(e, x) * square_of(e, y));
    free(x);
    return isfinite(cosine) ? cosine : 0.0;
}

/* Rows of the signature. False if it cannot be simulated. */
static bool rows_of(const evidence_t *e, const model_t *altered, size_t at, double *rows) {
    double *signature = evidence_signature(e, altered, at);
    if (signature == NULL) {
        return false;
    }
    take_rows(e, signature, rows);
    free(signature);
    return true;
}

/* x'y beyond the nuisance subspace. */
static double beyond(const evidence_t *e, const double *x, const double *x_share, const double *y,
                     const double *y_share) {
    return cblas_ddot((int)e->rows, x, 1, y, 1) - cblas_ddot((int)e->basis.columns, x_share, 1, y_share, 1);
}

typedef struct {
    double *rows, *share;
} signature_rows_t;

typedef struct {
    const evidence_t *evidence;
    model_t *altered;
    size_t at;
    searched_t searched;
    double *room;
    signature_rows_t now, then;                        /* the signature where the search stands, and where it looks */
    signature_rows_t derivative[BLOCK_MAX_PARAMETERS]; /* by each unknown */
    double gram[BLOCK_MAX_PARAMETERS * BLOCK_MAX_PARAMETERS], moment[BLOCK_MAX_PARAMETERS];
    double settled; /* a minimum is near enough when the sum of squares falls by no more */
} refinement_t;

/* From one signature's rows to the next one's, and from its shares to the next one's. */
static size_t room_of_one(const evidence_t *e) {
    return e->rows + e->basis.columns + 1;
}

static signature_rows_t take_room(const evidence_t *e, double **room) {
    const signature_rows_t taken = {.rows = *room, .share = *room + e->rows};
    *room += room_of_one(e);
    return taken;
}

static void open_refinement(refinement_t *r, const evidence_t *e, model_t *altered, size_t at) {
    *r = (refinement_t){.evidence = e, .altered = altered, .at = at};
    searched_open(&r->searched, altered, at, recordings_held_s(e->samples->recordings, e->samples->count));
    double *next = r->room = allocate((r->searched.count + 2) * room_of_one(e), sizeof(double));
    r->now = take_room(e, &next);
    r->then = take_room(e, &next);
    for (size_t i = 0; i < r->searched.count; i++) {
        r->derivative[i] = take_room(e, &next);
    }
}

/* The signature as the model now is, and what it leaves: |residual - signature|^2 beyond the nuisance subspace.
 * HUGE_VAL where it cannot be simulated, or is so large that what the nuisance subspace leaves of it is rounding. */
static double look(const refinement_t *r, const signature_rows_t *s) {
    const evidence_t *e = r->evidence;
    if (!rows_of(e, r->altered, r->at, s->rows) || rounding * square_of(e, s->rows) > rounding_at_most * e->power) {
        return HUGE_VAL;
    }
    basis_shares(&e->basis, s->rows, 1, room_of_one(e), s->share);
    return e->power - 2.0 * cblas_ddot((int)e->rows, s->rows, 1, e->residual, 1) +
           beyond(e, s->rows, s->share, s->rows, s->share);
}

/* Derivative by one unknown; 0 where there is no model a little beside this one. */
static void take_derivative(void *context, size_t i) {
    const refinement_t *r = context;
    const evidence_t *e = r->evidence;
    double *rows = r->derivative[i].rows;
    model_t nudged;
    const double difference = searched_nudge(&r->searched, i, r->altered, r->at, &nudged);
    const bool simulated = rows_of(e, &nudged, r->at, rows);
    model_free(&nudged);
    cblas_daxpy((int)e->rows, -1.0, r->now.rows, 1, rows, 1);
    cblas_dscal((int)e->rows, simulated ? 1.0 / difference : 0.0, rows, 1);
}

static bool linearise(void *context, double *cost) {
    refinement_t *r = context;
    const evidence_t *e = r->evidence;
    const size_t n = r->searched.count;
    (void)cost;
    memset(r->gram, 0, sizeof r->gram);
    memset(r->moment, 0, sizeof r->moment);
    parallel(n, take_derivative, r);
    basis_shares(&e->basis, r->derivative[0].rows, n, room_of_one(e), r->derivative[0].share);
    for (size_t i = 0; i < n; i++) {
        const signature_rows_t *d = &r->derivative[i];
        const double own = beyond(e, d->rows, d->share, d->rows, d->share);
        if (own <= imitated_square * square_of(e, d->rows)) {
            continue;
        }
        r->moment[i] = cblas_ddot((int)e->rows, d->rows, 1, e->residual, 1) -
                       beyond(e, d->rows, d->share, r->now.rows, r->now.share);
        r->gram[i * n + i] = own;
        for (size_t j = 0; j < i; j++) {
            r->gram[i * n + j] = r->gram[j * n + i] =
                r->gram[j * n + j] > 0.0 ? beyond(e, d->rows, d->share, r->derivative[j].rows, r->derivative[j].share)
                                         : 0.0;
        }
    }
    return true;
}

/* Its damping is its own. */
static bool find_step(void *context, double damping, double *step) {
    refinement_t *r = context;
    (void)damping;
    searched_solve(r->searched.count, r->gram, r->moment, step);
    return true;
}

static double move(void *context, const double *step, double part) {
    refinement_t *r = context;
    searched_move(&r->searched, step, part);
    return look(r, &r->then);
}

static void move_back(void *context, const double *step, double part) {
    refinement_t *r = context;
    (void)step;
    (void)part;
    searched_back(&r->searched);
}

static void keep(void *context) {
    refinement_t *r = context;
    const signature_rows_t before = r->now;
    r->now = r->then;
    r->then = before;
}

static bool ends(void *context, bool improved, double before, double now) {
    const refinement_t *r = context;
    return !improved || !(before - now > r->settled);
}

/* To the nearest minimum. */
static double descend(refinement_t *r, double left) {
    /* Iterations: a number may be several powers of e away, and moves by one at a time. Trials: the step, a third of
     * it, a ninth .. */
    static const gauss_newton_tunables_t tunables = {
        .most_iterations = 25, .most_trials = 5, .worth = 1.0, .shorten = 0.3};
    const gauss_newton_problem_t problem = {r, r->searched.count, linearise, find_step, move, move_back, keep, ends};
    if (isfinite(left)) {
        (void)gauss_newton(&problem, &tunables, &left);
    }
    return left;
}

/* Looks for less in the neighbourhood: in parts of each number. */
static double look_around(refinement_t *r, double left) {
    static const double around[] = {0.003, -0.003, 0.01, -0.01, 0.03, -0.03};
    for (size_t i = 0; i < r->searched.count; i++) {
        double step[BLOCK_MAX_PARAMETERS] = {0.0};
        step[i] = 1.0;
        for (size_t k = 0; k < sizeof around / sizeof around[0]; k++) {
            const double tried = move(r, step, around[k]);
            if (tried < left) {
                left = tried;
                keep(r);
            } else {
                move_back(r, step, around[k]);
            }
        }
    }
    return left;
}

double evidence_refine(const evidence_t *e, model_t *altered, size_t at) {
    enum { MOST_MINIMA = 3 };
    const double settled = 0.1 * e->power / (double)e->rows; /* 0.1 in 2 log likelihood */
    const bool corners = block_search(altered->block[at].block)->corners;
    refinement_t r;
    open_refinement(&r, e, altered, at);
    r.settled = settled;
    double left = descend(&r, look(&r, &r.now)), before = HUGE_VAL;
    for (int minima = 1; corners && minima < MOST_MINIMA && isfinite(left) && before - left > settled; minima++) {
        before = left;
        left = look_around(&r, left);
        left = before - left > settled ? descend(&r, left) : left;
    }
    free(r.room);
    return isfinite(left) ? left / e->power : HUGE_VAL;
}
