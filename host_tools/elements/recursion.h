/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The dynamics that follow the hysteresis in paper 001, as one recursion of the position (docs/MODELS.md,
 * section 9):
 *
 *     y[k] = x[k] + c1 y[k-1] + c2 y[k-2] + c3 y[k-3] + g y[k-1] u[k-1]
 *          + (A11 u + A31 u^3 + A51 u^5)[k-1] sin(angle[k-1]) + (A12 u + A32 u^3 + A52 u^5)[k-1] cos(angle[k-1])
 *
 * x is the output of the hysteresis, u the drive as a fraction of its half range, angle[k] = phase + 2 pi f k dt. The
 * coefficients hold only at the sample rate of their identification.
 */
#ifndef RECURSION_H
#define RECURSION_H

#include "chain/block.h"

#define RECURSION_FEEDBACK  3
#define RECURSION_HARMONICS 6

typedef struct {
    double center_v, half_range_v;
    double feedback[RECURSION_FEEDBACK];  /**< c1, c2, c3 */
    double bilinear;                      /**< g */
    double harmonic[RECURSION_HARMONICS]; /**< A11, A31, A51, A12, A32, A52 */
    bool harmonics;                       /**< whether any of them is not 0 */
    double angle, angle_step;             /**< of the last sample; per sample */
    double input;                         /**< u of the last sample */
    double output[RECURSION_FEEDBACK];    /**< y of the last samples, newest first */
} recursion_t;

/* Parameters that blocks with this recursion share, at the end of a block's table. */
enum {
    RECURSION_CENTER,
    RECURSION_HALF_RANGE,
    RECURSION_FEEDBACK_TERMS,
    RECURSION_BILINEAR,
    RECURSION_HARMONIC_TERMS,
    RECURSION_FREQUENCY,
    RECURSION_PHASE,
    RECURSION_PARAMETERS
};

#define RECURSION_PARAMETER_TABLE                                                                                      \
    {.name = "center_v",                                                                                               \
     .unit = "V",                                                                                                      \
     .low = -1e9,                                                                                                      \
     .high = 1e9,                                                                                                      \
     .optional = true,                                                                                                 \
     .chosen = true,                                                                                                   \
     .text = "drive that counts as 0"},                                                                                \
        {.name = "half_range_v",                                                                                       \
         .unit = "V",                                                                                                  \
         .low = 1e-9,                                                                                                  \
         .high = 1e9,                                                                                                  \
         .chosen = true,                                                                                               \
         .text = "drive above center_v that counts as 1"},                                                             \
        {.name = "feedback",                                                                                           \
         .unit = "1",                                                                                                  \
         .low = -3.0,                                                                                                  \
         .high = 3.0,                                                                                                  \
         .array = true,                                                                                                \
         .optional = true,                                                                                             \
         .text = "c1, c2, c3: of the last three positions, at the model's sample rate"},                               \
        {.name = "bilinear_gain",                                                                                      \
         .unit = "1",                                                                                                  \
         .low = -2.0,                                                                                                  \
         .high = 2.0,                                                                                                  \
         .optional = true,                                                                                             \
         .text = "g: of last position times last drive (as a fraction)"},                                              \
        {.name = "harmonics_um",                                                                                       \
         .unit = "um",                                                                                                 \
         .low = -1e9,                                                                                                  \
         .high = 1e9,                                                                                                  \
         .array = true,                                                                                                \
         .optional = true,                                                                                             \
         .text = "A11, A31, A51 of u, u^3, u^5 times the sine, A12, A32, A52 times the cosine"},                       \
        {.name = "frequency_hz",                                                                                       \
         .unit = "Hz",                                                                                                 \
         .low = 0.0,                                                                                                   \
         .high = 1e6,                                                                                                  \
         .optional = true,                                                                                             \
         .chosen = true,                                                                                               \
         .text = "of that sine"},                                                                                      \
    {                                                                                                                  \
        .name = "phase_rad", .unit = "rad", .low = -100.0, .high = 100.0, .optional = true, .chosen = true,            \
        .text = "of that sine at the first sample"                                                                     \
    }

/**
 * Stability margin: the smallest slack in Jury's conditions for z^3 - (c1 + g u) z^2 - c2 z - c3 over all constant u in
 * [-1, 1]. If positive, all roots are inside the unit circle for every constant drive within the range.
 */
double recursion_margin(const double feedback[RECURSION_FEEDBACK], double bilinear);

/** Whether any feedback, bilinear gain or harmonic is not 0. `parameter` begins at RECURSION_CENTER. */
bool recursion_is_used(const parameter_t *parameter);

/** A block's check of its parameters from RECURSION_CENTER on: lengths, stability. */
bool recursion_check(const parameter_t *parameter, failure_t *failure);

void recursion_open(recursion_t *recursion, const parameter_t *parameter, const stage_setup_t *setup);

/** The drive as a fraction of its half range. */
static inline double recursion_input(const recursion_t *recursion, double drive_v) {
    return (drive_v - recursion->center_v) / recursion->half_range_v;
}

/** Goes to the steady state for x and u, without the sine, just before the first sample. Returns y. */
double recursion_settle(recursion_t *recursion, double x, double u);
/** One sample. Returns y. */
double recursion_step(recursion_t *recursion, double x, double u);

/** The six products of powers of u with sine and cosine, in the order of harmonic[]. */
void recursion_harmonics(double u, double angle, double product[RECURSION_HARMONICS]);

#endif
