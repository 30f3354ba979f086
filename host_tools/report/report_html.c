/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/quantity.h"
#include "base/shown_name.h"
#include "page/html_page.h"
#include "page/svg_plot.h"
#include "report/prose.h"
#include "report/report.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ERROR_LABEL "position − reference, µm"

/* Part of a track that the pictures show: all of it, or the last three periods of a fast one. */
typedef struct {
    size_t first, count;
} window_t;

static window_t shown_window(const recording_t *recording) {
    const double *reference = recording->column[COLUMN_REFERENCE];
    double low = reference[0], high = reference[0];
    for (size_t k = 1; k < recording->samples; k++) {
        low = fmin(low, reference[k]);
        high = fmax(high, reference[k]);
    }
    const double middle = 0.5 * (low + high);
    enum { SHOWN = 3 };
    size_t upward[SHOWN + 1] = {0}, crossings = 0;
    for (size_t k = 1; k < recording->samples; k++) {
        if (reference[k - 1] < middle && reference[k] >= middle) {
            memmove(upward, upward + 1, SHOWN * sizeof upward[0]);
            upward[SHOWN] = k;
            crossings++;
        }
    }
    if (crossings <= 2 * SHOWN) {
        return (window_t){0, recording->samples};
    }
    return (window_t){upward[0], upward[SHOWN] - upward[0]};
}

/* Time and tracking error of a window. */
typedef struct {
    double *time_s, *error_um;
    size_t count;
} trace_t;

/* start_s: of the recording's first sample; NaN: of the window's. */
static trace_t error_trace(const recording_t *recording, double start_s) {
    const window_t window = shown_window(recording);
    const double from_s = isfinite(start_s) ? start_s + (double)window.first / recording->sample_rate_hz : 0.0;
    trace_t trace = {allocate(window.count, sizeof(double)), allocate(window.count, sizeof(double)), window.count};
    for (size_t i = 0; i < window.count; i++) {
        const size_t k = window.first + i;
        trace.time_s[i] = from_s + (double)i / recording->sample_rate_hz;
        trace.error_um[i] = recording->column[COLUMN_DISPLACEMENT][k] - recording->column[COLUMN_REFERENCE][k];
    }
    return trace;
}

/* Whether both recordings show the same part of the same reference, so that the times of the one are those of the
 * other. */
static bool show_the_same(const recording_t *a, const recording_t *b) {
    return a->start_s == b->start_s && a->sample_rate_hz == b->sample_rate_hz &&
           shown_window(a).first == shown_window(b).first;
}

static plot_line_t trace_line(const trace_t *trace, const char *class_name, const char *label) {
    return (plot_line_t){class_name, label, trace->time_s, trace->error_um, trace->count};
}

static void trace_free(trace_t *trace) {
    free(trace->time_s);
    free(trace->error_um);
}

static plot_line_t position_line(const recording_t *recording, const char *class_name, const char *label) {
    const window_t window = shown_window(recording);
    return (plot_line_t){class_name, label, recording->column[COLUMN_REFERENCE] + window.first,
                         recording->column[COLUMN_DISPLACEMENT] + window.first, window.count};
}

static void write_track(FILE *file, const report_words_t *words, const report_track_t *track) {
    const plot_line_t loop[] = {position_line(&track->before, "before", words->before),
                                position_line(&track->after, "after", words->after)};
    const bool same = show_the_same(&track->before, &track->after);
    const double start_s = same ? track->before.start_s : (double)NAN;
    const char *const time = same ? "time, s" : "time in this part, s";
    trace_t before = error_trace(&track->before, start_s), after = error_trace(&track->after, start_s);
    const plot_line_t error[] = {trace_line(&before, "before", words->before),
                                 trace_line(&after, "after", words->after)};

    fprintf(file, "<h3>");
    write_escaped(file, track->name);
    fprintf(file, "</h3>\n<div class=\"row\">\n");
    plot_write(file, &(plot_t){"Loop", "reference, µm", "position, µm", loop, 2, PLOT_NO_SHADE});
    plot_write(file, &(plot_t){"Error", time, ERROR_LABEL, error, 2, PLOT_NO_SHADE});
    plot_write(file, &(plot_t){"Error that remains", time, ERROR_LABEL, &error[1], 1, PLOT_NO_SHADE});
    fprintf(file, "</div>\n");
    trace_free(&before);
    trace_free(&after);
}

