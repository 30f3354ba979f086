/* SPDX-License-Identifier: MIT */
/**
 * The parameter image in force, the one that is being uploaded, and the way from one to the other.
 *
 * A commit decodes and validates the staged image as a set and builds its coefficients in the idle half of a double
 * buffer; the loop adopts them (loop_adopt). A refused image changes nothing but the result. Besides what
 * hyst/parameters.h checks, the image must have been made for this board's sample rate
 * (HYST_PARAMETERS_INCONSISTENT, HYST_FIELD_SAMPLE_RATE).
 *
 * Main loop only.
 */
#ifndef PARAMETER_STORE_H
#define PARAMETER_STORE_H

#include "loop.h"

/** Words of each of the two register blocks: the longest image. */
#define PARAMETER_STORE_WORDS HYST_IMAGE_MAX_WORDS

/** Puts the default image in force, for this board's sample rate. Returns what loop_init is to start with. */
const loop_parameters_t *parameter_store_init(void);

/** Where an upload is written to. PARAMETER_STORE_WORDS words, in any order. */
uint32_t *parameter_store_staging(void);

/** The image in force. PARAMETER_STORE_WORDS words; 0 behind the image's length. */
const uint32_t *parameter_store_active(void);

/** Result of the last commit, and how many were accepted since start (saturates at UINT16_MAX). */
typedef struct {
    hyst_parameters_fault_t fault;
    uint16_t commits;
} parameter_store_status_t;

parameter_store_status_t parameter_store_status(void);

/** Tries to put the staged image in force. Not while loop_adoption_pending(): the idle half is not idle then. */
void parameter_store_commit(void);

#endif
