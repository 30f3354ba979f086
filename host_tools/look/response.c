/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/response.h"
#include "numerics/reversals.h"
#include "thresholds/thresholds.h"
#include <complex.h>
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

enum { HALF_WIDTH = 8, ORDER = 3, UNKNOWNS = 2 * ORDER, LINES = 2 * HALF_WIDTH + 1, MIDDLE = HALF_WIDTH / 4 };
enum { POINTS = 48, MOST_LINES = 4096, LEAST_SAMPLES = 64, LEAST_TURNS = 3, FEW_WAYS = 8 };
static const double highest_part_of_nyquist = 0.98;
/* Of that power, what the middle quarter of a window has; an even spectrum has 0.29. Where all is at an edge, parabolas
 * guess what is in the middle. */
static const double least_in_the_middle = 0.05;

static const double complex j = (double complex)I; /* I alone is single precision */

static double complex at_line(const double *spectrum, size_t h) {
    return spectrum[2 * h] + j * spectrum[2 * h + 1];
}

static void set_point(response_point_t *point, double f, double complex gain, double variance, double coherence) {
    const double size = cabs(gain);
    point->frequency_hz = f;
    point->gain_um_per_v = size;
    point->gain_sigma = sqrt(0.5 * variance);
    point->phase_rad = carg(gain);
    point->phase_sigma = size > 0.0 ? fmin(M_PI, sqrt(0.5 * variance) / size) : M_PI;
    point->coherence = coherence;
    point->lag_s = -point->phase_rad / (2.0 * M_PI * f);
}

/* Drive and position at the lines of a window, around line `middle` of it; r is -1 .. 1 at half its width. */
typedef struct {
    double complex drive[LINES], position[LINES];
    double r[LINES];
    size_t middle;
} window_t;

static void window_cut(const double *u, const double *y, size_t line, window_t *window) {
    const size_t first = line > HALF_WIDTH ? line - HALF_WIDTH : 1;
    window->middle = line - first;
    for (size_t l = 0; l < LINES; l++) {
        window->drive[l] = at_line(u, first + l);
        window->position[l] = at_line(y, first + l);
        window->r[l] = ((double)l - (double)window->middle) / HALF_WIDTH;
    }
}

/* Columns of a fit, each of length 1 and orthogonal to those before it. */
typedef struct {
    double complex column[UNKNOWNS][LINES];
    size_t count;
} basis_t;

static double power_of(const double complex value[LINES]) {
    double sum = 0.0;
    for (size_t l = 0; l < LINES; l++) {
        sum += creal(value[l]) * creal(value[l]) + cimag(value[l]) * cimag(value[l]);
    }
    return sum;
}

static double complex product(const double complex a[LINES], const double complex b[LINES]) {
    double complex sum = 0.0;
    for (size_t l = 0; l < LINES; l++) {
        sum += conj(a[l]) * b[l];
    }
    return sum;
}

/* Takes out of `value` what the columns explain. Returns the part of its power that is left. */
static double basis_leave(const basis_t *basis, double complex value[LINES]) {
    const double all = power_of(value);
    for (size_t i = 0; i < 2 * basis->count; i++) { /* twice, for the rounding of the first time */
        const double complex *column = basis->column[i % basis->count];
        const double complex some = product(column, value);
        for (size_t l = 0; l < LINES; l++) {
            value[l] -= some * column[l];
        }
    }
    return all > 0.0 ? power_of(value) / all : 0.0;
}

/* Adds weight r^power, or nothing if those before make it up. Returns the part of its power that they leave. */
static double basis_add(basis_t *basis, const window_t *window, const double complex *weight, size_t power) {
    static const double rounding = 1e-20;
    double complex *column = basis->column[basis->count];
    for (size_t l = 0; l < LINES; l++) {
        column[l] = (weight == NULL ? 1.0 : weight[l]) * gsl_pow_uint(window->r[l], (unsigned)power);
    }
    const double part = basis_leave(basis, column), size = sqrt(power_of(column));
    if (!(part > rounding)) {
        return 0.0;
    }
    for (size_t l = 0; l < LINES; l++) {
        column[l] /= size;
    }
    basis->count++;
    return part;
}

static void basis_of_leakage(const window_t *window, basis_t *basis) {
    basis->count = 0;
    for (size_t p = 0; p < ORDER; p++) {
        basis_add(basis, window, NULL, p);
    }
}

/* How many coefficients of the response the leakage leaves room for: a drive as smooth as leakage has some that are
 * leakage as well. 0: it is nothing else. */
