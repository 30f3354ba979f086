/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis_pictures.h"
#include "failure.h"
#include "spectrum.h"
#include "svg_plot.h"
#include <stdlib.h>

#define BEFORE "before"
#define AFTER  "after"

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

/* Where the two models differ most, on average over `length` samples: the first of them. */
static size_t most_different(const compared_t *c, size_t length) {
    double sum = 0.0, most = -1.0;
    size_t best = 0;
    for (size_t k = 0; k < c->samples; k++) {
        const double d = c->after_um[k] - c->before_um[k];
        sum += d * d;
        if (k >= length) {
            const double gone = c->after_um[k - length] - c->before_um[k - length];
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

static void write_residuals(FILE *file, const compared_t *c, const double *time_s) {
    double *before = residual(c, c->before_um), *after = residual(c, c->after_um);
    const plot_line_t traces[] = {{"before", BEFORE, time_s, before, c->samples},
                                  {"after", AFTER, time_s, after, c->samples}};
    density_t density_before = density_of(before, c), density_after = density_of(after, c);
    const plot_line_t spectra[] = {{"before", BEFORE, density_before.hz, density_before.density, density_before.count},
                                   {"after", AFTER, density_after.hz, density_after.density, density_after.count}};
    plot_write(file, &(plot_t){"Residual: recorded − model", "time, s", "residual, µm", traces, 2, PLOT_NO_SHADE});
    plot_write_logarithmic(
        file, &(plot_t){"Spectrum of the residual", "frequency, Hz", "density, µm/√Hz", spectra, 2, PLOT_NO_SHADE});
    density_free(&density_before);
    density_free(&density_after);
    free(before);
    free(after);
}

void write_pictures(FILE *file, const compared_t *c) {
    enum { SHOWN = 200, LEAST = 100 };
    const size_t wished = c->samples / SHOWN > LEAST ? c->samples / SHOWN : LEAST;
    const size_t length = wished < c->samples ? wished : c->samples, first = most_different(c, length);
    double *time_s = times(c);
    const plot_line_t loop[] = {{"plain under", "recorded", c->drive_v, c->measured_um, c->samples},
                                {"before", BEFORE, c->drive_v, c->before_um, c->samples},
                                {"after", AFTER, c->drive_v, c->after_um, c->samples}};
    const plot_line_t trace[] = {{"plain under", "recorded", time_s + first, c->measured_um + first, length},
                                 {"before", BEFORE, time_s + first, c->before_um + first, length},
                                 {"after", AFTER, time_s + first, c->after_um + first, length}};
    fprintf(file, "<div class=\"row pictures\">\n");
    plot_write(file, &(plot_t){"Loop", "drive, V", "position, µm", loop, 3, PLOT_NO_SHADE});
    plot_write(file, &(plot_t){"Where the two models differ most", "time, s", "position, µm", trace, 3, PLOT_NO_SHADE});
    write_residuals(file, c, time_s);
    fprintf(file, "</div>\n");
    free(time_s);
}
