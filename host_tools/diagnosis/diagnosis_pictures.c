/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis_pictures.h"
#include "failure.h"
#include "spectrum.h"
#include "svg_plot.h"
#include <stdlib.h>

#define BEFORE "before"
#define AFTER  "after"

static const char *const class_name[] = {"before", "after"}, *const label[] = {BEFORE, AFTER};

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

/* Where the two models differ most, or the only one from the recording, over `length` samples: the first of them. */
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

/* Density in um per root hertz over bands of a twelfth of an octave, as a line of positive points. */
typedef struct {
    double *hz, *density;
    size_t count;
} density_t;

static density_t density_of(const double *signal, const compared_t *c) {
    static const double band = 1.0594630943592953; /* 2^(1/12) */
    spectrum_t s;
    spectrum_of(signal, c->samples, c->sample_rate_hz, &s);
    density_t d = {allocate(s.count, sizeof(double)), allocate(s.count, sizeof(double)), 0};
    for (size_t f = 2, next; f < s.count; f = next) {
        double energy = 0.0;
        for (next = f; next < s.count && (next == f || (double)next < band * (double)f); next++) {
            energy += s.energy[next];
        }
        if (energy > 0.0) {
            d.hz[d.count] = s.step_hz * 0.5 * (double)(f + next - 1);
            d.density[d.count++] = sqrt(energy / ((double)(next - f) * s.white) / (0.5 * c->sample_rate_hz));
        }
    }
    spectrum_free(&s);
    return d;
}

static void density_free(density_t *density) {
    free(density->hz);
    free(density->density);
}

/* What there is of the two models begins at line `first` of two. */
static size_t first_model(const compared_t *c) {
    return c->before_um != NULL ? 0 : 1;
}

/* What the models leave, over x: the differences that the eye misses where models are drawn themselves. */
static void write_errors(FILE *file, const char *title, const char *x_label, const double *x, double *const error[2],
                         size_t begin, size_t first, size_t length) {
    plot_line_t line[2];
    for (size_t i = begin; i < 2; i++) {
        line[i] = (plot_line_t){class_name[i], begin == 0 ? label[i] : "model", x, error[i] + first, length};
    }
    plot_write(file, &(plot_t){title, x_label, "recorded − model, µm", line + begin, 2 - begin, PLOT_NO_SHADE});
}

static void write_spectrum(FILE *file, const compared_t *c, double *const error[2], size_t begin) {
    density_t density[2] = {{0}};
    plot_line_t line[2];
    for (size_t i = begin; i < 2; i++) {
        density[i] = density_of(error[i], c);
        line[i] = (plot_line_t){class_name[i], label[i], density[i].hz, density[i].density, density[i].count};
    }
    plot_write_logarithmic(file, &(plot_t){"Spectrum of the residual", "frequency, Hz", "density, µm/√Hz", line + begin,
                                           2 - begin, PLOT_NO_SHADE});
    for (size_t i = begin; i < 2; i++) {
        density_free(&density[i]);
    }
}

/* Recorded displacement and models of it over x. The earlier model is dashed: where they agree, both are seen. */
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
