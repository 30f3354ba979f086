/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/path/lags.h"
#include "numerics/autocorrelation.h"
#include "numerics/column_factor.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    LEAST_WINDOWS = 48,
    MOST_WINDOWS = 1024,
    LEAST_SAMPLES = 8,
    SLOW_PIECES = 24,
    PHASES = 16,
    WINDOWS_PER_TOOTH = 8,
    NUISANCES = 2
};
static const double first_teeth = 1.5;     /* in the duration; */
static const double rates_per_tooth = 4.0; /* steps of the rate in it: a quarter of a tooth more or less */

/* Offset, gain and lag of the error in pieces; offset and gain are taken out, along straight lines between the pieces'
 * middles, so that no course of the lag loses its edges. */
static double *without_slow(const reference_t *r) {
    const size_t n = span_length(r->span), pieces = SLOW_PIECES;
    const double *e = r->error + r->span.from, *p = r->expected + r->span.from, *s = r->slope + r->span.from;
    double *rest = allocate(n, sizeof *rest), *ones = allocate(n, sizeof *ones),
           *centred = allocate(n, sizeof *centred);
    double *offset = allocate(pieces, sizeof *offset), *gain = allocate(pieces, sizeof *gain), mean = look_mean(p, n);
    for (size_t k = 0; k < n; k++) {
        ones[k] = 1.0;
        centred[k] = p[k] - mean;
    }
    for (size_t i = 0; i < pieces; i++) {
        const size_t from = i * n / pieces, to = (i + 1) * n / pieces;
        const double *const columns[] = {ones + from, centred + from, s + from};
        look_regression_t fit = {0};
        look_regress(columns, 3, e + from, NULL, to - from, &fit);
        offset[i] = fit.coefficient[0];
        gain[i] = fit.coefficient[1];
    }
    for (size_t k = 0; k < n; k++) {
        const double at = fmax(0.0, fmin((double)pieces - 1.0, ((double)k + 0.5) * (double)pieces / (double)n - 0.5));
        const size_t i = (size_t)fmin(floor(at), (double)pieces - 2.0);
        const double x = at - (double)i;
        rest[k] =
            e[k] - (1.0 - x) * (offset[i] + gain[i] * centred[k]) - x * (offset[i + 1] + gain[i + 1] * centred[k]);
    }
    free(ones);
    free(centred);
    free(offset);
    free(gain);
    return rest;
}

/* Which pass each window belongs to, or quarter of a pass where passes are few; without passes each window is one. */
static void make_batches(const drive_look_t *drive, const reference_t *r, lags_t *lags) {
    const double parts = (double)drive_periods(drive) < threshold.few_passes ? 4.0 : 1.0;
    lags->batch = allocate(lags->count, sizeof *lags->batch);
    for (size_t j = 0; j < lags->count; j++) {
        const double middle = 0.5 * (double)(lags->from[j] + lags->from[j + 1]) - (double)r->span.from;
        lags->batch[j] = r->repeated ? (size_t)(parts * middle / drive->period) : j;
        lags->batches = lags->batch[j] + 1;
    }
}

void lags_make(const recording_t *recording, const drive_look_t *drive, const reference_t *r, lags_t *lags) {
    const size_t n = span_length(r->span);
    memset(lags, 0, sizeof *lags);
    _Static_assert(LEAST_WINDOWS * LEAST_SAMPLES >= SLOW_PIECES * 16, "enough samples for the slow part, too");
    if (n < LEAST_WINDOWS * LEAST_SAMPLES) {
        return;
    }
    const size_t count = n / LEAST_SAMPLES < MOST_WINDOWS ? n / LEAST_SAMPLES : MOST_WINDOWS;
    double *rest = without_slow(r);
    const double limit = threshold.beyond_chance * look_robust_deviation(rest, n);
    lags->at_s = allocate(count, sizeof *lags->at_s);
    lags->product = allocate(count, sizeof *lags->product);
    lags->square = allocate(count, sizeof *lags->square);
    lags->from = allocate(count + 1, sizeof *lags->from);
    for (size_t j = 0; j < count; j++) {
        const size_t from = j * n / count, to = (j + 1) * n / count;
        lags->from[j] = r->span.from + from;
        lags->from[j + 1] = r->span.from + to;
        lags->at_s[j] = (double)(r->span.from + from) / recording->sample_rate_hz;
        for (size_t k = from; k < to; k++) {
            const double slope = r->slope[r->span.from + k];
            if (fabs(rest[k]) <= limit) { /* a single wrong reading says nothing about time */
                lags->product[j] -= rest[k] * slope;
                lags->square[j] += slope * slope;
            }
        }
    }
    lags->count = count;
    make_batches(drive, r, lags);
    free(rest);
}

