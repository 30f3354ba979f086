/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/json_output.h"
#include "base/quantity.h"
#include "chain/chain.h"
#include "command_line/recording_input.h"
#include "command_line/recording_output.h"
#include "commands/command.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int simulate(int argc, char **argv);

const command_t command_simulate = {
    .name = "simulate",
    .order = 20,
    .arguments = "MODEL RECORDING [-o OUT.csv] [--json]",
    .summary = "Run a model with the drive of a recording and compare",
    .details =
        "The model starts with its initial memory, or demagnetised if it has none. Until the drive of the recording "
        "has\n"
        "swept far enough to erase the hysteresis' past, a wrong initial memory shows in the error: the second line\n"
        "counts from there on. With its own zero: less the mean of the error, as between two days of a sensor that is "
        "set\n"
        "to zero anew. The header key drive_before_v says what the drive was before the recording. NRMSE is the RMS "
        "error\n"
        "over the peak-to-peak displacement.\n"
        "OUT.csv is a recording of the model: its displacement is the simulated one, the measured one is its "
        "reference.",
    .run = simulate,
    .files = FILE_MODEL FILE_RECORDING,
    .examples = "# The error of a model on a recording that it was not fitted to\n"
                "hyst simulate model.json other.csv\n"
                "# The simulated displacement, for a plot; the measured one is its column reference\n"
                "hyst simulate model.json recording.csv -o simulated.csv\n"};

static void print_measure(const char *what, const error_measure_t *error, double start_s, double rate_hz) {
    char time[QUANTITY_TEXT];
    quantity_time(time, start_s + (double)error->max_sample / rate_hz, 1.0 / rate_hz);
    printf("%-22s NRMSE %.4f %%, RMS %.6g um, largest %.6g um at t = %s s\n", what, error->nrmse_percent, error->rms_um,
           error->max_um, time);
}

static json_t *measure_to_json(const error_measure_t *error, double start_s, double rate_hz) {
    return json_pack("{s:f, s:f, s:f, s:f}", "nrmse_percent", error->nrmse_percent, "rms_um", error->rms_um, "max_um",
                     error->max_um, "max_at_s", start_s + (double)error->max_sample / rate_hz);
}

/* The error with the zero of this recording: between two days a sensor is set to zero anew, and that is no error of a
 * model. */
static error_measure_t measure_beside_zero(const recording_t *recording, const double *position, double *zero_um) {
    const double *measured = recording->column[COLUMN_DISPLACEMENT];
    double *moved = allocate(recording->samples, sizeof *moved);
    memcpy(moved, position, recording->samples * sizeof *moved);
    *zero_um = error_take_zero(measured, moved, recording->samples);
    const error_measure_t error = measure_error(measured, moved, recording->samples);
    free(moved);
    return error;
}

static bool report(const model_t *model, const recording_t *recording, const double *position, bool as_json,
                   failure_t *failure) {
    const double *measured = recording->column[COLUMN_DISPLACEMENT], rate = recording->sample_rate_hz;
    const size_t from = chain_memory_determined(model, recording, recording->samples);
    const error_measure_t whole = measure_error(measured, position, recording->samples);
    double zero_um;
    const error_measure_t moved = measure_beside_zero(recording, position, &zero_um);
    error_measure_t rest = {0};
    bool has_rest = false;
    if (!isfinite(whole.nrmse_percent)) {
        return fail(failure, "%s: the displacement never changes: no error relative to its range", recording->name);
    }
    if (from + 1 < recording->samples) {
        rest = measure_error(measured + from, position + from, recording->samples - from);
        has_rest = isfinite(rest.nrmse_percent);
    }
    if (as_json) {
        json_t *json = measure_to_json(&whole, recording->start_s, rate);
        json_object_set_new(json, "format", json_string("hyst-simulate-1"));
        json_object_set_new(json, "recording", json_string(recording->name));
        json_object_set_new(json, "samples", json_integer((json_int_t)recording->samples));
        json_object_set_new(json, "sample_rate_hz", json_real(rate));
        json_t *beside_zero = measure_to_json(&moved, recording->start_s, rate);
        json_object_set_new(beside_zero, "offset_um", json_real(zero_um));
        json_object_set_new(json, "zero_of_its_own", beside_zero);
        if (has_rest) {
            const double rest_s = recording->start_s + (double)from / rate;
            json_t *part = measure_to_json(&rest, rest_s, rate);
            json_object_set_new(part, "from_s", json_real(rest_s));
            json_object_set_new(json, "memory_determined", part);
        }
        const bool good = json_print(json, JSON_INDENT(2), failure);
        if (!good || !text_wanted(true)) {
            return good;
        }
    }
    printf("%s: %zu samples at %.6g Hz\n", recording->name, recording->samples, rate);
    print_measure("whole recording", &whole, recording->start_s, rate);
    print_measure("with its own zero", &moved, recording->start_s, rate);
    printf("%-22s %+.6g um beside the model's\n", "", zero_um);
    if (has_rest && from > 0) {
        char time[QUANTITY_TEXT], what[QUANTITY_TEXT + 20];
        const double rest_s = recording->start_s + (double)from / rate;
        quantity_time(time, rest_s, 1.0 / rate);
        snprintf(what, sizeof what, "from t = %s s on", time);
        print_measure(what, &rest, rest_s, rate);
    } else if (!has_rest) { /* else that is the whole recording */
        puts("The drive never sweeps far enough to erase the hysteresis' past.");
    }
    return true;
}

static bool run(const char *model_path, const char *recording_path, const char *output, bool as_json,
                failure_t *failure) {
    model_t model;
    recording_t recording = {0};
    double *position = NULL;
    bool good = false;
    if (!model_read(&model, model_path, failure)) {
        return false;
    }
    if (read_recording_aloud(&recording, recording_path, failure)) {
        position = allocate(recording.samples, sizeof(double));
        good = chain_simulate_finite(&model, &recording, 1, position, failure) &&
               report(&model, &recording, position, as_json, failure);
        if (good && output != NULL) {
            const size_t size = recording.samples * sizeof(double);
            memcpy(recording_add_column(&recording, COLUMN_REFERENCE), recording.column[COLUMN_DISPLACEMENT], size);
            memcpy(recording.column[COLUMN_DISPLACEMENT], position, size);
            good = recording_write(&recording, output, failure);
            if (good && text_wanted(as_json)) {
                extras_print(stdout, &recording, output);
            }
        }
    }
    free(position);
    recording_free(&recording);
    model_free(&model);
    return good;
}

static int simulate(int argc, char **argv) {
    const char *output = NULL;
    bool as_json = false;
    const option_t options[] = {{.name = "--output",
                                 .letter = "-o",
                                 .kind = OPTION_OUTPUT,
                                 .argument = "OUT.csv",
                                 .help = "write the simulated position",
                                 .target = &output},
                                JSON_OPTION(&as_json)};
    size_t positionals;
    failure_t failure;
    const int status =
        options_parse(&command_simulate, options, sizeof options / sizeof options[0], argc, argv, 2, 2, &positionals);
    if (status != OPTIONS_RUN) {
        return status;
    }
    return run(argv[1], argv[2], output, as_json, &failure) ? STATUS_DONE : failure_print(&failure);
}
