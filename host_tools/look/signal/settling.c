/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/signal/settling.h"
#include "base/failure.h"
#include "thresholds/thresholds.h"
#include <complex.h>
#include <gsl/gsl_eigen.h>
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

/* MOST_ORDER: dimensions that may be more than noise. COARSER: from one scale to the next. LEAST_WINDOWS: lengths of a
 * window that a scale needs. MOST_SAMPLES: of the first spans, for the time it takes. */
enum { WINDOW = 24, MOST_ORDER = 10, COARSER = 4, LEAST_WINDOWS = 2, MOST_SAMPLES = 1 << 16, BASELINE = 3 };

size_t settling_columns(const settling_t *settling, settling_pick_t pick, size_t count, double *columns) {
    size_t made = 0;
    for (size_t i = 0; i < settling->count; i++) {
        const settling_term_t *t = &settling->term[i];
        double *even = columns + made * count, *odd = even + count;
        if (pick == SETTLING_RINGS && !(t->turn > 0.0)) {
            continue;
        }
        for (size_t k = 0; k < count; k++) {
            const double size = exp(-t->decay * (double)k);
            even[k] = size * cos(t->turn * (double)k);
            if (t->turn > 0.0) {
                odd[k] = size * sin(t->turn * (double)k);
            }
        }
        made += t->turn > 0.0 ? 2 : 1;
    }
    return made;
}

/* Takes a polynomial of `baseline` coefficients and the terms out of `count` values. Returns how many columns. */
static size_t take_out(const settling_t *settling, size_t baseline, double *value, size_t count) {
    double *columns = allocate((BASELINE + SETTLING_COLUMNS) * count, sizeof *columns);
    const double *column[BASELINE + SETTLING_COLUMNS];
    look_regression_t fit;
    for (size_t k = 0; k < count; k++) {
        const double x = 2.0 * (double)k / (double)count - 1.0;
        for (size_t i = 0; i < baseline; i++) {
            columns[i * count + k] = gsl_pow_uint(x, (unsigned)i);
        }
    }
    const size_t all = baseline + settling_columns(settling, SETTLING_ALL, count, columns + baseline * count);
    for (size_t i = 0; i < all; i++) {
        column[i] = columns + i * count;
    }
    if (look_regress(column, all, value, NULL, count, &fit)) {
        for (size_t i = 0; i < all; i++) {
            for (size_t k = 0; k < count; k++) {
                value[k] -= fit.coefficient[i] * column[i][k];
            }
        }
    }
    free(columns);
    return all;
}

void settling_take_out(const settling_t *settling, double *value, size_t count) {
    const double taken = (double)take_out(settling, BASELINE, value, count), all = (double)count;
    for (size_t k = 0; k < count && all > taken; k++) {
        value[k] *= sqrt(all / (all - taken));
    }
}

typedef struct {
    const double *y;
    const look_span_t *span;
    size_t spans, typical; /* samples of the middle one */
} rests_t;

/* What the terms leave of a span. To be freed. */
static double *left_of(const rests_t *rests, size_t which, const settling_t *settling, size_t baseline,
                       size_t *columns) {
    const size_t count = span_length(rests->span[which]);
    double *left = allocate(count, sizeof *left);
    memcpy(left, rests->y + rests->span[which].from, count * sizeof *left);
    *columns = take_out(settling, baseline, left, count);
    return left;
}

/* Sum of squares that the terms leave of all spans, and the degrees of freedom left. */
static double squares_left(const rests_t *rests, const settling_t *settling, double *freedom) {
    double sum = 0.0;
    *freedom = 0.0;
    for (size_t i = 0; i < rests->spans; i++) {
        const size_t count = span_length(rests->span[i]);
        size_t columns;
        double *left = left_of(rests, i, settling, BASELINE, &columns);
        for (size_t k = 0; k < count; k++) {
            sum += left[k] * left[k];
        }
        *freedom += (double)count - (double)columns;
        free(left);
    }
    return sum;
}

