/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The amplifier in front of a twin: lib/hyst runs a compiled image sample by sample, and its drive goes to the
 * actuator.
 */
#ifndef AMPLIFIER_H
#define AMPLIFIER_H

#include "hyst/parameters.h"
#include "recording/recording.h"

/** A twin, as the amplifier meets it. */
typedef struct {
    void *state;
    /** Returns the displacement measured now, in um, and then holds the drive for one sample. */
    double (*sample)(void *state, double drive_v);
} actuator_t;

typedef struct {
    hyst_mode_t mode; /**< compensate, or linear: without the model */
    double offset_um, amplitude_um, frequency_hz;
    double settle_s; /**< not recorded: the way from the parked drive, and periods until the loop has closed */
    size_t samples;  /**< recorded */
} sine_track_t;

/**
 * Tracks offset + amplitude sin(2 pi f t) from parked on, looking ahead as the image says. *recording receives drive,
 * displacement and reference, of the same instants. false, with a line, if the image is refused or the drive met its
 * limits while recording.
 */
bool amplifier_track(const hyst_parameters_t *image, const actuator_t *actuator, const sine_track_t *track,
                     recording_t *recording, failure_t *failure);

/** Displacement less reference, of its mean freed, over a range in um. */
typedef struct {
    double max_percent, rms_percent;
} tracking_error_t;

tracking_error_t tracking_error(const recording_t *recording, double range_um);

#endif
