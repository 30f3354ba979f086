/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/noise_budget.h"
#include "numerics/spectrum.h"
#include "page/svg_plot.h"
#include "report/density.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Standard errors by which something has to exceed the noise. */
static const double significant = 3.0;
/* Independent frequencies under a Hann window are this many times the inverse duration apart. */
static const double hann_width = 1.5;

/* Mean square of a signal within a band, from its spectrum. */
static double power_in(const spectrum_t *s, size_t samples, double low_hz, double high_hz) {
    double energy = 0.0;
    for (size_t f = 1; f < s->count; f++) {
        const double hz = (double)f * s->step_hz;
        energy += hz >= low_hz && hz < high_hz ? s->energy[f] : 0.0;
    }
    return energy / (double)samples;
}

static double noise_power_in(const budget_input_t *input, double step_hz, double low_hz, double high_hz) {
    double power = 0.0;
    for (size_t f = (size_t)ceil(low_hz / step_hz); input->noise != NULL && (double)f * step_hz < high_hz; f++) {
        const double density = density_of_noise(input->noise, (double)f * step_hz, input->sample_rate_hz);
        power += density * density * step_hz;
    }
    return power;
}

static void spectrum_about_mean(const double *signal, const budget_input_t *input, spectrum_t *s) {
    double *x = allocate(input->samples, sizeof *x), mean = 0.0;
    for (size_t k = 0; k < input->samples; k++) {
        mean += signal[k] / (double)input->samples;
    }
    for (size_t k = 0; k < input->samples; k++) {
        x[k] = signal[k] - mean;
    }
    spectrum_of(x, input->samples, input->sample_rate_hz, s);
    free(x);
}

static void add(double *all, double part) {
    *all = sqrt(*all * *all + part * part);
}

/* The next edge: a power of ten above this frequency. */
static double next_edge(double hz, double end) {
    return fmin(end, pow(10.0, floor(log10(hz) + 1e-9) + 1.0));
}

void noise_budget(const budget_input_t *input, noise_budget_t *budget) {
    const double duration_s = (double)input->samples / input->sample_rate_hz;
    spectrum_t residual, left, share[DIAGNOSIS_MOST_FINDINGS];
    memset(budget, 0, sizeof *budget);
    spectrum_about_mean(input->residual_um, input, &residual);
    spectrum_about_mean(input->left_um, input, &left);
    for (size_t i = 0; i < input->shares; i++) {
        spectrum_about_mean(input->share_um[i], input, &share[i]);
    }
    const double end = 0.5 * input->sample_rate_hz;
    for (double low = 1.0 / duration_s; low < 0.999 * end && budget->bands < BUDGET_MOST_BANDS;) {
        const double high = next_edge(low, end),
                     past = high < end ? high : 2.0 * end; /* half the rate is in the last */
        budget_band_t *band = &budget->band[budget->bands++];
        *band = (budget_band_t){.low_hz = low, .high_hz = high};
        const double noise = noise_power_in(input, residual.step_hz, low, high);
        const double remains = power_in(&left, input->samples, low, past);
        const double independent = fmax(1.0, (high - low) * duration_s / hann_width);
        const bool more = remains > noise * (1.0 + significant / sqrt(independent));
        band->residual_um = sqrt(power_in(&residual, input->samples, low, past));
        band->noise_um = sqrt(noise);
        band->unexplained_um = more ? sqrt(remains - noise) : 0.0;
        add(&band->total_um, band->noise_um);
        add(&band->total_um, band->unexplained_um);
        for (size_t i = 0; i < input->shares; i++) {
            band->share_um[i] = sqrt(power_in(&share[i], input->samples, low, past));
            add(&band->total_um, band->share_um[i]);
            add(&budget->all.share_um[i], band->share_um[i]);
        }
        add(&budget->all.residual_um, band->residual_um);
        add(&budget->all.noise_um, band->noise_um);
        add(&budget->all.unexplained_um, band->unexplained_um);
        add(&budget->all.total_um, band->total_um);
        low = high;
    }
    budget->all.low_hz = 1.0 / duration_s;
    budget->all.high_hz = end;
    for (size_t i = 0; i < input->shares; i++) {
        spectrum_free(&share[i]);
    }
    spectrum_free(&residual);
    spectrum_free(&left);
}

