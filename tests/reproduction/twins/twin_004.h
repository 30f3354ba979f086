/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The positioner of paper 004: a cantilever of 36 piezoelectric layers, 15 mm x 2 mm x 2 mm, at a 5 kHz controller.
 *
 * Reported: +-10 V, some 40 um, dt = 0.2 ms, a sensor of 10 nm resolution, 100 nm precision and more than 1 kHz, and a
 * loop that is up to 17.5 um wide at 200 Hz. The widths at 10, 50 and 100 Hz are those of the model that the paper
 * identified there. Chosen (twin_004.c): viscous play operators, a dense density of them, one mode of the cantilever at
 * the frequency that its dimensions give, sensor bandwidth and noise.
 */
#ifndef TWIN_004_H
#define TWIN_004_H

#include "recording/recording.h"
#include <stdint.h>

#define TWIN_004_RATE_HZ 5000.0
#define TWIN_004_DRIVE_V 10.0 /**< range of the drive, to both sides */

typedef struct twin_004 twin_004_t;

/** At rest at 0 V, demagnetised. Free with free(). */
twin_004_t *twin_004_open(uint64_t seed);

/** Returns the displacement as measured now, in um, and then holds the drive for one sample. */
double twin_004_sample(twin_004_t *twin, double drive_v);

/** A new recording of amplitude sin(2 pi f t), `periods` of it, from rest. */
void twin_004_record(recording_t *recording, double frequency_hz, double amplitude_v, unsigned periods, uint64_t seed);

#endif
