/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/signal/noise.h"
#include "look/signal/resolution.h"
#include "look/signal/settling.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_cdf.h>
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_SAMPLES = 64, MOST_SEGMENT = 4096, TREND = 3, LOWEST_LINES = 3, WHITTLE_STEPS = 30, AROUND = 16 };

/* Several stretches of noise in time order: stretch i is value[begin[i] .. begin[i + 1]). */
typedef struct {
    double *value;
    size_t count, stretches;
    size_t *begin;
    double rounding; /* deviation that the steps of a converter make alone */
} stretches_t;

static void stretches_free(stretches_t *s) {
    free(s->value);
    free(s->begin);
}

static void add_stretch(stretches_t *s, const double *value, size_t count) {
    s->value = reallocate(s->value, s->count + count, sizeof *s->value);
    s->begin = reallocate(s->begin, s->stretches + 2, sizeof *s->begin);
    memcpy(s->value + s->count, value, count * sizeof *value);
    s->begin[s->stretches++] = s->count;
    s->count += count;
    s->begin[s->stretches] = s->count;
}

/* Averaged periodogram under Hann's window, half overlapping, one-sided density. Returns how many were averaged. */
static size_t density_of(const stretches_t *s, size_t length, double rate_hz, double *density) {
    double *piece = allocate(length, sizeof *piece), *spectrum = allocate(length + 2, sizeof *spectrum);
    size_t averaged = 0;
    memset(density, 0, (length / 2 + 1) * sizeof *density);
    for (size_t i = 0; i < s->stretches; i++) {
        for (size_t from = s->begin[i]; from + length <= s->begin[i + 1]; from += length / 2) {
            for (size_t k = 0; k < length; k++) {
                piece[k] = s->value[from + k] * (1.0 - cos(2.0 * M_PI * ((double)k + 0.5) / (double)length));
            }
            look_transform(piece, length, spectrum);
            for (size_t h = 0; h <= length / 2; h++) { /* the window's square sums to 3/2 length */
                density[h] += (spectrum[2 * h] * spectrum[2 * h] + spectrum[2 * h + 1] * spectrum[2 * h + 1]) * 2.0 /
                              (1.5 * (double)length * rate_hz);
            }
            averaged++;
        }
    }
    for (size_t h = 0; averaged > 0 && h <= length / 2; h++) {
        density[h] /= (double)averaged;
    }
    free(piece);
    free(spectrum);
    return averaged;
}

/* w + a / f at a line of a spectrum, one-sided. */
typedef struct {
    double white, slow, step_hz;
} shares_t;

static double density_at(const shares_t *shares, size_t line) {
    return shares->white + shares->slow / ((double)line * shares->step_hz);
}

/* A spectrum whose noise is looked for. */
typedef struct {
    const double *density;
    size_t lines;
    double *around; /* what noise has at each line, of any colour, by the median around it */
    double most;    /* times as much as is expected, noise has by chance */
} spectrum_t;

/* The overlap of Hann's windows makes the variance of their mean 1.06 times as large. */
static void spectrum_make(const double *density, size_t lines, size_t averaged, spectrum_t *spectrum) {
    const double independent = fmax(1.0, (double)averaged / 1.06);
    const double usual = gsl_cdf_gamma_Pinv(0.5, independent, 1.0 / independent);
    *spectrum = (spectrum_t){density, lines, allocate(lines, sizeof *spectrum->around),
                             gsl_cdf_gamma_Qinv(threshold.line_of_noise, independent, 1.0 / independent)};
    for (size_t h = LOWEST_LINES; h < lines; h++) {
        const size_t from = h > LOWEST_LINES + AROUND ? h - AROUND : LOWEST_LINES;
        const size_t to = h + AROUND < lines ? h + AROUND + 1 : lines;
        spectrum->around[h] = look_quantile(density + from, to - from, 0.5) / usual;
    }
}

/* One step of Whittle's likelihood: least squares weighted with what was found before, neither below 0. What exceeds
 * the largest of noise counts as that; out[h] != 0: a line that does not count. false: nothing to weight with, as of
 * readings that repeat exactly. */
static bool whittle_step(const spectrum_t *spectrum, const unsigned char *out, shares_t *shares) {
    double s11 = 0.0, s12 = 0.0, s22 = 0.0, b1 = 0.0, b2 = 0.0;
    for (size_t h = LOWEST_LINES; h < spectrum->lines; h++) {
        const double x = 1.0 / ((double)h * shares->step_hz), model = density_at(shares, h);
        const double weight = model > 0.0 && out[h] == 0 ? 1.0 / (model * model) : 0.0;
        const double here = fmin(spectrum->density[h], spectrum->most * model);
        s11 += weight;
        s12 += weight * x;
        s22 += weight * x * x;
        b1 += weight * here;
        b2 += weight * x * here;
    }
    if (s11 <= 0.0) {
        return false;
    }
    const double determinant = s11 * s22 - s12 * s12;
    double white = determinant > 0.0 ? (b1 * s22 - b2 * s12) / determinant : b1 / s11;
    double slow = determinant > 0.0 ? (b2 * s11 - b1 * s12) / determinant : 0.0;
    if (slow < 0.0) {
        slow = 0.0;
        white = b1 / s11;
    } else if (white < 0.0) {
        white = 0.0;
        slow = b2 / s22;
    }
    shares->white = 0.5 * (shares->white + white);
    shares->slow = 0.5 * (shares->slow + slow);
    return true;
}

