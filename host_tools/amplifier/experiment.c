/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/experiment.h"
#include "amplifier/capture_reader.h"
#include "amplifier/device/arming.h"
#include "amplifier/device/mode_names.h"
#include "amplifier/device/parking.h"
#include "amplifier/device/restart.h"
#include "amplifier/device/sample_number.h"
#include "amplifier/device/standstill.h"
#include "amplifier/sampling_note.h"
#include "amplifier/stage_supply.h"
#include "base/monotonic_clock.h"
#include "base/progress.h"
#include "chain/fit_ranges.h"
#include "compile/compile.h"
#include "loop/capture.h"
#include "loop/telemetry.h"
#include "motion/source.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Interval of polling the amplifier's progress. Each answer costs the emulated amplifier some samples. */
#define POLL_S 0.05

/* Settled: in 0.1 s, or as long as it is to rest, the drive changes by no more than one code of a 16-bit converter. */
#define SETTLED_S     0.1
#define SETTLED_DRIVE ((int64_t)1 << 16)
/* A reference on its way moves in every sample, however slow its slew. One that has rested for so long elsewhere does
 * not get there. */
#define STUCK_S 1.0

#define CAPTURE_SCALE 65536 /* a captured value is the upper 16 bits of Q31 */

/* Polls the amplifier's telemetry, and notices when its loop has stopped. */
typedef struct {
    device_t *device;
    int64_t now[REGISTER_COUNT]; /* the newest snapshot */
    standstill_t standstill;
    int64_t rests_since; /* the reference, by the loop's sample; also of one that conditions */
} watch_t;

static bool watch_begin(watch_t *watch, device_t *device, failure_t *failure) {
    watch->device = device;
    if (!device_read_telemetry(device, watch->now, failure)) {
        return false;
    }
    watch->standstill = standstill_begin(watch->now[INDEX_sequence]);
    watch->rests_since = watch->now[INDEX_sequence];
    return true;
}

/* Always false. */
static bool has_parked(watch_t *watch, failure_t *failure) {
    (void)parking_fail(watch->now[INDEX_faults_sticky], failure);
    device_blame_restart(watch->device, failure);
    return false;
}

/* parks: parked is what it is to be. */
static bool watch_on(watch_t *watch, bool parks, failure_t *failure) {
    const int64_t before = watch->now[INDEX_sequence], reference = watch->now[INDEX_reference];
    if (!device_read_telemetry(watch->device, watch->now, failure) ||
        !standstill_check(&watch->standstill, watch->now[INDEX_sequence], failure)) {
        return false;
    }
    if (watch->now[INDEX_reference] != reference || watch->now[INDEX_state] == LOOP_CONDITIONING) {
        watch->rests_since = watch->now[INDEX_sequence];
    }
    const bool parked =
        watch->now[INDEX_state] == LOOP_PARKED && (!parks || parking_is_off(watch->now[INDEX_amplifier_state]));
    return watch->now[INDEX_sequence] == before || !parked || has_parked(watch, failure);
}

static bool watch_next(watch_t *watch, failure_t *failure) {
    return watch_on(watch, false, failure);
}

static int64_t full_scale(const hyst_parameters_t *image, hyst_mode_t mode, double level) {
    return mode == HYST_MODE_DIRECT ? drive_from_volts(image, level) : position_from_micrometres(image, level);
}

/* Settings that do not depend on what is played. */
typedef struct {
    hyst_mode_t mode;
    bool condition;
    double start;               /* level at which it begins */
    double rest_s;              /* how long it has been there before */
    int64_t decimation, frames; /* of the capture */
    char text[200];             /* what is played, for the recording */
} run_t;

static double level_of(const hyst_parameters_t *image, hyst_mode_t mode, int64_t reference) {
    return mode == HYST_MODE_DIRECT ? drive_to_volts(image, (hyst_q31_t)reference)
                                    : position_to_micrometres(image, (hyst_q31_t)reference);
}

