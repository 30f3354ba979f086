/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Family `ellipse`: one ellipse for each sine recording. docs/MODELS.md, section 13.
 *
 * Of each recording the last whole periods of the training part are used. Where there are three or more, the first is
 * left out, since it contains the transient from rest into the loop. The two halves of a loop get separate ellipses up
 * to the highest frequency at which these fit the training samples clearly better than one ellipse for both.
 */
#include "chain/catalogue.h"
#include "identify/family.h"
#include "numerics/ellipse_fit.h"
#include "numerics/sine_fit.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>

/* As fractions of the amplitude: the RMS deviation of the drive from its sine, and how far the amplitudes and centres
 * of the recordings may differ. The first accepts converters of 8 bits, but no triangle (0.12). */
static const double drive_left = 0.02, amplitudes_differ = 0.02;
/* Relative difference of frequency below which two recordings have the same one. */
static const double frequencies_differ = 0.005;
/* Separate halves have ten parameters; accepted where they reduce the RMS error to this fraction. */
static const double halves_worth = 0.8;

typedef struct {
    const recording_t *recording;
    size_t from, samples; /* whole periods */
    sine_t drive;         /* its phase belongs to sample `from` */
    ellipse_t ellipse, sigma;
    ellipse_t half[2]; /* ascending, descending */
    double single_um, halves_um;
} loop_t;

typedef struct {
    loop_t *loop;
    size_t count;
    double drive_range_v, displacement_range_um;
    family_notes_t *notes;
    failure_t *failure;
} work_t;

static bool find_sine(work_t *work, loop_t *loop, size_t train_to) {
    const recording_t *recording = loop->recording;
    const double *drive = recording->column[COLUMN_DRIVE];
    if (!sine_fit(drive, train_to, recording->sample_rate_hz, &loop->drive, work->failure)) {
        return fail_in(work->failure, "%s: family ellipse needs a sinusoidal drive", recording->name);
    }
    if (!(loop->drive.rms <= drive_left * loop->drive.amplitude)) {
        return fail(
            work->failure,
            "%s: family ellipse needs a sinusoidal drive; %.2g %% of this one's amplitude is no sine of %.6g Hz",
            recording->name, 100.0 * loop->drive.rms / loop->drive.amplitude, loop->drive.frequency_hz);
    }
    const double period = recording->sample_rate_hz / loop->drive.frequency_hz;
    const double periods = floor((double)train_to / period + 0.01); /* the last period lacks a sample */
    if (periods < 1.0) {
        return fail(work->failure, "%s: the training part holds less than one period of its %.6g Hz", recording->name,
                    loop->drive.frequency_hz);
    }
    loop->samples = (size_t)fmin((double)train_to, floor((periods >= 3.0 ? periods - 1.0 : periods) * period + 0.5));
    loop->from = train_to - loop->samples;
    loop->drive.phase += 2.0 * M_PI * (double)loop->from / period;
    return true;
}

static int by_frequency(const void *a, const void *b) {
    const double x = ((const loop_t *)a)->drive.frequency_hz, y = ((const loop_t *)b)->drive.frequency_hz;
    return (x > y) - (x < y);
}

static bool check_together(const work_t *work) {
    const loop_t *first = &work->loop[0];
    for (size_t i = 1; i < work->count; i++) {
        const loop_t *loop = &work->loop[i];
        const double tolerance = amplitudes_differ * first->drive.amplitude;
        if (!(fabs(loop->drive.amplitude - first->drive.amplitude) <= tolerance &&
              fabs(loop->drive.offset - first->drive.offset) <= tolerance)) {
            return fail(
                work->failure,
                "%s: family ellipse holds for one amplitude about one bias; this is %.4g +- %.4g V, %s is %.4g +- "
                "%.4g V",
                loop->recording->name, loop->drive.offset, loop->drive.amplitude, first->recording->name,
                first->drive.offset, first->drive.amplitude);
        }
        if (!(loop->drive.frequency_hz > (1.0 + frequencies_differ) * loop[-1].drive.frequency_hz)) {
            return fail(work->failure, "%s: family ellipse needs one recording a frequency, and %s is %.6g Hz too",
                        loop->recording->name, loop[-1].recording->name, loop->drive.frequency_hz);
        }
    }
    return true;
}

