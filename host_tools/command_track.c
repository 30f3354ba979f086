/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier_image.h"
#include "chain.h"
#include "compile.h"
#include "error_budget.h"
#include "experiment.h"
#include "json_output.h"
#include "mode_names.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

typedef struct {
    device_options_t line;
    waveform_options_t waveform;
    const char *mode;
    bool both, no_condition, json;
    unsigned long frames;
    const char *output;
} settings_t;

typedef struct {
    hyst_mode_t mode;
    recording_t recording;
    experiment_events_t events;
    double peak_to_peak_um; /* of the reference */
    error_measure_t error;
    error_budget_t budget;
} track_t;

/* Positions between the ends of the drive, from the demagnetised state: what every drive history reaches. */
static bool reach(const hyst_parameters_t *image, double range_um[2], failure_t *failure) {
    hyst_compensator_t compensator;
    const hyst_parameters_fault_t fault = hyst_parameters_build(image, &compensator);
    if (fault.error != HYST_PARAMETERS_OK) {
        return fail(failure, "the image in force is not valid: %s %s", hyst_field_text(fault.field),
                    hyst_parameters_error_text(fault.error));
    }
    const hyst_q31_t ends[2] = {compensator.drive_low, compensator.drive_high};
    for (int i = 0; i < 2; i++) {
        hyst_compensator_state_t state;
        compensator.drive_park = ends[i];
        hyst_compensator_reset(&compensator, &state);
        const double position =
            0x1p-31 * hyst_hysteresis_output(&compensator.hysteresis, hyst_compensator_memory(&state));
        range_um[i] =
            1e-6 * (image->position_center_pm + image->position_half_range_pm * reference_for(image, position));
    }
    return true;
}

static void measure(track_t *track) {
    const recording_t *r = &track->recording;
    const double *reference = r->column[COLUMN_REFERENCE];
    const double *position = r->column[COLUMN_DISPLACEMENT];
    track->error = measure_error(reference, position, r->samples);
    track->budget = error_budget(reference, position, r->samples, r->sample_rate_hz);
    double low = reference[0];
    double high = reference[0];
    for (size_t i = 1; i < r->samples; i++) {
        low = fmin(low, reference[i]);
        high = fmax(high, reference[i]);
    }
    track->peak_to_peak_um = high - low;
}

static void print_track(const track_t *track, const waveform_t *w) {
    const recording_t *r = &track->recording;
    const error_measure_t *e = &track->error;
    const error_budget_t *b = &track->budget;
    printf("%s, %s: %lu cycles at %g Hz, %.4g um peak to peak, %zu frames at %g Hz\n", waveform_name(w->kind),
           mode_name(track->mode), w->cycles, w->frequency_hz, track->peak_to_peak_um, r->samples, r->sample_rate_hz);
    printf("  worst  %10.4f um at %.4f s (%.3f %%)\n", e->max_um, (double)e->max_sample / r->sample_rate_hz,
           100.0 * e->max_um / track->peak_to_peak_um);
    printf("  RMS    %10.4f um, NRMSE %.4f %%\n", e->rms_um, e->nrmse_percent);
    printf("  of which offset and gain %.4f um, delay %.4f um (%.1f us), noise %.4f um, rest %.4f um\n", b->static_um,
           b->delay_um, 1e6 * b->delay_s, b->noise_um, b->rest_um);
}

static json_t *track_to_json(const track_t *track) {
    const recording_t *r = &track->recording;
    const error_measure_t *e = &track->error;
    const error_budget_t *b = &track->budget;
    return json_pack(
        "{s:s, s:f, s:f, s:f, s:o, s:f, s:I, s:f, s:{s:f, s:f, s:f, s:f, s:f}, s:{s:I, s:I, s:I, s:I, s:I}}", "mode",
        mode_name(track->mode), "max_error_um", e->max_um, "max_error_at_s", (double)e->max_sample / r->sample_rate_hz,
        "rms_error_um", e->rms_um, "nrmse_percent", json_number_or_null(e->nrmse_percent), "peak_to_peak_um",
        track->peak_to_peak_um, "frames", (json_int_t)r->samples, "sample_rate_hz", r->sample_rate_hz, "made_of",
        "static_um", b->static_um, "delay_um", b->delay_um, "delay_s", b->delay_s, "noise_um", b->noise_um, "rest_um",
        b->rest_um, "samples_with", "drive_limited", (json_int_t)track->events.drive_limited, "unreachable",
        (json_int_t)track->events.unreachable, "filter_saturated", (json_int_t)track->events.filter_saturated,
        "overruns", (json_int_t)track->events.overruns, "converter_timeouts",
        (json_int_t)track->events.converter_timeouts);
}

/* NRMSE before over NRMSE after. */
static double gain_of(const track_t *before, const track_t *after) {
    return before->error.nrmse_percent / after->error.nrmse_percent;
}

static bool report(const track_t *tracks, size_t count, const waveform_t *w, bool json, failure_t *failure) {
    if (json) {
        json_t *list = json_array();
        for (size_t i = 0; i < count; i++) {
            json_array_append_new(list, track_to_json(&tracks[i]));
        }
        json_t *object =
            json_pack("{s:s, s:{s:s, s:f, s:f, s:f, s:I}, s:o}", "format", "hyst-track-1", "waveform", "name",
                      waveform_name(w->kind), "frequency_hz", w->frequency_hz, "amplitude_um", w->amplitude,
                      "offset_um", w->offset, "cycles", (json_int_t)w->cycles, "tracks", list);
        if (count == 2) {
            json_object_set_new(object, "ratio", json_number_or_null(gain_of(&tracks[0], &tracks[1])));
        }
        return json_print(object, JSON_INDENT(2), failure);
    }
    for (size_t i = 0; i < count; i++) {
        print_track(&tracks[i], w);
    }
    if (count == 2) {
        printf("NRMSE %.4f %% before, %.4f %% after: %.1f times less\n", tracks[0].error.nrmse_percent,
               tracks[1].error.nrmse_percent, gain_of(&tracks[0], &tracks[1]));
    }
    return true;
}