static size_t separable(const window_t *window) {
    basis_t basis;
    basis_of_leakage(window, &basis);
    for (size_t p = 0; p < ORDER; p++) {
        const double least = p == 0 ? threshold.least_drive * (LINES - ORDER) / LINES : threshold.least_bend;
        if (!(basis_add(&basis, window, window->drive, p) > least)) {
            return p;
        }
    }
    return ORDER;
}

typedef struct {
    double complex gain;
    double variance; /* of real and imaginary part together */
    double noise;    /* power a line, that is left */
    bool in_middle;  /* a slope or bend of the response changes it as if it came from the middle quarter */
} local_t;

/* Whether r and r^2 of what a gain comes from, by a column, are those of the middle quarter. */
static bool comes_from_middle(const window_t *window, const double complex *column, double size) {
    double complex value[LINES];
    bool middle = true;
    memcpy(value, window->drive, sizeof value);
    for (unsigned power = 1; power < ORDER; power++) {
        for (size_t l = 0; l < LINES; l++) {
            value[l] *= window->r[l];
        }
        middle = middle && cabs(product(column, value)) <= gsl_pow_uint((double)MIDDLE / HALF_WIDTH, power) * size;
    }
    return middle;
}

/* The response in the middle, as the first of `order` coefficients. It comes last, so that its column alone says it.
 * What is left is taken as white, unless the lines of the drive disagree: distortion is where the drive is. A line that
 * the gain hangs on has little left whatever is wrong with it. So each is compared with what white noise would leave
 * of it. If it has more, the error is how far the gain moves without this line, in the measure of the other one. false:
 * without one of the lines, nothing says the gain. */
static bool local_gain(const window_t *window, size_t order, local_t *fit) {
    static const double least_freedom = 1e-9;
    double complex left[LINES];
    double moved = 0.0;
    basis_t basis;
    basis_of_leakage(window, &basis);
    for (size_t p = order - 1; p > 0; p--) {
        basis_add(&basis, window, window->drive, p);
    }
    const size_t others = basis.count;
    if (!(basis_add(&basis, window, window->drive, 0) > 0.0)) {
        return false;
    }
    const double complex *column = basis.column[others];
    const double size = cabs(product(column, window->drive)), freedom = (double)(LINES - basis.count);
    fit->gain = product(column, window->position) / size;
    fit->in_middle = comes_from_middle(window, column, size);
    memcpy(left, window->position, sizeof left);
    basis_leave(&basis, left);
    const double all = power_of(left);
    fit->noise = all / freedom;
    for (size_t l = 0; l < LINES; l++) {
        double own = 1.0;
        for (size_t i = 0; i < basis.count; i++) {
            own -= pow(cabs(basis.column[i][l]), 2.0);
        }
        if (own < least_freedom) {
            return false;
        }
        const double some = fmin(all, pow(cabs(left[l]), 2.0) / own);
        if (some > 0.0 && pow(1.0 - some / all, freedom - 1.0) < threshold.lines_disagree) {
            moved += pow(cabs(column[l] * left[l]) / own, 2.0);
        }
    }
    fit->variance = fmax(fit->noise, moved * freedom / LINES) / (size * size);
    return true;
}

/* Whether the drive has most of the window in the middle, among so many lines to either side. */
static bool is_strongest(const window_t *window, size_t reach) {
    for (size_t l = 0; l < LINES; l++) {
        if (l + reach >= window->middle && l <= window->middle + reach &&
            cabs(window->drive[l]) > cabs(window->drive[window->middle])) {
            return false;
        }
    }
    return true;
}

