/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a model may leave out: the physical effects of the catalogue of blocks, written anew, and effects that no
 * catalogue has.
 *
 * An effect works on the instants of the simulation (those of STAGE_SAMPLES on the samples of the recording). How large
 * it is, is one number, its size; the other parameters are drawn.
 */
#ifndef PROOF_EFFECTS_H
#define PROOF_EFFECTS_H

#include "actuator.h"

enum { EFFECT_PARAMETERS = 4 };

/** In the order of the signal, as is the table of effects. */
typedef enum { STAGE_ELECTRONICS, STAGE_HYSTERESIS, STAGE_POSITION, STAGE_SAMPLES } stage_t;

/** What an effect works on, and what it may look at. */
typedef struct {
    double *value; /**< V up to the hysteresis, um behind it */
    size_t count;
    double step_s;
    double *growth_v;      /**< STAGE_HYSTERESIS: of the half widths, count of them */
    const double *drive_v; /**< the command, count of them (not for STAGE_SAMPLES) */
    const actuator_t *actuator;
    double largest_rate_v_per_s; /**< of the command */
    double preload_n;
    uint64_t seed; /**< of the effect's own chance */
} passage_t;

typedef struct {
    const char *name;                         /**< as the block's in the catalogue, or in words */
    const char *parameter[EFFECT_PARAMETERS]; /**< named as the block's; NULL: none further */
    double typical;                           /**< size of a typical case */
    double most;                              /**< size that physics allows */
    /** Parameters for a size. `random` gives the others the same values for the same seed. */
    void (*set)(const passage_t *passage, double size, random_t *random, double parameter[EFFECT_PARAMETERS]);
    void (*apply)(passage_t *passage, const double parameter[EFFECT_PARAMETERS]);
    stage_t stage;
    bool not_in_bouc_wen; /**< needs half widths */
} effect_t;

/** One a block of the catalogue, in the order of the signal. */
extern const effect_t catalogue_effects[];
extern const size_t catalogue_effect_count;

/** In no catalogue. */
extern const effect_t unknown_effects[];
extern const size_t unknown_effect_count;

/** The effect of the catalogue with that name; there must be one. */
const effect_t *effect_find(const char *name);

#endif
