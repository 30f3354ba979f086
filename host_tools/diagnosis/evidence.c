/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "evidence.h"
#include "evidence_columns.h"
#include "lines.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_linalg.h>
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { OPERATORS = 24, SHAPES = 6, TRENDS = 12, ORDER = 6, TIME_BLOCKS = 36 };
/* A column of which J leaves less than this part is imitated. */
static const double imitated = 1e-6;

bool held_out(size_t samples, size_t sample) {
    return sample * TIME_BLOCKS / samples % 3 == 2;
}

/* Nearer to an end of the range than this part of it counts as having been there. */
static const double at_the_end = 0.02;

size_t first_that_counts(const model_t *model, const recording_t *recording) {
    const double *drive = recording->column[COLUMN_DRIVE];
    const size_t determined = chain_memory_determined(model, recording, recording->samples);
    double range[2], margin;
    size_t at_low = recording->samples, at_high = recording->samples, from;
    values_range(drive, recording->samples, range);
    margin = at_the_end * (range[1] - range[0]);
    for (size_t k = recording->samples; k-- > 0;) {
        at_low = drive[k] <= range[0] + margin ? k : at_low;
        at_high = drive[k] >= range[1] - margin ? k : at_high;
    }
    from = at_low > at_high ? at_low : at_high;
    from = from > determined ? from : determined;
    return recording->samples - from < recording->samples / 4 ? 0 : from;
}

struct evidence {
    const recording_t *recordings;
    size_t count;
    double **simulated; /* one a recording, whole */
    size_t *from;       /* samples that take part begin there; whitened ones ORDER later */
    size_t samples;     /* that take part, of all recordings */
    size_t rows;        /* whitened samples of all recordings */
    size_t used;        /* of them, not held out */
    double filter[ORDER];
    size_t columns;
    double *basis;    /* orthonormal whitened J, column by column, rows each */
    double *residual; /* whitened, beyond J */
    double power;     /* of the residual */
};

static size_t length_of(const evidence_t *e, size_t i) {
    return e->recordings[i].samples - e->from[i];
}

/* x[k] - sum filter x[k-j], from the ORDER-th sample of every recording on. `column` runs over the samples that take
 * part. */
static void whiten(const evidence_t *e, const double *column, double *white) {
    for (size_t i = 0; i < e->count; i++) {
        const size_t length = length_of(e, i);
        for (size_t k = ORDER; k < length; k++) {
            double x = column[k];
            for (size_t j = 0; j < ORDER; j++) {
                x -= e->filter[j] * column[k - 1 - j];
            }
            *white++ = held_out(e->recordings[i].samples, e->from[i] + k) ? 0.0 : x;
        }
        column += length;
    }
}

/* Takes what the first `columns` columns of the basis explain out of x. Twice: once leaves rounding behind. */
static void project(const evidence_t *e, size_t columns, double *x) {
    double *share = allocate(columns + 1, sizeof(double));
    for (int pass = 0; pass < 2 && columns > 0; pass++) {
        cblas_dgemv(CblasColMajor, CblasTrans, (int)e->rows, (int)columns, 1.0, e->basis, (int)e->rows, x, 1, 0.0,
                    share, 1);
        cblas_dgemv(CblasColMajor, CblasNoTrans, (int)e->rows, (int)columns, -1.0, e->basis, (int)e->rows, share, 1,
                    1.0, x, 1);
    }
    free(share);
}

static void add_to_basis(evidence_t *e, const double *column) {
    double *x = e->basis + e->columns * e->rows;
    double before, after;
    whiten(e, column, x);
    before = cblas_dnrm2((int)e->rows, x, 1);
    project(e, e->columns, x);
    after = cblas_dnrm2((int)e->rows, x, 1);
    if (after > imitated * before) {
        cblas_dscal((int)e->rows, 1.0 / after, x, 1);
        e->columns++;
    }
}

/* Runs a column of one recording through the model's blocks of these places, except those that add what is not a
 * response (noise, steps, a sensor's curve, hum). */
