/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/model_guard.h"
#include "amplifier/device/mode_names.h"
#include "amplifier/device/restart.h"
#include "amplifier/device/sample_number.h"
#include "amplifier/sampling_note.h"
#include "amplifier/stage_supply.h"
#include "base/monotonic_clock.h"
#include "chain/fit_ranges.h"
#include "compile/compile.h"
#include "loop/capture.h"
#include "loop/telemetry.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* What is usual is the worst of so many blocks: a second, many periods of what scans and tracks. */
#define USUAL_BLOCKS 10
/* A limit below two codes of the converter would be one on its rounding. */
#define LEAST_CODES 2.0
/* Nothing watched for this long: the amplifier does not compensate. */
#define UNWATCHED_S 30.0

#define FRAME_VALUES CAPTURE_FRAME_REGISTERS /* reference, drive, position */

static double micrometres(const guard_t *guard, double full_scale) {
    return full_scale * 0x1p-31 * 1e-6 * guard->image->position_half_range_pm;
}

static guard_error_t error_of(const guard_t *guard) {
    const int64_t *now = guard->now;
    return (guard_error_t){.rms_um = micrometres(guard, (double)now[INDEX_model_error_rms]),
                           .largest_um = micrometres(guard, (double)now[INDEX_model_error_largest]),
                           .slow_um = micrometres(guard, (double)now[INDEX_model_error_slow]),
                           .fast_um = micrometres(guard, (double)now[INDEX_model_error_fast])};
}

/* What no longer compensates has no error of its model, and would be watched without end. */
static bool still_compensates(guard_t *guard, failure_t *failure) {
    const int64_t mode = guard->now[INDEX_active_mode];
    if (!guard->compensates || mode == HYST_MODE_COMPENSATE ||
        guard->now[INDEX_amplifier_state] == AMPLIFIER_CONDITIONING) {
        return true;
    }
    (void)fail(failure, "the amplifier no longer compensates: it is %s, in mode %s",
               power_name(guard->now[INDEX_amplifier_state]), mode_name(mode));
    device_blame_restart(guard->device, failure);
    return false;
}

static bool look(guard_t *guard, failure_t *failure) {
    const int64_t before = guard->now[INDEX_sequence];
    if (!device_read_span(guard->device, INDEX_sequence, INDEX_high_voltage, guard->now, failure)) {
        return false;
    }
    const int64_t passed = samples_between(before, guard->now[INDEX_sequence]);
    if (passed < 0 && guard->looked) {
        return device_check_start(guard->device, failure);
    }
    guard->samples += guard->looked ? (double)passed : 0.0;
    guard->looked = true;
    if (guard->now[INDEX_amplifier_state] == AMPLIFIER_FAULT) {
        char faults[FAULTS_TEXT];
        return fail(failure, "the amplifier tripped (faults: %s) and is parked",
                    faults_text(guard->now[INDEX_faults_sticky], faults));
    }
    return still_compensates(guard, failure);
}

double guard_supply_v(const guard_t *guard) {
    return stage_supply_v(guard->now[INDEX_high_voltage]);
}

double guard_clock_s(const guard_t *guard) {
    return guard->samples / device_sample_rate_hz(guard->device);
}

/* The worst of some whole blocks. */
static bool measure_usual(guard_t *guard, guard_pause_t *pause, void *context, failure_t *failure) {
    guard->usual = (guard_error_t){0};
    if (!look(guard, failure)) {
        return false;
    }
    uint32_t last = (uint32_t)guard->now[INDEX_model_error_blocks];
    double since_s = monotonic_s();
    for (int blocks = -1; blocks < USUAL_BLOCKS;) { /* the first one may have begun before */
        if (!pause(context, failure) || !look(guard, failure)) {
            return false;
        }
        const uint32_t now = (uint32_t)guard->now[INDEX_model_error_blocks];
        if (now == last) {
            if (monotonic_s() - since_s > UNWATCHED_S) {
                return fail(failure,
                            "for %g s the amplifier has watched nothing: it compensates nothing, or a limit "
                            "is in force",
                            UNWATCHED_S);
            }
            continue;
        }
        const guard_error_t error = error_of(guard);
        if (blocks >= 0 && error.rms_um > guard->usual.rms_um) {
            guard->usual = error;
        }
        blocks += (int)(now - last);
        last = now;
        since_s = monotonic_s();
    }
    return true;
}

