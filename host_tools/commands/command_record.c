/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/shown_name.h"
#include "command_line/device_options.h"
#include "command_line/waveform_options.h"
#include "commands/command.h"
#include "interface/record_run.h"
#include "recording/reserved_output.h"
#include <stdio.h>

typedef struct {
    device_options_t line;
    record_options_t record;
    bool json;
    const char *output;
    reserved_output_t file; /* of that name */
} settings_t;

static bool report(const recording_t *recording, const settings_t *settings, failure_t *failure) {
    double drive[2];
    double position[2];
    values_range(recording->column[COLUMN_DRIVE], recording->samples, drive);
    values_range(recording->column[COLUMN_DISPLACEMENT], recording->samples, position);
    if (settings->json) {
        const bool good =
            json_print(json_pack("{s:s, s:s, s:I, s:f, s:[ff], s:[ff]}", "format", "hyst-record-1", "recording",
                                 shown_name(settings->output), "samples", (json_int_t)recording->samples,
                                 "sample_rate_hz", recording->sample_rate_hz, "drive_v", drive[0], drive[1],
                                 "displacement_um", position[0], position[1]),
                       JSON_INDENT(2), failure);
        if (!good || !text_wanted(true)) {
            return good;
        }
    }
    printf("%s: %zu samples at %g Hz, drive %.4f..%.4f V, displacement %.4f..%.4f um\n", shown_name(settings->output),
           recording->samples, recording->sample_rate_hz, drive[0], drive[1], position[0], position[1]);
    return true;
}

/* While the run is guarded: a file that cannot be written parks the amplifier. */
static bool take(void *context, const recording_t *recording, const experiment_events_t *events, failure_t *failure) {
    settings_t *settings = context;
    const char *contradiction = recording_key(recording, RECORDING_CONTRADICTION_KEY);
    experiment_print_events(events);
    if (contradiction != NULL) {
        fprintf(stderr, "note: %s: the recording has the former\n", contradiction);
    }
    return reserved_output_write(&settings->file, recording, failure) && report(recording, settings, failure);
}

/* Returns the exit status. */
static int record(device_t *device, void *context) {
    settings_t *settings = context;
    const record_listener_t listener = {.take = take, .context = settings};
    recording_t recording;
    failure_t failure;
    bool usage = false;
    const size_t rows = experiment_rows_most(device, settings->record.frames, settings->record.probe != NULL);
    if (!reserved_output_open(&settings->file, settings->output, rows, &failure)) {
        return failure_print(&failure);
    }
    device_print_left_fault(device);
    const bool good = record_run(device, &settings->record, &listener, &recording, &usage, &failure);
    reserved_output_close(&settings->file);
    if (!good) {
        return usage ? usage_error(&command_record, "%s", failure.text) : failure_print(&failure);
    }
    recording_free(&recording);
    return STATUS_DONE;
}

/* What can be said before there is an amplifier. */
static int check(void *context) {
    const settings_t *settings = context;
    failure_t failure;
    if (settings->output == NULL) {
        return usage_error(&command_record, "-o CSV is missing");
    }
    if (!record_check(&settings->record, &failure)) {
        return usage_error(&command_record, "%s", failure.text);
    }
    return settings->record.probe == NULL ? waveform_check(&command_record, &settings->record.waveform) : OPTIONS_RUN;
}

static int run(int argc, char **argv) {
    settings_t s = {.line = DEVICE_OPTIONS_DEFAULT, .record = RECORD_OPTIONS_DEFAULT};
    const option_t options[] = {
        DEVICE_OPTIONS(s.line),
        WAVEFORM_OPTIONS(s.record.waveform, "V"),
        {"--probe", NULL, OPTION_TEXT, "BLOCK", "excitation that identifies this block; all: every block (25 s)",
         &s.record.probe},
        {"--slew-rate", NULL, OPTION_NUMBER, "V/S", "steepest line of a probe (the drive range in 20 ms)",
         &s.record.slew_v_per_s},
        {"--drive-range", NULL, OPTION_RANGE, "LO:HI", "range of the drive converter in V (that of the image in force)",
         s.record.drive_range_v},
        {"--position-range", NULL, OPTION_RANGE, "LO:HI", "range of the position converter in um (likewise)",
         s.record.position_range_um},
        {"--no-condition", NULL, OPTION_FLAG, NULL, "do not sweep the drive range first", &s.record.no_condition},
        {"--output", "-o", OPTION_OUTPUT, "CSV", "recording to write", &s.output},
        JSON_OPTION(&s.json),
    };
    const device_work_t job = {.settings = &s, .line = &s.line, .check = check, .to_its_end = true, .work = record};
    return device_command_run(&command_record, options, sizeof options / sizeof options[0], argc, argv, &job);
}

const command_t command_record = {
    .name = "record",
    .order = 100,
    .arguments = "--port DEV --waveform NAME|--probe BLOCK -o CSV",
    .summary = "Drive the actuator directly and record what it does",
    .details =
        "Sweeps the whole drive range once, which erases the memory of the hysteresis. Then it plays the waveform as a "
        "drive\n"
        "and writes drive and displacement: the input of `hyst fit`. An amplifier without a model does not know its "
        "units: it\n"
        "is not driven without --drive-range and --position-range.\n"
        "  sine       cycles of offset + amplitude * sin\n"
        "  triangle   the first cycle has the full amplitude, each further one is smaller: a major loop and minor "
        "loops\n"
        "  staircase  up in steps and down again, once a cycle; a step rises for a fifth of its time\n"
        "  sweep      a sine whose frequency goes from --frequency to --end-frequency, once a cycle\n"
        "  multisine  tones at odd multiples of --frequency up to --end-frequency, all at once\n"
        "A probe is a recording for `hyst diagnose`: a sweep and loops, then the silence, holds, triangles, chirps, "
        "bursts and\n"
        "small loops that the block needs, over the whole drive range of the image. It is one recording without a gap, "
        "read\n"
        "while it is played, at the rate that --baud allows. Before it the drive rests for as "
        "long.\n"
        "A name that is no block lists the blocks there are.",
    .run = run,
    .files = FILE_RECORDING,
    .examples = "# A major loop with minor loops, for `hyst fit`; the first time with the ranges of the converters\n"
                "hyst record --port /dev/ttyUSB0 --waveform triangle --cycles 6 --drive-range 0:120 --position-range "
                "-2:40 -o recording.csv\n"
                "# How the gain and the delay go with the frequency\n"
                "hyst record --port /dev/ttyUSB0 --waveform sweep --frequency 1 --end-frequency 500 --amplitude 5 -o "
                "sweep.csv\n"
                "# Everything that `hyst diagnose` can look for\n"
                "hyst record --port /dev/ttyUSB0 --probe all -o probe.csv\n"};
