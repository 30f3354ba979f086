/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/json_output.h"
#include "command_line/recording_input.h"
#include "commands/command.h"
#include "commands/fit_print.h"
#include "interface/exchanged.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int run(int argc, char **argv);

const command_t command_fit = {
    .name = "fit",
    .order = 10,
    .arguments = "RECORDING... [-o MODEL.json] [options]",
    .summary = "Identify a hysteresis model from recordings",
    .details = "Several recordings make one fit. The last third of each is held out: the fit does not see it. The "
               "held-out error\n"
               "is the error to compare models by. NRMSE is the RMS error over the peak-to-peak displacement of the "
               "same samples.\n"
               "With --operators auto, the number of play operators or Preisach intervals is chosen by validation "
               "inside the first\n"
               "two thirds. The other families have a fixed number (ellipse and Bouc-Wen have none). Above 64 play "
               "operators the\n"
               "density of thresholds is smoothed: for a twin, since compile merges it to what an amplifier holds.\n"
               "Families of play operators take a slow drift of the offset out of the fit where that predicts better. "
               "The offset of\n"
               "the model is then the one at the end of the training data. With --creep a block creep takes its place, "
               "which the\n"
               "amplifier can compensate. A family that does not look for creep says so.\n"
               "--family all fits every family and prints one line each, best held-out error first; -o writes the "
               "first. Families\n"
               "that hold for one sine only come last, and -o does not choose them: name one with --family.",
    .run = run,
    .files = FILE_RECORDING FILE_MODEL,
    .examples = "# Fit a bank of play operators, then see what the model is worth on the last third of the recording\n"
                "hyst fit recording.csv -o model.json\n"
                "# Compare all families on data that the fits have not seen\n"
                "hyst fit recording.csv --family all\n"
                "# One model for recordings at several frequencies\n"
                "hyst fit slow.csv fast.csv --family rate_dependent_prandtl_ishlinskii -o model.json\n"};

/* One line a family, under each other in the help. */
static void list_families(char *text, size_t size) {
    size_t length =
        (size_t)snprintf(text, size, "what the hysteresis is made of (default: the first)\n%35sall: compare them", "");
    for (size_t i = 0; i < families_count && length < size; i++) {
        length +=
            (size_t)snprintf(text + length, size - length, "\n%35s%s: %s", "", families[i]->name, families[i]->text);
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
    good = good && (!as_json || json_print(model_to_json(&model), JSON_INDENT(1), failure));
    if (good && text_wanted(as_json)) {
        fit_print(&model, recordings, &report, options->use_all);
    }
    fit_report_free(&report);
    model_free(&model);
    return good;
}

/* Best held-out error first, then those without a finite one, then those for one sine only, in the same order, then
 * those that do not apply. */
static int compare_entries(const void *left, const void *right) {
    const fit_entry_t *a = left, *b = right;
    const double error_a = a->fitted ? a->report.held_out_nrmse_percent : HUGE_VAL;
    const double error_b = b->fitted ? b->report.held_out_nrmse_percent : HUGE_VAL;
    if (a->fitted != b->fitted) {
        return a->fitted ? -1 : 1;
    }
    if (a->family->one_sine != b->family->one_sine) {
        return a->family->one_sine ? 1 : -1;
    }
    if (isfinite(error_a) != isfinite(error_b)) {
        return isfinite(error_a) ? -1 : 1;
    }
    return (error_a > error_b) - (error_a < error_b);
}

static bool compare_families(const recording_t *recordings, size_t count, const fit_options_t *options,
                             const char *output, bool as_json, failure_t *failure) {
    fit_entry_t *entry = allocate(families_count, sizeof *entry);
    bool good;
    for (size_t i = 0; i < families_count; i++) {
        entry[i].family = families[i];
        entry[i].fitted = fit_recordings(families[i], recordings, count, options, &entry[i].model, &entry[i].report,
                                         &entry[i].failure);
    }
    qsort(entry, families_count, sizeof *entry, compare_entries);
    good = entry[0].fitted || fail(failure, "no family fits: %s", entry[0].failure.text);
    good = good && (output == NULL || !entry[0].family->one_sine ||
                    fail(failure,
                         "%s: what fits these recordings holds for one sine only; choose it by name if that is enough: "
                         "--family %s",
                         output, entry[0].family->name));
    good = good && (output == NULL || model_write(&entry[0].model, output, failure));
    good = good && (!as_json || json_print(fit_table_to_json(entry, families_count), JSON_INDENT(1), failure));
    if (good && text_wanted(as_json)) {
        fit_print_table(entry, families_count);
    }
    for (size_t i = 0; i < families_count && entry[i].fitted; i++) {
        fit_report_free(&entry[i].report);
        model_free(&entry[i].model);
    }
    free(entry);
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
    bool as_json = false, columns_are_right = false;
    char family_list[4096];
    fit_options_t settings = {0};
    span_t span = SPAN_WHOLE;
    const option_t options[] = {
        {"--family", NULL, OPTION_TEXT, "FAMILY", family_list, &family_name},
        {"--operators", NULL, OPTION_TEXT, "N|auto", "operators, intervals or levels of the family (default: auto)",
         &operators},
        {"--creep", NULL, OPTION_FLAG, NULL, "find creep too: gamma_per_decade of a block creep", &settings.creep},
        {"--use-all", NULL, OPTION_FLAG, NULL, "after judging it, fit as many operators to the whole recordings",
         &settings.use_all},
        SPAN_OPTIONS(span),
        {"--columns-are-right", NULL, OPTION_FLAG, NULL,
         "go on where drive and displacement look exchanged, and a fit says so too", &columns_are_right},
        {"--output", "-o", OPTION_OUTPUT, "MODEL.json", "write the model", &output},
        JSON_OPTION(&as_json)};
    const family_t *family;
    size_t count;
    failure_t failure;
    int status;
    list_families(family_list, sizeof family_list);
    status =
        options_parse(&command_fit, options, sizeof options / sizeof options[0], argc, argv, 1, (size_t)argc, &count);
    if (status != OPTIONS_RUN) {
        return status;
    }
    family = family_find(family_name);
    const bool all = strcmp(family_name, "all") == 0;
    if (family == NULL && !all) {
        char names[400];
        family_list_names(names, sizeof names);
        return usage_error(&command_fit, "unknown family '%s': there are %s", family_name, names);
    }
    if (!read_operators(operators, &settings.operators)) {
        return usage_error(&command_fit, "--operators: '%s' is not auto or a number from 1 to %d", operators,
                           FAMILY_MAX_OPERATORS);
    }
    recording_t *recordings = read_spans_aloud(argv + 1, count, &span, &failure);
    bool good = recordings != NULL;
    good = good && (columns_are_right || exchanged_refuse(recordings, count, NULL, &failure));
    good = good && (all ? compare_families(recordings, count, &settings, output, as_json, &failure)
                        : fit_and_report(family, recordings, count, &settings, output, as_json, &failure));
    recordings_free(recordings, count);
    return good ? STATUS_DONE : failure_print(&failure);
}
