/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "serve/live.h"
#include "amplifier/amplifier_image.h"
#include "amplifier/device/mode_names.h"
#include "amplifier/device/sample_number.h"
#include "base/json_output.h"
#include "compile/compile.h"
#include "loop/telemetry.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>

/* By bit; registers.def explains them. */
static const char *const limit_texts[] = {"drive range",
                                          "reference unreachable",
                                          "filter saturated",
                                          "largest step of the board",
                                          "memory of the model lost",
                                          "reference held back"};
/* A warning stops nothing, so what it means has to be said. */
static const char *const warning_texts[] = {
    "the model is no longer true", "the sensor is lost: its reading stands at an end of the converter",
    "the reading stands still while the drive moves", "the amplifier is hot, or its temperature sensor is lost"};

static const char *limit_text(unsigned bit) {
    return bit < sizeof limit_texts / sizeof limit_texts[0] ? limit_texts[bit] : NULL;
}

static const char *warning_text(unsigned bit) {
    return bit < sizeof warning_texts / sizeof warning_texts[0] ? warning_texts[bit] : NULL;
}

/* One that newer firmware has is shown by its value. */
static json_t *names(int64_t bits, const char *(*name)(unsigned bit)) {
    json_t *list = json_array();
    for (unsigned bit = 0; bit < FAULT_BITS; bit++) {
        if ((bits >> bit & 1) != 0) {
            const char *const text = name(bit);
            json_array_append_new(list, text != NULL ? json_string(text) : json_sprintf("unknown (%u)", 1U << bit));
        }
    }
    return list;
}

/* Root mean square of what the model misses, of the last tenth of a second; null before there is one. */
static json_t *model_error(const int64_t now[REGISTER_COUNT], const hyst_parameters_t *image) {
    const double rms = 0x1p-31 * (double)now[INDEX_model_error_rms];
    return now[INDEX_model_error_blocks] == 0 ? json_null()
                                              : json_real(round(1e-2 * image->position_half_range_pm * rms) / 1e4);
}

/* To the tenth of a nanometre and of a millivolt: shorter to send. */
static json_t *rounded(double value) {
    return json_real(round(value * 1e4) / 1e4);
}

static json_t *counters(const int64_t now[REGISTER_COUNT]) {
    json_t *object = json_object();
#define COUNTER(name, address, note, text) json_object_set_new(object, #name, json_integer(now[INDEX_##name]));
#include "registers/registers.def"
    return object;
}

static double advance(live_clock_t *clock, uint32_t sequence) {
    const int64_t passed = clock->begun ? samples_between(clock->last, sequence) : 0;
    clock->begun = true;
    clock->last = sequence;
    clock->samples += passed > 0 ? (double)passed : 0.0; /* else it has started anew */
    return clock->samples;
}

bool live_follows(const int64_t now[REGISTER_COUNT]) {
    return now[INDEX_active_mode] == HYST_MODE_LINEAR || now[INDEX_active_mode] == HYST_MODE_COMPENSATE;
}

/* Signal s of each frame. */
static json_t *values(const stream_block_t *block, size_t s, double (*unit)(const hyst_parameters_t *, hyst_q31_t),
                      const hyst_parameters_t *image) {
    json_t *list = json_array();
    for (size_t i = 0; i < block->frames; i++) {
        const hyst_q31_t value = (hyst_q31_t)(int16_t)block->value[block->width * i + s] * 65536;
        json_array_append_new(list, rounded(unit(image, value)));
    }
    return list;
}

json_t *live_stream(const live_clock_t *clock, const stream_block_t *block, bool follows,
                    const hyst_parameters_t *image, double sample_rate_hz) {
    const double sample = clock->samples + (double)samples_between(clock->last, block->sample);
    return json_pack("{s:s, s:f, s:f, s:I, s:I, s:b, s:o, s:o, s:o}", "event", "stream", "t", sample / sample_rate_hz,
                     "step", block->decimation / sample_rate_hz, "first", (json_int_t)block->first, "lost",
                     (json_int_t)block->lost, "restarted", block->restarted, "drive",
                     values(block, 1, drive_to_volts, image), "position",
                     values(block, 2, position_to_micrometres, image), "reference",
                     follows ? values(block, 0, position_to_micrometres, image) : json_null());
}

json_t *live_snapshot(live_clock_t *clock, const int64_t now[REGISTER_COUNT], const hyst_parameters_t *image,
                      double sample_rate_hz) {
    const int64_t mode = now[INDEX_active_mode];
    const bool follows = live_follows(now);
    const double position = position_to_micrometres(image, (hyst_q31_t)now[INDEX_position]);
    const double reference = position_to_micrometres(image, (hyst_q31_t)now[INDEX_reference]);
    return json_pack("{s:s, s:o, s:o, s:o, s:o, s:o, s:s, s:s, s:s, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "event",
                     "live", "t", rounded(advance(clock, (uint32_t)now[INDEX_sequence]) / sample_rate_hz), "reference",
                     follows ? rounded(reference) : json_null(), "drive",
                     rounded(drive_to_volts(image, (hyst_q31_t)now[INDEX_drive])), "position", rounded(position),
                     "error", follows ? rounded(position - reference) : json_null(), "mode", mode_name(mode), "state",
                     state_name(now[INDEX_state]), "power", power_name(now[INDEX_amplifier_state]), "limits",
                     names(now[INDEX_limits_live], limit_text), "faults", names(now[INDEX_faults_live], fault_name),
                     "faults_before", names(now[INDEX_faults_sticky], fault_name), "warnings",
                     names(now[INDEX_warnings_live], warning_text), "warnings_before",
                     names(now[INDEX_warnings_sticky], warning_text), "model_error", model_error(now, image),
                     "counters", counters(now));
}

json_t *live_line(const char *port, const device_t *device, const hyst_parameters_t *image, const char *why) {
    json_t *line = json_pack("{s:s, s:b, s:o, s:o}", "event", "line", "connected", device != NULL, "why",
                             json_text(why), "port", json_text(port));
    if (device == NULL) {
        return line;
    }
    char model[16];
    (void)snprintf(model, sizeof model, "0x%08" PRIX32, image->model_id);
    const char *const board = board_name(device_identity(device, INDEX_board));
    json_object_update_new(line,
                           json_pack("{s:s, s:f, s:b, s:s, s:[ff], s:[ff]}", "board", board != NULL ? board : "unknown",
                                     "sample_rate_hz", device_sample_rate_hz(device), "has_parameters",
                                     !amplifier_image_is_neutral(image), "model_id", model, "drive_v",
                                     drive_to_volts(image, image->drive_low), drive_to_volts(image, image->drive_high),
                                     "position_um", position_to_micrometres(image, HYST_Q31_MIN),
                                     position_to_micrometres(image, HYST_Q31_MAX)));
    return line;
}
