/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier_image.h"
#include "compile.h"
#include "experiment.h"
#include "json_output.h"
#include <math.h>
#include <stdio.h>

typedef struct {
    device_options_t line;
    waveform_options_t waveform;
    const char *probe;
    unsigned parts;                                /* of the probe */
    double slew_rate;                              /* NAN: the default */
    double drive_range_v[2], position_range_um[2]; /* both 0: the image's */
    bool no_condition, json;
    const char *output;
} settings_t;

/* The whole drive range in 20 ms: fast enough for electronics to show, gentle for most high-voltage amplifiers. */
static const double ranges_per_s = 50.0;
/* A fifth of the longest probe: creep goes on evenly in the logarithm of time. */
static const double probe_rest_s = 5.0;

static bool given(const double range[2]) {
    return range[0] < range[1];
}

/* Writes centre and half range in millionths of the unit, which is how the image has them. */
static bool set_scale(const double range[2], int32_t *center, int32_t *half_range, const char *what,
                      failure_t *failure) {
    const double millionths[2] = {range[0] * 1e6, range[1] * 1e6};
    if (fabs(millionths[0]) > INT32_MAX || fabs(millionths[1]) > INT32_MAX) {
        return fail(failure, "%s %g:%g: an image holds at most 2147 to each side", what, range[0], range[1]);
    }
    *center = (int32_t)lround((millionths[0] + millionths[1]) / 2.0);
    *half_range = (int32_t)lround((millionths[1] - millionths[0]) / 2.0);
    return true;
}

/* Replaces the scales of the image, for an amplifier whose image does not know the units yet. */
static bool set_scales(hyst_parameters_t *image, const settings_t *settings, failure_t *failure) {
    return (!given(settings->drive_range_v) || set_scale(settings->drive_range_v, &image->drive_center_uv,
                                                         &image->drive_half_range_uv, "--drive-range", failure)) &&
           (!given(settings->position_range_um) ||
            set_scale(settings->position_range_um, &image->position_center_pm, &image->position_half_range_pm,
                      "--position-range", failure)) &&
           parameters_check(image, "--drive-range, --position-range", failure);
}

static bool report(const recording_t *recording, const settings_t *settings, failure_t *failure) {
    double drive[2];
    double position[2];
    values_range(recording->column[COLUMN_DRIVE], recording->samples, drive);
    values_range(recording->column[COLUMN_DISPLACEMENT], recording->samples, position);
    if (settings->json) {
        return json_print(json_pack("{s:s, s:s, s:I, s:f, s:[ff], s:[ff]}", "format", "hyst-record-1", "recording",
                                    settings->output, "samples", (json_int_t)recording->samples, "sample_rate_hz",
                                    recording->sample_rate_hz, "drive_v", drive[0], drive[1], "displacement_um",
                                    position[0], position[1]),
                          JSON_INDENT(2), failure);
    }
    printf("%s: %zu samples at %g Hz, drive %.4f..%.4f V, displacement %.4f..%.4f um\n", settings->output,
           recording->samples, recording->sample_rate_hz, drive[0], drive[1], position[0], position[1]);
    return true;
}

/* Fills in the default. Returns OPTIONS_RUN, or the usage error's status after printing it. */
static int choose_slew_rate(const settings_t *settings, const double range_v[2], double *slew_v_per_s) {
    const double width_v = range_v[1] - range_v[0];
    *slew_v_per_s = isnan(settings->slew_rate) ? ranges_per_s * width_v : settings->slew_rate;
    if (!(*slew_v_per_s * PROBE_PLAN_SLOWEST_S >= width_v)) {
        return usage_error(&command_record, "--slew-rate %g: a probe needs at least %g V/s for a range of %g V",
                           settings->slew_rate, width_v / PROBE_PLAN_SLOWEST_S, width_v);
    }
    return OPTIONS_RUN;
}

