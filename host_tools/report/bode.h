/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A frequency response in all its forms: as a table, as JSON (format hyst-bode-1), and as figures of a page. It is that
 * of look/response.h, of a recording and of a model that is driven by the same drive.
 */
#ifndef BODE_H
#define BODE_H

#include "chain/chain.h"
#include "look/response.h"
#include <jansson.h>
#include <stdio.h>

typedef struct {
    const char *recording; /**< its name */
    response_t measured;
    bool has_model;
    response_t model; /**< of the simulated position, by the same estimator */
} bode_t;

/** The response of the recording, and of the model if one is given. To be freed. */
bool bode_of(const recording_t *recording, const drive_look_t *drive, const model_t *model, bode_t *bode,
             failure_t *failure);
/** The same of a position that was simulated already; NULL: no model. */
void bode_of_simulated(const recording_t *recording, const drive_look_t *drive, const double *simulated_um,
                       bode_t *bode);
/** The same with a look at the drive first. Fails, too, where there is no response: too few samples, or too little that
 * moves. */
bool bode_ask(const recording_t *recording, const model_t *model, bode_t *bode, failure_t *failure);
void bode_free(bode_t *bode);

/** A row a frequency. */
void bode_print(FILE *file, const bode_t *bode);

/**
 * {"recording":, "method": "periods" | "local polynomials", "points": [{"frequency_hz":, "gain_um_per_v":,
 * "gain_sigma":, "phase_deg":, "phase_sigma_deg":, "coherence":, "lag_s":}], "model": [..] | null}. A new reference.
 */
json_t *bode_to_json(const bode_t *bode);

/** Gain, phase and coherence. Nothing where there are fewer than two points. */
void bode_write_figures(FILE *file, const bode_t *bode);

/** As one page. small: of a model for small signals, not of a recording. */
bool bode_write_page(const bode_t *bode, bool small, const char *path, failure_t *failure);

#endif
