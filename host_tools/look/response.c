/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/response.h"
#include "thresholds/thresholds.h"
#include <complex.h>
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

/* Coefficients of a complex parabola, as real numbers; of leakage and response; rows are real and imaginary parts. */
enum { HALF_WIDTH = 8, ORDER = 3, LEAKAGE = 2 * ORDER, UNKNOWNS = 2 * LEAKAGE, LINES = 2 * HALF_WIDTH + 1 };
enum { ROWS = 2 * LINES, POINTS = 48, MOST_LINES = 4096, LEAST_SAMPLES = 64 };
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

/* What the leakage's columns leave of the drive in the middle quarter of the window. */
static double power_in_the_middle(double columns[UNKNOWNS][ROWS], const double *leakage, const double drive[ROWS]) {
    double sum = 0.0;
    for (size_t row = ROWS / 2 - HALF_WIDTH / 2 - 1; row <= ROWS / 2 + HALF_WIDTH / 2; row++) {
        double left = drive[row];
        for (size_t i = 0; i < LEAKAGE; i++) {
            left -= leakage[i] * columns[i][row];
        }
        sum += left * left;
    }
    return sum;
}

/* Local polynomials around line `middle`. The leakage's columns come first: of a drive that is nothing but leakage
 * there, they leave nothing. false: the drive has no power there. */
static bool local_fit(const double *u, const double *y, size_t middle, double f, response_point_t *point) {
    double columns[UNKNOWNS][ROWS], drive[ROWS], position[ROWS], all = 0.0;
    const double *column[UNKNOWNS];
    look_regression_t leaked, fit;
    for (size_t l = 0; l < LINES; l++) {
        const size_t h = middle + l - HALF_WIDTH;
        const double r = ((double)l - HALF_WIDTH) / HALF_WIDTH;
        double x = 1.0;
        for (size_t p = 0; p < ORDER; p++) {
            const double re = u[2 * h] * x, im = u[2 * h + 1] * x;
            double(*const leakage)[ROWS] = &columns[2 * p], (*const response)[ROWS] = &columns[LEAKAGE + 2 * p];
            leakage[0][2 * l] = x;
            leakage[0][2 * l + 1] = 0.0;
            leakage[1][2 * l] = 0.0;
            leakage[1][2 * l + 1] = x;
            response[0][2 * l] = re;
            response[0][2 * l + 1] = im;
            response[1][2 * l] = -im;
            response[1][2 * l + 1] = re;
            x *= r;
        }
        drive[2 * l] = u[2 * h];
        drive[2 * l + 1] = u[2 * h + 1];
        all += u[2 * h] * u[2 * h] + u[2 * h + 1] * u[2 * h + 1];
        position[2 * l] = y[2 * h];
        position[2 * l + 1] = y[2 * h + 1];
    }
    for (size_t i = 0; i < UNKNOWNS; i++) {
        column[i] = columns[i];
    }
    if (!look_regress(column, LEAKAGE, drive, NULL, ROWS, &leaked) ||
        !look_regress(column, UNKNOWNS, position, NULL, ROWS, &fit) ||
        !(ROWS * leaked.rms * leaked.rms > threshold.least_drive * all)) {
        return false;
    }
    if (!(power_in_the_middle(columns, leaked.coefficient, drive) >=
          least_in_the_middle * ROWS * leaked.rms * leaked.rms)) {
        return false;
    }
    const double complex gain = fit.coefficient[LEAKAGE] + j * fit.coefficient[LEAKAGE + 1];
    const double power = leaked.rms * leaked.rms, noise = fit.rms * fit.rms;
    const double explained = cabs(gain) * cabs(gain) * power;
    set_point(point, f, gain, pow(fit.sigma[LEAKAGE], 2.0) + pow(fit.sigma[LEAKAGE + 1], 2.0),
              explained + noise > 0.0 ? explained / (explained + noise) : 0.0);
    return true;
}

/* The square of gain over error that noise exceeds, at any of `points` points, with the chance false_response: of two
 * normal numbers, with an error from ROWS - UNKNOWNS degrees of freedom, it is distributed like 2 F(2, freedom). */
static double least_square_of_response(size_t points) {
    const double half_freedom = 0.5 * (ROWS - UNKNOWNS);
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

static void by_local_polynomials(const recording_t *recording, response_t *response) {
    const size_t length = look_smooth_length(recording->samples), lines = length / 2;
    const double step_hz = recording->sample_rate_hz / (double)length;
    double *u = allocate(length + 2, sizeof *u), *y = allocate(length + 2, sizeof *y);
    size_t last = 0;
    look_transform(recording->column[COLUMN_DRIVE], length, u);
    look_transform(recording->column[COLUMN_DISPLACEMENT], length, y);
    const double low = HALF_WIDTH + 1, high = highest_part_of_nyquist * (double)lines - HALF_WIDTH - 1;
    const double half_way = sqrt(pow(high / low, 1.0 / (POINTS - 1)));
    for (size_t i = 0; i < POINTS && high > 2.0 * low; i++) {
        const double f = low * pow(high / low, (double)i / (POINTS - 1));
        const size_t middle = strongest_line(u, fmax(low, f / half_way), fmin(high, f * half_way));
        if (middle > last && local_fit(u, y, middle, (double)middle * step_hz, &response->point[response->count])) {
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
    double complex mean_u = 0.0, mean_y = 0.0;
    double scatter = 0.0;
    double complex *each = allocate(passes, sizeof *each);
    for (size_t p = 0; p < passes; p++) {
        const double from = (double)drive->repeat.from + (double)p * drive->period;
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
    const size_t passes = drive_periods(drive), used = passes < 64 ? passes : 64;
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

void response_look(const recording_t *recording, const drive_look_t *drive, response_t *response) {
    memset(response, 0, sizeof *response);
    if (recording->samples < LEAST_SAMPLES || drive->kind == DRIVE_RESTS) {
        return;
    }
    response->point = allocate(POINTS, sizeof *response->point);
    response->periodic = drive_periods(drive) >= 2 &&
                         (double)span_length(drive->repeat) > threshold.most_of_recording * (double)recording->samples;
    if (response->periodic) {
        by_periods(recording, drive, response);
    } else {
        by_local_polynomials(recording, response);
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
