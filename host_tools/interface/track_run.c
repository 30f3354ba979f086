/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "interface/track_run.h"
#include "amplifier/amplifier_image.h"
#include "amplifier/device/mode_names.h"
#include "amplifier/driving.h"
#include "base/json_output.h"
#include "compile/compile.h"
#include <math.h>

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

json_t *events_to_json(const experiment_events_t *events) {
    json_t *object = json_object();
#define COUNTER(name, address, note, text) json_object_set_new(object, #name, json_integer(events->name));
#include "registers/registers.def"
    return object;
}

static json_t *track_to_json(const track_t *track) {
    const recording_t *r = &track->recording;
    const error_measure_t *e = &track->error;
    const error_budget_t *b = &track->budget;
    return json_pack("{s:s, s:f, s:f, s:f, s:o, s:f, s:I, s:f, s:{s:f, s:f, s:f, s:f, s:f}, s:o}", "mode",
                     mode_name(track->mode), "max_error_um", e->max_um, "max_error_at_s",
                     (double)e->max_sample / r->sample_rate_hz, "rms_error_um", e->rms_um, "nrmse_percent",
                     json_number_or_null(e->nrmse_percent), "peak_to_peak_um", track->peak_to_peak_um, "frames",
                     (json_int_t)r->samples, "sample_rate_hz", r->sample_rate_hz, "made_of", "static_um", b->static_um,
                     "delay_um", b->delay_um, "delay_s", b->delay_s, "noise_um", b->noise_um, "rest_um", b->rest_um,
                     "samples_with", events_to_json(&track->events));
}

double track_ratio(const track_t *before, const track_t *after) {
    return before->error.nrmse_percent / after->error.nrmse_percent;
}

json_t *tracks_to_json(const track_t *track, size_t count, const waveform_t *w) {
    json_t *list = json_array();
    for (size_t i = 0; i < count; i++) {
        json_array_append_new(list, track_to_json(&track[i]));
    }
    json_t *object = json_pack("{s:s, s:{s:s, s:f, s:f, s:f, s:I}, s:o}", "format", "hyst-track-1", "waveform", "name",
                               waveform_name(w->kind), "frequency_hz", w->frequency_hz, "amplitude_um", w->amplitude,
                               "offset_um", w->offset, "cycles", (json_int_t)w->cycles, "tracks", list);
    if (w->kind == WAVEFORM_SWEEP || w->kind == WAVEFORM_MULTISINE) {
        json_object_set_new(json_object_get(object, "waveform"), "end_frequency_hz", json_real(w->end_frequency_hz));
    }
    if (w->kind == WAVEFORM_SWEEP) {
        json_object_set_new(json_object_get(object, "waveform"), "sweep_s", json_real(w->sweep_s));
    }
    if (count == 2) {
        json_object_set_new(object, "ratio", json_number_or_null(track_ratio(&track[0], &track[1])));
    }
    return object;
}

static bool check_scales(const hyst_parameters_t *image, failure_t *failure) {
    return !amplifier_image_is_neutral(image) ||
           fail(failure, "the amplifier has no parameters, so what its converters' ranges are is not known: make an "
                         "image with `hyst compile` and `hyst push` it first");
}

static experiment_t experiment_of(const track_options_t *options, const waveform_t *waveform, hyst_mode_t mode) {
    return (experiment_t){
        .waveform = *waveform, .mode = mode, .condition = !options->no_condition, .frames = options->frames};
}

/* A recording that is complete is kept, even if the amplifier could not be disarmed after it. */
static bool run_one(device_t *device, const hyst_parameters_t *image, const waveform_t *waveform,
                    const track_options_t *options, track_t *track, failure_t *failure) {
    const experiment_t experiment = experiment_of(options, waveform, track->mode);
    const bool played = experiment_run(device, image, &experiment, &track->recording, &track->events, failure);
    if (track->recording.samples == 0) {
        return false;
    }
    measure(track);
    if (!(track->peak_to_peak_um > 0.0)) {
        return fail(failure,
                    "the reference does not move by one code of the converter: no error relative to its range");
    }
    const bool taken = options->take == NULL || options->take(options->context, track, failure);
    return taken && played;
}

typedef struct {
    const hyst_parameters_t *image;
    const waveform_t *waveform;
    const track_options_t *options;
    track_t *track;
} run_t;

static bool play(device_t *device, void *context, failure_t *failure) {
    const run_t *run = context;
    const track_options_t *options = run->options;
    bool good = true;
    for (size_t i = 0; i < options->count; i++) {
        good = good && run_one(device, run->image, run->waveform, options, &run->track[i], failure);
    }
    return good;
}

bool track_run(device_t *device, const track_options_t *options, waveform_t *waveform, track_t track[TRACK_MOST],
               bool *usage, failure_t *failure) {
    hyst_parameters_t image;
    double range_um[2];
    run_t run = {.image = &image, .waveform = waveform, .options = options, .track = track};
    const driving_t driving = {.play = play, .context = &run, .stop = options->stop};
    *usage = false;
    if (!amplifier_image_read(device, &image, failure) || !check_scales(&image, failure) ||
        !reach(&image, range_um, failure)) {
        return false;
    }
    *usage = !waveform_make(&options->waveform, range_um, "um", waveform, failure);
    const experiment_t first = experiment_of(options, waveform, options->mode[0]);
    if (*usage || !experiment_check(device, &first, failure)) {
        return false;
    }
    for (size_t i = 0; i < options->count; i++) {
        track[i] = (track_t){.mode = options->mode[i]};
    }
    const bool good = driving_run(device, &driving, failure);
    if (!good) {
        tracks_free(track, options->count);
    }
    return good;
}

void tracks_free(track_t *track, size_t count) {
    for (size_t i = 0; i < count; i++) {
        recording_free(&track[i].recording);
    }
}