static void write_verdict(FILE *file, const report_t *report) {
    const report_track_t *worst = report_worst(report);
    fprintf(file, "<p class=\"verdict\">");
    if (report_gain(worst) <= 1.0) {
        fprintf(file, "%s ", report_words(report)->no_help);
    } else if (report->tracks > 1) {
        fprintf(file, "The tracking error falls to 1/%.1f or less on every track. ", report_gain(worst));
    } else {
        fprintf(file, "The tracking error falls to 1/%.1f. ", report_gain(worst));
    }
    fprintf(file, report->tracks > 1 ? "The least gain is on “" : "On “");
    write_escaped(file, worst->name);
    fprintf(file, "”: from %.2f&nbsp;%% to %.2f&nbsp;%%.</p>\n", worst->error_before.nrmse_percent,
            worst->error_after.nrmse_percent);
    if (report->simulated != NULL) {
        fprintf(file, "<p class=\"simulated\"><strong>Simulated, not measured on hardware.</strong> ");
        write_escaped(file, report->simulated);
        fprintf(file, "</p>\n");
    }
}

/* A string of a JSON object, or nothing. */
static void write_text(FILE *file, const json_t *object, const char *key) {
    const char *text = json_string_value(json_object_get(object, key));
    write_escaped(file, text == NULL ? "" : text);
}

static void write_finding(FILE *file, json_t *finding) {
    const char *name;
    json_t *parameter;
    fprintf(file, "<li><strong>");
    write_text(file, finding, "block");
    fprintf(file, "</strong>, in the ");
    write_text(file, finding, "place");
    fprintf(file, " (");
    write_text(file, finding, "certainty");
    fprintf(file, ")");
    json_object_foreach(json_object_get(finding, "parameters"), name, parameter) {
        const json_t *value = json_object_get(parameter, "value"), *sigma = json_object_get(parameter, "sigma");
        if (json_is_number(value)) {
            char text[QUANTITY_TEXT];
            const char *unit = json_string_value(json_object_get(parameter, "unit"));
            quantity_text(text, name, unit != NULL ? unit : "1", json_number_value(value),
                          json_is_number(sigma) ? json_number_value(sigma) : (double)NAN);
            fprintf(file, ", ");
            write_prose(file, text);
        }
    }
    fprintf(file, ". ");
    write_text(file, finding, "explanation");
    fprintf(file, "</li>\n");
}

static void write_diagnosis(FILE *file, const json_t *diagnosis) {
    const json_t *findings = json_object_get(diagnosis, "findings");
    fprintf(file, "<h2>What the diagnosis found</h2>\n<p>Verdict: ");
    write_text(file, diagnosis, "verdict");
    fprintf(file, ".</p>\n<ul>\n");
    for (size_t i = 0; i < json_array_size(findings); i++) {
        write_finding(file, json_array_get(findings, i));
    }
    fprintf(file, "</ul>\n");
}

static void write_table(FILE *file, const report_t *report) {
    fprintf(file, "<div class=\"wide\"><table>\n<thead><tr><th>Track</th><th>Stroke, µm</th>"
                  "<th>Error before, %%</th><th>Error after, %%</th><th>Factor</th>"
                  "<th>Worst before, µm</th><th>Worst after, µm</th></tr></thead>\n<tbody>\n");
    for (size_t i = 0; i < report->tracks; i++) {
        const report_track_t *track = &report->track[i];
        fprintf(file, "<tr><td>");
        write_escaped(file, track->name);
        fprintf(
            file,
            "</td><td>%.1f</td><td>%.3f</td><td>%.3f</td><td class=\"gain\">%.1f</td><td>%.3f</td><td>%.3f</td></tr>\n",
            track->peak_to_peak_um, track->error_before.nrmse_percent, track->error_after.nrmse_percent,
            report_gain(track), track->error_before.max_um, track->error_after.max_um);
    }
    fprintf(file,
            "</tbody></table></div>\n<p class=\"note\">Error: RMS of position minus reference, over the stroke "
            "(peak-to-peak reference). %s Worst: largest magnitude of the error.</p>\n",
            report_words(report)->what_they_are);
}

