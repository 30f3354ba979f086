/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What the simulated actuator is driven with, as a curve that is known between the samples of the recording too.
 * Turning points of triangles lie on samples: a generator that shares its clock with the converter has it so.
 */
#ifndef PROOF_EXCITATION_H
#define PROOF_EXCITATION_H

#include "random.h"
#include <stdbool.h>
#include <stddef.h>

/** Instants of the simulation for each sample of the recording. */
enum { OVERSAMPLING = 8 };

typedef enum {
    EXCITATION_DESIGNED,  /**< a sweep of the range, silence at two levels, staircase with holds, decaying triangles at
                             two rates, chirps of  5 and 30 %, burst and pause */
    EXCITATION_SHORT,     /**< the same at a third of the length, without the sweep */
    EXCITATION_SINE,      /**< 1 Hz over the whole range */
    EXCITATION_SINES,     /**< three amplitudes at each of three frequencies */
    EXCITATION_MULTISINE, /**< 20 frequencies with random phases, over the whole range */
    EXCITATION_COUNT
} excitation_kind_t;

typedef struct {
    double sample_rate_hz;
    size_t samples;  /**< of the recording */
    size_t instants; /**< of the simulation, the first and the last are samples */
    double *drive_v; /**< instants of it, to be freed with excitation_free */
    double low_v, high_v;
} excitation_t;

const char *excitation_name(excitation_kind_t kind);

/** The curve between low_v and high_v. */
excitation_t excitation_make(excitation_kind_t kind, double sample_rate_hz, double low_v, double high_v,
                             random_t *random);
void excitation_free(excitation_t *excitation);

/** calloc that ends the program when there is no memory. */
void *proof_allocate(size_t count, size_t size);

#endif