static void pass_through(const model_t *model, const recording_t *recording, place_t first, place_t last, double *x) {
    const stage_setup_t setup = {.sample_rate_hz = recording->sample_rate_hz};
    for (size_t b = 0; b < model->blocks; b++) {
        const model_block_t *block = &model->block[b];
        void *state;
        signal_t signal = {.value = x[0]};
        if (block->block->place < first || block->block->place > last || block->block->adds) {
            continue;
        }
        state = block_open(block->block, block->parameter, &setup);
        block->block->settle(state, &signal);
        for (size_t k = 0; k < recording->samples; k++) {
            signal = (signal_t){.value = x[k]};
            block->block->step(state, &signal);
            x[k] = signal.value;
        }
        free(state);
    }
}

typedef struct {
    evidence_t *evidence;
    const model_t *model;
    double center_v, half_v;
    double **whole; /* a recording's column, all samples */
    double *column; /* the samples that take part */
    double **drive; /* behind the electronics, as a part of half the range */
    double ***play; /* [operator][recording][sample], likewise */
} builder_t;

/* Adds the column that `whole` holds. */
static void add_column(builder_t *b) {
    evidence_t *e = b->evidence;
    double *at = b->column;
    for (size_t i = 0; i < e->count; i++) {
        pass_through(b->model, &e->recordings[i], PLACE_SLOW, PLACE_SENSOR, b->whole[i]);
        memcpy(at, b->whole[i] + e->from[i], length_of(e, i) * sizeof(double));
        at += length_of(e, i);
    }
    add_to_basis(e, b->column);
}

static void add_offset(builder_t *b, size_t recording) {
    evidence_t *e = b->evidence;
    double *at = b->column;
    for (size_t i = 0; i < e->count; i++) {
        for (size_t k = e->from[i]; k < e->recordings[i].samples; k++) {
            *at++ = i == recording ? 1.0 : 0.0;
        }
    }
    add_to_basis(e, b->column);
}

/* x^a z^b, z: the drive itself or one of the operators. */
static void add_product(builder_t *b, double **z, int drive_power, int power) {
    for (size_t i = 0; i < b->evidence->count; i++) {
        for (size_t k = 0; k < b->evidence->recordings[i].samples; k++) {
            b->whole[i][k] = gsl_pow_int(b->drive[i][k], drive_power) * gsl_pow_int(z[i][k], power);
        }
    }
    add_column(b);
}

static void find_range(builder_t *b) {
    double range[2];
    recordings_range(b->evidence->recordings, b->evidence->count, COLUMN_DRIVE, range);
    b->center_v = 0.5 * (range[0] + range[1]);
    b->half_v = 0.5 * (range[1] - range[0]);
}

/* The drive behind the electronics, and operators of evenly spread thresholds on it. */
static void find_operators(builder_t *b) {
    evidence_t *e = b->evidence;
    b->drive = recordings_room(e->recordings, e->count);
    b->play = allocate(OPERATORS, sizeof *b->play);
    for (size_t i = 0; i < e->count; i++) {
        memcpy(b->drive[i], e->recordings[i].column[COLUMN_DRIVE], e->recordings[i].samples * sizeof(double));
        pass_through(b->model, &e->recordings[i], PLACE_ELECTRONICS, PLACE_ELECTRONICS, b->drive[i]);
        for (size_t k = 0; k < e->recordings[i].samples; k++) {
            b->drive[i][k] = (b->drive[i][k] - b->center_v) / b->half_v;
        }
    }
    for (size_t j = 0; j < OPERATORS; j++) {
        const double r = (double)(j + 1) / (OPERATORS + 1);
        b->play[j] = recordings_room(e->recordings, e->count);
        for (size_t i = 0; i < e->count; i++) {
            double z = 0.0;
            for (size_t k = 0; k < e->recordings[i].samples; k++) {
                z = fmax(b->drive[i][k] - r, fmin(b->drive[i][k] + r, z));
                b->play[j][i][k] = z;
            }
        }
    }
}

/* Half waves over the length of each recording. */
static void add_trends(builder_t *b) {
    evidence_t *e = b->evidence;
    for (int waves = 1; waves <= TRENDS; waves++) {
        double *at = b->column;
        for (size_t i = 0; i < e->count; i++) {
            for (size_t k = 0; k < length_of(e, i); k++) {
                *at++ = cos(M_PI * waves * ((double)k + 0.5) / (double)length_of(e, i));
            }
        }
        add_to_basis(e, b->column);
    }
}