/* What a line of noise is expected to have. Noise of another colour than white and slow is no line. */
static double expected_at(const spectrum_t *spectrum, const shares_t *shares, size_t line) {
    return fmax(spectrum->around[line], density_at(shares, line));
}

/* Marks lines of hum or of a ring: more than noise has, with their skirts to where they are down to what is expected.
 */
static void mark_lines(const spectrum_t *spectrum, const shares_t *shares, unsigned char *out) {
    const double *density = spectrum->density;
    memset(out, 0, spectrum->lines);
    for (size_t h = LOWEST_LINES; h < spectrum->lines; h++) {
        if (density[h] > spectrum->most * expected_at(spectrum, shares, h)) {
            for (size_t l = h; l < spectrum->lines && density[l] > expected_at(spectrum, shares, l); l++) {
                out[l] = 1;
            }
            for (size_t l = h; l >= LOWEST_LINES && density[l] > expected_at(spectrum, shares, l); l--) {
                out[l] = 1;
            }
        }
    }
}

/* Goes on from a start; with leave_out, without lines of hum. Returns -2 log likelihood, as if no line had more than
 * noise has. */
static double settle_shares(const spectrum_t *spectrum, bool leave_out, shares_t *shares) {
    unsigned char *out = allocate(spectrum->lines, 1);
    double misfit = 0.0;
    bool goes_on = true;
    memset(out, 0, spectrum->lines);
    for (size_t i = 0; i < WHITTLE_STEPS && goes_on; i++) {
        if (leave_out) {
            mark_lines(spectrum, shares, out);
        }
        goes_on = whittle_step(spectrum, out, shares);
    }
    for (size_t h = LOWEST_LINES; h < spectrum->lines && goes_on; h++) {
        const double model = density_at(shares, h);
        misfit += 2.0 * (log(model) + fmin(spectrum->density[h] / model, spectrum->most));
    }
    free(out);
    return misfit;
}

/* w + a / f. Lines of hum do not count, but which these are depends on what is expected. If all is white but lines, the
 * median says that; if not, a fit in which lines count as the largest of noise. What fits better stays. */
static shares_t fit_shares(const double *density, size_t length, size_t averaged, double rate_hz) {
    spectrum_t spectrum;
    spectrum_make(density, length / 2, averaged, &spectrum);
    shares_t white = {.step_hz = rate_hz / (double)length};
    white.white = look_quantile(density + LOWEST_LINES, spectrum.lines - LOWEST_LINES, 0.5) / 0.7;
    white.slow = 1e-3 * white.white * white.step_hz;
    shares_t both = white;
    settle_shares(&spectrum, false, &both);
    const double of_both = settle_shares(&spectrum, true, &both);
    const double of_white = settle_shares(&spectrum, true, &white);
    free(spectrum.around);
    return of_white < of_both ? white : both;
}

/* Marks single samples far from their neighbours: one leaves half of itself with either, and so do those marked
 * already. */
static void mark_single(const stretches_t *s, unsigned char *far) {
    double *apart = allocate(s->count, sizeof *apart);
    size_t *at = allocate(s->count, sizeof *at), inner = 0;
    for (size_t i = 0; i < s->stretches; i++) {
        for (size_t k = s->begin[i] + 1; k + 1 < s->begin[i + 1]; k++) {
            apart[inner] = s->value[k] - 0.5 * (s->value[k - 1] + s->value[k + 1]);
            at[inner++] = k;
        }
    }
    const double usual = inner > 0 ? fmax(s->rounding, look_robust_deviation(apart, inner)) : 0.0;
    for (size_t k = 0; k < inner; k++) {
        const size_t here = at[k];
        if (far[here - 1] == 0 && far[here] == 0 && far[here + 1] == 0 && usual > 0.0 &&
            fabs(apart[k]) > threshold.beyond_chance * usual && (k == 0 || fabs(apart[k]) >= fabs(apart[k - 1])) &&
            (k + 1 == inner || fabs(apart[k]) > fabs(apart[k + 1]))) {
            far[here] = 1;
        }
    }
    free(apart);
    free(at);
}

/* Marks samples far from all others, unless they are so many that the distribution is wide. */
static void mark_far(const stretches_t *s, unsigned char *far) {
    const double usual = fmax(s->rounding, look_robust_deviation(s->value, s->count));
    size_t count = 0;
    for (size_t k = 0; k < s->count; k++) {
        count += fabs(s->value[k]) > threshold.beyond_chance * usual ? 1 : 0;
    }
    for (size_t k = 0; usual > 0.0 && (double)count < threshold.few_far * (double)s->count && k < s->count; k++) {
        far[k] |= fabs(s->value[k]) > threshold.beyond_chance * usual ? 1 : 0;
    }
}

