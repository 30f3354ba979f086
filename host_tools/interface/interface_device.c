/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The amplifier of hyst_interface.h. */
#include "amplifier/amplifier_image.h"
#include "amplifier/device/mode_names.h"
#include "amplifier/device/opening.h"
#include "amplifier/driving.h"
#include "amplifier/model_guard.h"
#include "base/monotonic_clock.h"
#include "base/stop_signal.h"
#include "compile/compile.h"
#include "compile/hysteresis_text.h"
#include "interface/handles.h"
#include "interface/info_run.h"
#include "interface/interface_work.h"
#include "interface/record_run.h"
#include "interface/track_run.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct hyst_host_device {
    device_t *device;
    provenance_note_t *note;
    bool known; /* the image in force, as of model_id */
    hyst_parameters_t image;
    volatile sig_atomic_t stop;              /* STOP_BY_PROGRAM, in place of the commands' signal; 0: go on */
    hyst_host_recording_t *kept[TRACK_MOST]; /* complete, of the run that goes on or was last; NULL: none, or taken */
    driving_fault_t left;                    /* what the newest of these, or stop, led out of; "": none, or taken */
};

static void drop_kept(hyst_host_device_t *device) {
    for (size_t i = 0; i < TRACK_MOST; i++) {
        hyst_host_recording_free(device->kept[i]);
        device->kept[i] = NULL;
    }
}

hyst_host_device_t *hyst_host_device_open(const char *options) {
    device_options_t line = DEVICE_OPTIONS_DEFAULT;
    line.look_elsewhere = true;
    json_int_t baud = (json_int_t)line.baud, slave = (json_int_t)line.slave;
    hyst_host_device_t *handle = NULL;
    json_t *json = interface_options(options, "{s:s, s?I, s?s, s?I, s?F}", "port", &line.port, "baud", &baud, "parity",
                                     &line.parity, "slave", &slave, "timeout_s", &line.timeout_s);
    if (json == NULL) {
        return NULL;
    }
    line.baud = baud > 0 ? (unsigned long)baud : 0;
    line.slave = slave > 0 ? (unsigned long)slave : 0;
    provenance_note_t *note = provenance_note();
    provenance_note_t *before = provenance_enter(note);
    device_t *device =
        device_options_check(&line, interface_failure()) ? device_open_any_map(&line, interface_failure()) : NULL;
    (void)provenance_enter(before);
    json_decref(json);
    if (device != NULL) {
        handle = allocate(1, sizeof *handle);
        handle->device = device;
        handle->note = note;
        device_when_left_fault(device, driving_keep_fault, &handle->left);
    } else {
        provenance_note_free(note);
    }
    return handle;
}

void hyst_host_device_close(hyst_host_device_t *device) {
    if (device != NULL) {
        device_close(device->device);
        drop_kept(device);
        provenance_note_free(device->note);
        free(device);
    }
}

void hyst_host_device_cancel(hyst_host_device_t *device, int cancel) {
    device->stop = cancel != 0 ? STOP_BY_PROGRAM : 0;
}

static hyst_host_recording_t *recorded(const hyst_host_device_t *device, const recording_t *recording) {
    provenance_note_t *note = provenance_note();
    provenance_note_add(note, device->note);
    return interface_recording(recording, note);
}

/* As record_take_t and track_take_t. */
static void keep(hyst_host_device_t *device, const recording_t *recording, size_t index) {
    recording_t copy;
    recording_copy(&copy, recording, 0, recording->samples);
    device->kept[index] = recorded(device, &copy);
}

hyst_host_recording_t *hyst_host_device_kept(hyst_host_device_t *device, size_t index) {
    hyst_host_recording_t *const kept = index < TRACK_MOST ? device->kept[index] : NULL;
    if (kept != NULL) {
        device->kept[index] = NULL;
    }
    return kept;
}

char *hyst_host_device_left_fault(hyst_host_device_t *device) {
    char *const line = device->left.text[0] != '\0' ? copy_text(device->left.text) : NULL;
    device->left.text[0] = '\0';
    return line;
}

static void begin_run(hyst_host_device_t *device) {
    interface_listen(&device->stop);
    drop_kept(device);
    device->left.text[0] = '\0';
}

