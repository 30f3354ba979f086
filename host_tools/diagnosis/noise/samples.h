/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The samples of a diagnosis: which are included, and which are held out.
 *
 * A column has one value a sample, all samples of one recording after those of the one before.
 */
#ifndef SAMPLES_H
#define SAMPLES_H

#include "chain/chain.h"

enum { SAMPLES_SKIPPED = 6 /* at the beginning of each recording, for filters */ };

typedef struct {
    const recording_t *recordings;
    size_t count;
    size_t *begin;       /**< of each recording in a column, and the column's length: count + 1 */
    size_t *from;        /**< of a recording's samples, the first included one */
    size_t all;          /**< length of a column */
    size_t fitted, held; /**< included samples: fitted, and held out */
    bool past_matters;   /**< some included ones depend on drives before the recording */
    unsigned char *part; /**< of each sample: samples_part_t */
} samples_t;

typedef enum { SAMPLE_LEFT_OUT, SAMPLE_FITTED, SAMPLE_HELD_OUT } samples_part_t;

/**
 * Of 36 blocks of time a third is held out (held_out.h): kept from every fit and every test.
 *
 * Included is what comes after the hysteresis' memory is determined and the drive has been at both ends of its range (a
 * model whose plane ends there cannot have another past). Where that would leave out more than 20 % of a recording (of
 * several: 75 %), it is what comes after the drive has been at both
 * ends of what it covers in the first 20 %. The rest of the past is then a matter of the model.
 * The recordings must outlive it. Fails when a recording is too short, or all of them together have fewer samples than
 * a few for each number that the nuisance subspace has (nuisance.h): whatever they hold could be explained away, and
 * chance explained.
 */
bool samples_open(samples_t *samples, const model_t *model, const recording_t *recordings, size_t count,
                  failure_t *failure);
void samples_close(samples_t *samples);
/** The same samples, shared out so that both parts were near both ends of the drive's range: what is near an end counts
 * in 36 blocks by itself. Their `part` is to be freed; all else is that of `samples`. */
samples_t samples_share_ends(const samples_t *samples);

/**
 * What decays as exp(-rate k) behind these samples of a recording, in parts a sample: where one part has hardly any of
 * it, each decay is shared out. Its beginning, two thirds of its energy, is fitted, and what follows is held out. One
 * that is not included is, and the past then matters.
 */
void samples_share_decays(samples_t *samples, size_t recording, const size_t *from, size_t count, double rate);

/** Room for a column, zeroed. */
double *samples_column(const samples_t *samples);
/** displacement - simulated; samples that are left out are 0. */
void samples_residual(const samples_t *samples, const double *simulated, double *residual);
/** Picks the samples of one part, in their order. Returns how many. */
size_t samples_pick(const samples_t *samples, samples_part_t part, const double *column, double *picked);

/** How often the drives turn round, all recordings together (loop_parts.h). */
size_t samples_reversals(const samples_t *samples, double part);

/** The recording with the most samples, the first of them. */
size_t samples_longest(const samples_t *samples);
/** The highest sample rate. */
double samples_fastest_hz(const samples_t *samples);
/** Duration of the longest recording. */
double samples_longest_s(const samples_t *samples);

/** Sum of the squares of a column over the samples of one part. */
double samples_square(const samples_t *samples, samples_part_t part, const double *column);
/** Root mean square of a column about its mean, over the included samples. */
double samples_rms(const samples_t *samples, const double *column);

/** Simulates all recordings into a column. */
bool samples_simulate(const samples_t *samples, const model_t *model, double *column, failure_t *failure);
/** Simulation of one model less that of the other: a column, to be freed. NULL if either cannot be simulated. */
double *samples_change(const samples_t *samples, const model_t *with, const model_t *without, failure_t *failure);

/** Error of a simulation over the samples of a part: root mean square over the peak-to-peak displacement of the whole
 * recording, in percent, of the worst recording. */
double samples_nrmse_percent(const samples_t *samples, samples_part_t part, const double *simulated);
/** What an error of that root mean square in all recordings would be by the same measure. */
double samples_percent(const samples_t *samples, double rms_um);

#endif
