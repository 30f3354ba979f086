/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command.h"
#include "fit.h"
#include "json_output.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int run(int argc, char **argv);

const command_t command_fit = {
    .name = "fit",
    .arguments = "RECORDING... [-o MODEL.json] [options]",
    .summary = "Find the numbers of a hysteresis model from recordings",
    .details =
        "Several recordings are one fit. The last third of each is held out: the fit does not see it, and the held-out "
        "error is\n"
        "what the model is worth. NRMSE is the RMS error over the peak-to-peak displacement of the same samples.\n"
        "With --operators auto the number of operators is chosen inside the first two thirds; above 64 operators the "
        "density of\n"
        "thresholds is smoothed (for a twin; compile merges it to what an amplifier holds).\n"
        "A slow drift of the offset is taken out of the fit where that predicts better; the model's offset is then the "
        "one at\n"
        "the end of the training data. With --creep a block creep takes its place, which the amplifier can undo.",
    .run = run};

/* One line a family, under each other in the help. */
static void list_families(char *text, size_t size) {
    size_t length = (size_t)snprintf(text, size, "what the hysteresis is made of (default: the first)");
    for (size_t i = 0; i < families_count && length < size; i++) {
        length +=
            (size_t)snprintf(text + length, size - length, "\n%35s%s: %s", "", families[i]->name, families[i]->text);
    }
}

static void print_value(double value, const double *sigma) {
    printf(" %14.8g", value);
    if (sigma != NULL && *sigma > 0.0) {
        printf(" +- %-8.2g", *sigma);
    } else {
        printf("            ");
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
            printf("%s%-27s", p > 0 ? "" : "  ", title);
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
                printf("%27s", "");
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
    printf("%s\n", block->block->name);
    for (size_t p = 0; p < block->block->parameters; p++) {
        const parameter_info_t *info = &block->block->parameter[p];
        arrays = arrays || info->array;
        if (!info->array) {
            printf("  %-16s", info->name);
            print_value(block->parameter[p].value[0], block->parameter[p].sigma);
            printf(" %s\n", info->unit);
        }
    }
    if (arrays) {
        print_arrays(block);
    }
}

static void print_recording(const recording_t *recording, const fit_recording_report_t *r) {
    printf("%s\n  held out, from t = %.6g s:  NRMSE %.4f %%, largest error %.4g um at t = %.6g s\n", recording->name,
           r->held_out_s, r->held_out_nrmse_percent, r->held_out_max_um, r->held_out_max_s);
    printf("  training, from t = %.6g s:  NRMSE %.4f %%\n", r->train_s, r->train_nrmse_percent);
    if (r->determined_s > recording->start_s) {
        printf("  before t = %.6g s the memory depends on the past: mean error there %.4g um\n", r->determined_s,
               r->initial_mean_error_um);
    }
}

static void print_text(const model_t *model, const recording_t *recordings, const fit_report_t *report,
                       const fit_options_t *options) {
    for (size_t i = 0; i < model->blocks; i++) {
        print_block(&model->block[i]);
    }
    putchar('\n');
    for (size_t i = 0; i < report->notes.count; i++) {
        puts(report->notes.line[i]);
    }
    if (report->family->without != NULL) {
        printf("held out with %s instead: %.4f %%\n", report->family->without->name,
               report->without_held_out_nrmse_percent);
    }
    for (size_t i = 0; i < report->recordings; i++) {
        print_recording(&recordings[i], &report->recording[i]);
    }
    if (options->use_all) {
        puts("the errors above are of the fit to the first two thirds; the model was then fitted to everything");
    }
}

static bool fit_and_report(const family_t *family, const recording_t *recordings, size_t count,
                           const fit_options_t *options, const char *output, bool as_json, failure_t *failure) {
    model_t model;
    fit_report_t report;
    bool good;
    if (!fit_recordings(family, recordings, count, options, &model, &report, failure)) {
        return false;
    }
    good = output == NULL || model_write(&model, output, failure);
    if (good && as_json) {
        good = json_print(model_to_json(&model), JSON_INDENT(1), failure);
    } else if (good) {
        print_text(&model, recordings, &report, options);
    }
    fit_report_free(&report);
    model_free(&model);
    return good;
}

static bool read_operators(const char *text, size_t *operators) {
    char *end;
    if (strcmp(text, "auto") == 0) {
        *operators = 0;
        return true;
    }
    *operators = text[0] >= '0' && text[0] <= '9' ? strtoul(text, &end, 10) : 0;
    return *operators >= 1 && *operators <= FAMILY_MAX_OPERATORS && *end == '\0';
}

static int run(int argc, char **argv) {
    const char *family_name = families[0]->name, *operators = "auto", *output = NULL;
    bool as_json = false, good = true;
    char family_list[4096];
    fit_options_t settings = {0};
    const option_t options[] = {
        {"--family", NULL, OPTION_TEXT, "FAMILY", family_list, &family_name},
        {"--operators", NULL, OPTION_TEXT, "N|auto", "number of play operators (default: auto)", &operators},
        {"--creep", NULL, OPTION_FLAG, NULL, "find creep too: gamma_per_decade of a block creep", &settings.creep},
        {"--use-all", NULL, OPTION_FLAG, NULL, "after judging it, fit as many operators to the whole recordings",
         &settings.use_all},
        {"--output", "-o", OPTION_TEXT, "MODEL.json", "write the model", &output},
        {"--json", NULL, OPTION_FLAG, NULL, "print the model as JSON", &as_json}};
    const family_t *family;
    recording_t *recordings;
    size_t positionals, count = 0;
    failure_t failure;
    int status;
    list_families(family_list, sizeof family_list);
    status = options_parse(&command_fit, options, sizeof options / sizeof options[0], argc, argv, 1, (size_t)argc,
                           &positionals);
    if (status != OPTIONS_RUN) {
        return status;
    }
    family = family_find(family_name);
    if (family == NULL) {
        return usage_error(&command_fit, "unknown family '%s'", family_name);
    }
    if (!read_operators(operators, &settings.operators)) {
        return usage_error(&command_fit, "--operators: '%s' is not auto or a number from 1 to %d", operators,
                           FAMILY_MAX_OPERATORS);
    }
    recordings = allocate(positionals, sizeof *recordings);
    while (good && count < positionals) {
        good = recording_read(&recordings[count], argv[count + 1], &failure);
        count += good ? 1 : 0;
    }
    good = good && fit_and_report(family, recordings, count, &settings, output, as_json, &failure);
    for (size_t i = 0; i < count; i++) {
        recording_free(&recordings[i]);
    }
    free(recordings);
    return good ? STATUS_DONE : failure_print(&failure);
}
