/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What the files of paper 001 share. */
#ifndef SEED_001_H
#define SEED_001_H

#include "chain/model.h"
#include "record_001.h"
#include "twins/twin_001.h"

/** What is tracked: the paper's 0.05 mm. */
#define SEED_001_REFERENCE_UM 50.0

/** Tracking of a sine in the steady state, one second or two periods of it. */
typedef struct {
    double rms_um;      /**< of reference - measured */
    double third_power; /**< power of the third harmonic over that of the fundamental */
    double drive_v;     /**< largest magnitude */
} seed_001_tracked_t;

/** Half the peak-to-peak displacement. */
double seed_001_amplitude(const recording_t *recording);

/** The paper's control law (37) in double precision, with the paper's phase of the harmonics. */
seed_001_tracked_t seed_001_track_directly(const model_t *model, double frequency_hz);

typedef struct {
    double lead_rad;  /**< of the drive before the reference; the harmonics are in phase with the drive */
    size_t lookahead; /**< samples by which the reference is known ahead */
    bool exact;       /**< exact inverse, or direct inverse multiplication */
} seed_001_control_t;

/** In the amplifier's arithmetic, from the compiled image. false: the image is refused. */
bool seed_001_track_in_amplifier(const model_t *model, double frequency_hz, const seed_001_control_t *control,
                                 seed_001_tracked_t *tracked, failure_t *failure);

/** One physical chain for all frequencies. */
typedef struct {
    double *simulated_um;        /**< RMS error at +-75 V, one a frequency, of a chain fitted at +-75 V */
    seed_001_tracked_t *tracked; /**< with the exact inverse of a chain fitted at the reference's amplitude */
    double mode_hz, damping_ratio, cutoff_hz; /**< of the latter */
} seed_001_chain_t;

/** Fills the caller's arrays of `count` elements. */
bool seed_001_chain(bool reduced, const double *frequency_hz, size_t count, seed_001_chain_t *result,
                    failure_t *failure);

#endif