static void write_remaining(FILE *file, const report_t *report) {
    fprintf(file, "<h2>What remains after compensation</h2>\n<div class=\"wide\"><table>\n<thead><tr><th>Track</th>"
                  "<th>Error, %%</th><th>Offset and gain, %%</th><th>Delay, %%</th><th>Delay, µs</th>"
                  "<th>Noise, %%</th><th>Rest, %%</th></tr></thead>\n<tbody>\n");
    for (size_t i = 0; i < report->tracks; i++) {
        const report_track_t *track = &report->track[i];
        const error_budget_t *part = &track->remaining;
        const double percent = 100.0 / track->peak_to_peak_um;
        fprintf(file, "<tr><td>");
        write_escaped(file, track->name);
        fprintf(file, "</td><td>%.3f</td><td>%.3f</td><td>%.3f</td><td>%.1f</td><td>%.3f</td><td>%.3f</td></tr>\n",
                track->error_after.nrmse_percent, percent * part->static_um, percent * part->delay_um,
                1e6 * part->delay_s, percent * part->noise_um, percent * part->rest_um);
    }
    fprintf(
        file,
        "</tbody></table></div>\n<p class=\"note\">From the compensated tracks alone. The squares of the parts add "
        "up to the square of the error. Offset and gain: what a corrected straight line would remove. Delay: what a "
        "shift in time would remove (positive: the position is late). Noise: what changes from sample to sample. "
        "Rest: hysteresis that the model does not have, ringing, and whatever else. For a sine, a resonance shows as "
        "gain and delay; on a slow track, what is left of hysteresis shows as a long delay.</p>\n");
}

static void write_number(FILE *file, const json_t *fit, const char *key, const char *text) {
    const json_t *value = fit == NULL ? NULL : json_object_get(fit, key);
    if (json_is_number(value)) {
        fprintf(file, "%s %.3f&nbsp;%%. ", text, json_number_value(value));
    }
}

/* A time that the fit states about its only recording, or NAN. */
static double fit_time(const model_t *model, const char *key) {
    const json_t *recordings = json_object_get(model->fit, "recordings"); /* NULL of NULL */
    const json_t *time_s = json_object_get(json_array_get(recordings, 0), key);
    return json_array_size(recordings) == 1 && json_is_number(time_s) ? json_number_value(time_s) : (double)NAN;
}

/* By its name. A fit that names none, as of a model written by hand, may be to any. */
static bool is_fitted_to(const model_t *model, const recording_t *recording) {
    const json_t *recordings = json_object_get(model->fit, "recordings");
    bool is = json_array_size(recordings) == 0;
    for (size_t i = 0; i < json_array_size(recordings); i++) {
        const char *name = json_string_value(json_object_get(json_array_get(recordings, i), "name"));
        is = is || (name != NULL && strcmp(without_folder(name), without_folder(recording->name)) == 0);
    }
    return is;
}