/* Another master that parks the amplifier, or writes a setpoint, takes the way to the start away. */
static bool check_way(const watch_t *watch, const hyst_parameters_t *image, hyst_mode_t mode, int64_t start,
                      failure_t *failure) {
    const int64_t reference = watch->now[INDEX_reference];
    const double rested_s =
        (double)samples_between(watch->rests_since, watch->now[INDEX_sequence]) / device_sample_rate_hz(watch->device);
    return reference == start || rested_s < STUCK_S ||
           fail(failure,
                "the waveform begins at %.6g %s, and the amplifier's reference rests at %.6g: does somebody else move "
                "or park it?",
                level_of(image, mode, start), mode == HYST_MODE_DIRECT ? "V" : "um", level_of(image, mode, reference));
}

/* The hold source goes on from what it held last, perhaps at the other end of the range, perhaps in other units: that
 * way is made in park, where the drive does not follow it. */
static bool lead_reference(device_t *device, const hyst_parameters_t *image, hyst_mode_t mode, int64_t start,
                           failure_t *failure) {
    watch_t watch;
    bool ok = device_command(device, COMMAND_PARK, failure) && device_write(device, INDEX_setpoint, start, failure) &&
              watch_begin(&watch, device, failure);
    while (ok && !(watch.now[INDEX_state] == LOOP_PARKED && watch.now[INDEX_reference] == start)) {
        sleep_until(monotonic_s() + POLL_S);
        ok = watch_on(&watch, true, failure) && check_way(&watch, image, mode, start, failure);
    }
    return ok;
}

/* In this order: a conditioning that begins forgets the setpoint, and in direct mode ends at park and goes there. */
static bool enter_mode(device_t *device, const hyst_parameters_t *image, const run_t *run, int64_t start,
                       failure_t *failure) {
    return device_arm(device, failure) && lead_reference(device, image, run->mode, start, failure) &&
           device_write(device, INDEX_mode, run->mode, failure) &&
           (!run->condition || (device_command(device, COMMAND_CONDITION, failure) &&
                                device_write(device, INDEX_setpoint, start, failure)));
}

/* The reference would never be there. */
static bool check_start(device_t *device, const hyst_parameters_t *image, hyst_mode_t mode, int64_t start,
                        failure_t *failure) {
    int64_t low, high;
    return device_read(device, INDEX_reference_low, &low, failure) &&
           device_read(device, INDEX_reference_high, &high, failure) &&
           ((start >= low && start <= high) ||
            fail(failure,
                 "the waveform begins at %.6g %s, and the amplifier keeps its reference between %.6g and %.6g "
                 "(registers reference_low, reference_high)",
                 level_of(image, mode, start), mode == HYST_MODE_DIRECT ? "V" : "um", level_of(image, mode, low),
                 level_of(image, mode, high)));
}

/* Conditions the actuator if requested, and waits until the amplifier rests at the start. */
static bool go_to_start(device_t *device, const hyst_parameters_t *image, const run_t *run, failure_t *failure) {
    const int64_t start = full_scale(image, run->mode, run->start);
    progress_t progress;
    progress_begin(&progress, run->condition ? "conditioning" : "going to the start");
    const int64_t window = (int64_t)(fmax(SETTLED_S, run->rest_s) * device_sample_rate_hz(device));
    watch_t watch;
    bool ok = check_start(device, image, run->mode, start, failure) && enter_mode(device, image, run, start, failure) &&
              watch_begin(&watch, device, failure);
    const int64_t first = ok ? watch.now[INDEX_sequence] : 0;
    int64_t since = first;
    int64_t drive = ok ? watch.now[INDEX_drive] : 0;
    while (ok && samples_between(since, watch.now[INDEX_sequence]) < window) {
        sleep_until(monotonic_s() + POLL_S);
        ok = watch_next(&watch, failure) && check_way(&watch, image, run->mode, start, failure);
        const bool rests = watch.now[INDEX_state] == LOOP_IDLE && watch.now[INDEX_active_mode] == run->mode &&
                           watch.now[INDEX_reference] == start &&
                           llabs(watch.now[INDEX_drive] - drive) <= SETTLED_DRIVE;
        if (!rests) {
            since = watch.now[INDEX_sequence];
            drive = watch.now[INDEX_drive];
        }
        /* The sweep takes two to three seconds, or longer where a slew is slower; the time to reach the start after it
         * is not known. */
        const double seconds =
            (double)samples_between(first, watch.now[INDEX_sequence]) / device_sample_rate_hz(device);
        progress_update(&progress, seconds / (seconds + 1.0 + run->rest_s));
    }
    progress_end(&progress);
    return ok;
}