/* Cosine and sine at each line of the residual. */
static void add_lines(builder_t *b) {
    evidence_t *e = b->evidence;
    double hz[LINES_MOST];
    const size_t lines = evidence_lines(e, hz);
    for (size_t line = 0; line < 2 * lines; line++) {
        double *at = b->column;
        for (size_t i = 0; i < e->count; i++) {
            const double turn = 2.0 * M_PI * hz[line / 2] / e->recordings[i].sample_rate_hz;
            for (size_t k = 0; k < length_of(e, i); k++) {
                *at++ = cos(turn * (double)k - (line % 2 == 0 ? 0.0 : M_PI / 2.0));
            }
        }
        add_to_basis(e, b->column);
    }
}

static void build_basis(evidence_t *e, const model_t *model, bool shapes, bool trends) {
    builder_t b = {.evidence = e, .model = model, .whole = recordings_room(e->recordings, e->count)};
    const size_t most = e->count + 3 + OPERATORS + 3 * SHAPES + TRENDS + 2 * LINES_MOST;
    free(e->basis);
    e->columns = 0;
    e->basis = allocate(most * e->rows, sizeof(double));
    b.column = allocate(e->samples, sizeof(double));
    find_range(&b);
    find_operators(&b);
    for (size_t i = 0; i < e->count; i++) {
        add_offset(&b, i);
    }
    add_product(&b, b.drive, 0, 1);
    for (size_t j = 0; j < OPERATORS; j++) {
        add_product(&b, b.play[j], 0, 1);
    }
    if (shapes) {
        add_product(&b, b.drive, 0, 2);
        add_product(&b, b.drive, 0, 3);
        for (size_t j = 0; j < OPERATORS; j += OPERATORS / SHAPES) {
            add_product(&b, b.play[j], 0, 2);
            add_product(&b, b.play[j], 0, 3);
            add_product(&b, b.play[j], 1, 1);
        }
    }
    if (trends) {
        add_trends(&b);
        add_lines(&b);
    }
    for (size_t j = 0; j < OPERATORS; j++) {
        recordings_room_free(b.play[j], e->count);
    }
    free(b.play);
    recordings_room_free(b.drive, e->count);
    recordings_room_free(b.whole, e->count);
    free(b.column);
}

/* displacement - simulation over the samples that take part. */
static double *raw_residual(const evidence_t *e) {
    double *raw, *at;
    at = raw = allocate(e->samples, sizeof(double));
    for (size_t i = 0; i < e->count; i++) {
        for (size_t k = e->from[i]; k < e->recordings[i].samples; k++) {
            *at++ = e->recordings[i].column[COLUMN_DISPLACEMENT][k] - e->simulated[i][k];
        }
    }
    return raw;
}

/* The filter that predicts x (rows) best from its past, by least squares over all recordings; a little noise keeps it
 * finite. */
static void find_filter(evidence_t *e, const double *x) {
    gsl_matrix *gram = gsl_matrix_calloc(ORDER, ORDER);
    gsl_vector *moment = gsl_vector_calloc(ORDER), *filter = gsl_vector_alloc(ORDER);
    double power = 0.0;
    for (size_t i = 0; i < e->count; i++) {
        const size_t length = length_of(e, i) - ORDER;
        for (size_t k = ORDER; k < length; k++) {
            for (size_t a = 0; a < ORDER; a++) {
                *gsl_vector_ptr(moment, a) += x[k] * x[k - 1 - a];
                for (size_t c = 0; c <= a; c++) {
                    *gsl_matrix_ptr(gram, a, c) += x[k - 1 - a] * x[k - 1 - c];
                }
            }
            power += x[k] * x[k];
        }
        x += length;
    }
    for (size_t a = 0; a < ORDER; a++) {
        *gsl_matrix_ptr(gram, a, a) += 1e-9 * power + 1e-300;
    }
    gsl_linalg_cholesky_decomp1(gram);
    gsl_linalg_cholesky_solve(gram, moment, filter);
    for (size_t a = 0; a < ORDER; a++) {
        e->filter[a] = gsl_vector_get(filter, a);
    }
    gsl_matrix_free(gram);
    gsl_vector_free(moment);
    gsl_vector_free(filter);
}

