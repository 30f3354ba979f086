/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/event_page.h"
#include "base/json_output.h"
#include "page/html_page.h"
#include "page/svg_plot.h"
#include "report/diagnosis_json.h"
#include "report/diagnosis_text.h"
#include "report/prose.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* As long as a block of the amplifier's own watch at 10 kHz; and how finely it is moved. */
static const double stretch_s = EVENT_SINCE_S;
static const double stride_s = 0.005;

void event_time_text(time_t time, char text[EVENT_TIME]) {
    struct tm parts;
    (void)gmtime_r(&time, &parts);
    (void)strftime(text, EVENT_TIME, "%Y-%m-%dT%H:%M:%SZ", &parts);
}

static double error_at(const recording_t *record, size_t i) {
    return record->column[COLUMN_DISPLACEMENT][i] - record->column[COLUMN_REFERENCE][i];
}

static double rms_between(const recording_t *record, size_t from, size_t to) {
    double squares = 0.0;
    for (size_t i = from; i < to; i++) {
        squares += error_at(record, i) * error_at(record, i);
    }
    return sqrt(squares / (double)(to - from));
}

double event_since_s(const recording_t *record, double warned_s, double judged_s, double usual_um, double limit_um) {
    const double rate_hz = record->sample_rate_hz;
    const size_t stretch = (size_t)fmax(1.0, stretch_s * rate_hz);
    const size_t stride = (size_t)fmax(1.0, stride_s * rate_hz);
    /* Its first bad block may have begun before the error grew. */
    const double grown_s = fmax(0.0, warned_s - fmax(0.0, judged_s - EVENT_SINCE_S));
    const size_t grown = (size_t)fmin(grown_s * rate_hz, (double)record->samples);
    const double still_um = (2.0 * usual_um + limit_um) / 3.0;
    for (size_t end = grown; end >= stretch && end > 0; end = end > stride ? end - stride : 0) {
        if (rms_between(record, end - stretch, end) <= still_um) {
            return (double)end / rate_hz;
        }
    }
    return (double)NAN;
}

/* "2.31 s before the warning", and the date. */
static void since_text(const event_t *event, char text[DIAGNOSIS_LINE]) {
    text[0] = '\0';
    if (isnan(event->since_s)) {
        text_append(text, "before the record begins, which is %.2f s before the warning", event->warned_s);
        return;
    }
    const double ago_s = event->warned_s - event->since_s;
    char date[EVENT_TIME];
    event_time_text(event->warned_at - (time_t)lround(ago_s), date);
    text_append(text, "%s, %.2f s before the warning (to a tenth of a second)", date, ago_s);
}

void event_supply_text(const event_t *event, char text[EVENT_SUPPLY]) {
    char before[EVENT_SUPPLY / 4], now[EVENT_SUPPLY / 4];
    text[0] = '\0';
    if (isnan(event->usual_supply_v) || isnan(event->supply_v)) {
        return;
    }
    (void)snprintf(before, sizeof before, "%.4g V", event->usual_supply_v);
    (void)snprintf(now, sizeof now, "%.4g V", event->supply_v);
    if (strcmp(before, now) == 0) {
        (void)snprintf(text, EVENT_SUPPLY, "The high-voltage supply is %s, as before.", now);
    } else {
        (void)snprintf(text, EVENT_SUPPLY, "The high-voltage supply %s from %s to %s.",
                       event->supply_v < event->usual_supply_v ? "fell" : "rose", before, now);
    }
}

static void write_paragraph(FILE *file, const char *text) {
    fputs("<p>", file);
    write_escaped(file, text);
    fputs("</p>\n", file);
}

static void write_supply(FILE *file, const event_t *event) {
    char text[EVENT_SUPPLY];
    event_supply_text(event, text);
    if (text[0] != '\0') {
        write_paragraph(file, text);
    }
}

/* The numbers of the given chain that changed: a gain is one of them. Returns how many. */
static size_t write_refitted(FILE *file, const answer_t *answer) {
    char text[DIAGNOSIS_LINE];
    size_t written = 0;
    for (size_t i = 0; i < answer->refitted; i++) {
        for (size_t p = 0; p < answer->refitted_block[i]->parameters; p++) {
            if (refitted_text(answer, answer->refitted_block[i], p, text)) {
                fputs("<li>A number of the model changed: ", file);
                write_prose(file, text);
                fputs("</li>\n", file);
                written++;
            }
        }
    }
    return written;
}

static void write_finding(FILE *file, const answer_t *answer, const account_t *account, size_t index) {
    const finding_t *finding = &answer->finding[index];
    char text[DIAGNOSIS_LINE];
    fprintf(file, "<li><b>%s</b> (%s, confidence %.2f)", finding->block->name, certainty_name(finding->certainty),
            account->confidence[index]);
    const model_block_t *block = &answer->model.block[finding_index(answer, finding)];
    for (size_t p = 0; p < block->block->parameters; p++) {
        if (number_is_told(block, p)) {
            parameter_text(block, p, text);
            fputs("; ", file);
            write_prose(file, text);
        }
    }
    finding_explanation(finding, text);
    fputs("<br>", file);
    write_escaped(file, text);
    fputs("</li>\n", file);
}

static void write_what(FILE *file, const answer_t *answer, const account_t *account) {
    char text[DIAGNOSIS_LINE];
    verdict_sentence(answer, text);
    fputs("<h2>What changed</h2>\n", file);
    write_paragraph(file, text);
    fputs("<ul>\n", file);
    for (size_t f = 0; f < answer->findings; f++) {
        write_finding(file, answer, account, f);
    }
    const block_t *another = diagnosis_other_shape(answer);
    if (another != NULL) {
        fprintf(file, "<li>A hysteresis of another shape, <b>%s</b>, takes the place of the given one</li>\n",
                another->name);
    }
    if (write_refitted(file, answer) + answer->findings == 0 && another == NULL) {
        fprintf(file, "<li>Nothing that has a name: %s</li>\n", verdict_name(answer->verdict));
    }
    fputs("</ul>\n", file);
}