/* So that what is printed of the lowest frequency is not below it. */
#define PRINTED 1.00001

/* Phase step of this frequency. */
static bool increment_of(const device_t *device, double frequency_hz, int64_t *increment, failure_t *failure) {
    const double turns = round(frequency_hz / device_sample_rate_hz(device) * 4294967296.0);
    const double rate_hz = device_sample_rate_hz(device);
    *increment = (int64_t)turns;
    if (turns < 1.0) {
        return fail(failure, "a sine of %g Hz cannot be played at %g samples per second: the lowest frequency is %g Hz",
                    frequency_hz, rate_hz, PRINTED * 0x1p-32 * rate_hz);
    }
    /* Two samples a period are all at the middle of a sine, or at any share of a tone's amplitude. */
    return turns < 0x1p31 ||
           fail(failure, "a sine of %g Hz cannot be played at %g samples per second: only below half of that",
                frequency_hz, rate_hz);
}

/* What sines, sweeps and multisines have in common. */
static bool load_sine(device_t *device, const hyst_parameters_t *image, hyst_mode_t mode, const waveform_t *w,
                      source_kind_t kind, unsigned long passes, failure_t *failure) {
    const int64_t offset = full_scale(image, mode, w->offset);
    const int64_t top = full_scale(image, mode, w->offset + w->amplitude);
    int64_t increment;
    return increment_of(device, w->frequency_hz, &increment, failure) &&
           device_write(device, INDEX_source, kind, failure) &&
           device_write(device, INDEX_source_offset, offset, failure) &&
           device_write(device, INDEX_source_amplitude, top - offset, failure) &&
           device_write(device, INDEX_source_increment, increment, failure) &&
           device_write(device, INDEX_source_cycles, (int64_t)passes, failure);
}

static bool load_sweep(device_t *device, const waveform_t *w, failure_t *failure) {
    int64_t end;
    return increment_of(device, w->end_frequency_hz, &end, failure) &&
           device_write(device, INDEX_sweep_increment, end, failure) &&
           device_write(device, INDEX_sweep_samples,
                        (int64_t)fmax(1.0, round(w->sweep_s * device_sample_rate_hz(device))), failure) &&
           device_write(device, INDEX_sweep_spacing, w->linear ? SWEEP_LINEAR : SWEEP_LOGARITHMIC, failure);
}

enum { TONE_REGISTERS = 6 };

static bool load_tones(device_t *device, const waveform_t *w, failure_t *failure) {
    uint16_t registers[TONE_REGISTERS * SOURCE_TONES_MAX];
    int64_t increment;
    if (!increment_of(device, w->frequency_hz * w->tone[w->tones - 1].harmonic, &increment, failure)) {
        return false;
    }
    for (size_t i = 0; i < w->tones; i++) {
        const uint32_t words[] = {w->tone[i].harmonic, (uint32_t)lround(w->tone[i].amplitude * HYST_Q31_MAX),
                                  (uint32_t)(uint64_t)round(w->tone[i].phase_turns * 4294967296.0)};
        for (size_t k = 0; k < TONE_REGISTERS; k++) {
            registers[TONE_REGISTERS * i + k] = (uint16_t)(k % 2 == 0 ? words[k / 2] >> 16 : words[k / 2]);
        }
    }
    return device_write_block(device, ADDRESS_tones, 0, TONE_REGISTERS * w->tones, registers, failure) &&
           device_write(device, INDEX_source_tones, (int64_t)w->tones, failure);
}

/* The corners as the amplifier holds them, four registers each; to be freed. */
static uint16_t *table_of(const hyst_parameters_t *image, hyst_mode_t mode, const breakpoint_t *corner,
                          size_t corners) {
    uint16_t *registers = allocate(4 * corners, sizeof *registers);
    for (size_t i = 0; i < corners; i++) {
        const uint32_t value = (uint32_t)full_scale(image, mode, corner[i].level);
        registers[4 * i] = (uint16_t)(corner[i].samples >> 16);
        registers[4 * i + 1] = (uint16_t)corner[i].samples;
        registers[4 * i + 2] = (uint16_t)(value >> 16);
        registers[4 * i + 3] = (uint16_t)value;
    }
    return registers;
}

