/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/bode.h"
#include "base/json_output.h"
#include "page/html_page.h"
#include "page/svg_plot.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double degrees = 180.0 / M_PI;

void bode_of_simulated(const recording_t *recording, const drive_look_t *drive, const double *simulated_um,
                       bode_t *bode) {
    *bode = (bode_t){.recording = recording->name, .has_model = simulated_um != NULL};
    response_look(recording, drive, &bode->measured);
    if (simulated_um != NULL) {
        recording_t simulated = *recording; /* the drive and the rate are the recording's; only read */
        double *position = allocate(recording->samples, sizeof *position);
        memcpy(position, simulated_um, recording->samples * sizeof *position);
        simulated.column[COLUMN_DISPLACEMENT] = position;
        response_look(&simulated, drive, &bode->model);
        free(position);
    }
}

bool bode_of(const recording_t *recording, const drive_look_t *drive, const model_t *model, bode_t *bode,
             failure_t *failure) {
    double *position = NULL;
    bool good = true;
    if (model != NULL) {
        position = allocate(recording->samples, sizeof *position);
        good = chain_simulate(model, recording, 1, position, failure);
    }
    if (good) {
        bode_of_simulated(recording, drive, position, bode);
    }
    free(position);
    return good;
}

enum { FEWEST_SAMPLES = 64 };

bool bode_ask(const recording_t *recording, const model_t *model, bode_t *bode, failure_t *failure) {
    drive_look_t drive;
    if (recording->samples < FEWEST_SAMPLES) {
        return fail(failure, "%s: %zu samples are too few for a frequency response; %d are needed", recording->name,
                    recording->samples, FEWEST_SAMPLES);
    }
    if (!drive_look(recording, &drive, failure)) {
        return false;
    }
    const bool good = bode_of(recording, &drive, model, bode, failure);
    drive_look_free(&drive);
    if (good && bode->measured.count == 0) {
        bode_free(bode);
        return fail(
            failure,
            "%s: no frequency response: the drive moves too little, or not for long enough, or like a transient",
            recording->name);
    }
    return good;
}

void bode_free(bode_t *bode) {
    response_free(&bode->measured);
    response_free(&bode->model);
}

/* The model's point at the frequency of a measured one; both have the same lines, unless one was without power. */
static const response_point_t *model_at(const bode_t *bode, double frequency_hz) {
    for (size_t i = 0; i < bode->model.count; i++) {
        if (fabs(bode->model.point[i].frequency_hz - frequency_hz) <= 1e-6 * frequency_hz) {
            return &bode->model.point[i];
        }
    }
    return NULL;
}

void bode_print(FILE *file, const bode_t *bode) {
    fprintf(file, "%s: %zu %s, by %s\n", bode->recording, bode->measured.count,
            bode->measured.count == 1 ? "frequency" : "frequencies",
            bode->measured.periodic ? "whole periods of the drive" : "local polynomials");
    fprintf(file, "%12s %12s %9s %9s %8s %9s%s\n", "frequency Hz", "gain um/V", "+-", "phase deg", "+-", "coherence",
            bode->has_model ? "   model um/V  and deg" : "");
    for (size_t i = 0; i < bode->measured.count; i++) {
        const response_point_t *p = &bode->measured.point[i], *m = model_at(bode, p->frequency_hz);
        fprintf(file, "%12.6g %12.5g %9.2g %9.2f %8.2g %9.4f", p->frequency_hz, p->gain_um_per_v, p->gain_sigma,
                degrees * p->phase_rad, degrees * p->phase_sigma, p->coherence);
        if (m != NULL) {
            fprintf(file, " %12.5g %9.2f", m->gain_um_per_v, degrees * m->phase_rad);
        }
        fputc('\n', file);
    }
    if (bode->measured.goes_on_to_hz > 0.0) {
        fprintf(file,
                "It ends there: the drive sweeps on to about %.4g Hz within %.2g s, too fast to tell a response from "
                "how the recording ends.\n",
                bode->measured.goes_on_to_hz, bode->measured.goes_on_s);
    }
}

static json_t *points_of(const response_t *response) {
    json_t *list = json_array();
    for (size_t i = 0; i < response->count; i++) {
        const response_point_t *p = &response->point[i];
        json_array_append_new(
            list, json_pack("{s:f, s:o, s:o, s:o, s:o, s:o, s:o}", "frequency_hz", p->frequency_hz, "gain_um_per_v",
                            json_number_or_null(p->gain_um_per_v), "gain_sigma", json_number_or_null(p->gain_sigma),
                            "phase_deg", json_number_or_null(degrees * p->phase_rad), "phase_sigma_deg",
                            json_number_or_null(degrees * p->phase_sigma), "coherence",
                            json_number_or_null(p->coherence), "lag_s", json_number_or_null(p->lag_s)));
    }
    return list;
}

json_t *bode_to_json(const bode_t *bode) {
    return json_pack("{s:s, s:s, s:o, s:o}", "recording", bode->recording, "method",
                     bode->measured.periodic ? "periods" : "local polynomials", "points", points_of(&bode->measured),
                     "model", bode->has_model ? points_of(&bode->model) : json_null());
}

