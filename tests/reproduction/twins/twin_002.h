/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Twin of the actuator of paper 002: P-753.31C flexure stage behind an E-505 amplifier, capacitive sensor.
 *
 * Reported: nominal lines, nonlinearity and residual displacement at 0.1, 1, 10 and 100 Hz for 0 to 70 V (Table 3.1),
 * loops that are asymmetric, resolution 0.1 nm. Chosen, and tuned until the loops show the reported numbers: everything
 * below. Table 3.1 by itself would like a curvature (quadratic_um_per_v2) of -0.00099, but hardly better than less of
 * it, and with that no symmetric model could come down to the 1.30 % that Table 5.2 reports for one at 10 Hz: so the
 * curvature is what both tables together allow.
 *
 *   1. The amplifier is a first-order lag that puts out 0 to 100 V.
 *   2. The ceramic: a curved, reversible part, which makes the loops asymmetric, and a continuum of plays that is never
 *      cut into operators. A branch that leaves a turning point v_0 is
 *
 *          h = h_0 +- 2 G(|v - v_0| / 2),      G(x) = integral from 0 to x of (x - r) rho(r) dr,
 *
 *      with a density rho = rho_0 / (1 + (r / scale)^2), which has a closed G; the unforgotten turning points are kept
 * on a stack, and a branch that passes the one before the last forgets both (Madelung's rules).
 *   3. Relaxation: parts of the position follow with their own time constants. They make the stroke fall and the loop
 *      widen as the frequency rises, and leave the residual displacement.
 *   4. Sensor noise of 0.1 nm rms (normal), read in steps of 0.1 nm.
 *
 * At rest, 0 V, the actuator comes from 100 V and has been left alone; that is where the position is 0.
 */
#ifndef TWIN_002_H
#define TWIN_002_H

#include "random.h"
#include <stddef.h>

#define TWIN_002_RELAXATIONS 3
/** Most unforgotten turning points; a drive with more of them that shrink without end ends the program. */
#define TWIN_002_TURNING_POINTS 256

typedef struct {
    double cutoff_hz;                   /**< of the amplifier */
    double linear_um_per_v;             /**< of the voltage itself */
    double quadratic_um_per_v2;         /**< of its square */
    double density_um_per_v2;           /**< rho_0 */
    double scale_v;                     /**< of the density */
    double part[TWIN_002_RELAXATIONS];  /**< of the position that relaxes */
    double tau_s[TWIN_002_RELAXATIONS]; /**< with this time constant */
    double noise_um, step_um;
} twin_002_numbers_t;

/** The actuator of the paper. */
extern const twin_002_numbers_t twin_002_actuator;

typedef struct {
    twin_002_numbers_t numbers;
    double sample_s;
    random_t random;
    double drive_v, voltage_v; /* before and behind the amplifier */
    size_t turns;              /* turning points on the stack; the first is 0 V, coming down from 100 V */
    double turn_v[TWIN_002_TURNING_POINTS], turn_h[TWIN_002_TURNING_POINTS];
    double followed_v, h; /* where the ceramic is */
    double instant_um;    /* position before relaxation */
    double relaxed_um[TWIN_002_RELAXATIONS];
} twin_002_t;

/** At rest. */
void twin_002_open(twin_002_t *twin, const twin_002_numbers_t *numbers, double sample_rate_hz, uint64_t seed);

/** Goes on to the drive at the next sample, in a straight line. Returns the position without noise, um. */
double twin_002_step(twin_002_t *twin, double drive_v);

/** What the sensor reads, um. */
double twin_002_measure(twin_002_t *twin, double position_um);

/** Goes to the last sample of a period that has been repeated without end: the next one is its first. */
void twin_002_repeat(twin_002_t *twin, const double *drive_v, size_t samples);

#endif