/* Local polynomials around a line. false: the drive has no power there, or leakage looks the same. */
static bool local_fit(const double *u, const double *y, size_t line, double step_hz, response_point_t *point) {
    double complex drive[LINES];
    double around = 0.0, at = 0.0;
    window_t window;
    basis_t leakage;
    local_t fit, full;
    window_cut(u, y, line, &window);
    const size_t order = separable(&window);
    const bool bent = order == ORDER;
    if (order == 0 || (order == 1 && !is_strongest(&window, MIDDLE)) || !local_gain(&window, order, &fit)) {
        return false;
    }
    memcpy(drive, window.drive, sizeof drive);
    basis_of_leakage(&window, &leakage);
    basis_leave(&leakage, drive);
    const double power = power_of(drive) / (LINES - ORDER);
    for (size_t l = 0; l < LINES; l++) {
        if (l + MIDDLE >= window.middle && l <= window.middle + MIDDLE) {
            const double some = pow(cabs(drive[l]), 2.0);
            around += some;
            at += some * ((double)l - (double)window.middle);
        }
    }
    if (!(around >= least_in_the_middle * LINES * power)) {
        return false;
    }
    /* What looks like leakage may be there all the same. A tone's gain is its own line's and does not hang on it; that
     * of a drive as smooth as leakage, as the end of a sweep is, does. */
    const bool tone = is_strongest(&window, LINES) && fit.in_middle;
    if (!bent && !tone) {
        if (!local_gain(&window, ORDER, &full)) {
            return false;
        }
        fit.variance += pow(cabs(full.gain - fit.gain), 2.0);
    }
    const double explained = cabs(fit.gain) * cabs(fit.gain) * power;
    set_point(point, ((double)line + (order == 1 && tone ? at / around : 0.0)) * step_hz, fit.gain, fit.variance,
              explained + fit.noise > 0.0 ? explained / (explained + fit.noise) : 0.0);
    return true;
}

/* The square of gain over error that noise exceeds, at any of `points` points, with the chance false_response: of two
 * normal numbers, with an error from LINES - UNKNOWNS lines, it is distributed like 2 F(2, freedom). */
static double least_square_of_response(size_t points) {
    const double half_freedom = LINES - UNKNOWNS;
    return 2.0 * half_freedom * (pow(threshold.false_response / (double)points, -1.0 / half_freedom) - 1.0);
}

/* Keeps what was measured: where a gain is seen at all, or would be if it were the one that is known best. Above the
 * band of a smooth drive, neither holds: what it has there is rounding. */
static void keep_measured(response_t *response) {
    const response_point_t *best = response->point;
    size_t kept = 0;
    if (response->count == 0) {
        return;
    }
    const double least = least_square_of_response(response->count);
    for (size_t i = 0; i < response->count; i++) {
        const response_point_t *p = &response->point[i];
        if (p->gain_sigma * best->gain_um_per_v < best->gain_sigma * p->gain_um_per_v) {
            best = p;
        }
    }
    const double known = best->gain_um_per_v;
    for (size_t i = 0; i < response->count; i++) {
        const response_point_t p = response->point[i];
        const double seen = fmax(p.gain_um_per_v, known);
        if (seen * seen >= least * p.gain_sigma * p.gain_sigma) {
            response->point[kept++] = p;
        }
    }
    response->count = kept;
}

/* The line from `low` to `high` at which the drive has most. */
static size_t strongest_line(const double *u, double low, double high) {
    size_t best = (size_t)(low + 0.5);
    for (size_t h = best; (double)h <= high; h++) {
        best = cabs(at_line(u, h)) > cabs(at_line(u, best)) ? h : best;
    }
    return best;
}

/* Whether a drive is one frequency of any amplitudes, with nearly all of its power in one window. The turns of a sine
 * that fades come a little early, each by another part of a way, so that it may be a sweep by its kind. */
static bool has_one_tone(const drive_look_t *drive, double tone_hz, double step_hz) {
    return (drive->kind == DRIVE_SINE || drive->kind == DRIVE_SWELLING || drive->kind == DRIVE_SWEEP) &&
           drive->frequency_hz[0] > tone_hz - HALF_WIDTH * step_hz &&
           drive->frequency_hz[1] < tone_hz + HALF_WIDTH * step_hz;
}

static void by_local_polynomials(const recording_t *recording, const drive_look_t *drive, response_t *response) {
    const size_t length = look_smooth_length(recording->samples), lines = length / 2;
    const double step_hz = recording->sample_rate_hz / (double)length;
    double *u = allocate(length + 2, sizeof *u), *y = allocate(length + 2, sizeof *y);
    size_t last = 0;
    look_transform(recording->column[COLUMN_DRIVE], length, u);
    look_transform(recording->column[COLUMN_DISPLACEMENT], length, y);
    const double low = HALF_WIDTH + 1, high = highest_part_of_nyquist * (double)lines - HALF_WIDTH - 1;
    const double half_way = sqrt(pow(high / low, 1.0 / (POINTS - 1)));
    const size_t points = high > 2.0 * low ? POINTS : 0;
    /* Of a tone, only its strongest line counts. Of other drives, one below those with a whole window may be a point:
     * where the drive has most. */
    const size_t tone = strongest_line(u, 1.0, fmax(low, high)), lowest = strongest_line(u, 1.0, 2 * HALF_WIDTH);
    const bool one_tone = has_one_tone(drive, (double)tone * step_hz, step_hz);
    const size_t first = one_tone ? tone : lowest;
    if (points > 0 && (one_tone || (lowest >= LEAST_TURNS && lowest <= HALF_WIDTH))) {
        response->count += local_fit(u, y, first, step_hz, &response->point[response->count]) ? 1 : 0;
        last = first;
    }
    for (size_t i = 0; i < points && !one_tone; i++) {
        const double f = low * pow(high / low, (double)i / (POINTS - 1));
        const size_t middle = strongest_line(u, fmax(low, f / half_way), fmin(high, f * half_way));
        if (middle > last && local_fit(u, y, middle, step_hz, &response->point[response->count])) {
            response->count++;
        }
        last = middle > last ? middle : last;
    }
    keep_measured(response);
    free(u);
    free(y);
}

