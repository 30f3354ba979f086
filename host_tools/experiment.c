/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "experiment.h"
#include "capture.h"
#include "compile.h"
#include "mode_names.h"
#include "monotonic_clock.h"
#include "progress.h"
#include "source.h"
#include "telemetry.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* The amplifier is asked this often how far it is. Each answer costs the emulated one some of its samples. */
#define POLL_S 0.05
/* A loop that makes no sample for this long will not make one. */
#define STANDSTILL_S 5.0

/* Settled: in 0.1 s the drive changes by no more than one code of a 16-bit converter. */
#define SETTLED_S     0.1
#define SETTLED_DRIVE ((int64_t)1 << 16)

#define CAPTURE_SCALE 65536 /* a captured value is the upper 16 bits of Q31 */

/* Polls the amplifier's telemetry, and notices when its loop has stopped. */
typedef struct {
    device_t *device;
    int64_t now[REGISTER_COUNT]; /* the newest snapshot */
    double progress_s;           /* when its sequence number last changed */
} watch_t;

static bool watch_begin(watch_t *watch, device_t *device, failure_t *failure) {
    watch->device = device;
    watch->progress_s = monotonic_s();
    return device_read_telemetry(device, watch->now, failure);
}

static bool watch_next(watch_t *watch, failure_t *failure) {
    sleep_until(monotonic_s() + POLL_S);
    const int64_t before = watch->now[INDEX_sequence];
    if (!device_read_telemetry(watch->device, watch->now, failure)) {
        return false;
    }
    if (watch->now[INDEX_sequence] != before) {
        watch->progress_s = monotonic_s();
        if (watch->now[INDEX_state] == LOOP_PARKED) {
            return fail(failure,
                        "the amplifier has parked (faults 0x%04X): somebody else, or its watchdog, stopped the run",
                        (unsigned)watch->now[INDEX_faults_sticky]);
        }
    } else if (monotonic_s() - watch->progress_s > STANDSTILL_S) {
        return fail(failure,
                    "the amplifier's loop stands still at sample %" PRId64 ": do its converters, or its twin, run?",
                    before);
    }
    return true;
}

static int64_t full_scale(const hyst_parameters_t *image, hyst_mode_t mode, double level) {
    return mode == HYST_MODE_DIRECT ? drive_from_volts(image, level) : position_from_micrometres(image, level);
}

/* Conditions if asked to and waits until the amplifier rests at the start of the waveform. */
static bool go_to_start(device_t *device, const hyst_parameters_t *image, const experiment_t *experiment,
                        failure_t *failure) {
    const int64_t start = full_scale(image, experiment->mode, waveform_start(&experiment->waveform));
    if (!device_command(device, COMMAND_STOP, failure) ||
        !device_write(device, INDEX_mode, experiment->mode, failure) ||
        (experiment->condition && !device_command(device, COMMAND_CONDITION, failure)) ||
        /* In this order: a conditioning that begins forgets the setpoint, one that ends goes there. */
        !device_write(device, INDEX_setpoint, start, failure)) {
        return false;
    }
    progress_t progress;
    progress_begin(&progress, experiment->condition ? "conditioning" : "going to the start");
    const int64_t window = (int64_t)(SETTLED_S * device_sample_rate_hz(device));
    watch_t watch;
    bool ok = watch_begin(&watch, device, failure);
    const int64_t first = watch.now[INDEX_sequence];
    int64_t since = first;
    int64_t drive = watch.now[INDEX_drive];
    while (ok && (watch.now[INDEX_sequence] - since < window)) {
        ok = watch_next(&watch, failure);
        const bool rests = watch.now[INDEX_state] == LOOP_IDLE && watch.now[INDEX_active_mode] == experiment->mode &&
                           watch.now[INDEX_reference] == start &&
                           llabs(watch.now[INDEX_drive] - drive) <= SETTLED_DRIVE;
        if (!rests) {
            since = watch.now[INDEX_sequence];
            drive = watch.now[INDEX_drive];
        }
        /* The sweep takes two to three seconds; nobody knows the time after it. */
        const double seconds = (double)(watch.now[INDEX_sequence] - first) / device_sample_rate_hz(device);
        progress_update(&progress, seconds / (seconds + 1.0));
    }
    progress_end(&progress);
    return ok;
}