evidence_t *evidence_open(const model_t *baseline, const recording_t *recordings, size_t count, bool shapes,
                          failure_t *failure) {
    evidence_t *e = allocate(1, sizeof *e);
    double *raw;
    e->recordings = recordings;
    e->count = count;
    e->from = allocate(count, sizeof *e->from);
    e->simulated = recordings_room(e->recordings, e->count);
    for (size_t i = 0; i < count; i++) {
        const size_t samples = recordings[i].samples;
        if (!chain_simulate(baseline, &recordings[i], 0, e->simulated[i], failure)) {
            evidence_close(e);
            return NULL;
        }
        e->from[i] = first_that_counts(baseline, &recordings[i]);
        if (length_of(e, i) < 4 * ORDER) {
            fail(failure, "%s: %zu samples are too few for a diagnosis", recordings[i].name, samples);
            evidence_close(e);
            return NULL;
        }
        e->samples += length_of(e, i);
        e->rows += length_of(e, i) - ORDER;
        for (size_t k = e->from[i] + ORDER; k < samples; k++) {
            e->used += held_out(samples, k) ? 0 : 1;
        }
    }
    raw = raw_residual(e);
    e->residual = allocate(e->rows, sizeof(double));
    /* The filter is found in what J and slow trends leave of the residual: a drift is to be explained, not predicted.
     */
    for (int pass = 0; pass < 2; pass++) {
        build_basis(e, baseline, shapes, pass == 0);
        whiten(e, raw, e->residual);
        project(e, e->columns, e->residual);
        if (pass == 0) {
            find_filter(e, e->residual);
        }
    }
    free(raw);
    e->power = cblas_ddot((int)e->rows, e->residual, 1, e->residual, 1);
    return e;
}

void evidence_close(evidence_t *evidence) {
    if (evidence != NULL) {
        recordings_room_free(evidence->simulated, evidence->count);
        free(evidence->from);
        free(evidence->basis);
        free(evidence->residual);
        free(evidence);
    }
}

double *evidence_signature(const evidence_t *e, const model_t *altered) {
    failure_t ignored;
    double *signature, *at;
    at = signature = allocate(e->samples, sizeof(double));
    for (size_t i = 0; i < e->count; i++) {
        double *position = allocate(e->recordings[i].samples, sizeof(double));
        bool good = chain_simulate(altered, &e->recordings[i], 0, position, &ignored);
        for (size_t k = e->from[i]; good && k < e->recordings[i].samples; k++) {
            *at = position[k] - e->simulated[i][k];
            good = isfinite(*at++);
        }
        free(position);
        if (!good) {
            free(signature);
            return NULL;
        }
    }
    return signature;
}

/* The signature beyond J, whitened; to be freed. *own: its square's part of the whole. */
static double *beyond(const evidence_t *e, const double *signature, double *own) {
    double *x = allocate(e->rows, sizeof(double));
    whiten(e, signature, x);
    const double before = cblas_dnrm2((int)e->rows, x, 1);
    project(e, e->columns, x);
    const double after = cblas_dnrm2((int)e->rows, x, 1);
    *own = before > 0.0 ? after / before : 0.0;
    return x;
}

/* Sum over blocks of time of the square of sum x (residual - a x): what the amplitude's variance is without assuming
 * that neighbours are independent. */
static double scatter(const evidence_t *e, const double *x, double amplitude) {
    double sum = 0.0;
    const size_t length = e->rows / TIME_BLOCKS + 1;
    for (size_t begin = 0; begin < e->rows; begin += length) {
        double block = 0.0;
        for (size_t k = begin; k < begin + length && k < e->rows; k++) {
            block += x[k] * (e->residual[k] - amplitude * x[k]);
        }
        sum += block * block;
    }
    return sum;
}

evidence_test_t evidence_test(const evidence_t *e, const double *signature) {
    evidence_test_t test = {0};
    double own;
    double *x = beyond(e, signature, &own);
    const double square = cblas_ddot((int)e->rows, x, 1, x, 1),
                 product = cblas_ddot((int)e->rows, x, 1, e->residual, 1);
    if (own > imitated && square > 0.0) {
        const double degrees = (double)(e->used - e->columns - 1), explained = product * product / square;
        const double variance = (e->power - explained) / degrees;
        test.amplitude = product / square;
        test.t = product / sqrt(square * variance);
        test.t_blocks = product / sqrt(scatter(e, x, test.amplitude));
        test.own_um = fabs(test.amplitude) * sqrt(square / (double)e->used);
        test.explained = explained / e->power;
    }
    free(x);
    return test;
}