/* Largest magnitudes, by which drive and displacement are scaled, as in the paper. */
static void measure_ranges(work_t *work) {
    for (size_t i = 0; i < work->count; i++) {
        const loop_t *loop = &work->loop[i];
        for (size_t k = loop->from; k < loop->from + loop->samples; k++) {
            work->drive_range_v = fmax(work->drive_range_v, fabs(loop->recording->column[COLUMN_DRIVE][k]));
            work->displacement_range_um =
                fmax(work->displacement_range_um, fabs(loop->recording->column[COLUMN_DISPLACEMENT][k]));
        }
    }
}

/* RMS difference of the displacement and k (u(t - d) - u_c), with the drive's amplitude. */
static double single_error(const work_t *work, const loop_t *loop, const double *y) {
    const ellipse_sines_t sines = ellipse_sines(&loop->ellipse);
    const double gain = sines.y_radius / sines.x_radius;
    double squares = 0.0;
    for (size_t k = 0; k < loop->samples; k++) {
        const double angle = 2.0 * M_PI * loop->drive.frequency_hz / loop->recording->sample_rate_hz * (double)k;
        const double u = loop->drive.offset + loop->drive.amplitude * sin(angle + loop->drive.phase - sines.lag);
        squares += gsl_pow_2(y[k] - loop->ellipse.y_center - gain * (u / work->drive_range_v - loop->ellipse.x_center));
    }
    return work->displacement_range_um * sqrt(squares / (double)loop->samples);
}

/* Fits the halves; halves_um stays infinite where they cannot be fitted. */
static void fit_halves(const work_t *work, loop_t *loop, const double *x, const double *y) {
    double *half_x = allocate(loop->samples, sizeof(double)), *half_y = allocate(loop->samples, sizeof(double));
    const double angle = 2.0 * M_PI * loop->drive.frequency_hz / loop->recording->sample_rate_hz;
    double squares = 0.0;
    failure_t unused;
    loop->halves_um = HUGE_VAL;
    for (int h = 0; h < 2; h++) {
        const double side = h == 0 ? -1.0 : 1.0;
        size_t count = 0;
        for (size_t k = 0; k < loop->samples; k++) {
            if (side * cos(angle * (double)k + loop->drive.phase) < 0.0) {
                half_x[count] = x[k];
                half_y[count++] = y[k];
            }
        }
        if (!ellipse_fit(half_x, half_y, count, &loop->half[h], NULL, &unused)) {
            squares = HUGE_VAL;
            break;
        }
        for (size_t k = 0; k < count; k++) {
            squares += gsl_pow_2(half_y[k] - ellipse_arc(&loop->half[h], half_x[k], side));
        }
    }
    loop->halves_um = work->displacement_range_um * sqrt(squares / (double)loop->samples);
    free(half_x);
    free(half_y);
}

static bool fit_loop(work_t *work, loop_t *loop) {
    double *x = allocate(loop->samples, sizeof(double)), *y = allocate(loop->samples, sizeof(double));
    for (size_t k = 0; k < loop->samples; k++) {
        x[k] = loop->recording->column[COLUMN_DRIVE][loop->from + k] / work->drive_range_v;
        y[k] = loop->recording->column[COLUMN_DISPLACEMENT][loop->from + k] / work->displacement_range_um;
    }
    const bool good = ellipse_fit(x, y, loop->samples, &loop->ellipse, &loop->sigma, work->failure);
    if (good) {
        loop->single_um = single_error(work, loop, y);
        fit_halves(work, loop, x, y);
        family_note(work->notes, "%.6g Hz: one ellipse leaves %.4g um RMS of the training loop, one a half %.4g um",
                    loop->drive.frequency_hz, loop->single_um, loop->halves_um);
    }
    free(x);
    free(y);
    return good || fail_in(work->failure, "%s", loop->recording->name);
}

