/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Twin of the actuator of paper 001: bimorph PZBA-00030, clamped at one end, capacitive sensor at the tip.
 *
 * Reported: +-75 V, a converter that holds its output for 0.2 ms, sensor resolution 20 nm, a resonance around 70 Hz,
 * harmonics at drives of 15, 25 and 35 Hz, the kind of loop at 1 to 95 Hz. Chosen, and tuned until these show: the
 * equations below and all of their numbers (twin_001.c).
 *
 *   1. The driver is a first-order lag.
 *   2. The ceramic's strain is a reversible part and a continuum of plays, cut into many more than a model has. Each
 *      play goes through a curve that saturates, so that the loops at different bias are not congruent and the odd
 *      harmonics have sizes of their own.
 *   3. The cantilever is one mode. Its spring softens and its damping rises with the amplitude, as that of a bimorph
 *      does; Runge-Kutta of fourth order, eight steps a sample.
 *   4. The tip turns in front of the probe: the reading has a part that goes with the square of the position.
 *   5. Sensor noise (normal) and steps of 20 nm.
 */
#ifndef TWIN_001_H
#define TWIN_001_H

#include "random.h"

#define TWIN_001_PLAYS   75
#define TWIN_001_RATE_HZ 5000.0
#define TWIN_001_RANGE_V 75.0

typedef struct {
    double voltage_v;              /**< behind the driver */
    double play_v[TWIN_001_PLAYS]; /**< V */
    double force_um;               /**< what the ceramic would move the tip by if it had no mass */
    double position_um, rate_um_s; /**< of the tip */
    random_t random;
} twin_001_t;

/** At rest at 0 V, demagnetised. The noise follows from the seed. */
void twin_001_open(twin_001_t *twin, uint64_t seed);

/** Holds the drive for one sample. Returns what the sensor reads at its end, in um. */
double twin_001_step(twin_001_t *twin, double drive_v);

#endif