double evidence_remaining(const evidence_t *e, const double *signature) {
    double own;
    double *x = beyond(e, signature, &own);
    cblas_daxpy((int)e->rows, -1.0, e->residual, 1, x, 1);
    const double power = cblas_ddot((int)e->rows, x, 1, x, 1);
    free(x);
    return power / e->power;
}

double evidence_cosine(const evidence_t *e, const double *one, const double *other) {
    double own;
    double *x = beyond(e, one, &own), *y = beyond(e, other, &own);
    const double norm = cblas_dnrm2((int)e->rows, x, 1) * cblas_dnrm2((int)e->rows, y, 1);
    const double cosine = norm > 0.0 ? cblas_ddot((int)e->rows, x, 1, y, 1) / norm : 0.0;
    free(x);
    free(y);
    return cosine;
}

size_t evidence_samples(const evidence_t *evidence) {
    return evidence->used;
}

double evidence_noise_um(const evidence_t *evidence) {
    return sqrt(evidence->power / (double)(evidence->used - evidence->columns));
}

size_t evidence_lines(const evidence_t *e, double *hz) {
    size_t longest = 0, lines;
    for (size_t i = 1; i < e->count; i++) {
        longest = length_of(e, i) > length_of(e, longest) ? i : longest;
    }
    const recording_t *recording = &e->recordings[longest];
    const size_t from = e->from[longest], length = length_of(e, longest);
    double *difference = allocate(length, sizeof(double));
    for (size_t k = 0; k < length; k++) {
        difference[k] = recording->column[COLUMN_DISPLACEMENT][from + k] - e->simulated[longest][from + k];
    }
    lines = find_lines(difference, length, recording->sample_rate_hz, hz);
    free(difference);
    return lines;
}

const recording_t *evidence_recordings(const evidence_t *evidence) {
    return evidence->recordings;
}

size_t evidence_count(const evidence_t *evidence) {
    return evidence->count;
}

/* Sum of squares of displacement - simulation, whitened, over the held-out samples. */
static bool held_out_power(const evidence_t *e, const model_t *model, double *power) {
    failure_t ignored;
    *power = 0.0;
    for (size_t i = 0; i < e->count; i++) {
        const recording_t *recording = &e->recordings[i];
        double *x = allocate(recording->samples, sizeof(double));
        const bool good = chain_simulate(model, recording, 0, x, &ignored);
        for (size_t k = 0; good && k < recording->samples; k++) {
            x[k] = recording->column[COLUMN_DISPLACEMENT][k] - x[k];
        }
        for (size_t k = e->from[i] + ORDER; good && k < recording->samples; k++) {
            double white = x[k];
            for (size_t j = 0; j < ORDER; j++) {
                white -= e->filter[j] * x[k - 1 - j];
            }
            *power += held_out(recording->samples, k) ? white * white : 0.0;
        }
        free(x);
        if (!good) {
            return false;
        }
    }
    return true;
}

bool evidence_held_out(const evidence_t *e, const model_t *worse, const model_t *better, double *likelihood) {
    double before, after;
    if (!held_out_power(e, worse, &before) || !held_out_power(e, better, &after)) {
        return false;
    }
    *likelihood = (double)(e->rows - e->used) * log(before / after);
    return true;
}

double evidence_held_out_share(const evidence_t *e) {
    return (double)(e->rows - e->used) / (double)e->used;
}

void evidence_beyond(const evidence_t *e, double **columns, bool scaled, double *rows) {
    double *column, *at;
    at = column = allocate(e->samples, sizeof(double));
    for (size_t i = 0; i < e->count; i++) {
        memcpy(at, columns[i] + e->from[i], length_of(e, i) * sizeof(double));
        at += length_of(e, i);
    }
    whiten(e, column, rows);
    if (scaled) {
        const double norm = cblas_dnrm2((int)e->rows, rows, 1);
        cblas_dscal((int)e->rows, norm > 0.0 ? sqrt((double)e->used) / norm : 0.0, rows, 1);
    }
    project(e, e->columns, rows);
    free(column);
}

const double *evidence_residual(const evidence_t *e, size_t *rows) {
    *rows = e->rows;
    return e->residual;
}