/* The shares of what is not far outside: a burst has the spectrum of neither. */
static void fit_density(const stretches_t *s, const unsigned char *far, double rate_hz, noise_share_t *share) {
    size_t longest = 0, length = 16, used = 0;
    double squares = 0.0;
    stretches_t usual = *s;
    for (size_t i = 0; i < s->stretches; i++) {
        const size_t count = s->begin[i + 1] - s->begin[i];
        longest = count > longest ? count : longest;
    }
    while (2 * length <= longest && 2 * length <= MOST_SEGMENT) {
        length *= 2;
    }
    double *density = allocate(length / 2 + 1, sizeof *density);
    usual.value = allocate(s->count, sizeof *usual.value);
    for (size_t k = 0; k < s->count; k++) {
        usual.value[k] = far[k] != 0 ? 0.0 : s->value[k];
        squares += usual.value[k] * usual.value[k];
        used += far[k] == 0 ? 1 : 0;
    }
    const size_t averaged = density_of(&usual, length, rate_hz, density);
    if (averaged > 0) {
        const shares_t shares = fit_shares(density, length, averaged, rate_hz);
        share->lowest_hz = LOWEST_LINES * rate_hz / (double)length;
        share->white_um = sqrt(shares.white * 0.5 * rate_hz);
        share->slow_um = sqrt(shares.slow * log(0.5 * rate_hz / share->lowest_hz));
        share->other_um =
            sqrt(fmax(0.0, squares / fmax(1.0, (double)used) - pow(share->white_um, 2.0) - pow(share->slow_um, 2.0)));
    }
    free(density);
    free(usual.value);
}

static void share_of(const stretches_t *s, double rate_hz, noise_share_t *share) {
    double squares = 0.0, fourth = 0.0;
    memset(share, 0, sizeof *share);
    if (s->count < LEAST_SAMPLES) {
        return;
    }
    unsigned char *far = allocate(s->count, 1);
    memset(far, 0, s->count);
    for (size_t k = 0; k < s->count; k++) {
        squares += s->value[k] * s->value[k];
        fourth += pow(s->value[k], 4.0);
    }
    share->samples = s->count;
    share->rms_um = sqrt(squares / (double)s->count);
    share->kurtosis = squares > 0.0 ? fourth * (double)s->count / (squares * squares) : 3.0;
    mark_far(s, far);
    mark_single(s, far);
    for (size_t k = 0; k < s->count; k++) {
        share->outliers += far[k];
    }
    fit_density(s, far, rate_hz, share);
    free(far);
}

/* What was before a rest settles in it. How, those behind a motion say; the recording may begin so, too. */
static void rests_of(const recording_t *recording, const drive_look_t *drive, stretches_t *s) {
    look_span_t *spans = allocate(drive->rests + 1, sizeof *spans);
    size_t count = 0, first = 0; /* the first that something was before */
    settling_t settling;
    for (size_t i = 0; i < drive->rests; i++) {
        look_span_t span = drive->rest[i];
        const double third = threshold.settling_part * (double)span_length(span);
        span.from += span.from == 0 ? 0 : (size_t)fmin(third, threshold.settling_s * recording->sample_rate_hz + 1.0);
        if (span_length(span) >= LEAST_SAMPLES) {
            first = span.from == 0 ? 1 : first;
            spans[count++] = span;
        }
    }
    settling_find(recording->column[COLUMN_DISPLACEMENT], spans + first, count - first, &settling);
    for (size_t i = 0; i < count; i++) {
        const size_t length = span_length(spans[i]);
        double *piece = allocate(length, sizeof *piece);
        memcpy(piece, recording->column[COLUMN_DISPLACEMENT] + spans[i].from, length * sizeof *piece);
        settling_take_out(&settling, piece, length);
        add_stretch(s, piece, length);
        free(piece);
    }
    free(spans);
}

void noise_look(const recording_t *recording, const drive_look_t *drive, const repetition_t *repetition,
                noise_look_t *noise) {
    const double *y = recording->column[COLUMN_DISPLACEMENT];
    memset(noise, 0, sizeof *noise);
    noise->digit_um = resolution_digit(y, recording->samples);
    noise->step_um = resolution_step_of_reading(y, recording->column[COLUMN_DRIVE], recording->samples);
    stretches_t rests = {.rounding = noise->step_um / sqrt(12.0)}, repeats = rests;
    rests_of(recording, drive, &rests);
    share_of(&rests, recording->sample_rate_hz, &noise->rest);
    if (repetition->count > 0) {
        const size_t skipped = (size_t)ceil((double)drive_unsettled_passes(drive) * drive->period);
        add_stretch(&repeats, repetition->difference + skipped, repetition->count - skipped);
        share_of(&repeats, recording->sample_rate_hz, &noise->repeat);
    }
    stretches_free(&rests);
    stretches_free(&repeats);
}

double noise_known_um(const noise_look_t *noise) {
    return noise->rest.samples > 0 ? noise->rest.rms_um : noise->repeat.rms_um;
}
