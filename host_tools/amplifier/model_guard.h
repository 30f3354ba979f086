/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The host's side of the amplifier's watch over its model (firmware/app/protection/model_watch.h): sets the limit, arms
 * the recorder, waits for the warning and fetches what was recorded before and after it.
 *
 * Nothing here moves the actuator. Every poll is a request, so the amplifier's communication timeout does not pass as
 * long as the caller polls.
 */
#ifndef MODEL_GUARD_H
#define MODEL_GUARD_H

#include "amplifier/device/device.h"
#include "hyst/parameters.h"
#include "recording/recording.h"
#include <math.h>

typedef struct {
    double limit_um; /**< on the root mean square; NAN: `times` what is there when the guard begins */
    double times;
    double time_s;            /**< how long above it */
    double before_s, after_s; /**< what is recorded before and after the warning */
} guard_settings_t;

#define GUARD_SETTINGS_DEFAULT                                                                                         \
    { .limit_um = (double)NAN, .times = 2.0, .time_s = 0.5, .before_s = 1.2, .after_s = 1.2 }

/** Whether they can be right. The message calls them by their names on the command line. */
bool guard_settings_check(const guard_settings_t *settings, failure_t *failure);

/** The error of the model as the amplifier has it. */
typedef struct {
    double rms_um, largest_um, slow_um, fast_um;
} guard_error_t;

typedef struct {
    device_t *device;
    const hyst_parameters_t *image; /**< in force, for the units */
    guard_settings_t settings;
    double limit_um;             /**< in force */
    guard_error_t usual;         /**< what was there when it was set */
    int64_t decimation;          /**< of the recorder */
    int64_t now[REGISTER_COUNT]; /**< the newest snapshot */
    uint32_t begun;              /**< the sample at which it began */
    bool looked;                 /**< there is a snapshot */
    double samples;              /**< of the loop since the guard began; their number wraps */
    bool compensates;            /**< and did since the limit was set */
    double usual_supply_v;       /**< of the stage, when the limit was set; NAN: not measured */
    size_t ring;                 /**< frames that the recorder holds */
} guard_t;

typedef enum { GUARD_QUIET, GUARD_WARNED /**< and the record is whole */, GUARD_FAILED } guard_answer_t;

/** What the guard does between two polls: false, with the reason in *failure, ends it. */
typedef bool guard_pause_t(void *context, failure_t *failure);

/** Measures what is usual, sets the limit, arms the recorder. Fails on firmware that does not watch, and where a limit
 * was given that is not above what is usual. */
bool guard_begin(guard_t *guard, device_t *device, const hyst_parameters_t *image, const guard_settings_t *settings,
                 guard_pause_t *pause, void *context, failure_t *failure);

/** The same again, after a warning: what is there now counts as usual, and is no news. A limit that was given
 * holds as long as it is above that, and else is as one that was not given. */
bool guard_again(guard_t *guard, guard_pause_t *pause, void *context, failure_t *failure);

/** One look. */
guard_answer_t guard_look(guard_t *guard, failure_t *failure);

/** Reference, drive, displacement, and the warning's place in it: *warned is the frame. The supply of the stage in the
 * newest look, which saw the record's end, goes into its header. To be freed. */
bool guard_fetch(guard_t *guard, recording_t *recording, size_t *warned, failure_t *failure);

/** Takes the limit away, and the settings of the recorder back, which waits for no warning any more. */
bool guard_end(guard_t *guard, failure_t *failure);

/** Supply of the stage in the newest look, in V; NAN: not measured. */
double guard_supply_v(const guard_t *guard);

/** Seconds of the loop since the guard began. */
double guard_clock_s(const guard_t *guard);

#endif