static bool load_sine(device_t *device, const hyst_parameters_t *image, const experiment_t *experiment,
                      failure_t *failure) {
    const waveform_t *w = &experiment->waveform;
    const int64_t offset = full_scale(image, experiment->mode, w->offset);
    const int64_t top = full_scale(image, experiment->mode, w->offset + w->amplitude);
    const double increment = round(w->frequency_hz / device_sample_rate_hz(device) * 4294967296.0);
    if (increment < 1.0 || increment > 2147483648.0) {
        return fail(failure, "a sine of %g Hz cannot be played at %g samples per second", w->frequency_hz,
                    device_sample_rate_hz(device));
    }
    return device_write(device, INDEX_source, SOURCE_SINE, failure) &&
           device_write(device, INDEX_source_offset, offset, failure) &&
           device_write(device, INDEX_source_amplitude, top - offset, failure) &&
           device_write(device, INDEX_source_increment, (int64_t)increment, failure) &&
           device_write(device, INDEX_source_cycles, (int64_t)w->cycles, failure);
}

static bool load_breakpoints(device_t *device, const hyst_parameters_t *image, const experiment_t *experiment,
                             failure_t *failure) {
    breakpoint_t corner[WAVEFORM_MAX_BREAKPOINTS] = {0};
    const size_t corners = waveform_breakpoints(&experiment->waveform, device_sample_rate_hz(device), corner);
    if ((int64_t)corners > device_identity(device, INDEX_waveform_capacity)) {
        return fail(failure, "the amplifier holds %" PRId64 " breakpoints, this waveform has %zu",
                    device_identity(device, INDEX_waveform_capacity), corners);
    }
    uint16_t registers[4 * WAVEFORM_MAX_BREAKPOINTS];
    for (size_t i = 0; i < corners; i++) {
        const uint32_t value = (uint32_t)full_scale(image, experiment->mode, corner[i].level);
        registers[4 * i] = (uint16_t)(corner[i].samples >> 16);
        registers[4 * i + 1] = (uint16_t)corner[i].samples;
        registers[4 * i + 2] = (uint16_t)(value >> 16);
        registers[4 * i + 3] = (uint16_t)value;
    }
    /* A triangle has all its cycles in the table. */
    const unsigned long passes = experiment->waveform.kind == WAVEFORM_TRIANGLE ? 1UL : experiment->waveform.cycles;
    return device_write_block(device, ADDRESS_waveform, 0, 4 * corners, registers, failure) &&
           device_write(device, INDEX_waveform_points, (int64_t)corners, failure) &&
           device_write(device, INDEX_source, SOURCE_BREAKPOINTS, failure) &&
           device_write(device, INDEX_source_cycles, (int64_t)passes, failure);
}

/* How the waveform fits into the capture buffer. */
typedef struct {
    int64_t decimation, frames;
} capture_plan_t;

static bool plan_capture(device_t *device, const waveform_t *waveform, capture_plan_t *plan, failure_t *failure) {
    const double samples = waveform_samples(waveform, device_sample_rate_hz(device));
    const double capacity = (double)device_identity(device, INDEX_capture_capacity);
    const double decimation = ceil(samples / capacity);
    if (decimation > UINT16_MAX) {
        return fail(failure, "the waveform lasts %.0f s; the amplifier captures at most %.0f s",
                    samples / device_sample_rate_hz(device), capacity * UINT16_MAX / device_sample_rate_hz(device));
    }
    plan->decimation = (int64_t)decimation;
    plan->frames = (int64_t)(samples / decimation);
    return plan->frames >= 2 || fail(failure, "the waveform has fewer than two samples");
}

static bool arm(device_t *device, const capture_plan_t *plan, failure_t *failure) {
    return device_write(device, INDEX_capture_decimation, plan->decimation, failure) &&
           device_write(device, INDEX_capture_length, plan->frames, failure) &&
           device_write(device, INDEX_capture_trigger, CAPTURE_AT_SOURCE, failure) &&
           device_command(device, COMMAND_ARM_CAPTURE, failure);
}

static bool play(device_t *device, const capture_plan_t *plan, experiment_events_t *events, failure_t *failure) {
    watch_t watch;
    if (!watch_begin(&watch, device, failure)) {
        return false;
    }
    int64_t before[REGISTER_COUNT];
    for (int i = 0; i < REGISTER_COUNT; i++) {
        before[i] = watch.now[i];
    }
    if (!device_start(device, failure)) {
        return false;
    }
    progress_t progress;
    progress_begin(&progress, "playing");
    bool ok = true;
    while (ok && (watch.now[INDEX_capture_state] != CAPTURE_DONE || watch.now[INDEX_state] == LOOP_PLAYING)) {
        ok = watch_next(&watch, failure);
        progress_update(&progress, (double)watch.now[INDEX_capture_frames] / (double)plan->frames);
    }
    progress_end(&progress);
    *events = (experiment_events_t){
        .drive_limited = watch.now[INDEX_drive_limited] - before[INDEX_drive_limited],
        .unreachable = watch.now[INDEX_unreachable] - before[INDEX_unreachable],
        .filter_saturated = watch.now[INDEX_filter_saturated] - before[INDEX_filter_saturated],
        .overruns = watch.now[INDEX_overruns] - before[INDEX_overruns],
        .converter_timeouts = watch.now[INDEX_converter_timeouts] - before[INDEX_converter_timeouts]};
    return ok;
}

