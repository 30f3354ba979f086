/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The hysteresis of the simulated actuators: three sources that share nothing with each other, nor with the tool under
 * test.
 */
#ifndef PROOF_ACTUATOR_H
#define PROOF_ACTUATOR_H

#include "excitation.h"
#include <stdbool.h>

enum { PLAYS = 240 };

typedef enum {
    SOURCE_PLAY,     /**< a dense density of play operators, PLAYS of them */
    SOURCE_BOUC_WEN, /**< the Bouc-Wen equation, integrated in small steps (fourth order) */
    SOURCE_PLANE,    /**< a Preisach plane: a continuum of relays whose density is not constant along the diagonal, so
                          that minor loops at different bias differ */
    SOURCE_COUNT
} source_t;

typedef struct {
    source_t source;
    double low_v, high_v;
    double offset_um, um_per_half_range;
    double density_scale;         /**< plays and relays: how fast the density falls with the half width, of half the
                                       range */
    double hysteretic;            /**< part of the motion that is hysteretic */
    double curvature;             /**< plane: of the density along the diagonal */
    double beta, gamma, exponent; /**< Bouc-Wen */
    bool from_above;              /**< the last end of the range that was visited before the recording */
    double noise_um, noise_correlation; /**< rms; of neighbouring samples (AR(1)) */
    double converter_step_um;
} actuator_t;

const char *source_name(source_t source);

/** Random numbers in the range of real actuators. */
actuator_t actuator_draw(source_t source, random_t *random);

/**
 * The position, in um, of the instants. voltage_v becomes it. growth_v is what the half width of every play or relay
 * has grown by (Bouc-Wen has none: NULL or zeros). Before the first instant the whole range was swept, and the first
 * voltage has been present for long.
 */
void actuator_move(const actuator_t *actuator, const double *growth_v, double *voltage_v, size_t instants);

#endif
