/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Evidence for what a chain leaves out: how much of a candidate's signature stands in the residual, beyond what the
 * model's own numbers, and a hysteresis of another shape, could imitate. docs/DIAGNOSIS.md.
 *
 *     e = displacement - simulation
 *     J = offset of each recording, the drive and play operators behind the model's electronics, their squares, cubes
 *         and products (a hysteresis that is asymmetric or not congruent), all through the model's slow, mechanical and
 *         sensor blocks
 *     T = s'e' / (sigma |s'|),   s', e': signature and residual, whitened by an autoregressive filter, less their
 *         projections on the whitened J
 *
 * T is the likelihood ratio statistic of one number, its sign that of the amplitude. A second one takes its standard
 * error from the scatter over blocks of time instead (t_blocks): a signature that fits what another effect has left
 * behind gets a large T, but seldom the same amplitude in every block.
 */
#ifndef EVIDENCE_H
#define EVIDENCE_H

#include "chain.h"

typedef struct evidence evidence_t;

/** Whether a sample is kept from every fit and every test of a diagnosis: of 36 blocks of time, each third one. */
bool held_out(size_t samples, size_t sample);

/**
 * First sample of a recording that takes part in a diagnosis: the hysteresis' memory is determined there, and the drive
 * has been at both ends of its range (a model whose plane ends there cannot have another past). 0 if that left less
 * than a quarter of the recording.
 */
size_t first_that_counts(const model_t *model, const recording_t *recording);

typedef struct {
    double amplitude; /**< of the signature in the residual */
    double t;         /**< amplitude over its standard error, white residuals */
    double t_blocks;  /**< amplitude over its standard error, from the scatter over blocks */
    double own_um;    /**< root mean square of the signature, at that amplitude, beyond what J imitates */
    double explained; /**< part of the whitened residual's square that it explains */
} evidence_test_t;

/**
 * Simulates the baseline. `shapes`: with the columns for a hysteresis of another shape (false: to ask whether it has
 * another shape). The recordings must outlive it. NULL on failure.
 */
evidence_t *evidence_open(const model_t *baseline, const recording_t *recordings, size_t count, bool shapes,
                          failure_t *failure);
void evidence_close(evidence_t *evidence);

/**
 * The signature of a model that differs from the baseline: its simulation less the baseline's, as a column to be freed
 * by the caller. NULL if it cannot be simulated or is not finite.
 */
double *evidence_signature(const evidence_t *evidence, const model_t *altered);

/** Tests a column. All zero where J imitates all but 1e-6 of it. */
evidence_test_t evidence_test(const evidence_t *evidence, const double *signature);

/** Part of the whitened residual's square that is left when the signature, at amplitude 1, is taken out of it. */
double evidence_remaining(const evidence_t *evidence, const double *signature);

/** Cosine between two columns beyond J, whitened: 1 means that these recordings cannot tell them apart. */
double evidence_cosine(const evidence_t *evidence, const double *one, const double *other);

const recording_t *evidence_recordings(const evidence_t *evidence);
size_t evidence_count(const evidence_t *evidence);

/**
 * How the held-out samples speak of two models: 2 log of the likelihood ratio of `better` to `worse` there, with this
 * evidence's filter and noise. Both must have been fitted.
 */
bool evidence_held_out(const evidence_t *evidence, const model_t *worse, const model_t *better, double *likelihood);

/** Held-out samples for each one that takes part. */
double evidence_held_out_share(const evidence_t *evidence);

/** Samples that take part, and the deviation of the whitened residual in um. */
size_t evidence_samples(const evidence_t *evidence);
double evidence_noise_um(const evidence_t *evidence);

/** Narrow peaks in the residual of the longest recording, the samples that are held out included (lines.h). */
size_t evidence_lines(const evidence_t *evidence, double *hz);

#endif