static int64_t in_full_scale(const guard_t *guard, double um) {
    return (int64_t)fmin(HYST_Q31_MAX, ceil(um / micrometres(guard, 1.0)));
}

/* A frame every so many samples, so that the whole record fits. */
static bool arm_recorder(guard_t *guard, failure_t *failure) {
    const double rate_hz = device_sample_rate_hz(guard->device);
    const double samples = (guard->settings.before_s + guard->settings.after_s) * rate_hz;
    const double most = (double)guard->ring;
    guard->decimation = (int64_t)fmax(1.0, ceil(samples / most));
    const int64_t length = (int64_t)(samples / (double)guard->decimation);
    const int64_t before = (int64_t)(guard->settings.before_s * rate_hz / (double)guard->decimation);
    return device_write(guard->device, INDEX_capture_signals, CAPTURE_DEFAULT_SIGNALS, failure) &&
           device_write(guard->device, INDEX_capture_decimation, guard->decimation, failure) &&
           device_write(guard->device, INDEX_capture_length, length, failure) &&
           device_write(guard->device, INDEX_capture_before, before, failure) &&
           device_write(guard->device, INDEX_capture_trigger, CAPTURE_AT_WARNING, failure) &&
           device_command(guard->device, COMMAND_ARM_CAPTURE, failure);
}

static bool set_limit(guard_t *guard, failure_t *failure) {
    return device_write(guard->device, INDEX_model_error_time, (int64_t)lround(1000.0 * guard->settings.time_s),
                        failure) &&
           device_write(guard->device, INDEX_model_error_limit, in_full_scale(guard, guard->limit_um), failure);
}

/* again: what is there now has been warned of. */
static bool begin(guard_t *guard, bool again, guard_pause_t *pause, void *context, failure_t *failure) {
    const guard_settings_t *s = &guard->settings;
    const double codes = ldexp(1.0, (int)device_identity(guard->device, INDEX_position_bits));
    const double code_um = 2e-6 * guard->image->position_half_range_pm / codes;
    if (!measure_usual(guard, pause, context, failure)) {
        return false;
    }
    guard->usual_supply_v = guard_supply_v(guard);
    const double measured_um = fmax(s->times * guard->usual.rms_um, LEAST_CODES * code_um);
    const bool above = s->limit_um > guard->usual.rms_um; /* not if it is NAN */
    if (!again && !above && !isnan(s->limit_um)) {
        return fail(failure, "--limit %g: the error is already %.4g um (root mean square), and a limit is above it",
                    s->limit_um, guard->usual.rms_um);
    }
    guard->limit_um = above ? s->limit_um : measured_um;
    guard->compensates = true; /* there were blocks of its error */
    return arm_recorder(guard, failure) && set_limit(guard, failure);
}

bool guard_settings_check(const guard_settings_t *s, failure_t *failure) {
    if (s->limit_um <= 0.0 || isinf(s->limit_um)) { /* NAN: measured */
        return fail(failure, "--limit %g: must be above 0", s->limit_um);
    }
    if (!(s->times > 1.0)) {
        return fail(failure, "--times %g: must be above 1", s->times);
    }
    return (s->time_s > 0.0 && s->time_s <= 60.0 && s->before_s > s->time_s && s->after_s > 0.0 &&
            s->before_s + s->after_s <= 600.0) ||
           fail(failure,
                "--time %g, --before %g, --after %g: the time is up to 60 s, the record up to 600 s, and begins before "
                "the time that is judged",
                s->time_s, s->before_s, s->after_s);
}

bool guard_begin(guard_t *guard, device_t *device, const hyst_parameters_t *image, const guard_settings_t *settings,
                 guard_pause_t *pause, void *context, failure_t *failure) {
    *guard = (guard_t){.device = device, .image = image, .settings = *settings};
    device_note_start(device);
    int64_t words = 0;
    if (!device_read(device, INDEX_capture_words, &words, failure)) {
        return fail_in(failure, "does the firmware watch its model? An older one does not");
    }
    if (!look(guard, failure)) {
        return false;
    }
    guard->ring = (size_t)words / FRAME_VALUES;
    guard->begun = (uint32_t)guard->now[INDEX_sequence];
    return device_unlock(device, CONTROL_PARAMETERS, failure) &&
           device_write(device, INDEX_model_error_limit, 0, failure) && begin(guard, false, pause, context, failure);
}