void lags_free(lags_t *lags) {
    free(lags->at_s);
    free(lags->product);
    free(lags->square);
    free(lags->from);
    free(lags->batch);
    memset(lags, 0, sizeof *lags);
}

/* Windows without motion have no say. */
static double root_square(const lags_t *lags, size_t j) {
    return sqrt(lags->square[j]);
}

/* Standard error of the size of one course: what the residuals of whole batches do to it. alone: the course less what
 * the others make of it, times sqrt(B); residual: in the same units. */
static double error_of_course(const lags_t *lags, const double *alone, const double *residual, size_t unknowns) {
    double *moment = allocate(lags->batches, sizeof *moment), *mean = allocate(lags->batches, sizeof *mean);
    double *weight = allocate(lags->batches, sizeof *weight), square = 0.0, scatter = 0.0;
    for (size_t j = 0; j < lags->count; j++) {
        const double b = root_square(lags, j);
        moment[lags->batch[j]] += alone[j] * residual[j];
        mean[lags->batch[j]] += b * residual[j];
        weight[lags->batch[j]] += b * b;
        square += alone[j] * alone[j];
    }
    for (size_t i = 0; i < lags->batches; i++) {
        scatter += moment[i] * moment[i];
        mean[i] = weight[i] > 0.0 ? mean[i] / sqrt(weight[i]) : 0.0;
    }
    const residual_run_t run = {mean, lags->batches};
    const double freedom = fmax(1.0, (double)lags->batches - (double)unknowns);
    scatter *= autocorrelation_time(&run, 1) * (double)lags->batches / freedom;
    free(moment);
    free(mean);
    free(weight);
    return square > 0.0 ? sqrt(scatter) / square : HUGE_VAL;
}

/* A lag that changes slowly, as creep and warming make it: a straight line in time and one in its logarithm. */
static double *make_nuisances(const lags_t *lags) {
    double *slow = allocate(NUISANCES * lags->count, sizeof *slow);
    for (size_t j = 0; j < lags->count; j++) {
        const double x = (lags->at_s[j] - lags->at_s[0]) / (lags->at_s[lags->count - 1] - lags->at_s[0]);
        slow[j] = log1p(100.0 * x);
        slow[lags->count + j] = x;
    }
    return slow;
}

/* Fits a constant, the slow nuisances (the first `slow` of them) and the courses: weighted least squares of A / B.
 * Returns the sum of squares that is left. */
static double fit_courses(const lags_t *lags, size_t slow, const double *const *given, size_t courses, double *size,
                          double *sigma) {
    double *nuisance = make_nuisances(lags);
    const double *course[LAGS_MOST_STEPS + NUISANCES];
    const size_t wanted = courses;
    for (size_t c = 0; c < courses; c++) {
        course[c] = given[c];
    }
    for (size_t i = 0; i < slow; i++) {
        course[courses++] = nuisance + i * lags->count;
    }
    const size_t n = lags->count;
    double *columns = allocate((courses + 1) * n, sizeof *columns), *value = allocate(n, sizeof *value);
    const double *column[LAGS_MOST_STEPS + NUISANCES + 1];
    look_regression_t fit = {0};
    double chi = 0.0;
    for (size_t j = 0; j < n; j++) {
        const double b = root_square(lags, j);
        columns[j] = b;
        for (size_t c = 0; c < courses; c++) {
            columns[(c + 1) * n + j] = b * course[c][j];
        }
        value[j] = b > 0.0 ? lags->product[j] / b : 0.0;
    }
    for (size_t c = 0; c <= courses; c++) {
        column[c] = columns + c * n;
    }
    look_regress(column, courses + 1, value, NULL, n, &fit);
    columns_add(column, courses + 1, fit.coefficient, -1.0, n, value);
    for (size_t j = 0; j < n; j++) {
        chi += value[j] * value[j];
    }
    for (size_t c = 0; c < wanted; c++) {
        const double *other[LAGS_MOST_STEPS + NUISANCES + 1];
        size_t others = 0;
        look_regression_t by_others = {0};
        double *alone = allocate(n, sizeof *alone);
        for (size_t i = 0; i <= courses; i++) {
            if (i != c + 1) {
                other[others++] = column[i];
            }
        }
        look_regress(other, others, column[c + 1], NULL, n, &by_others);
        memcpy(alone, column[c + 1], n * sizeof *alone);
        columns_add(other, others, by_others.coefficient, -1.0, n, alone);
        size[c] = fit.coefficient[c + 1];
        sigma[c] = error_of_course(lags, alone, value, courses + 1);
        free(alone);
    }
    free(columns);
    free(value);
    free(nuisance);
    return chi;
}

