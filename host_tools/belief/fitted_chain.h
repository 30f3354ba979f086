/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A chain of blocks with the universal operator in the place of its hysteresis, fitted to the samples of a diagnosis.
 */
#ifndef FITTED_CHAIN_H
#define FITTED_CHAIN_H

#include "belief/imitation.h"
#include "belief/scan.h"
#include "diagnosis/noise/samples.h"

typedef struct {
    const samples_t *samples;
    imitation_t imitation;
    hysteresis_t hysteresis;
    kept_rows_t fitted_rows; /**< of it, where the fit had them; fitted_chain_rows takes them */
    hysteresis_rows_t rows;  /**< fitted_chain_rows */
    unsigned char *use;      /**< of all samples: fitted */
    double *position_um;     /**< the displacements, a column */
    size_t thin;             /**< of these samples every `thin`-th is fitted in the end */
    suspects_t scanned;      /**< fitted_chain_suspects */
    suspects_t searched;     /**< fitted_suspects */
} fitted_chain_t;

/** A chain with the operator's place holder as its hysteresis, without noise; to be freed. */
void chain_for_operator(const model_t *from, model_t *chain);

/** Fits the operator's weights and the noise. To be closed. false: the drive does not move, or the chain cannot be
 * simulated; nothing is there then. like: of hysteresis_fit. */
bool fitted_chain_open(fitted_chain_t *fitted, const samples_t *samples, const model_t *chain,
                       const hysteresis_t *like);
void fitted_chain_close(fitted_chain_t *fitted);

/** Whether it is the fit of this chain, whatever its hysteresis, to these samples. It may be empty. */
bool fitted_chain_is_of(const fitted_chain_t *fitted, const samples_t *samples, const model_t *chain);

/** The operator's rows at the fitted samples. */
const hysteresis_rows_t *fitted_chain_rows(fitted_chain_t *fitted);

/** For scan.h. */
scan_t fitted_chain_scan(fitted_chain_t *fitted, const probe_setting_t *setting);

#endif