static bool check_capacity(const device_t *device, size_t corners, failure_t *failure) {
    return (int64_t)corners <= device_identity(device, INDEX_waveform_capacity) ||
           fail(failure,
                "the amplifier holds %" PRId64 " breakpoints, this waveform has %zu; newer firmware holds more",
                device_identity(device, INDEX_waveform_capacity), corners);
}

static bool load_breakpoints(device_t *device, const hyst_parameters_t *image, hyst_mode_t mode,
                             const breakpoint_t *corner, size_t corners, unsigned long passes, failure_t *failure) {
    uint16_t *registers = table_of(image, mode, corner, corners);
    const bool ok = device_write_block(device, ADDRESS_waveform, 0, 4 * corners, registers, failure) &&
                    device_write(device, INDEX_waveform_points, (int64_t)corners, failure) &&
                    device_write(device, INDEX_source, SOURCE_BREAKPOINTS, failure) &&
                    device_write(device, INDEX_source_cycles, (int64_t)passes, failure);
    free(registers);
    return ok;
}

/* passes 0: without end. */
static bool load_waveform(device_t *device, const hyst_parameters_t *image, hyst_mode_t mode, const waveform_t *w,
                          unsigned long passes, failure_t *failure) {
    switch (w->kind) {
    case WAVEFORM_SINE:
        return load_sine(device, image, mode, w, SOURCE_SINE, passes, failure);
    case WAVEFORM_SWEEP:
        return load_sine(device, image, mode, w, SOURCE_SWEEP, passes, failure) && load_sweep(device, w, failure);
    case WAVEFORM_MULTISINE:
        return load_tones(device, w, failure) && load_sine(device, image, mode, w, SOURCE_MULTISINE, passes, failure);
    case WAVEFORM_TRIANGLE:
    case WAVEFORM_STAIRCASE:
        break;
    }
    breakpoint_t corner[WAVEFORM_MAX_BREAKPOINTS] = {0};
    const size_t corners = waveform_breakpoints(w, device_sample_rate_hz(device), corner);
    return load_breakpoints(device, image, mode, corner, corners, passes, failure);
}

/* The amplifier would take a line of no sample for one of one, and play another frequency. */
static bool check_polygon(const device_t *device, const waveform_t *w, failure_t *failure) {
    breakpoint_t corner[WAVEFORM_MAX_BREAKPOINTS] = {0};
    const double lowest_hz = waveform_lowest_hz(w, device_sample_rate_hz(device));
    if (w->frequency_hz < lowest_hz) {
        return fail(failure, "a %s of %g Hz cannot be played at %g samples per second: the lowest frequency is %g Hz",
                    waveform_name(w->kind), w->frequency_hz, device_sample_rate_hz(device), PRINTED * lowest_hz);
    }
    const size_t corners = waveform_breakpoints(w, device_sample_rate_hz(device), corner);
    for (size_t i = 0; i < corners; i++) {
        if (corner[i].samples == 0) {
            return fail(failure,
                        "a %s of %g Hz cannot be played at %g samples per second: some of its lines have no sample",
                        waveform_name(w->kind), w->frequency_hz, device_sample_rate_hz(device));
        }
    }
    return check_capacity(device, corners, failure);
}

/* What a waveform takes of any amplifier. */
static bool check_waveform(const device_t *device, const waveform_t *w, failure_t *failure) {
    int64_t increment;
    switch (w->kind) {
    case WAVEFORM_SINE:
        return increment_of(device, w->frequency_hz, &increment, failure);
    case WAVEFORM_SWEEP:
        return increment_of(device, w->frequency_hz, &increment, failure) &&
               increment_of(device, w->end_frequency_hz, &increment, failure);
    case WAVEFORM_MULTISINE:
        return increment_of(device, w->frequency_hz, &increment, failure) &&
               increment_of(device, w->frequency_hz * w->tone[w->tones - 1].harmonic, &increment, failure);
    case WAVEFORM_TRIANGLE:
    case WAVEFORM_STAIRCASE:
        break;
    }
    return check_polygon(device, w, failure);
}