static bool write_model(FILE *file, const report_t *report, failure_t *failure) {
    const recording_t *recording = report->recording;
    double *position_um = allocate(recording->samples, sizeof *position_um);
    if (!chain_simulate(report->model, recording, 1, position_um, failure)) {
        free(position_um);
        return false;
    }
    double *time_s = allocate(recording->samples, sizeof *time_s);
    double *error_um = allocate(recording->samples, sizeof *error_um);
    const double *measured_um = recording->column[COLUMN_DISPLACEMENT], *drive_v = recording->column[COLUMN_DRIVE];
    for (size_t k = 0; k < recording->samples; k++) {
        time_s[k] = recording->start_s + (double)k / recording->sample_rate_hz;
        error_um[k] = position_um[k] - measured_um[k];
    }
    /* Before that time the difference is due to the unknown past of the recording. */
    const bool fitted = is_fitted_to(report->model, recording);
    const double determined_s = fitted ? fit_time(report->model, "memory_determined_from_s") : (double)NAN;
    size_t from = 0;
    while (from + 2 < recording->samples && time_s[from] < determined_s) {
        from++;
    }
    const plot_line_t loop[] = {
        {"before under", "recorded", drive_v + from, measured_um + from, recording->samples - from},
        {"after", "model", drive_v + from, position_um + from, recording->samples - from}};
    const plot_line_t error = {"plain", "model − recorded", time_s + from, error_um + from, recording->samples - from};
    const double held_out_s = fit_time(report->model, "held_out_from_s");
    const bool held_out =
        fitted && !json_is_true(json_object_get(report->model->fit, "fitted_to_all")) && isfinite(held_out_s);

    fprintf(file, "<h2>The model and %s</h2>\n<p>Recording: ",
            fitted ? "its recording" : "a recording that it was not fitted to");
    write_escaped(file, without_folder(recording->name));
    for (size_t i = 0; i < recording->keys; i++) {
        fprintf(file, "; ");
        write_escaped(file, recording->key[i].key);
        fprintf(file, ": ");
        write_escaped(file, recording->key[i].value);
    }
    fprintf(file, ".</p>\n<p>Chain:");
    for (size_t i = 0; i < report->model->blocks; i++) {
        fprintf(file, "%s %s", i > 0 ? "," : "", report->model->block[i].block->name);
    }
    fprintf(file, ". ");
    if (fitted) {
        write_number(file, report->model->fit, "held_out_nrmse_percent",
                     "Error on the part that was held out of the fit:");
        write_number(file, report->model->fit, "nrmse_percent", "On the fitted part:");
    } else {
        fprintf(file, "Error: %.3f&nbsp;%%. ",
                measure_error(measured_um, position_um, recording->samples).nrmse_percent);
    }
    fprintf(file, "</p>\n<div class=\"row\">\n");
    plot_write(file, &(plot_t){"Recorded and modelled", "drive, V", "position, µm", loop, 2, PLOT_NO_SHADE});
    plot_write(file, &(plot_t){held_out ? "Model − recorded (shaded: held out of the fit)" : "Model − recorded",
                               "time, s", "error, µm", &error, 1, held_out ? held_out_s : PLOT_NO_SHADE});
    fprintf(file, "</div>\n");
    free(error_um);
    free(time_s);
    free(position_um);
    return true;
}

bool report_write_html(const report_t *report, const char *path, failure_t *failure) {
    output_file_t page;
    if (!page_open(&page, path, report_words(report)->title, failure)) {
        return false;
    }
    FILE *const file = page.file;
    write_verdict(file, report);
    if (report->diagnosis != NULL) {
        write_diagnosis(file, report->diagnosis);
    }
    write_table(file, report);
    fprintf(file, "<h2>Tracks</h2>\n<p class=\"note\">Of fast tracks the pictures show the last three periods; the "
                  "numbers are of the whole track.</p>\n");
    for (size_t i = 0; i < report->tracks; i++) {
        write_track(file, report_words(report), &report->track[i]);
    }
    write_remaining(file, report);
    const bool good = write_model(file, report, failure);
    return page_close(&page, good, failure);
}

bool report_write_picture(const report_t *report, const char *path, failure_t *failure) {
    output_file_t picture;
    if (!output_file_open(&picture, path, failure)) {
        return false;
    }
    const report_words_t *words = report_words(report);
    trace_t *trace = allocate(2 * report->tracks, sizeof *trace);
    plot_line_t *line = allocate(2 * report->tracks, sizeof *line);
    plot_t *plot = allocate(report->tracks, sizeof *plot);
    for (size_t i = 0; i < report->tracks; i++) {
        trace[2 * i] = error_trace(&report->track[i].before, (double)NAN);
        trace[2 * i + 1] = error_trace(&report->track[i].after, (double)NAN);
        line[2 * i] = trace_line(&trace[2 * i], "before", words->before);
        line[2 * i + 1] = trace_line(&trace[2 * i + 1], "after", words->after);
        plot[i] = (plot_t){report->track[i].name, "time, s", ERROR_LABEL, &line[2 * i], 2, PLOT_NO_SHADE};
    }
    plot_write_sheet(picture.file, plot, report->tracks, 2);
    for (size_t i = 0; i < 2 * report->tracks; i++) {
        trace_free(&trace[i]);
    }
    free(plot);
    free(line);
    free(trace);
    return output_file_close(&picture, true, failure);
}
