/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Which blocks of the catalogue the recordings speak for, whatever the hysteresis is.
 *
 * A block's signature is what it changes of the position when it is put into the chain, the operator's weights as they
 * are. What the operator could imitate of it, its weights marginalised, does not count (hysteresis_beyond). Each block
 * is first looked at in its probes (chain/probe.h), in one linear scan; what promises something is refined.
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
                         probe, and once it is refined as its numbers are */
    double promise;   /**< what makes a probe a good start for the refinement */
    double amplitude; /**< in the recordings, in parts of its signature */
    double sigma;     /**< of that */
    /** Of all its probes: least root mean square of the change of the position that would be worth least_gain, and the
     * block's numbers at that size. */
    double smallest_um, smallest_value[BLOCK_MAX_PARAMETERS];
    bool refined; /**< its numbers were searched; amplitude is then near 1 */
    bool shown;   /**< it begins with what a look has shown, and is worth more there than the scan promises */
} suspect_t;

/** Several of them, the loudest first. */
typedef struct {
    suspect_t *suspect;
    size_t count;
} suspects_t;

typedef struct {
    const imitation_t *imitation;  /**< was run */
    const hysteresis_rows_t *rows; /**< the operator's, of the samples that speak */
    const probe_setting_t *setting;
} scan_t;

/** The linear scan: one suspect a block that could be simulated. To be freed. */
void scan_blocks(const scan_t *scan, suspects_t *suspects);
/** How many of them promise something beside the very first, at most `most`: those whose numbers are worth a search. */
size_t scan_promising(const suspects_t *suspects, size_t most);
/** Steps of a search that is to end where no more is to be had. */
enum { SCAN_STEPS = 8 };
/** Searches the numbers of one, the weights as they are, from where its amplitude puts them; in at most so many steps.
 * The scan's chain may have the block already, with the same index: then `gain` is what other numbers are worth. */
void scan_refine(const scan_t *scan, size_t steps, suspect_t *suspect);

/** The standard errors of the numbers of the block at `at`, which the scan's chain has: beside the operator, its
 * weights integrated out, each number with the others free. A number that the operator imitates gets none. */
void scan_errors(const scan_t *scan, model_t *chain, size_t at);

void suspects_copy(const suspects_t *suspects, size_t count, suspects_t *copy);
void suspects_sort(suspects_t *suspects);
void suspects_free(suspects_t *suspects);

#endif