/* A triangle has all its cycles in the table. */
static unsigned long passes_of(const waveform_t *w) {
    return w->kind == WAVEFORM_TRIANGLE ? 1UL : w->cycles;
}

size_t experiment_rows_most(const device_t *device, unsigned long frames, bool probe) {
    const size_t most = (size_t)device_identity(device, INDEX_capture_capacity);
    return probe ? UINT16_MAX : frames > 0 && frames < most ? frames : most;
}

static bool fit_into_buffer(const device_t *device, const experiment_t *experiment, run_t *run, failure_t *failure) {
    const double samples = waveform_samples(&experiment->waveform, device_sample_rate_hz(device));
    const double capacity = (double)experiment_rows_most(device, experiment->frames, false);
    const double decimation = ceil(samples / capacity);
    if (decimation > UINT16_MAX) {
        return fail(failure, "the waveform lasts %.0f s; the amplifier captures at most %.0f s",
                    samples / device_sample_rate_hz(device), capacity * UINT16_MAX / device_sample_rate_hz(device));
    }
    run->decimation = (int64_t)decimation;
    run->frames = (int64_t)(samples / decimation);
    return run->frames >= 2 || fail(failure, "the recording would have fewer than two samples");
}

bool experiment_check(const device_t *device, const experiment_t *experiment, failure_t *failure) {
    run_t run;
    return check_waveform(device, &experiment->waveform, failure) && fit_into_buffer(device, experiment, &run, failure);
}

bool experiment_check_start(const device_t *device, const experiment_t *experiment, failure_t *failure) {
    return check_waveform(device, &experiment->waveform, failure);
}

bool experiment_check_table(const device_t *device, const experiment_table_t *table, failure_t *failure) {
    return check_capacity(device, table->corners, failure);
}

/* The three signals from the trigger on, whatever was recorded before. An older firmware records nothing else. */
static bool choose_signals(device_t *device, failure_t *failure) {
    int64_t words;
    return !device_read(device, INDEX_capture_words, &words, failure) ||
           (device_write(device, INDEX_capture_before, 0, failure) &&
            device_write(device, INDEX_capture_signals, CAPTURE_DEFAULT_SIGNALS, failure));
}

static bool arm(device_t *device, const run_t *run, failure_t *failure) {
    return choose_signals(device, failure) &&
           device_write(device, INDEX_capture_decimation, run->decimation, failure) &&
           device_write(device, INDEX_capture_length, run->frames, failure) &&
           device_write(device, INDEX_capture_trigger, CAPTURE_AT_SOURCE, failure) &&
           device_command(device, COMMAND_ARM_CAPTURE, failure);
}

/* Reads a capture longer than the ring buffer while it runs. */
static bool play(device_t *device, capture_reader_t *reader, experiment_events_t *events, failure_t *failure) {
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
        sleep_until(monotonic_s() + POLL_S);
        ok = watch_next(&watch, failure);
        const size_t captured = (size_t)watch.now[INDEX_capture_frames];
        while (ok && capture_reader_streams(reader) && reader->done < captured) {
            ok = capture_reader_some(reader, captured, failure);
        }
        progress_update(&progress, (double)captured / (double)reader->frames);
    }
    progress_end(&progress);
#define COUNTER(name, address, note, text) events->name = watch.now[INDEX_##name] - before[INDEX_##name];
#include "registers/registers.def"
    return ok;
}

static hyst_q31_t captured(uint16_t value) {
    return (hyst_q31_t)(int16_t)value * CAPTURE_SCALE;
}