static bool read_frames(device_t *device, size_t frames, uint16_t *registers, failure_t *failure) {
    const size_t count = CAPTURE_FRAME_REGISTERS * frames;
    const size_t part = CAPTURE_FRAME_REGISTERS * 256U; /* between two updates of the bar */
    progress_t progress;
    progress_begin(&progress, "reading the capture");
    bool ok = true;
    for (size_t done = 0; ok && done < count; done += part) {
        progress_update(&progress, (double)done / (double)count);
        ok = device_read_block(device, ADDRESS_capture, done, count - done < part ? count - done : part,
                               registers + done, failure);
    }
    progress_end(&progress);
    return ok;
}

static hyst_q31_t captured(uint16_t value) {
    return (hyst_q31_t)(int16_t)value * CAPTURE_SCALE;
}

static void to_recording(const device_t *device, const hyst_parameters_t *image, const experiment_t *experiment,
                         const capture_plan_t *plan, const uint16_t *registers, recording_t *recording) {
    recording_create(recording, "capture", device_sample_rate_hz(device) / (double)plan->decimation,
                     (size_t)plan->frames);
    double *reference = experiment->mode == HYST_MODE_DIRECT ? NULL : recording_add_column(recording, COLUMN_REFERENCE);
    for (size_t i = 0; i < (size_t)plan->frames; i++) {
        const uint16_t *frame = registers + CAPTURE_FRAME_REGISTERS * i;
        if (reference != NULL) {
            reference[i] = position_to_micrometres(image, captured(frame[0]));
        }
        recording->column[COLUMN_DRIVE][i] = drive_to_volts(image, captured(frame[1]));
        recording->column[COLUMN_DISPLACEMENT][i] = position_to_micrometres(image, captured(frame[2]));
    }
    char text[80];
    recording_set_key(recording, "source", "hyst amplifier, captured");
    recording_set_key(recording, "mode", mode_name(experiment->mode));
    const waveform_t *w = &experiment->waveform;
    (void)snprintf(text, sizeof text, "%s, %lu cycles at %g Hz", waveform_name(w->kind), w->cycles, w->frequency_hz);
    recording_set_key(recording, "waveform", text);
    recording_set_key(recording, "conditioned", experiment->condition ? "yes" : "no");
    (void)snprintf(text, sizeof text, "0x%08" PRIX32, image->model_id);
    recording_set_key(recording, "model_id", text);
}

bool experiment_run(device_t *device, const hyst_parameters_t *image, const experiment_t *experiment,
                    recording_t *recording, experiment_events_t *events, failure_t *failure) {
    capture_plan_t plan = {0};
    if (!plan_capture(device, &experiment->waveform, &plan, failure) ||
        !go_to_start(device, image, experiment, failure)) {
        return false;
    }
    const bool loaded = experiment->waveform.kind == WAVEFORM_SINE
                            ? load_sine(device, image, experiment, failure)
                            : load_breakpoints(device, image, experiment, failure);
    if (!loaded || !arm(device, &plan, failure) || !play(device, &plan, events, failure)) {
        return false;
    }
    uint16_t *registers = allocate(CAPTURE_FRAME_REGISTERS * (size_t)plan.frames, sizeof *registers);
    const bool ok = read_frames(device, (size_t)plan.frames, registers, failure);
    if (ok) {
        to_recording(device, image, experiment, &plan, registers, recording);
    }
    free(registers);
    return ok;
}

static void print_event(int64_t samples, const char *what) {
    if (samples > 0) {
        (void)fprintf(stderr, "note: %s in %" PRId64 " samples\n", what, samples);
    }
}

void experiment_print_events(const experiment_events_t *events) {
    print_event(events->converter_timeouts, "the position converter was not ready");
    print_event(events->overruns, "the loop came late");
    print_event(events->unreachable, "no drive reaches the reference");
    print_event(events->drive_limited, "the drive met its limit");
    print_event(events->filter_saturated, "a filter saturated");
}