/* Transform of one pass at one line of the period. */
static double complex pass_line(const double *value, double from, double period, size_t line) {
    const size_t first = (size_t)ceil(from - 1e-9), end = (size_t)ceil(from + period - 1e-9);
    const double turn = -2.0 * M_PI * (double)line / period;
    const double complex step = cexp(j * turn);
    double complex phase = cexp(j * (turn * ((double)first - from))), sum = 0.0;
    double mean = 0.0;
    for (size_t k = first; k < end; k++) {
        mean += value[k] / (double)(end - first);
    }
    for (size_t k = first; k < end; k++) {
        sum += (value[k] - mean) * phase;
        phase *= step;
    }
    return sum;
}

/* Sums over the lines that share a point. */
typedef struct {
    double complex product;           /* sum conj(U) Y over lines, of the mean over passes */
    double drive, position, noise, f; /* sums of |U|^2, |Y|^2, |Y - G U|^2 of passes, f |U|^2 */
    size_t lines;
} band_t;

static void add_line(const recording_t *recording, const drive_look_t *drive, size_t line, size_t passes,
                     band_t *band) {
    const double *u = recording->column[COLUMN_DRIVE], *y = recording->column[COLUMN_DISPLACEMENT];
    const size_t skipped = drive_unsettled_passes(drive);
    double complex mean_u = 0.0, mean_y = 0.0;
    double scatter = 0.0;
    double complex *each = allocate(passes, sizeof *each);
    for (size_t p = 0; p < passes; p++) {
        const double from = (double)drive->repeat.from + (double)(skipped + p) * drive->period;
        mean_u += pass_line(u, from, drive->period, line) / (double)passes;
        each[p] = pass_line(y, from, drive->period, line);
        mean_y += each[p] / (double)passes;
    }
    for (size_t p = 0; p < passes; p++) {
        scatter += cabs(each[p] - mean_y) * cabs(each[p] - mean_y);
    }
    const double power = cabs(mean_u) * cabs(mean_u);
    band->product += conj(mean_u) * mean_y;
    band->drive += power;
    band->position += cabs(mean_y) * cabs(mean_y);
    band->noise += scatter / (double)(passes - 1) / (double)passes;
    band->f += power * (double)line * recording->sample_rate_hz / drive->period;
    band->lines++;
    free(each);
}

