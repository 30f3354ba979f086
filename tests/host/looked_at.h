/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Recordings for tests of the look: three drives, a hysteresis that shares nothing with the look, and sensors. */
#ifndef LOOKED_AT_H
#define LOOKED_AT_H

#include "look/fault.h"
#include "random.h"

enum { SCENE_DRIVES = 3, SCENE_SAMPLES = 12000, SCENE_FINER = 16 };
extern const double scene_rate_hz;

/** What the actuator did, sixteen times as finely as it is sampled: all times are in samples. */
typedef struct {
    double *drive, *position; /* (SCENE_SAMPLES + 64) * SCENE_FINER values; sample 0 stands at 32 * SCENE_FINER */
    double noise_um;          /**< white */
    double slow_um;           /**< noise with a power of 1 / f, about this large */
} scene_t;

/** which: 0 a path of two harmonics over and over, 1 triangles that shrink and grow, 2 many frequencies at random. All
 * begin with half a second of rest and have one at the end. Dahl's hysteresis: z' = (1 - z sign(u') / 8 V) u', position
 * 0.1 um/V (u - 0.6 z). */
void scene_open(scene_t *scene, size_t which, random_t *random);
void scene_close(scene_t *scene);
/** The same with a converter that has a new value every so many samples, and holds it. */
void scene_hold(scene_t *scene, size_t samples);

/** Position at a time in samples, fractions included; without noise. */
double scene_position(const scene_t *scene, double at);

/** The recording: position at late_samples before each sample's time (NULL: at it), noise, and five digits. */
void scene_record(const scene_t *scene, const double *late_samples, random_t *random, recording_t *recording);
/** Five digits for a column. */
void scene_round(double *column, size_t samples);

#endif