/* Returns the exit status. */
static int record(device_t *device, const settings_t *settings) {
    failure_t failure;
    hyst_parameters_t image;
    if (!amplifier_image_read(device, &image, &failure) || !set_scales(&image, settings, &failure)) {
        return failure_print(&failure);
    }
    const double range_v[2] = {drive_to_volts(&image, image.drive_low), drive_to_volts(&image, image.drive_high)};
    experiment_t experiment = {.mode = HYST_MODE_DIRECT, .condition = !settings->no_condition};
    experiment_probe_t probe = {.parts = settings->parts, .condition = !settings->no_condition, .rest_s = probe_rest_s};
    const int status = settings->probe != NULL
                           ? choose_slew_rate(settings, range_v, &probe.slew_v_per_s)
                           : waveform_choose(&command_record, &settings->waveform, range_v, "V", &experiment.waveform);
    if (status != OPTIONS_RUN) {
        return status;
    }
    recording_t recording;
    experiment_events_t events;
    const bool recorded = settings->probe != NULL
                              ? experiment_run_probe(device, &image, &probe, &recording, &events, &failure)
                              : experiment_run(device, &image, &experiment, &recording, &events, &failure);
    if (!recorded) {
        return failure_print(&failure);
    }
    experiment_print_events(&events);
    const bool ok = recording_write(&recording, settings->output, &failure) && report(&recording, settings, &failure);
    recording_free(&recording);
    return ok ? STATUS_DONE : failure_print(&failure);
}

/* What can be said before there is an amplifier. */
static int check(settings_t *settings) {
    failure_t failure;
    if (settings->output == NULL) {
        return usage_error(&command_record, "-o CSV is missing");
    }
    if (settings->probe == NULL) {
        return isnan(settings->slew_rate) ? OPTIONS_RUN
                                          : usage_error(&command_record, "--slew-rate belongs to --probe");
    }
    if (settings->waveform.name != NULL) {
        return usage_error(&command_record, "either --waveform or --probe");
    }
    if (!isnan(settings->waveform.amplitude) || !isnan(settings->waveform.offset)) {
        return usage_error(&command_record, "--amplitude, --offset: a probe takes the whole drive range of the image");
    }
    settings->parts = probe_parts(settings->probe, &failure);
    return settings->parts != 0 ? OPTIONS_RUN : usage_error(&command_record, "--probe %s", failure.text);
}

static int run(int argc, char **argv) {
    settings_t s = {.line = DEVICE_OPTIONS_DEFAULT, .waveform = WAVEFORM_OPTIONS_DEFAULT, .slew_rate = (double)NAN};
    const option_t options[] = {
        DEVICE_OPTIONS(s.line),
        WAVEFORM_OPTIONS(s.waveform, "V"),
        {"--probe", NULL, OPTION_TEXT, "BLOCK", "what tells this effect from others; all: everything (25 s)", &s.probe},
        {"--slew-rate", NULL, OPTION_NUMBER, "V/S", "steepest line of a probe (the drive range in 20 ms)",
         &s.slew_rate},
        {"--drive-range", NULL, OPTION_RANGE, "LO:HI", "range of the drive converter in V (that of the image in force)",
         s.drive_range_v},
        {"--position-range", NULL, OPTION_RANGE, "LO:HI", "range of the position converter in um (likewise)",
         s.position_range_um},
        {"--no-condition", NULL, OPTION_FLAG, NULL, "do not sweep the drive range first", &s.no_condition},
        {"--output", "-o", OPTION_TEXT, "CSV", "recording to write", &s.output},
        {"--json", NULL, OPTION_FLAG, NULL, "result as JSON on stdout", &s.json},
    };
    int status =
        device_options_parse(&command_record, options, sizeof options / sizeof options[0], argc, argv, 0, &s.line);
    if (status == OPTIONS_RUN) {
        status = check(&s);
    }
    if (status != OPTIONS_RUN) {
        return status;
    }
    failure_t failure;
    device_t *device = device_open(&s.line, &failure);
    if (device == NULL) {
        return failure_print(&failure);
    }
    status = record(device, &s);
    device_close(device);
    return status;
}

const command_t command_record = {
    "record", "--port DEV --waveform NAME|--probe BLOCK -o CSV", "Drive the actuator directly and record what it does",
    "Sweeps the whole drive range once, so that the past is forgotten, then plays the waveform as a drive and writes\n"
    "drive and displacement: the input of `hyst fit`. An amplifier without a model does not know its units: give it\n"
    "--drive-range and --position-range the first time.\n"
    "  sine       cycles of offset + amplitude * sin\n"
    "  triangle   the first cycle has the full amplitude, each further one is smaller: a major loop and minor loops\n"
    "  staircase  up in steps and down again, once a cycle; a step rises for a fifth of its time\n"
    "A probe is a recording for `hyst diagnose`: a sweep and loops, and what the block asks for of silence, holds,\n"
    "triangles, chirps, bursts and small loops, over the whole drive range of the image. It is one recording without "
    "a\n"
    "gap, read while it is played, at the rate that --baud allows. A name that is no block lists those there are.",
    run};