/* Sum over all spans of the products of values in a window, at means over so many samples. false: too few windows. */
static bool covariance_of(const rests_t *rests, const settling_t *settling, size_t scale, gsl_matrix *c) {
    size_t windows = 0;
    gsl_matrix_set_zero(c);
    for (size_t i = 0; i < rests->spans; i++) {
        const size_t count = span_length(rests->span[i]) / scale;
        size_t columns;
        double *left = left_of(rests, i, settling, 1, &columns);
        for (size_t k = 0; k < count; k++) {
            left[k] = look_mean(left + k * scale, scale);
        }
        for (size_t k = 0; k + WINDOW <= count; k++) {
            for (size_t a = 0; a < WINDOW; a++) {
                for (size_t b = 0; b <= a; b++) {
                    *gsl_matrix_ptr(c, a, b) += left[k + a] * left[k + b];
                }
            }
            windows++;
        }
        free(left);
    }
    return windows >= 2 * WINDOW;
}

/* From the vectors of a space of `order` dimensions, sorted, how it goes on by one step: (I + l l' / (1 - l' l)) U1'
 * U2. U1 and U2 are all rows but the last and the first one, l is the last one. */
static void step_of_space(const gsl_matrix *vectors, size_t order, gsl_matrix *step) {
    double last[MOST_ORDER], size = 0.0;
    gsl_matrix *product = gsl_matrix_calloc(order, order);
    for (size_t i = 0; i < order; i++) {
        last[i] = gsl_matrix_get(vectors, WINDOW - 1, i);
        size += last[i] * last[i];
        for (size_t l = 0; l < order; l++) {
            for (size_t k = 0; k + 1 < WINDOW; k++) {
                *gsl_matrix_ptr(product, i, l) += gsl_matrix_get(vectors, k, i) * gsl_matrix_get(vectors, k + 1, l);
            }
        }
    }
    for (size_t l = 0; l < order; l++) {
        double along = 0.0;
        for (size_t i = 0; i < order; i++) {
            along += last[i] * gsl_matrix_get(product, i, l);
        }
        for (size_t i = 0; i < order; i++) {
            gsl_matrix_set(step, i, l, gsl_matrix_get(product, i, l) + last[i] * along / fmax(1.0 - size, 1e-12));
        }
    }
    gsl_matrix_free(product);
}

/* Dimensions above the noise, which the median of the others is. */
static size_t order_of(const gsl_vector *values) {
    double others[WINDOW - MOST_ORDER];
    size_t order = 0;
    for (size_t i = MOST_ORDER; i < WINDOW; i++) {
        others[i - MOST_ORDER] = gsl_vector_get(values, i);
    }
    const double noise = look_quantile(others, WINDOW - MOST_ORDER, 0.5);
    while (order < MOST_ORDER && gsl_vector_get(values, order) > threshold.settling_stands_out * noise) {
        order++;
    }
    return order;
}

/* Adds what decays, if this scale is the one to see it at. last: there is no coarser one. */
static void add_term(const rests_t *rests, double complex log_z, size_t scale, bool last, settling_t *settling) {
    static const double shortest = 2.0, fastest_of_coarse = 1.0, slowest = 2.0, highest = 3.0;
    const double decay = -creal(log_z), turn = cimag(log_z), size = cabs(log_z);
    const bool rings = turn > 0.0;
    const double decayed = decay / (double)scale * (double)rests->typical;
    if (turn < 0.0 || turn > highest || !(decay > 0.0) || decay > shortest || (scale > 1 && size > fastest_of_coarse) ||
        (!last && size * WINDOW < slowest) ||
        decayed < (rings ? threshold.ring_decays : threshold.exponential_decays) || settling->count == SETTLING_MOST) {
        return;
    }
    settling->term[settling->count++] = (settling_term_t){decay / (double)scale, turn / (double)scale};
}