static void to_recording(const device_t *device, const hyst_parameters_t *image, const run_t *run,
                         const uint16_t *registers, recording_t *recording) {
    recording_create(recording, "capture", device_sample_rate_hz(device) / (double)run->decimation,
                     (size_t)run->frames);
    double *reference = run->mode == HYST_MODE_DIRECT ? NULL : recording_add_column(recording, COLUMN_REFERENCE);
    for (size_t i = 0; i < (size_t)run->frames; i++) {
        const uint16_t *frame = registers + CAPTURE_FRAME_REGISTERS * i;
        if (reference != NULL) {
            reference[i] = position_to_micrometres(image, captured(frame[0]));
        }
        recording->column[COLUMN_DRIVE][i] = drive_to_volts(image, captured(frame[1]));
        recording->column[COLUMN_DISPLACEMENT][i] = position_to_micrometres(image, captured(frame[2]));
    }
    char text[DEVICE_TEXT];
    recording_set_key(recording, "source", "hyst amplifier, captured");
    device_text(device, text);
    recording_set_key(recording, RECORDING_DEVICE_KEY, text);
    recording_set_key(recording, "mode", mode_name(run->mode));
    recording_set_key(recording, "waveform", run->text);
    recording_set_key(recording, "conditioned", run->condition ? "yes" : "no");
    if (run->condition && run->mode == HYST_MODE_DIRECT) { /* conditioning.h, and then to the start */
        (void)snprintf(text, sizeof text, "%.6f, %.6f, %.6f", drive_to_volts(image, image->drive_high),
                       drive_to_volts(image, image->drive_low), drive_to_volts(image, image->drive_park));
        recording_set_key(recording, RECORDING_BEFORE_KEY, text);
    }
    if (run->rest_s > 0.0) {
        (void)snprintf(text, sizeof text, "%g", run->rest_s);
        recording_set_key(recording, "rested_s", text);
    }
    device_serial(device, text);
    if (text[0] != '\0') {
        recording_set_key(recording, RECORDING_SERIAL_KEY, text);
    }
    (void)snprintf(text, sizeof text, "0x%08" PRIX32, image->model_id);
    recording_set_key(recording, "model_id", text);
    (void)snprintf(text, sizeof text, "%.6f:%.6f", drive_to_volts(image, HYST_Q31_MIN),
                   drive_to_volts(image, HYST_Q31_MAX));
    recording_set_key(recording, DRIVE_CONVERTER_KEY, text);
    (void)snprintf(text, sizeof text, "%.6f:%.6f", position_to_micrometres(image, HYST_Q31_MIN),
                   position_to_micrometres(image, HYST_Q31_MAX));
    recording_set_key(recording, POSITION_CONVERTER_KEY, text);
}

/* What the stage was supplied with, where that is measured. Older firmware has no such register, and a line that fails
 * fails in the next request. */
static void note_supply(device_t *device, recording_t *recording) {
    int64_t reading;
    failure_t ignored;
    if (device_read(device, INDEX_high_voltage, &reading, &ignored)) {
        stage_supply_note(recording, stage_supply_v(reading));
    }
}

/* From the loaded waveform to the recording, which stays when the amplifier then cannot be disarmed. */
static bool play_and_read(device_t *device, const hyst_parameters_t *image, const run_t *run, recording_t *recording,
                          experiment_events_t *events, failure_t *failure) {
    capture_reader_t reader = capture_reader(device, (size_t)run->frames);
    bool ok = arm(device, run, failure) && play(device, &reader, events, failure) &&
              capture_reader_rest(&reader, failure) && device_check_start(device, failure);
    if (ok) { /* after a restart the rest of the capture reads as 0 */
        to_recording(device, image, run, reader.registers, recording);
        note_supply(device, recording);
        sampling_note(device, run->decimation, recording);
        ok = device_command(device, COMMAND_DISARM, failure) ||
             fail_in(failure, "the recording is complete, but the amplifier was not disarmed");
    }
    capture_reader_free(&reader);
    return ok;
}

bool experiment_run(device_t *device, const hyst_parameters_t *image, const experiment_t *experiment,
                    recording_t *recording, experiment_events_t *events, failure_t *failure) {
    const waveform_t *w = &experiment->waveform;
    run_t run = {.mode = experiment->mode, .condition = experiment->condition, .start = waveform_start(w)};
    char text[120];
    *recording = (recording_t){0};
    waveform_describe(w, text);
    (void)snprintf(run.text, sizeof run.text, "%s, %s", waveform_name(w->kind), text);
    return check_waveform(device, w, failure) && fit_into_buffer(device, experiment, &run, failure) &&
           go_to_start(device, image, &run, failure) &&
           load_waveform(device, image, run.mode, w, passes_of(w), failure) &&
           play_and_read(device, image, &run, recording, events, failure);
}

