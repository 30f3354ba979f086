/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/noise/noise_bands.h"
#include "base/failure.h"
#include "base/parallel.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_fft_real.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A column of which less than this part of the square is left was a line. */
static const double taken = 1e-9;
/* Frequencies of a piece that are separate bands; above them, bands an octave. */
enum { SINGLE = 8, BANDS_PER_OCTAVE = 16, MOST_BANDS = 320 };
enum { MOST_PIECES = 4, LEAST_SAMPLES = 4000 };
/* A piece's end is this part of it: a mean over as much knows where a column ends, and little of a quick noise. */
enum { END = 96 };

bool noise_bands_suit(const explained_noise_t *noise) {
    bool suit = noise->pieces <= MOST_PIECES;
    for (size_t piece = 0; suit && piece < noise->pieces; piece++) {
        suit = noise->end[piece] - noise->begin[piece] >= LEAST_SAMPLES;
    }
    return suit;
}

/* The largest one up to this of which a transform is quick: 2, 3 and 5 are its only factors. */
static size_t quick_length(size_t length) {
    for (;; length--) {
        size_t left = length;
        for (size_t factor = 2; factor <= 5; factor++) {
            while (left % factor == 0) {
                left /= factor;
            }
        }
        if (left == 1) {
            return length;
        }
    }
}

static size_t band_of(size_t frequency) {
    return frequency <= SINGLE ? frequency - 1
                               : SINGLE + (size_t)(BANDS_PER_OCTAVE * log2((double)frequency / (double)(SINGLE + 1)));
}

/* One piece of all vectors. */
typedef struct {
    const explained_noise_t *noise;
    size_t begin, length;
    const gsl_fft_real_wavetable *wavetable;
    double *spectrum; /* length a vector: cosine and sine of the first frequency, of the second one .. */
    size_t bands, from[MOST_BANDS + 1]; /* rows of the spectra that belong to each */
    noise_bands_t *sum;
} piece_t;

static void transform(void *context, size_t vector) {
    const piece_t *piece = context;
    const basis_t *explained = &piece->noise->explained;
    const size_t n = piece->length;
    const double *x = piece->begin +
                      (vector < explained->columns ? explained->column + vector * explained->rows : piece->noise->left);
    double *y = piece->spectrum + vector * n;
    gsl_fft_real_workspace *workspace = gsl_fft_real_workspace_alloc(n);
    const size_t end = n / END;
    const double first = gsl_stats_mean(x, 1, end), last = gsl_stats_mean(x + n - end, 1, end);
    for (size_t k = 0; k < n; k++) {
        const double part = ((double)k - 0.5 * (double)(end - 1)) / (double)(n - end);
        y[k] = x[k] - first - (last - first) * part;
    }
    gsl_fft_real_transform(y, 1, n, piece->wavetable, workspace);
    cblas_dscal((int)n, sqrt(2.0 / (double)n), y, 1);
    memmove(y, y + 1, (n - 1) * sizeof(double)); /* without the mean */
    gsl_fft_real_workspace_free(workspace);
}

static void multiply(void *context, size_t band) {
    const piece_t *piece = context;
    const size_t n = piece->sum->vectors, rows = piece->from[band + 1] - piece->from[band];
    if (rows > 0) {
        cblas_dsyrk(CblasColMajor, CblasUpper, CblasTrans, (int)n, (int)rows, 1.0, piece->spectrum + piece->from[band],
                    (int)piece->length, 1.0, piece->sum->product + band * n * n, (int)n);
    }
}

/* Rows of each band, and the turns of their frequencies; the last frequency of an even length, a cosine alone, is left
 * out. */
static void divide(piece_t *piece) {
    const size_t frequencies = (piece->length - 1) / 2;
    noise_bands_t *sum = piece->sum;
    for (size_t f = 1, band = 0; f <= frequencies; f++) {
        const size_t here = band_of(f) < MOST_BANDS ? band_of(f) : MOST_BANDS - 1;
        while (band <= here) {
            piece->from[band++] = 2 * (f - 1);
        }
        piece->bands = band;
        sum->turns[here] += 2.0 * (double)f / (double)piece->length;
        sum->frequencies[here] += 2.0;
    }
    piece->from[piece->bands] = 2 * frequencies;
    sum->bands = piece->bands > sum->bands ? piece->bands : sum->bands;
    sum->freedom += 2 * frequencies;
}

static void add_piece(const explained_noise_t *noise, size_t index, noise_bands_t *bands) {
    piece_t piece = {.noise = noise,
                     .begin = noise->begin[index],
                     .length = quick_length(noise->end[index] - noise->begin[index]),
                     .sum = bands};
    gsl_fft_real_wavetable *wavetable = gsl_fft_real_wavetable_alloc(piece.length);
    piece.wavetable = wavetable;
    piece.spectrum = allocate(bands->vectors * piece.length, sizeof(double));
    divide(&piece);
    parallel(bands->vectors, transform, &piece);
    parallel(piece.bands, multiply, &piece);
    gsl_fft_real_wavetable_free(wavetable);
    free(piece.spectrum);
}

/* Columns of which nothing is left cannot be told apart. */
static void leave_out_lines(const explained_noise_t *noise, noise_bands_t *bands) {
    const size_t n = bands->vectors;
    for (size_t j = 0; j + 1 < n; j++) {
        const double *column = noise->explained.column + j * noise->explained.rows;
        const double all = cblas_ddot((int)noise->explained.rows, column, 1, column, 1);
        double left = 0.0;
        for (size_t band = 0; band < bands->bands; band++) {
            left += bands->product[(band * n + j) * n + j];
        }
        bands->taken[j] = left <= taken * all;
        bands->freedom -= bands->taken[j] ? 0 : 1;
    }
}

void noise_bands_open(const explained_noise_t *noise, noise_bands_t *bands) {
    const size_t n = noise->explained.columns + 1;
    *bands = (noise_bands_t){.vectors = n,
                             .taken = allocate(n, sizeof(bool)),
                             .turns = allocate(MOST_BANDS, sizeof(double)),
                             .frequencies = allocate(MOST_BANDS, sizeof(double)),
                             .product = allocate(MOST_BANDS * n * n, sizeof(double))};
    for (size_t piece = 0; piece < noise->pieces; piece++) {
        add_piece(noise, piece, bands);
    }
    for (size_t band = 0; band < bands->bands; band++) {
        bands->turns[band] /= fmax(1.0, bands->frequencies[band]);
    }
    leave_out_lines(noise, bands);
}

void noise_bands_close(noise_bands_t *bands) {
    free(bands->taken);
    free(bands->turns);
    free(bands->frequencies);
    free(bands->product);
    *bands = (noise_bands_t){0};
}

void noise_bands_products(const noise_bands_t *bands, const noise_filter_t *filter, double *products) {
    const size_t n = bands->vectors, elements = n * n;
    memset(products, 0, elements * sizeof(double));
    for (size_t band = 0; band < bands->bands; band++) {
        cblas_daxpy((int)elements, 1.0 / noise_filter_power(filter, bands->turns[band]),
                    bands->product + band * elements, 1, products, 1);
    }
    for (size_t j = 0; j < n; j++) {
        for (size_t i = 0; i < n && bands->taken[j]; i++) {
            products[j * n + i] = products[i * n + j] = i == j ? 1.0 : 0.0;
        }
    }
}

double noise_bands_determinant(const noise_bands_t *bands, const noise_filter_t *filter) {
    double sum = 0.0;
    for (size_t band = 0; band < bands->bands; band++) {
        sum += bands->frequencies[band] * log(noise_filter_power(filter, bands->turns[band]));
    }
    return sum;
}