enum { NUMBERS = 5 }; /* parameters of an ellipse */

static void numbers_of(const ellipse_t *ellipse, double number[NUMBERS]) {
    number[0] = ellipse->major;
    number[1] = ellipse->minor;
    number[2] = ellipse->angle;
    number[3] = ellipse->x_center;
    number[4] = ellipse->y_center;
}

static void set_ellipses(model_block_t *block, const work_t *work) {
    static const char *const names[NUMBERS] = {"major", "minor", "angle_rad", "x_center", "y_center"};
    double *frequency = allocate(work->count, sizeof(double));
    double *value = allocate(NUMBERS * work->count, sizeof(double)),
           *sigma = allocate(NUMBERS * work->count, sizeof(double));
    for (size_t i = 0; i < work->count; i++) {
        double five[2][NUMBERS];
        frequency[i] = work->loop[i].drive.frequency_hz;
        numbers_of(&work->loop[i].ellipse, five[0]);
        numbers_of(&work->loop[i].sigma, five[1]);
        for (size_t n = 0; n < NUMBERS; n++) { /* each parameter is an array of the block */
            value[n * work->count + i] = five[0][n];
            sigma[n * work->count + i] = five[1][n];
        }
    }
    model_set_array(block, "frequencies_hz", work->count, frequency, NULL);
    for (size_t n = 0; n < NUMBERS; n++) {
        model_set_array(block, names[n], work->count, value + n * work->count, sigma + n * work->count);
    }
    free(frequency);
    free(value);
    free(sigma);
}

static void set_halves(model_block_t *block, const work_t *work) {
    static const char *const names[2] = {"ascending", "descending"};
    size_t count = 0;
    while (count < work->count && work->loop[count].halves_um < halves_worth * work->loop[count].single_um) {
        count++;
    }
    if (count == 0) {
        return;
    }
    double *number = allocate(NUMBERS * count, sizeof(double));
    for (size_t i = 0; i < count; i++) {
        number[i] = work->loop[i].drive.frequency_hz;
    }
    model_set_array(block, "halves_hz", count, number, NULL);
    for (size_t h = 0; h < 2; h++) {
        for (size_t i = 0; i < count; i++) {
            numbers_of(&work->loop[i].half[h], number + NUMBERS * i);
        }
        model_set_array(block, names[h], NUMBERS * count, number, NULL);
    }
    free(number);
    family_note(work->notes, "each half of the loop has its own ellipse up to %.6g Hz",
                work->loop[count - 1].drive.frequency_hz);
}

static void make_model(const work_t *work, model_t *model) {
    model_create(model, work->loop[0].recording->sample_rate_hz);
    model_block_t *block = model_append(model, &block_ellipse);
    model_set(block, "drive_range_v", work->drive_range_v);
    model_set(block, "displacement_range_um", work->displacement_range_um);
    set_ellipses(block, work);
    set_halves(block, work);
}

static bool fit(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    work_t work = {
        .loop = allocate(job->count, sizeof *work.loop), .count = job->count, .notes = notes, .failure = failure};
    bool good = true;
    for (size_t i = 0; good && i < job->count; i++) {
        work.loop[i].recording = &job->recordings[i];
        good = find_sine(&work, &work.loop[i], job->train_to[i]);
    }
    if (good) {
        qsort(work.loop, work.count, sizeof *work.loop, by_frequency);
        measure_ranges(&work);
        good = check_together(&work);
    }
    for (size_t i = 0; good && i < work.count; i++) {
        good = fit_loop(&work, &work.loop[i]);
    }
    if (good) {
        make_model(&work, model);
        good = model_check(model, "family ellipse", failure);
        if (!good) {
            model_free(model);
        }
    }
    free(work.loop);
    return good;
}

const family_t family_ellipse = {
    .name = "ellipse",
    .order = 90,
    .text = "an ellipse for each sine; gain and lag over the frequency; sines of one amplitude about one bias",
    .fit = fit,
    .one_sine = true};