static void write_sure(FILE *file, const answer_t *answer) {
    char text[DIAGNOSIS_LINE];
    fputs("<h2>How sure</h2>\n", file);
    if (verdict_caveat(answer, text)) {
        write_paragraph(file, text);
    }
    text[0] = '\0';
    text_append(text,
                "Error on the samples that were held out: %.4f %% with the model as it is, %.4f %% with what was "
                "found",
                answer->given_held_out_percent, answer->held_out_percent);
    if (isfinite(answer->noise_percent)) {
        text_append(text, "; noise alone would be %.4f %%", answer->noise_percent);
    }
    text_append(text, ".");
    write_paragraph(file, text);
    remainder_text(answer, text);
    write_paragraph(file, text);
}

static void write_push(const event_t *event, FILE *file, const answer_t *answer) {
    fputs("<h2>What to push</h2>\n", file);
    if (event->better) {
        fprintf(file, "<p>After you have looked at the <a href=\"%s/diagnosis.html\">whole diagnosis</a>:</p>\n<pre>",
                event->folder);
        fprintf(file,
                "hyst compile %s/better.json -o better.image\nhyst push better.image --port DEV --dry-run\n"
                "hyst push better.image --port DEV</pre>\n",
                event->folder);
    } else {
        fputs("<p>Nothing. ", file);
    }
    if (event->not_better != NULL) {
        fputs(event->better ? "<p>" : "", file);
        write_escaped(file, event->not_better);
    }
    fputs(!event->better || event->not_better != NULL ? "</p>\n" : "", file);
    fprintf(file,
            "<p>To know more, record on purpose: <code>hyst record --port DEV --probe %s -o probe.csv</code></p>\n",
            next_probe(answer));
}

static void write_picture(FILE *file, const event_t *event) {
    const recording_t *r = event->record;
    double *time = allocate(r->samples, sizeof *time);
    double *error = allocate(r->samples, sizeof *error);
    for (size_t i = 0; i < r->samples; i++) {
        time[i] = (double)i / r->sample_rate_hz - event->warned_s;
        error[i] = error_at(r, i);
    }
    const plot_line_t line = {.class_name = "before", .label = "error", .x = time, .y = error, .count = r->samples};
    const plot_t plot = {.title = "Position less reference around the warning",
                         .x_label = "time from the warning on, s",
                         .y_label = "error, µm",
                         .line = &line,
                         .lines = 1,
                         .shade_from = isnan(event->since_s) ? PLOT_NO_SHADE : event->since_s - event->warned_s};
    plot_write(file, &plot);
    free(time);
    free(error);
}

bool event_write_page(const event_t *event, const answer_t *answer, const account_t *account, const char *path,
                      failure_t *failure) {
    output_file_t page;
    char date[EVENT_TIME], since[DIAGNOSIS_LINE], title[100];
    event_time_text(event->warned_at, date);
    (void)snprintf(title, sizeof title, "The model is no longer true: warning of %s", date);
    if (!page_open(&page, path, title, failure)) {
        return false;
    }
    since_text(event, since);
    fprintf(page.file,
            "<p>The error of the position had been %.4g µm (root mean square); the limit was %.4g µm. The amplifier "
            "warned at %s, and went on. Since then it is %.4g µm.</p>\n<p><b>Since when:</b> ",
            event->usual_um, event->limit_um, date, event->rms_um);
    write_escaped(page.file, since);
    fputs(".</p>\n", page.file);
    write_supply(page.file, event);
    write_picture(page.file, event);
    write_what(page.file, answer, account);
    write_sure(page.file, answer);
    write_push(event, page.file, answer);
    fprintf(
        page.file,
        "<p class=\"note\">Dates are those of the host's clock, intervals those of the amplifier's samples. Record: "
        "<a href=\"%s/recording.csv\">recording.csv</a>; diagnosed was what is shaded, from a tenth of a second "
        "on.</p>\n",
        event->folder);
    return page_close(&page, true, failure);
}

bool event_write_json(const event_t *event, const answer_t *answer, const account_t *account,
                      const recording_t *recordings, size_t count, const char *path, failure_t *failure) {
    char warned[EVENT_TIME];
    char since[EVENT_TIME] = "";
    event_time_text(event->warned_at, warned);
    if (!isnan(event->since_s)) {
        event_time_text(event->warned_at - (time_t)lround(event->warned_s - event->since_s), since);
    }
    json_t *json =
        json_pack("{s:s, s:s, s:f, s:s*, s:o, s:f, s:f, s:f, s:o, s:o, s:b, s:s*, s:s, s:o}", "format", "hyst-watch-1",
                  "warned_at", warned, "sample_time_s", event->sample_time_s, "since", since[0] != '\0' ? since : NULL,
                  "since_s_before_warning", json_number_or_null(event->warned_s - event->since_s), "usual_rms_um",
                  event->usual_um, "limit_um", event->limit_um, "rms_um", event->rms_um, "usual_supply_v",
                  json_number_or_null(event->usual_supply_v), "supply_v", json_number_or_null(event->supply_v),
                  "better", event->better, "not_better", event->not_better, "folder", event->folder, "diagnosis",
                  diagnosis_to_json(answer, account, recordings, count));
    return json_write(json, path, failure);
}
