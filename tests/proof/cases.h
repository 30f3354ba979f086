/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What is recorded: actuators, excitations and what they hide.
 */
#ifndef PROOF_CASES_H
#define PROOF_CASES_H

#include "effects.h"

enum { CASE_EFFECTS = 3, CASE_RECORDINGS = 3 };

/** What a case is there to show. */
typedef enum {
    CASE_NULL,       /**< nothing is missing */
    CASE_SINGLE,     /**< one effect of the catalogue, at a strength */
    CASE_RARE,       /**< one that acts in a few hundredths of the samples */
    CASE_SEVERAL,    /**< two or three, of which the first dominates */
    CASE_UNKNOWN,    /**< one that no catalogue has */
    CASE_UNTESTABLE, /**< one that is there, in a recording that cannot show it */
    CASE_KINDS
} case_kind_t;

const char *case_kind_name(case_kind_t kind);

typedef struct {
    const effect_t *effect;
    /** Wanted: rms of what the effect changes, after a refit of gain and offset, over that of the noise. 0: the typical
     * size, whatever its strength. Then what was reached. */
    double strength;
    /** The same, reached, when the weights of ten play operators are refitted too: what a hysteresis of another shape
     * cannot imitate. */
    double visible;
    double parameter[EFFECT_PARAMETERS];
    uint64_t seed;
} presence_t;

typedef struct {
    case_kind_t kind;
    actuator_t actuator;
    excitation_kind_t excitation;
    double sample_rate_hz;
    size_t recordings; /**< several only with different preload_n */
    double preload_n[CASE_RECORDINGS];
    size_t effects;
    presence_t effect[CASE_EFFECTS];
    uint64_t seed; /**< of drive and noise */
} case_t;

/** All cases, in an order that says nothing about them. `reduced`: the few that run in continuous integration. To be
 * freed by the caller. */
case_t *cases_list(uint64_t seed, bool reduced, size_t *count);

#endif
