/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/diagnosis_pictures.h"
#include "base/failure.h"
#include "page/svg_plot.h"
#include "report/density.h"
#include <stdlib.h>

#define BEFORE "before"
#define AFTER  "after"

static const char *const class_name[] = {"before spread", "after spread"}, *const label[] = {BEFORE, AFTER};

/* measured - model */
static double *residual(const compared_t *c, const double *model) {
    double *x = allocate(c->samples, sizeof(double));
    for (size_t k = 0; k < c->samples; k++) {
        x[k] = c->measured_um[k] - model[k];
    }
    return x;
}

static double *times(const compared_t *c) {
    double *x = allocate(c->samples, sizeof(double));
    for (size_t k = 0; k < c->samples; k++) {
        x[k] = c->start_s + (double)k / c->sample_rate_hz;
    }
    return x;
}

/* First of `length` samples over which the two models differ most, or the only one differs most from the recording. */
static size_t most_different(const compared_t *c, size_t length) {
    const double *other = c->before_um != NULL ? c->before_um : c->measured_um;
    double sum = 0.0, most = -1.0;
    size_t best = 0;
    for (size_t k = 0; k < c->samples; k++) {
        const double d = c->after_um[k] - other[k];
        sum += d * d;
        if (k >= length) {
            const double gone = c->after_um[k - length] - other[k - length];
            sum -= gone * gone;
        }
        if (k + 1 >= length && sum > most) {
            most = sum;
            best = k + 1 - length;
        }
    }
    return best;
}

/* first: 0 with two models, 1 with only the later one. */
static size_t first_model(const compared_t *c) {
    return c->before_um != NULL ? 0 : 1;
}

/* Residuals of the models over x, since differences are hard to see where the models themselves are drawn. */
static void write_errors(FILE *file, const char *title, const char *x_label, const double *x, double *const error[2],
                         size_t begin, size_t first, size_t length) {
    plot_line_t line[2];
    for (size_t i = begin; i < 2; i++) {
        line[i] = (plot_line_t){class_name[i], begin == 0 ? label[i] : "model", x, error[i] + first, length};
    }
    plot_write(file, &(plot_t){title, x_label, "recorded − model, µm", line + begin, 2 - begin, PLOT_NO_SHADE});
}

static void write_spectrum(FILE *file, const compared_t *c, double *const error[2], size_t begin) {
    density_t density[3] = {{0}};
    plot_line_t line[3];
    size_t lines = 2;
    for (size_t i = begin; i < 2; i++) {
        density[i] = density_of(error[i], c->samples, c->sample_rate_hz);
        line[i] = (plot_line_t){class_name[i], label[i], density[i].hz, density[i].density, density[i].count};
    }
    if (c->noise != NULL) {
        density[2] = density_of_noise_at(c->noise, &density[1], c->sample_rate_hz);
        line[lines++] = (plot_line_t){"plain dotted", "noise", density[2].hz, density[2].density, density[2].count};
    }
    plot_write_logarithmic(file, &(plot_t){"Spectrum of the residual", "frequency, Hz", "density, µm/√Hz", line + begin,
                                           lines - begin, PLOT_NO_SHADE});
    for (size_t i = begin; i < lines; i++) {
        density_free(&density[i]);
    }
}

/* Recorded displacement and its models over x. The earlier model is dashed, so both are visible where they agree. */
static void write_models(FILE *file, const compared_t *c, const char *title, const char *x_label, const double *x,
                         size_t first, size_t length) {
    const plot_line_t recorded = {"plain under", "recorded", x, c->measured_um + first, length};
    const plot_line_t after = {"after", c->before_um != NULL ? AFTER : "model", x, c->after_um + first, length};
    plot_line_t line[3] = {recorded, after, after};
    if (c->before_um != NULL) {
        line[2] = (plot_line_t){"before dashed", BEFORE, x, c->before_um + first, length};
    }
    plot_write(file, &(plot_t){title, x_label, "position, µm", line, 3 - first_model(c), PLOT_NO_SHADE});
}

void write_pictures(FILE *file, const compared_t *c) {
    enum { SHOWN = 200, LEAST = 100 };
    const size_t wished = c->samples / SHOWN > LEAST ? c->samples / SHOWN : LEAST;
    const size_t length = wished < c->samples ? wished : c->samples, first = most_different(c, length);
    const size_t begin = first_model(c);
    double *time_s = times(c), *error[2] = {NULL, residual(c, c->after_um)};
    if (begin == 0) {
        error[0] = residual(c, c->before_um);
    }
    fprintf(file, "<div class=\"row pictures\">\n");
    write_models(file, c, "Loop", "drive, V", c->drive_v, 0, c->samples);
    write_errors(file, "Error over the drive", "drive, V", c->drive_v, error, begin, 0, c->samples);
    write_models(file, c, begin == 0 ? "Where the two models differ most" : "Where the model is worst", "time, s",
                 time_s + first, first, length);
    write_errors(file, "Error there", "time, s", time_s + first, error, begin, first, length);
    write_errors(file, "Residual over time", "time, s", time_s, error, begin, 0, c->samples);
    write_spectrum(file, c, error, begin);
    fprintf(file, "</div>\n");
    free(time_s);
    free(error[0]);
    free(error[1]);
}
