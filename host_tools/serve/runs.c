/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "serve/runs.h"
#include "amplifier/amplifier_image.h"
#include "compile/compile.h"
#include "interface/record_run.h"
#include "interface/track_run.h"
#include "serve/message.h"
#include <string.h>

bool run_request_read(json_t *message, run_request_t *request, failure_t *failure) {
    const run_kind_t kind = request->kind;
    *request = (run_request_t){.kind = kind, .waveform = WAVEFORM_OPTIONS_DEFAULT, .condition = true};
    char mode[16] = "both";
    (void)strcpy(request->waveform_name, "triangle");
    waveform_options_t *const w = &request->waveform;
    if (!message_text(message, "waveform", request->waveform_name, sizeof request->waveform_name, failure) ||
        !message_number(message, "frequency", &w->frequency_hz, failure) ||
        !message_number(message, "amplitude", &w->amplitude, failure) ||
        !message_number(message, "offset", &w->offset, failure) ||
        !message_count(message, "cycles", &w->cycles, failure) ||
        !message_count(message, "steps", &w->steps, failure) ||
        !message_number(message, "end_frequency", &w->end_frequency_hz, failure) ||
        !message_number(message, "sweep_time", &w->sweep_s, failure) ||
        !message_flag(message, "linear", &w->linear, failure) || !message_count(message, "tones", &w->tones, failure) ||
        !message_count(message, "frames", &request->frames, failure) ||
        !message_flag(message, "condition", &request->condition, failure) ||
        !message_range(message, "drive_range", request->drive_range_v, failure) ||
        !message_range(message, "position_range", request->position_range_um, failure) ||
        !message_text(message, "probe", request->probe, sizeof request->probe, failure) ||
        !message_text(message, "mode", mode, sizeof mode, failure)) {
        return false;
    }
    if (request->probe[0] != '\0' && probe_parts(request->probe, failure) == 0) {
        return false;
    }
    request->before = strcmp(mode, "both") == 0 || strcmp(mode, "linear") == 0;
    request->after = strcmp(mode, "both") == 0 || strcmp(mode, "compensate") == 0;
    return request->before || request->after || fail(failure, "mode: not linear, compensate or both");
}

/* The image in force is another one now. */
static bool take_image(line_keeper_t *keeper, device_t *device, failure_t *failure) {
    hyst_parameters_t image;
    if (!amplifier_image_read(device, &image, failure)) {
        return false;
    }
    line_keeper_new_image(keeper, &image);
    return true;
}

/* While the run is guarded: a file that cannot be written parks the amplifier. */
static bool take_recording(void *context, const recording_t *recording, const experiment_events_t *events,
                           failure_t *failure) {
    run_request_t *request = context;
    double drive[2];
    double position[2];
    values_range(recording->column[COLUMN_DRIVE], recording->samples, drive);
    values_range(recording->column[COLUMN_DISPLACEMENT], recording->samples, position);
    request->result = json_pack("{s:I, s:f, s:[ff], s:[ff], s:o}", "samples", (json_int_t)recording->samples,
                                "sample_rate_hz", recording->sample_rate_hz, "drive_v", drive[0], drive[1],
                                "displacement_um", position[0], position[1], "samples_with", events_to_json(events));
    return reserved_output_write(&request->file[0], recording, failure);
}

static bool record(line_keeper_t *keeper, device_t *device, run_request_t *request, failure_t *failure) {
    const bool probe = request->probe[0] != '\0';
    record_options_t options = RECORD_OPTIONS_DEFAULT;
    const record_listener_t listener = {.take = take_recording, .context = request};
    recording_t recording;
    hyst_parameters_t image;
    bool usage;
    if (!amplifier_image_read(device, &image, failure)) {
        return false;
    }
    if (probe) {
        options.probe = request->probe;
    } else {
        options.waveform = request->waveform;
    }
    if (amplifier_image_is_neutral(&image)) { /* otherwise its own ranges hold */
        memcpy(options.drive_range_v, request->drive_range_v, sizeof options.drive_range_v);
        memcpy(options.position_range_um, request->position_range_um, sizeof options.position_range_um);
    }
    options.no_condition = !request->condition;
    options.frames = request->frames;
    if (!record_run(device, &options, &listener, &recording, &usage, failure)) {
        return false;
    }
    recording_free(&recording);
    return !amplifier_image_is_neutral(&image) || take_image(keeper, device, failure);
}

static bool take_track(void *context, const track_t *track, failure_t *failure) {
    run_request_t *request = context;
    const size_t file = request->before && track->mode == HYST_MODE_COMPENSATE ? 1 : 0;
    return reserved_output_write(&request->file[file], &track->recording, failure);
}

static bool track(device_t *device, run_request_t *request, failure_t *failure) {
    track_options_t options = {.waveform = request->waveform,
                               .no_condition = !request->condition,
                               .frames = request->frames,
                               .take = take_track,
                               .context = request};
    waveform_t waveform;
    track_t tracks[TRACK_MOST];
    bool usage;
    if (request->before) {
        options.mode[options.count++] = HYST_MODE_LINEAR;
    }
    if (request->after) {
        options.mode[options.count++] = HYST_MODE_COMPENSATE;
    }
    if (!track_run(device, &options, &waveform, tracks, &usage, failure)) {
        return false;
    }
    request->result = tracks_to_json(tracks, options.count, &waveform);
    tracks_free(tracks, options.count);
    return true;
}

static bool push(line_keeper_t *keeper, device_t *device, run_request_t *request, failure_t *failure) {
    hyst_parameters_t image;
    if (!image_read(&image, request->path[0], failure) || !amplifier_image_write(device, &image, failure)) {
        return false;
    }
    line_keeper_new_image(keeper, &image);
    return true;
}

/* The command stop is the only way out of a fault. */
static bool clear(device_t *device, failure_t *failure) {
    return device_command(device, COMMAND_STOP, failure) && device_unlock(device, CONTROL_PARAMETERS, failure) &&
           device_command(device, COMMAND_CLEAR, failure);
}

static bool run(line_keeper_t *keeper, device_t *device, run_request_t *request, failure_t *failure) {
    const bool one = request->kind == RUN_RECORD;
    const size_t files = one ? 1 : (size_t)request->before + (size_t)request->after;
    const size_t rows = experiment_rows_most(device, request->frames, one && request->probe[0] != '\0');
    bool good = true;
    for (size_t i = 0; good && i < files; i++) {
        good = reserved_output_open(&request->file[i], request->path[i], rows, failure);
    }
    device_when_left_fault(device, driving_keep_fault, &request->left);
    good = good && (one ? record(keeper, device, request, failure) : track(device, request, failure));
    device_when_left_fault(device, NULL, NULL);
    for (size_t i = 0; i < files; i++) {
        reserved_output_close(&request->file[i]);
    }
    return good;
}

bool run_request_carry_out(line_keeper_t *keeper, device_t *device, void *context, failure_t *failure) {
    run_request_t *const request = context;
    if (request->kind == RUN_PUSH) {
        return push(keeper, device, request, failure);
    }
    if (request->kind == RUN_CLEAR) {
        return clear(device, failure);
    }
    request->waveform.name = request->waveform_name;
    return run(keeper, device, request, failure);
}