/* log10 of the chance of a size of t standard errors: Student's, with the batches less the unknowns. */
static double chance_of(const lags_t *lags, double t, size_t unknowns, double places) {
    return look_log_chance_student(t, fmax(1.0, (double)lags->batches - (double)unknowns), places);
}

/* Sum of squares that a course takes away, beside a constant, of what is left. */
static double taken_by(const lags_t *lags, const double *product, const double *course) {
    double b = 0.0, bl = 0.0, bll = 0.0, a = 0.0, al = 0.0;
    for (size_t j = 0; j < lags->count; j++) {
        b += lags->square[j];
        bl += lags->square[j] * course[j];
        bll += lags->square[j] * course[j] * course[j];
        a += product[j];
        al += product[j] * course[j];
    }
    const double square = bll - bl * bl / b, moment = al - a * bl / b;
    return square > 1e-12 * bll ? moment * moment / square : 0.0;
}

static void fill_step(double *course, size_t count, size_t at) {
    for (size_t j = 0; j < count; j++) {
        course[j] = j >= at ? 1.0 : 0.0;
    }
}

/* What is left of A beside fitted courses. */
static void left_of(const lags_t *lags, const double *const *course, const double *size, size_t courses,
                    double *product) {
    for (size_t j = 0; j < lags->count; j++) {
        product[j] = lags->product[j];
        for (size_t c = 0; c < courses; c++) {
            product[j] -= lags->square[j] * size[c] * course[c][j];
        }
    }
}

/* The window at which one more step takes most away. */
static size_t best_step(const lags_t *lags, const double *product) {
    double b = 0.0, a = 0.0, before_b = 0.0, before_a = 0.0, most = 0.0;
    size_t best = 0;
    for (size_t j = 0; j < lags->count; j++) {
        b += lags->square[j];
        a += product[j];
    }
    for (size_t j = 0; j + 1 < lags->count; j++) {
        before_b += lags->square[j];
        before_a += product[j];
        const double least = threshold.motion_beside_step * b;
        if (before_b > least && b - before_b > least) {
            const double moment = before_a - a * before_b / b, square = before_b * (b - before_b) / b;
            if (moment * moment / square > most) {
                most = moment * moment / square;
                best = j + 1;
            }
        }
    }
    return best;
}

void lags_steps(const lags_t *lags, double log_chance_limit, lag_steps_t *steps) {
    const size_t n = lags->count;
    double *room = allocate((LAGS_MOST_STEPS + 1) * n, sizeof *room), *product = room + LAGS_MOST_STEPS * n;
    const double *course[LAGS_MOST_STEPS];
    memset(steps, 0, sizeof *steps);
    for (size_t i = 0; n > 0 && i < LAGS_MOST_STEPS; i++) {
        lag_steps_t more = *steps;
        left_of(lags, course, steps->size, i, product);
        more.at[i] = best_step(lags, product);
        more.steps = i + 1;
        course[i] = room + i * n;
        if (more.at[i] == 0) {
            break;
        }
        fill_step(room + i * n, n, more.at[i]);
        more.left = fit_courses(lags, NUISANCES, course, i + 1, more.size, more.sigma);
        more.log_chance = -HUGE_VAL;
        for (size_t s = 0; s <= i; s++) {
            const double t = more.size[s] / more.sigma[s];
            more.log_chance = fmax(more.log_chance, chance_of(lags, t, i + 2 + NUISANCES, (double)n));
        }
        if (!(more.log_chance < log_chance_limit)) {
            break;
        }
        *steps = more;
    }
    free(room);
}

static void fill_saw(const lags_t *lags, double rate, double phase, double *course) {
    for (size_t j = 0; j < lags->count; j++) {
        const double x = rate * lags->at_s[j] + phase;
        course[j] = x - round(x);
    }
}