static void find_at_scale(const rests_t *rests, size_t scale, bool last, settling_t *settling) {
    gsl_matrix *c = gsl_matrix_alloc(WINDOW, WINDOW), *vectors = gsl_matrix_alloc(WINDOW, WINDOW);
    gsl_vector *values = gsl_vector_alloc(WINDOW);
    if (covariance_of(rests, settling, scale, c)) {
        gsl_eigen_symmv_workspace *room = gsl_eigen_symmv_alloc(WINDOW);
        gsl_eigen_symmv(c, values, vectors, room);
        gsl_eigen_symmv_free(room);
        gsl_eigen_symmv_sort(values, vectors, GSL_EIGEN_SORT_VAL_DESC);
        const size_t order = order_of(values);
        if (order > 0) {
            gsl_matrix *step = gsl_matrix_alloc(order, order);
            gsl_vector_complex *z = gsl_vector_complex_alloc(order);
            gsl_eigen_nonsymm_workspace *general = gsl_eigen_nonsymm_alloc(order);
            step_of_space(vectors, order, step);
            if (gsl_eigen_nonsymm(step, z, general) == 0) {
                for (size_t i = 0; i < order; i++) {
                    const gsl_complex root = gsl_vector_complex_get(z, i);
                    add_term(rests, clog(GSL_REAL(root) + (double complex)I * GSL_IMAG(root)), scale, last, settling);
                }
            }
            gsl_eigen_nonsymm_free(general);
            gsl_vector_complex_free(z);
            gsl_matrix_free(step);
        }
    }
    gsl_vector_free(values);
    gsl_matrix_free(vectors);
    gsl_matrix_free(c);
}

static settling_t without(const settling_t *settling, size_t which) {
    settling_t fewer = *settling;
    fewer.count--;
    memmove(fewer.term + which, fewer.term + which + 1, (fewer.count - which) * sizeof *fewer.term);
    return fewer;
}

/* Leaves out, one after the other, the term that explains least, while that is no more than chance explains. */
static void keep_worthy(const rests_t *rests, settling_t *settling) {
    bool left_out = true;
    while (left_out && settling->count > 0) {
        double freedom, least = HUGE_VAL;
        const double all = squares_left(rests, settling, &freedom);
        size_t worst = 0;
        for (size_t i = 0; i < settling->count; i++) {
            double more;
            const settling_t fewer = without(settling, i);
            const double worth = (squares_left(rests, &fewer, &more) - all) / (more - freedom);
            worst = worth < least ? i : worst;
            least = fmin(least, worth);
        }
        left_out = freedom > 0.0 && least < threshold.settling_worth * all / freedom;
        if (left_out) {
            *settling = without(settling, worst);
        }
    }
}

void settling_find(const double *y, const look_span_t *span, size_t spans, settling_t *settling) {
    size_t samples = 0, longest = 0;
    look_span_t *used = allocate(spans, sizeof *used);
    double *lengths = allocate(spans, sizeof *lengths);
    rests_t rests = {y, used, 0, 0};
    memset(settling, 0, sizeof *settling);
    for (size_t i = 0; i < spans && samples < MOST_SAMPLES; i++) {
        used[rests.spans] = span[i];
        if (span_length(span[i]) > MOST_SAMPLES) {
            used[rests.spans].to = span[i].from + MOST_SAMPLES;
        }
        const size_t length = span_length(used[rests.spans]);
        lengths[rests.spans++] = (double)length;
        longest = length > longest ? length : longest;
        samples += length;
    }
    if (rests.spans > 0) {
        rests.typical = (size_t)look_quantile(lengths, rests.spans, 0.5);
    }
    for (size_t scale = 1; longest >= LEAST_WINDOWS * WINDOW * scale; scale *= COARSER) {
        find_at_scale(&rests, scale, longest < LEAST_WINDOWS * WINDOW * scale * COARSER, settling);
        keep_worthy(&rests, settling);
    }
    free(used);
    free(lengths);
}
