/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "commands/fit_print.h"
#include "base/json_output.h"
#include "base/quantity.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static void print_value(double value, const double *sigma) {
    printf(" %14.8g", value);
    if (sigma != NULL && isinf(*sigma)) {
        printf(" undetermined");
    } else if (sigma != NULL && *sigma > 0.0) {
        printf(" +- %-9.2g", *sigma);
    } else {
        printf("%13s", "");
    }
}

/* The array parameters of a block as columns; a shorter array belongs to the last rows (w_0 has no threshold). */
static void print_arrays(const model_block_t *block) {
    size_t rows = 0;
    for (size_t p = 0; p < block->block->parameters; p++) {
        if (block->block->parameter[p].array && block->parameter[p].count > 0) {
            const size_t count = block->parameter[p].count;
            char title[64];
            rows = count > rows ? count : rows;
            snprintf(title, sizeof title, "%s %s", block->block->parameter[p].name, block->block->parameter[p].unit);
            printf("%s%-28s", p > 0 ? "" : "  ", title);
        }
    }
    putchar('\n');
    for (size_t row = 0; row < rows; row++) {
        for (size_t p = 0; p < block->block->parameters; p++) {
            const parameter_t *parameter = &block->parameter[p];
            if (!block->block->parameter[p].array || parameter->count == 0) {
                continue;
            }
            if (row + parameter->count < rows) {
                printf("%28s", "");
            } else {
                const size_t e = row + parameter->count - rows;
                print_value(parameter->value[e], parameter->sigma != NULL ? &parameter->sigma[e] : NULL);
            }
        }
        putchar('\n');
    }
}

static void print_block(const model_block_t *block) {
    bool arrays = false;
    int width = 16;
    printf("%s\n", block->block->name);
    for (size_t p = 0; p < block->block->parameters; p++) {
        const int length = (int)strlen(block->block->parameter[p].name);
        width = !block->block->parameter[p].array && length > width ? length : width;
    }
    for (size_t p = 0; p < block->block->parameters; p++) {
        const parameter_info_t *info = &block->block->parameter[p];
        arrays = arrays || info->array;
        if (!info->array) {
            printf("  %-*s", width, info->name);
            print_value(block->parameter[p].value[0], block->parameter[p].sigma);
            printf(" %s\n", info->unit);
        }
    }
    if (arrays) {
        print_arrays(block);
    }
}

/* Not finite: of a part in which the displacement does not move. */
static void print_nrmse(const char *before, double percent) {
    if (isfinite(percent)) {
        printf("%s%.4f %%", before, percent);
    } else {
        printf("%sno motion", before);
    }
}

/* The same in a column of the table. */
static void print_percent(double percent) {
    if (isfinite(percent)) {
        printf("  %9.4f %%", percent);
    } else {
        printf("  %11s", "no motion");
    }
}

static void print_recording(const recording_t *recording, const fit_recording_report_t *r) {
    char time[QUANTITY_TEXT];
    const double interval_s = 1.0 / recording->sample_rate_hz;
    quantity_time(time, r->held_out_s, interval_s);
    printf("%s\n  held out, from t = %s s:", recording->name, time);
    print_nrmse("  NRMSE ", r->held_out_nrmse_percent);
    quantity_time(time, r->held_out_max_s, interval_s);
    printf(", largest error %.4g um at t = %s s\n", r->held_out_max_um, time);
    quantity_time(time, r->train_s, interval_s);
    printf("  training, from t = %s s:", time);
    print_nrmse("  NRMSE ", r->train_nrmse_percent);
    putchar('\n');
    if (r->determined_s > recording->start_s) {
        quantity_time(time, r->determined_s, interval_s);
        printf("  before t = %s s the initial memory matters: mean error there %.4g um\n", time,
               r->initial_mean_error_um);
    }
}

void fit_print(const model_t *model, const recording_t *recordings, const fit_report_t *report, bool used_all) {
    for (size_t i = 0; i < model->blocks; i++) {
        print_block(&model->block[i]);
    }
    putchar('\n');
    for (size_t i = 0; i < report->notes.count; i++) {
        puts(report->notes.line[i]);
    }
    if (report->family->without != NULL) {
        printf("held out with %s instead:", report->family->without->name);
        print_nrmse(" ", report->without_held_out_nrmse_percent);
        putchar('\n');
    }
    for (size_t i = 0; i < report->recordings; i++) {
        print_recording(&recordings[i], &report->recording[i]);
    }
    if (used_all) {
        puts("the errors above are of the fit to the first two thirds; the model was then fitted to everything");
    }
}

void fit_print_table(const fit_entry_t *entry, size_t count) {
    printf("%-34s  %7s  %11s  %11s  %s\n", "family", "numbers", "training", "held out", "largest error held out");
    for (size_t i = 0; i < count; i++) {
        const fit_report_t *report = &entry[i].report;
        printf("%-34s", entry[i].family->name);
        if (!entry[i].fitted) {
            printf("  %s\n", entry[i].failure.text);
            continue;
        }
        printf("  %7zu", report->parameters);
        print_percent(report->nrmse_percent);
        print_percent(report->held_out_nrmse_percent);
        printf("  %.4g um%s\n", report->held_out_max_um, entry[i].family->one_sine ? ", that sine only" : "");
    }
}

json_t *fit_table_to_json(const fit_entry_t *entry, size_t count) {
    json_t *list = json_array();
    for (size_t i = 0; i < count; i++) {
        const fit_report_t *report = &entry[i].report;
        json_array_append_new(
            list, entry[i].fitted
                      ? json_pack("{s:s, s:b, s:I, s:o, s:o, s:f}", "family", entry[i].family->name, "one_sine",
                                  (int)entry[i].family->one_sine, "parameters", (json_int_t)report->parameters,
                                  "nrmse_percent", json_number_or_null(report->nrmse_percent), "held_out_nrmse_percent",
                                  json_number_or_null(report->held_out_nrmse_percent), "held_out_max_um",
                                  report->held_out_max_um)
                      : json_pack("{s:s, s:s}", "family", entry[i].family->name, "reason", entry[i].failure.text));
    }
    return json_pack("{s:s, s:o}", "format", "hyst-fit-table-1", "families", list);
}