/* Of an amplifier with another map there is no more than its stop. */
static bool known_map(const hyst_host_device_t *device) {
    return device_expect_known_map(device->device, interface_failure());
}

/* Counts of a waveform, as JSON has them. */
typedef struct {
    json_int_t cycles, steps, tones;
    int linear;
} counts_t;

static counts_t counts_of(const waveform_options_t *waveform) {
    return (counts_t){.cycles = (json_int_t)waveform->cycles,
                      .steps = (json_int_t)waveform->steps,
                      .tones = (json_int_t)waveform->tones};
}

static void set_counts(waveform_options_t *waveform, const counts_t *counts) {
    waveform->cycles = counts->cycles > 0 ? (unsigned long)counts->cycles : 0;
    waveform->steps = counts->steps > 0 ? (unsigned long)counts->steps : 0;
    waveform->tones = counts->tones > 0 ? (unsigned long)counts->tones : 0;
    waveform->linear = counts->linear != 0;
}

static bool keep_recording(void *context, const recording_t *recording, const experiment_events_t *events,
                           failure_t *failure) {
    (void)events, (void)failure;
    keep(context, recording, 0);
    return true;
}

hyst_host_recording_t *hyst_host_device_record(hyst_host_device_t *device, const char *options) {
    record_options_t settings = RECORD_OPTIONS_DEFAULT;
    const record_listener_t listener = {.stop = &device->stop, .take = keep_recording, .context = device};
    counts_t counts = counts_of(&settings.waveform);
    recording_t recording;
    bool usage;
    int condition = 1;
    json_t *json = interface_options(
        options, "{s?s, s?F, s?F, s?F, s?F, s?F, s?I, s?I, s?I, s?b, s?s, s?F, s?[FF!], s?[FF!], s?b}", "waveform",
        &settings.waveform.name, "frequency_hz", &settings.waveform.frequency_hz, "end_frequency_hz",
        &settings.waveform.end_frequency_hz, "sweep_s", &settings.waveform.sweep_s, "amplitude_v",
        &settings.waveform.amplitude, "offset_v", &settings.waveform.offset, "cycles", &counts.cycles, "steps",
        &counts.steps, "tones", &counts.tones, "linear", &counts.linear, "probe", &settings.probe, "slew_rate_v_per_s",
        &settings.slew_v_per_s, "drive_range_v", &settings.drive_range_v[0], &settings.drive_range_v[1],
        "position_range_um", &settings.position_range_um[0], &settings.position_range_um[1], "condition", &condition);
    if (json == NULL) {
        return NULL;
    }
    set_counts(&settings.waveform, &counts);
    settings.no_condition = condition == 0;
    begin_run(device);
    device->known = false; /* ranges that are given become an image */
    const bool good =
        known_map(device) && record_run(device->device, &settings, &listener, &recording, &usage, interface_failure());
    json_decref(json);
    if (good) {
        recording_free(&recording);
    }
    return good ? hyst_host_device_kept(device, 0) : NULL;
}

static bool take_modes(const char *name, track_options_t *settings) {
    const bool both = strcmp(name, "both") == 0;
    settings->count = both ? 2 : 1;
    settings->mode[0] = strcmp(name, "compensate") == 0 ? HYST_MODE_COMPENSATE : HYST_MODE_LINEAR;
    settings->mode[1] = HYST_MODE_COMPENSATE;
    return both || settings->mode[0] == HYST_MODE_COMPENSATE || strcmp(name, "linear") == 0 ||
           fail(interface_failure(), "--mode %s: not linear or compensate", name);
}

static bool keep_track(void *context, const track_t *track, failure_t *failure) {
    hyst_host_device_t *device = context;
    (void)failure;
    keep(device, &track->recording, device->kept[0] == NULL ? 0 : 1);
    return true;
}