bool guard_again(guard_t *guard, guard_pause_t *pause, void *context, failure_t *failure) {
    return device_write(guard->device, INDEX_model_error_limit, 0, failure) &&
           begin(guard, true, pause, context, failure);
}

guard_answer_t guard_look(guard_t *guard, failure_t *failure) {
    if (!look(guard, failure)) {
        return GUARD_FAILED;
    }
    return guard->now[INDEX_capture_state] == CAPTURE_DONE ? GUARD_WARNED : GUARD_QUIET;
}

static hyst_q31_t captured(uint16_t value) {
    return (hyst_q31_t)((uint32_t)value << 16);
}

/* From the ring's place of frame 0 on, and from its beginning. */
static bool read_ring(guard_t *guard, size_t frames, uint16_t *registers, failure_t *failure) {
    const size_t ring = guard->ring;
    const size_t first = (size_t)guard->now[INDEX_capture_first];
    const size_t tail = frames < ring - first ? frames : ring - first;
    return device_read_block(guard->device, ADDRESS_capture, FRAME_VALUES * first, FRAME_VALUES * tail, registers,
                             failure) &&
           (tail == frames || device_read_block(guard->device, ADDRESS_capture, 0, FRAME_VALUES * (frames - tail),
                                                registers + FRAME_VALUES * tail, failure));
}

static void set_range_key(recording_t *recording, const char *key, double low, double high) {
    char text[80];
    (void)snprintf(text, sizeof text, "%.6f:%.6f", low, high);
    recording_set_key(recording, key, text);
}

bool guard_fetch(guard_t *guard, recording_t *recording, size_t *warned, failure_t *failure) {
    const hyst_parameters_t *image = guard->image;
    const size_t frames = (size_t)guard->now[INDEX_capture_frames];
    if (frames < 2) {
        return fail(failure, "the record has %zu frames", frames);
    }
    uint16_t *registers = allocate(FRAME_VALUES * frames, sizeof *registers);
    if (!read_ring(guard, frames, registers, failure)) {
        free(registers);
        return false;
    }
    const double rate_hz = device_sample_rate_hz(guard->device) / (double)guard->decimation;
    recording_create(recording, "capture", rate_hz, frames);
    double *reference = recording_add_column(recording, COLUMN_REFERENCE);
    for (size_t i = 0; i < frames; i++) {
        const uint16_t *frame = registers + FRAME_VALUES * i;
        reference[i] = position_to_micrometres(image, captured(frame[0]));
        recording->column[COLUMN_DRIVE][i] = drive_to_volts(image, captured(frame[1]));
        recording->column[COLUMN_DISPLACEMENT][i] = position_to_micrometres(image, captured(frame[2]));
    }
    free(registers);
    recording_set_key(recording, "source", "hyst amplifier, around a warning");
    set_range_key(recording, DRIVE_CONVERTER_KEY, drive_to_volts(image, HYST_Q31_MIN),
                  drive_to_volts(image, HYST_Q31_MAX));
    set_range_key(recording, POSITION_CONVERTER_KEY, position_to_micrometres(image, HYST_Q31_MIN),
                  position_to_micrometres(image, HYST_Q31_MAX));
    stage_supply_note(recording, guard_supply_v(guard));
    sampling_note(guard->device, guard->decimation, recording);
    const size_t after = (size_t)(guard->settings.after_s * rate_hz);
    *warned = frames > after ? frames - after : 0;
    return true;
}

bool guard_end(guard_t *guard, failure_t *failure) {
    return device_write(guard->device, INDEX_model_error_limit, 0, failure) &&
           device_write(guard->device, INDEX_capture_trigger, CAPTURE_AT_ONCE, failure) &&
           device_write(guard->device, INDEX_capture_before, 0, failure) &&
           device_command(guard->device, COMMAND_END_CAPTURE, failure);
}