/* With two tracks OUT.csv becomes OUT-linear.csv and OUT-compensate.csv. */
static bool write_recording(const track_t *track, const settings_t *settings, failure_t *failure) {
    if (settings->output == NULL) {
        return true;
    }
    if (!settings->both) {
        return recording_write(&track->recording, settings->output, failure);
    }
    char path[4096];
    const size_t length = strlen(settings->output);
    const size_t stem = length > 4 && strcmp(settings->output + length - 4, ".csv") == 0 ? length - 4 : length;
    const int written = snprintf(path, sizeof path, "%.*s-%s.csv", (int)stem, settings->output, mode_name(track->mode));
    if (written < 0 || (size_t)written >= sizeof path) {
        return fail(failure, "%s: name too long", settings->output);
    }
    return recording_write(&track->recording, path, failure);
}

static bool run_track(device_t *device, const hyst_parameters_t *image, const waveform_t *waveform,
                      const settings_t *settings, track_t *track, failure_t *failure) {
    const experiment_t experiment = {
        .waveform = *waveform, .mode = track->mode, .condition = !settings->no_condition, .frames = settings->frames};
    if (!experiment_run(device, image, &experiment, &track->recording, &track->events, failure)) {
        return false;
    }
    experiment_print_events(&track->events);
    measure(track);
    return write_recording(track, settings, failure);
}

/* Returns the exit status. */
static int track(device_t *device, const settings_t *settings) {
    failure_t failure;
    hyst_parameters_t image;
    double range_um[2];
    if (!amplifier_image_read(device, &image, &failure) || !reach(&image, range_um, &failure)) {
        return failure_print(&failure);
    }
    waveform_t waveform;
    const int status = waveform_choose(&command_track, &settings->waveform, range_um, "um", &waveform);
    if (status != OPTIONS_RUN) {
        return status;
    }
    track_t tracks[2] = {{.mode = HYST_MODE_LINEAR}, {.mode = HYST_MODE_COMPENSATE}};
    const size_t count = settings->both ? 2 : 1;
    if (!settings->both && strcmp(settings->mode, mode_name(HYST_MODE_COMPENSATE)) == 0) {
        tracks[0].mode = HYST_MODE_COMPENSATE;
    }
    bool ok = true;
    for (size_t i = 0; ok && i < count; i++) {
        ok = run_track(device, &image, &waveform, settings, &tracks[i], &failure);
    }
    ok = ok && report(tracks, count, &waveform, settings->json, &failure);
    for (size_t i = 0; i < count; i++) {
        recording_free(&tracks[i].recording);
    }
    return ok ? STATUS_DONE : failure_print(&failure);
}

static int check(const settings_t *settings) {
    if (settings->both == (settings->mode != NULL)) {
        return usage_error(&command_track, "either --mode linear, --mode compensate or --both");
    }
    if (!settings->both && strcmp(settings->mode, mode_name(HYST_MODE_LINEAR)) != 0 &&
        strcmp(settings->mode, mode_name(HYST_MODE_COMPENSATE)) != 0) {
        return usage_error(&command_track, "--mode %s: not linear or compensate", settings->mode);
    }
    return OPTIONS_RUN;
}

static int run(int argc, char **argv) {
    settings_t s = {.line = DEVICE_OPTIONS_DEFAULT, .waveform = WAVEFORM_OPTIONS_DEFAULT};
    const option_t options[] = {
        DEVICE_OPTIONS(s.line),
        WAVEFORM_OPTIONS(s.waveform, "UM"),
        {"--mode", "-m", OPTION_TEXT, "MODE", "linear (no model) or compensate", &s.mode},
        {"--both", NULL, OPTION_FLAG, NULL, "linear first, then compensate, and compare", &s.both},
        {"--no-condition", NULL, OPTION_FLAG, NULL, "do not sweep the drive range first", &s.no_condition},
        {"--frames", NULL, OPTION_COUNT, "N",
         "rows of the recording at most: fewer are read sooner (as many as it holds)", &s.frames},
        {"--output", "-o", OPTION_TEXT, "CSV",
         "recording to write; with --both two, named CSV-linear and CSV-compensate", &s.output},
        {"--json", NULL, OPTION_FLAG, NULL, "result as JSON on stdout", &s.json},
    };
    int status =
        device_options_parse(&command_track, options, sizeof options / sizeof options[0], argc, argv, 0, &s.line);
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
    status = track(device, &s);
    device_close(device);
    return status;
}

const command_t command_track = {
    "track", "--port DEV --waveform NAME --mode MODE", "Let the amplifier follow a reference, and measure the error",
    "Sweeps the whole drive range once, goes to the start of the reference, plays it and captures reference and\n"
    "position of the same instants. NRMSE is the RMS of position - reference over the reference's peak to peak; the\n"
    "whole capture counts, from the first sample on. The waveforms are those of `hyst record`.",
    run};