char *hyst_host_device_track(hyst_host_device_t *device, const char *options, hyst_host_recording_t *recording[2]) {
    track_options_t settings = {
        .waveform = WAVEFORM_OPTIONS_DEFAULT, .stop = &device->stop, .take = keep_track, .context = device};
    counts_t counts = counts_of(&settings.waveform);
    json_int_t frames = 0;
    waveform_t waveform;
    track_t track[TRACK_MOST];
    const char *mode = "compensate";
    bool usage;
    int condition = 1;
    json_t *json =
        interface_options(options, "{s?s, s?F, s?F, s?F, s?F, s?F, s?I, s?I, s?I, s?b, s?I, s?b, s?s}", "waveform",
                          &settings.waveform.name, "frequency_hz", &settings.waveform.frequency_hz, "end_frequency_hz",
                          &settings.waveform.end_frequency_hz, "sweep_s", &settings.waveform.sweep_s, "amplitude_um",
                          &settings.waveform.amplitude, "offset_um", &settings.waveform.offset, "cycles",
                          &counts.cycles, "steps", &counts.steps, "tones", &counts.tones, "linear", &counts.linear,
                          "frames", &frames, "condition", &condition, "mode", &mode);
    recording[0] = recording[1] = NULL;
    if (json == NULL) {
        return NULL;
    }
    set_counts(&settings.waveform, &counts);
    settings.frames = frames > 0 ? (unsigned long)frames : 0;
    settings.no_condition = condition == 0;
    begin_run(device);
    const bool good = known_map(device) &&
                      (frames >= 0 || fail(interface_failure(), "--frames %lld: 0 or more", (long long)frames)) &&
                      take_modes(mode, &settings) &&
                      track_run(device->device, &settings, &waveform, track, &usage, interface_failure());
    json_decref(json);
    if (!good) {
        return NULL;
    }
    char *answer = interface_text(tracks_to_json(track, settings.count, &waveform));
    for (size_t i = 0; i < settings.count; i++) {
        recording[i] = hyst_host_device_kept(device, i);
    }
    tracks_free(track, settings.count);
    return answer;
}

char *hyst_host_device_push(hyst_host_device_t *device, const unsigned char *image, size_t length) {
    hyst_parameters_t parameters;
    device->known = false;
    if (!known_map(device) || !image_from_bytes(&parameters, image, length, "image", interface_failure()) ||
        !amplifier_image_write(device->device, &parameters, interface_failure())) {
        return NULL;
    }
    return interface_text(json_pack("{s:I, s:s, s:I}", "model_id", (json_int_t)parameters.model_id, "hysteresis",
                                    hysteresis_name(&parameters), "operators",
                                    (json_int_t)hysteresis_size(&parameters)));
}

static json_t *state_of(const int64_t *now) {
    return json_pack("{s:s, s:s}", "mode", mode_name(now[INDEX_active_mode]), "state", state_name(now[INDEX_state]));
}

static char *halt(hyst_host_device_t *device, control_command_t command) {
    int64_t now[REGISTER_COUNT];
    if (!driving_halt(device->device, command, now, interface_failure())) {
        return NULL;
    }
    return interface_text(device_map_known(device->device) ? state_of(now) : json_pack("{s:n, s:n}", "mode", "state"));
}

char *hyst_host_device_stop(hyst_host_device_t *device) {
    device->left.text[0] = '\0';
    return halt(device, COMMAND_STOP);
}

char *hyst_host_device_park(hyst_host_device_t *device) {
    return halt(device, COMMAND_PARK);
}

char *hyst_host_device_off(hyst_host_device_t *device) {
    return halt(device, COMMAND_DISARM);
}

char *hyst_host_device_now(hyst_host_device_t *device) {
    int64_t now[REGISTER_COUNT], model_id;
    const hyst_parameters_t *image = &device->image;
    if (!known_map(device) || !device_read_telemetry(device->device, now, interface_failure()) ||
        !device_read(device->device, INDEX_active_model_id, &model_id, interface_failure())) {
        return NULL;
    }
    if (!device->known || model_id != image->model_id) { /* a thousand registers: not each time */
        device->known = amplifier_image_read(device->device, &device->image, interface_failure());
        if (!device->known) {
            return NULL;
        }
    }
    const bool direct = now[INDEX_active_mode] == HYST_MODE_DIRECT;
    const hyst_q31_t reference = (hyst_q31_t)now[INDEX_reference];
    json_t *said =
        json_pack("{s:I, s:f, s:f, s:s, s:f, s:f}", "sample", (json_int_t)now[INDEX_sequence], "time_s",
                  (double)now[INDEX_sequence] / device_sample_rate_hz(device->device), "reference",
                  direct ? drive_to_volts(image, reference) : position_to_micrometres(image, reference),
                  "reference_unit", direct ? "V" : "um", "drive_v", drive_to_volts(image, (hyst_q31_t)now[INDEX_drive]),
                  "position_um", position_to_micrometres(image, (hyst_q31_t)now[INDEX_position]));
    json_t *json = state_of(now);
    json_object_update(json, said);
    json_decref(said);
    return interface_text(json);
}