static void judge(const lags_t *lags, size_t slow, const double *course, double places, lag_course_t *found) {
    const double *const courses[] = {course};
    found->left = fit_courses(lags, slow, courses, 1, &found->size, &found->sigma);
    found->log_chance = found->sigma > 0.0 ? chance_of(lags, found->size / found->sigma, 2 + NUISANCES, places) : 0.0;
}

/* What a saw tooth takes away of the changes of the lag, against what the likeliest sine of about its rate takes. */
static double part_by_wave(const lags_t *lags, const lag_course_t *saw) {
    double *sine = allocate(lags->count, sizeof *sine), *cosine = allocate(lags->count, sizeof *cosine);
    const double *const courses[] = {sine, cosine};
    const double duration = lags->at_s[lags->count - 1] - lags->at_s[0];
    const size_t steps = (size_t)(1.5 * saw->teeth_per_s * duration * rates_per_tooth);
    double size[2], sigma[2], left = HUGE_VAL;
    for (size_t step = 0; step <= steps; step++) {
        const double waves_per_s = 0.5 * saw->teeth_per_s + (double)step / (rates_per_tooth * duration);
        for (size_t j = 0; j < lags->count; j++) {
            const double turn = 2.0 * M_PI * waves_per_s * lags->at_s[j];
            sine[j] = sin(turn);
            cosine[j] = cos(turn);
        }
        left = fmin(left, fit_courses(lags, NUISANCES, courses, 2, size, sigma));
    }
    free(sine);
    free(cosine);
    const double all = fit_courses(lags, NUISANCES, NULL, 0, NULL, NULL);
    return (all - left) / (all - saw->left);
}

void lags_saw(const lags_t *lags, lag_course_t *saw) {
    memset(saw, 0, sizeof *saw);
    if (lags->count < LEAST_WINDOWS) {
        return;
    }
    const double duration = lags->at_s[lags->count - 1] - lags->at_s[0];
    const double most = (double)lags->count / WINDOWS_PER_TOOTH, teeth_step = 1.0 / rates_per_tooth;
    double *course = allocate(lags->count, sizeof *course), best = 0.0;
    for (size_t step = 0; first_teeth + (double)step * teeth_step < most; step++) {
        const double teeth = first_teeth + (double)step * teeth_step;
        for (size_t i = 0; i < PHASES; i++) {
            fill_saw(lags, teeth / duration, (double)i / PHASES, course);
            const double taken = taken_by(lags, lags->product, course);
            if (taken > best) {
                best = taken;
                saw->teeth_per_s = teeth / duration;
                saw->phase = (double)i / PHASES;
            }
        }
    }
    /* Finer, around the best: rate and phase in turn. */
    double step_rate = 0.5 * teeth_step / duration, step_phase = 0.5 / PHASES;
    for (size_t i = 0; i < 24; i++) {
        for (int direction = 0; direction < 4; direction++) {
            const double rate = saw->teeth_per_s + (direction == 0 ? step_rate : direction == 1 ? -step_rate : 0.0);
            /* Turned about the middle of the recording. */
            const double middle = lags->at_s[0] + 0.5 * duration;
            const double phase = saw->phase - (rate - saw->teeth_per_s) * middle +
                                 (direction == 2   ? step_phase
                                  : direction == 3 ? -step_phase
                                                   : 0.0);
            fill_saw(lags, rate, phase, course);
            const double taken = taken_by(lags, lags->product, course);
            if (taken > best) {
                best = taken;
                saw->teeth_per_s = rate;
                saw->phase = phase;
            }
        }
        if (i % 3 == 2) {
            step_rate *= 0.5;
            step_phase *= 0.5;
        }
    }
    fill_saw(lags, saw->teeth_per_s, saw->phase, course);
    judge(lags, NUISANCES, course, 4.0 * most,
          saw); /* two numbers, sine and cosine, of either sign, for each tooth more */
    saw->by_wave = part_by_wave(lags, saw);
    free(course);
}

void lags_ramp(const lags_t *lags, lag_course_t *ramp) {
    memset(ramp, 0, sizeof *ramp);
    if (lags->count >= LEAST_WINDOWS) {
        judge(lags, 1, lags->at_s, 1.0, ramp); /* beside the logarithm alone */
    }
}