/* Density of the sum of squares of lines that have the same frequencies as the last one, as all with energy have. */
static density_t total_of(const density_t *part, size_t parts, const density_t *frequencies) {
    density_t total = {allocate(frequencies->count, sizeof(double)), allocate(frequencies->count, sizeof(double)), 0};
    size_t *at = allocate(parts, sizeof *at);
    for (size_t f = 0; f < frequencies->count; f++) {
        double square = 0.0;
        for (size_t i = 0; i < parts; i++) {
            while (at[i] < part[i].count && part[i].hz[at[i]] < frequencies->hz[f]) {
                at[i]++;
            }
            if (at[i] < part[i].count && part[i].hz[at[i]] == frequencies->hz[f]) {
                square += part[i].density[at[i]] * part[i].density[at[i]];
            }
        }
        if (square > 0.0) {
            total.hz[total.count] = frequencies->hz[f];
            total.density[total.count++] = sqrt(square);
        }
    }
    free(at);
    return total;
}

static void write_figure(FILE *file, const budget_input_t *input) {
    enum { MOST = DIAGNOSIS_MOST_FINDINGS + 4 };
    static const char *const class_name[DIAGNOSIS_MOST_FINDINGS] = {"after",        "other",         "before dashed",
                                                                    "after dashed", "before dotted", "after dotted"};
    density_t density[MOST] = {{0}};
    plot_line_t line[MOST];
    size_t parts = 0;
    for (; parts < input->shares; parts++) {
        density[parts] = density_of(input->share_um[parts], input->samples, input->sample_rate_hz);
        line[parts + 2] = (plot_line_t){class_name[parts], input->name[parts], density[parts].hz,
                                        density[parts].density, density[parts].count};
    }
    const density_t left = density_of(input->left_um, input->samples, input->sample_rate_hz);
    density[parts] = left;
    line[parts + 2] = (plot_line_t){"plain", "noise and unexplained", left.hz, left.density, left.count};
    parts++;
    density_t measured = density_of(input->residual_um, input->samples, input->sample_rate_hz);
    density_t total = total_of(density, parts, &measured), noise = {0};
    line[0] = (plot_line_t){"plain under", "total", total.hz, total.density, total.count};
    line[1] = (plot_line_t){"before", "residual", measured.hz, measured.density, measured.count};
    size_t lines = parts + 2;
    if (input->shares == 0) { /* then the residual is the total, and all that is left */
        line[0] = (plot_line_t){"after", "residual", measured.hz, measured.density, measured.count};
        lines = 1;
    }
    if (input->noise != NULL) {
        noise = density_of_noise_at(input->noise, &measured, input->sample_rate_hz);
        line[lines++] = (plot_line_t){"plain dotted", "noise", noise.hz, noise.density, noise.count};
    }
    plot_write_logarithmic(
        file, &(plot_t){"Budget over frequency", "frequency, Hz", "density, µm/√Hz", line, lines, PLOT_NO_SHADE});
    for (size_t i = 0; i < parts; i++) {
        density_free(&density[i]);
    }
    density_free(&measured);
    density_free(&total);
    density_free(&noise);
}

static void write_cell(FILE *file, double um) {
    if (um > 0.0) {
        fprintf(file, "<td>%.3g</td>", 1e3 * um);
    } else {
        fprintf(file, "<td>–</td>");
    }
}

static void write_row(FILE *file, const budget_input_t *input, const budget_band_t *band, bool last) {
    fprintf(file, "<tr><td>%s%.3g to %.3g Hz</td>", last ? "all: " : "", band->low_hz, band->high_hz);
    for (size_t i = 0; i < input->shares; i++) {
        write_cell(file, band->share_um[i]);
    }
    if (input->noise != NULL) {
        write_cell(file, band->noise_um);
    }
    write_cell(file, band->unexplained_um);
    write_cell(file, band->total_um);
    write_cell(file, band->residual_um);
    fprintf(file, "</tr>\n");
}

void noise_budget_write(FILE *file, const budget_input_t *input) {
    noise_budget_t budget;
    noise_budget(input, &budget);
    fprintf(file, "<div class=\"row pictures\">\n");
    write_figure(file, input);
    fprintf(file, "</div>\n<div class=\"wide\"><table>\n<thead><tr><th>RMS, nm</th>");
    for (size_t i = 0; i < input->shares; i++) {
        fprintf(file, "<th>");
        write_escaped(file, input->name[i]);
        fprintf(file, "</th>");
    }
    fprintf(file, "%s<th>unexplained</th><th>total</th><th>residual</th></tr></thead>\n<tbody>\n",
            input->noise != NULL ? "<th>noise</th>" : "");
    for (size_t b = 0; b < budget.bands; b++) {
        write_row(file, input, &budget.band[b], false);
    }
    write_row(file, input, &budget.all, true);
    fprintf(file, "</tbody></table></div>\n<p class=\"note\">Residual: recorded less the model, before anything was "
                  "found. A block's share is what the model loses without it, its hysteresis fitted again. "
                  "Unexplained: what is left beyond the noise; –: no more than three standard errors of the noise. "
                  "Total: the root of the sum of squares. It differs from the residual where shares are alike or act "
                  "against each other.</p>\n");
}
