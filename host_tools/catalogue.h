/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The catalogue of blocks: every physical effect that a model can contain. docs/MODELS.md has the equations. */
#ifndef CATALOGUE_H
#define CATALOGUE_H

#include "block.h"

/* One line a block, in the order of the signal. */
#define BLOCKS(BLOCK)                                                                                                  \
    BLOCK(transport_delay)                                                                                             \
    BLOCK(amplifier_bandwidth)                                                                                         \
    BLOCK(amplifier_slew_limit)                                                                                        \
    BLOCK(amplifier_saturation)                                                                                        \
    BLOCK(asymmetric_hysteresis)                                                                                       \
    BLOCK(rate_dependent_hysteresis)                                                                                   \
    BLOCK(prandtl_ishlinskii)                                                                                          \
    BLOCK(preisach)                                                                                                    \
    BLOCK(stop_density)                                                                                                \
    BLOCK(stop_prandtl_ishlinskii)                                                                                     \
    BLOCK(inertial_hysteresis)                                                                                         \
    BLOCK(ellipse)                                                                                                     \
    BLOCK(modified_play)                                                                                               \
    BLOCK(bouc_wen)                                                                                                    \
    BLOCK(interleaved_hysteresis)                                                                                      \
    BLOCK(creep)                                                                                                       \
    BLOCK(dielectric_loss)                                                                                             \
    BLOCK(charge_leakage)                                                                                              \
    BLOCK(gain_drift)                                                                                                  \
    BLOCK(resonance)                                                                                                   \
    BLOCK(inertial_terms)                                                                                              \
    BLOCK(preload)                                                                                                     \
    BLOCK(sensor_bandwidth)                                                                                            \
    BLOCK(static_nonlinearity)                                                                                         \
    BLOCK(thermal_drift)                                                                                               \
    BLOCK(mains_interference)                                                                                          \
    BLOCK(sensor_noise)                                                                                                \
    BLOCK(quantisation)

#define BLOCK_DECLARE(name) extern const block_t block_##name;
BLOCKS(BLOCK_DECLARE)
#undef BLOCK_DECLARE

extern const block_t *const catalogue[];
extern const size_t catalogue_count;

/** The block of that name, or NULL. */
const block_t *catalogue_find(const char *name);

/** "electronics", "hysteresis", "slow", "mechanics", "sensor". */
const char *place_name(place_t place);

#endif
