/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Which blocks of the catalogue the recordings speak for, whatever the hysteresis is.
 *
 * A block's signature is what it changes of the position when it is put into the chain, the operator's weights as they
 * are. What the operator could imitate of it, its weights marginalised, does not count (hysteresis_beyond). Each block
 * is looked at in its probes (chain/probe.h), in one linear scan; what promises something is fitted (together.h).
 */
#ifndef BELIEF_SCAN_H
#define BELIEF_SCAN_H

#include "belief/imitation.h"
#include "chain/probe.h"

/** A block that may be missing, with the numbers at which it says most. */
typedef struct {
    const block_t *block;
    model_t chain; /**< with it, at index `at` */
    size_t at;
    double gain;      /**< natural units of evidence that it is worth, with its amplitude as it should be: of the best
                         probe */
    double promise;   /**< what makes a probe a good start */
    double amplitude; /**< in the recordings, in parts of its signature */
} suspect_t;

typedef struct {
    const imitation_t *imitation;  /**< was run */
    const hysteresis_rows_t *rows; /**< the operator's, of the samples that speak */
    const probe_setting_t *setting;
} scan_t;

/** The linear scan: one suspect a block that could be simulated, the one that is worth most first. To be freed.
 * signatures (may be NULL): how many were tried. */
void scan_blocks(const scan_t *scan, suspect_t **suspect, size_t *count, size_t *signatures);
void suspects_free(suspect_t *suspect, size_t count);

#endif