/* So that the capture is frames of the buffer, and those that the line can carry meanwhile. */
static unsigned long decimation_of(const device_t *device, double samples, double registers_per_sample) {
    const double frames = (double)device_identity(device, INDEX_capture_capacity) +
                          registers_per_sample / CAPTURE_FRAME_REGISTERS * samples;
    return (unsigned long)ceil(samples / fmin(frames, UINT16_MAX - 1.0));
}

bool experiment_run_probe(device_t *device, const hyst_parameters_t *image, const experiment_probe_t *probe,
                          recording_t *recording, experiment_events_t *events, failure_t *failure) {
    double registers_per_sample;
    *recording = (recording_t){0};
    if (!device_registers_per_sample(device, &registers_per_sample, failure)) {
        return false;
    }
    probe_limits_t limits = {
        .range_v = {drive_to_volts(image, image->drive_low), drive_to_volts(image, image->drive_high)},
        .slew_v_per_s = probe->slew_v_per_s,
        .sample_rate_hz = device_sample_rate_hz(device),
        .decimation = 1,
        .lead = image->lookahead_samples};
    probe_plan_t *plan = allocate(1, sizeof *plan);
    probe_plan_make(plan, probe->parts, &limits); /* how long it is */
    limits.decimation = decimation_of(device, plan->samples, registers_per_sample);
    probe_plan_make(plan, probe->parts, &limits);
    run_t run = {.mode = HYST_MODE_DIRECT,
                 .condition = probe->condition,
                 .start = plan->start_v,
                 .rest_s = probe->rest * plan->samples / limits.sample_rate_hz,
                 .decimation = (int64_t)limits.decimation,
                 .frames = ((int64_t)plan->samples - (int64_t)limits.lead - 1) / (int64_t)limits.decimation + 1};
    probe_plan_describe(plan, run.text, sizeof run.text);
    const bool ok = check_capacity(device, plan->corners, failure) && go_to_start(device, image, &run, failure) &&
                    load_breakpoints(device, image, run.mode, plan->corner, plan->corners, 1, failure) &&
                    play_and_read(device, image, &run, recording, events, failure);
    free(plan);
    return ok;
}

/* Whether the amplifier holds what was sent. */
static bool check_table(device_t *device, const hyst_parameters_t *image, const experiment_table_t *table,
                        failure_t *failure) {
    uint16_t *sent = table_of(image, table->mode, table->corner, table->corners);
    uint16_t *held = allocate(4 * table->corners, sizeof *held);
    bool ok = device_read_block(device, ADDRESS_waveform, 0, 4 * table->corners, held, failure);
    for (size_t i = 0; ok && i < 4 * table->corners; i++) {
        ok = held[i] == sent[i] ||
             fail(failure, "the table in the amplifier is not the one that was sent: point %zu", i / 4 + 1);
    }
    free(sent);
    free(held);
    return ok;
}

/* A capture tells whether the start was heard (device_start). */
static bool arm_and_start(device_t *device, const run_t *run, failure_t *failure) {
    return arm(device, run, failure) && device_start(device, failure);
}

bool experiment_start_table(device_t *device, const hyst_parameters_t *image, const experiment_table_t *table,
                            failure_t *failure) {
    const run_t run = {
        .mode = table->mode, .condition = table->condition, .start = table->start, .decimation = 1, .frames = 2};
    return experiment_check_table(device, table, failure) && go_to_start(device, image, &run, failure) &&
           load_breakpoints(device, image, run.mode, table->corner, table->corners, table->passes, failure) &&
           check_table(device, image, table, failure) && arm_and_start(device, &run, failure);
}

bool experiment_start(device_t *device, const hyst_parameters_t *image, const experiment_t *experiment,
                      unsigned long passes, failure_t *failure) {
    const run_t run = {.mode = experiment->mode,
                       .condition = experiment->condition,
                       .start = waveform_start(&experiment->waveform),
                       .decimation = 1,
                       .frames = 2};
    return check_waveform(device, &experiment->waveform, failure) && go_to_start(device, image, &run, failure) &&
           load_waveform(device, image, run.mode, &experiment->waveform, passes, failure) &&
           arm_and_start(device, &run, failure);
}
