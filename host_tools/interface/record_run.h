/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A whole recording on the amplifier, as `hyst record` makes it. */
#ifndef RECORD_RUN_H
#define RECORD_RUN_H

#include "amplifier/device/device.h"
#include "amplifier/experiment.h"
#include <math.h>

typedef struct {
    waveform_options_t waveform;                   /**< name NULL: a probe */
    const char *probe;                             /**< a block's name, or "all"; NULL: a waveform */
    double slew_v_per_s;                           /**< steepest line of a probe; NAN: the drive range in 20 ms */
    double drive_range_v[2], position_range_um[2]; /**< of the converters; both 0: those of the image in force */
    bool no_condition;
    unsigned long frames; /**< rows of a waveform's recording at most; 0: as many as the amplifier holds */
} record_options_t;

#define RECORD_OPTIONS_DEFAULT                                                                                         \
    { .waveform = WAVEFORM_OPTIONS_DEFAULT, .probe = NULL, .slew_v_per_s = (double)NAN }

/** Called with the result while the run is still guarded: when it returns false, the amplifier is parked. Also with one
 * after which the amplifier could not be disarmed, which is the failure of the run then. */
typedef bool record_take_t(void *context, const recording_t *recording, const experiment_events_t *events,
                           failure_t *failure);

typedef struct {
    const volatile sig_atomic_t *stop; /**< as of driving_run; NULL: signals */
    record_take_t *take;               /**< NULL: none */
    void *context;
} record_listener_t;

/** Key of a recording whose options name other ranges than the image in force, which is not changed: both of them. */
#define RECORDING_CONTRADICTION_KEY "contradiction"

/** What contradicts itself before there is an amplifier. */
bool record_check(const record_options_t *options, failure_t *failure);

/** Runs it. *usage: it is the options that are at fault. On success the caller frees *recording. */
bool record_run(device_t *device, const record_options_t *options, const record_listener_t *listener,
                recording_t *recording, bool *usage, failure_t *failure);

#endif
