/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What there is to know of an amplifier, as `hyst info` shows it. */
#ifndef INFO_RUN_H
#define INFO_RUN_H

#include "amplifier/device/device.h"
#include "hyst/parameters.h"
#include <jansson.h>

typedef struct {
    const device_t *device;
    hyst_parameters_t image; /**< in force */
    int64_t commits;
    int64_t now[REGISTER_COUNT]; /**< telemetry, capacitance, current_limit, current_peak and drive_slew */
} info_t;

/** Reads it. Moves and changes nothing. */
bool info_read(device_t *device, info_t *info, failure_t *failure);

/** {"format": "hyst-info-1", "amplifier":, "image":, "now":, "counters":, "current":}. */
json_t *info_to_json(const info_t *info);

/** Of what it is made: for text. */
#define INFO_VERSION_TEXT 24
const char *info_board(const info_t *info);
void info_version(const info_t *info, char text[INFO_VERSION_TEXT]);
/** A loop cost (INDEX_cost_last, INDEX_cost_max) in microseconds. */
double info_cost_us(const info_t *info, int which);
/** The current of a step of the drive from sample to sample. 0 unless the register capacitance says what is connected.
 */
double info_milliamperes(const info_t *info, int64_t step);
double info_volts(const info_t *info, int64_t drive);
double info_micrometres(const info_t *info, int64_t position);
/** A drive in mode direct, else a position; *unit: "V" or "um". */
double info_reference(const info_t *info, const char **unit);

#endif