/* Between two looks of the guard. */
#define WATCH_S 0.05

static bool watch_pause(void *context, failure_t *failure) {
    const hyst_host_device_t *device = context;
    sleep_until(monotonic_s() + WATCH_S);
    return device->stop == 0 || fail(failure, "interrupted (%s)", stop_signal_name(device->stop));
}

/* Until it warns, or for_s have passed (0: never). *recording has samples only if it warned. */
static bool watch(hyst_host_device_t *device, guard_t *guard, const guard_settings_t *settings, double for_s,
                  recording_t *recording, size_t *warned, failure_t *failure) {
    if (!guard_begin(guard, device->device, &device->image, settings, watch_pause, device, failure)) {
        return false;
    }
    for (;;) {
        const guard_answer_t answer = guard_look(guard, failure);
        if (answer != GUARD_QUIET) {
            return answer == GUARD_WARNED && guard_fetch(guard, recording, warned, failure);
        }
        if (for_s > 0.0 && guard_clock_s(guard) >= for_s) {
            return true;
        }
        if (!watch_pause(device, failure)) {
            return false;
        }
    }
}

char *hyst_host_device_watch(hyst_host_device_t *device, const char *options, hyst_host_recording_t *recording[1]) {
    guard_settings_t settings = GUARD_SETTINGS_DEFAULT;
    double for_s = 0.0;
    guard_t guard;
    recording_t record = {0};
    size_t warned = 0;
    failure_t ignored;
    recording[0] = NULL;
    json_t *json = interface_options(options, "{s?F, s?F, s?F, s?F, s?F, s?F}", "limit_um", &settings.limit_um, "times",
                                     &settings.times, "time_s", &settings.time_s, "before_s", &settings.before_s,
                                     "after_s", &settings.after_s, "for_s", &for_s);
    json_decref(json);
    if (json == NULL || !known_map(device) || !guard_settings_check(&settings, interface_failure()) ||
        (for_s < 0.0 && !fail(interface_failure(), "--for %g: must not be negative", for_s)) ||
        !amplifier_image_read(device->device, &device->image, interface_failure())) {
        return NULL;
    }
    device->known = true;
    bool good = watch(device, &guard, &settings, for_s, &record, &warned, interface_failure());
    good = guard_end(&guard, good ? interface_failure() : &ignored) && good;
    device_lock(device->device);
    if (!good) {
        recording_free(&record);
        return NULL;
    }
    const bool any = record.samples > 0;
    char *answer =
        interface_text(json_pack("{s:b, s:f, s:f, s:f, s:o}", "warned", any, "limit_um", guard.limit_um, "usual_um",
                                 guard.usual.rms_um, "seconds", guard_clock_s(&guard), "warned_s",
                                 any ? json_real((double)warned / record.sample_rate_hz) : json_null()));
    if (any) {
        recording[0] = recorded(device, &record);
    }
    return answer;
}

char *hyst_host_device_info(hyst_host_device_t *device) {
    info_t info;
    return known_map(device) && info_read(device->device, &info, interface_failure())
               ? interface_text(info_to_json(&info))
               : NULL;
}

unsigned char *hyst_host_device_pull(hyst_host_device_t *device, size_t *length) {
    hyst_parameters_t parameters;
    unsigned char bytes[IMAGE_MOST_BYTES], *image = NULL;
    if (known_map(device) && amplifier_image_read(device->device, &parameters, interface_failure()) &&
        image_to_bytes(&parameters, bytes, length, "image", interface_failure())) {
        image = allocate(*length, 1);
        memcpy(image, bytes, *length);
    }
    return image;
}