static void by_periods(const recording_t *recording, const drive_look_t *drive, response_t *response) {
    const double period = drive->period;
    const size_t most = (size_t)fmin(MOST_LINES, highest_part_of_nyquist * 0.5 * period);
    const size_t passes = drive_periods(drive) - drive_unsettled_passes(drive), used = passes < 64 ? passes : 64;
    const bool tone = drive->harmonics < threshold.one_tone;
    double *power = allocate(most + 1, sizeof *power), largest = 0.0;
    size_t strongest = 1;
    band_t band = {0};
    if (most > 0 && !tone) { /* all lines at once, from samples of the first pass */
        const size_t length = look_smooth_length((size_t)period);
        double *spectrum = allocate(length + 2, sizeof *spectrum);
        look_transform(recording->column[COLUMN_DRIVE] + drive->repeat.from, length, spectrum);
        for (size_t line = 1; line <= most && 2 * line < length; line++) {
            power[line] = pow(cabs(at_line(spectrum, line)), 2.0);
        }
        free(spectrum);
    }
    for (size_t line = 1; line <= most; line++) {
        if (tone) {
            power[line] =
                line <= 8
                    ? pow(cabs(pass_line(recording->column[COLUMN_DRIVE], (double)drive->repeat.from, period, line)),
                          2.0)
                    : 0.0;
        }
        strongest = power[line] > largest ? line : strongest;
        largest = fmax(largest, power[line]);
    }
    for (size_t line = 1; line <= most && largest > 0.0; line++) {
        const bool counts = tone ? line == strongest : power[line] > threshold.least_line * largest;
        if (counts) {
            add_line(recording, drive, line, used, &band);
        }
        /* Lines up to a fifth of an octave share a point, and all of a band until it has some of the drive. */
        const double next = floor(log2((double)(line + 1)) * 5.0), here = floor(log2((double)line) * 5.0);
        if (band.lines > 0 && (next > here || line == most) && response->count < POINTS) {
            const double complex gain = band.product / band.drive;
            const double left = fmax(0.0, band.position - cabs(gain) * cabs(gain) * band.drive);
            const double variance =
                fmax(band.noise, band.lines > 1 ? left / (double)(band.lines - 1) * (double)band.lines : 0.0) /
                band.drive / (double)band.lines;
            set_point(&response->point[response->count++], band.f / band.drive, gain, variance,
                      band.position > 0.0 ? fmax(0.0, 1.0 - fmax(left, band.noise) / band.position) : 0.0);
            band = (band_t){0};
        }
    }
    free(power);
}

/* How far beyond the last point a sweep goes, and for how long: by the ways between its turns. */
static void see_end_of_sweep(const recording_t *recording, const drive_look_t *drive, response_t *response) {
    const double range_v = drive->range_v[1] - drive->range_v[0];
    const double last_hz = response->count > 0 ? response->point[response->count - 1].frequency_hz : 0.0;
    double ways = 0.0, samples = 0.0, shortest = HUGE_VAL;
    reversals_t turns;
    reversals_find(recording->column[COLUMN_DRIVE], recording->samples, threshold.reversal * range_v, &turns);
    for (size_t i = FEW_WAYS; i < turns.count; i++) { /* a few ways: one alone is whole samples */
        const double way = (double)(turns.at[i] - turns.at[i - FEW_WAYS]) / FEW_WAYS;
        shortest = fmin(shortest, way);
        if (recording->sample_rate_hz > 2.0 * way * last_hz) {
            samples += way;
            ways += 1.0;
        }
    }
    if (ways >= FEW_WAYS && recording->sample_rate_hz > 2.0 * shortest * last_hz * threshold.ends_below) {
        response->goes_on_to_hz = recording->sample_rate_hz / (2.0 * shortest);
        response->goes_on_s = samples / recording->sample_rate_hz;
    }
    reversals_free(&turns);
}

void response_look(const recording_t *recording, const drive_look_t *drive, response_t *response) {
    memset(response, 0, sizeof *response);
    if (recording->samples < LEAST_SAMPLES || drive->kind == DRIVE_RESTS) {
        return;
    }
    response->point = allocate(POINTS + 1, sizeof *response->point);
    response->periodic = drive_periods(drive) >= 2 &&
                         (double)span_length(drive->repeat) > threshold.most_of_recording * (double)recording->samples;
    if (response->periodic) {
        by_periods(recording, drive, response);
    } else {
        by_local_polynomials(recording, drive, response);
        if (drive->kind == DRIVE_SWEEP && response->count > 1) {
            see_end_of_sweep(recording, drive, response);
        }
    }
}

void response_free(response_t *response) {
    free(response->point);
    memset(response, 0, sizeof *response);
}

const response_point_t *response_lowest(const response_t *response, double coherence) {
    for (size_t i = 0; i < response->count; i++) {
        if (response->point[i].coherence >= coherence) {
            return &response->point[i];
        }
    }
    return NULL;
}

const response_point_t *response_peak(const response_t *response) {
    const response_point_t *lowest = response_lowest(response, threshold.coherent_enough), *peak = NULL;
    for (size_t i = 1; lowest != NULL && i < response->count; i++) {
        const response_point_t *p = &response->point[i];
        if (p->coherence >= threshold.coherent_enough &&
            p->gain_um_per_v > threshold.peak_stands_out * lowest->gain_um_per_v &&
            p->gain_um_per_v > lowest->gain_um_per_v + threshold.peak_errors * (p->gain_sigma + lowest->gain_sigma) &&
            (peak == NULL || p->gain_um_per_v > peak->gain_um_per_v)) {
            peak = p;
        }
    }
    return peak;
}