/* A response as lines, the phase without jumps of a turn. */
typedef struct {
    double *hz, *gain, *phase, *coherence;
    size_t count;
} curves_t;

static curves_t curves_of(const response_t *response) {
    curves_t c = {allocate(response->count, sizeof(double)), allocate(response->count, sizeof(double)),
                  allocate(response->count, sizeof(double)), allocate(response->count, sizeof(double)), 0};
    for (size_t i = 0; i < response->count; i++) {
        const response_point_t *p = &response->point[i];
        if (!(p->gain_um_per_v > 0.0) || !isfinite(p->phase_rad)) {
            continue;
        }
        double phase = degrees * p->phase_rad;
        while (c.count > 0 && phase - c.phase[c.count - 1] > 180.0) {
            phase -= 360.0;
        }
        while (c.count > 0 && phase - c.phase[c.count - 1] < -180.0) {
            phase += 360.0;
        }
        c.hz[c.count] = p->frequency_hz;
        c.gain[c.count] = p->gain_um_per_v;
        c.phase[c.count] = phase;
        c.coherence[c.count++] = p->coherence;
    }
    return c;
}

static void curves_free(curves_t *c) {
    free(c->hz);
    free(c->gain);
    free(c->phase);
    free(c->coherence);
}

/* A sine's. */
static void write_one(FILE *file, const bode_t *bode) {
    const response_point_t *p = &bode->measured.point[0], *m = model_at(bode, p->frequency_hz);
    fprintf(file,
            "<p>At %.6g&nbsp;Hz the gain is %.5g&nbsp;&plusmn;&nbsp;%.2g&nbsp;µm/V and the phase "
            "%.2f&nbsp;&plusmn;&nbsp;%.2g degrees, with a coherence of %.4f",
            p->frequency_hz, p->gain_um_per_v, p->gain_sigma, degrees * p->phase_rad, degrees * p->phase_sigma,
            p->coherence);
    if (m != NULL) {
        fprintf(file, "; of the model %.5g&nbsp;µm/V and %.2f degrees", m->gain_um_per_v, degrees * m->phase_rad);
    }
    fprintf(file, ".</p>\n");
}

void bode_write_figures(FILE *file, const bode_t *bode) {
    if (bode->measured.count == 1) {
        write_one(file, bode);
        return;
    }
    curves_t measured = curves_of(&bode->measured), model = curves_of(&bode->model);
    if (measured.count >= 2) {
        const size_t lines = bode->has_model && model.count > 0 ? 2 : 1;
        const plot_line_t gain[] = {{"plain under", "recorded", measured.hz, measured.gain, measured.count},
                                    {"after", "model", model.hz, model.gain, model.count}};
        const plot_line_t phase[] = {{"plain under", "recorded", measured.hz, measured.phase, measured.count},
                                     {"after", "model", model.hz, model.phase, model.count}};
        const plot_line_t coherence = {"plain", "recorded", measured.hz, measured.coherence, measured.count};
        fprintf(file, "<div class=\"row pictures\">\n");
        plot_write_logarithmic(file, &(plot_t){"Gain", "frequency, Hz", "gain, µm/V", gain, lines, PLOT_NO_SHADE});
        plot_write_over_frequency(file,
                                  &(plot_t){"Phase", "frequency, Hz", "phase, degrees", phase, lines, PLOT_NO_SHADE});
        plot_write_over_frequency(file,
                                  &(plot_t){"Coherence", "frequency, Hz", "coherence", &coherence, 1, PLOT_NO_SHADE});
        fprintf(file,
                "</div>\n<p class=\"note\">The response by which a linear system comes nearest, at the amplitudes of "
                "this drive, by %s. Coherence: the part of the position's power that goes with the drive; where it is "
                "low, noise or hysteresis decides, and gain and phase say little.%s</p>\n",
                bode->measured.periodic ? "whole periods of the drive" : "local polynomials",
                lines > 1 ? " The model is driven by the recorded drive and estimated in the same way." : "");
    }
    curves_free(&measured);
    curves_free(&model);
}

bool bode_write_page(const bode_t *bode, bool small, const char *path, failure_t *failure) {
    output_file_t page;
    if (!page_open(&page, path, "Frequency response", failure)) {
        return false;
    }
    const response_point_t *peak = response_peak(&bode->measured);
    fprintf(page.file, "<p class=\"verdict\">");
    write_escaped(page.file, bode->recording);
    fprintf(page.file, ": drive to position, %zu %s%s.", bode->measured.count,
            bode->measured.count == 1 ? "frequency" : "frequencies", small ? ", for small signals" : "");
    if (peak != NULL && bode->measured.count > 1) {
        fprintf(page.file, " The gain is largest at %.4g&nbsp;Hz.", peak->frequency_hz);
    }
    if (bode->measured.goes_on_to_hz > 0.0) {
        fprintf(page.file,
                " The response ends before the drive does, which sweeps on to about %.2g&nbsp;Hz within %.2g&nbsp;s.",
                bode->measured.goes_on_to_hz, bode->measured.goes_on_s);
    }
    fprintf(page.file, "</p>\n");
    bode_write_figures(page.file, bode);
    return page_close(&page, true, failure);
}
