/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Evidence for what a chain leaves out: how much of a candidate's signature stands in the residual, beyond what the
 * model's own numbers, and a hysteresis of another shape, could imitate (nuisance.h). docs/DIAGNOSIS.md.
 *
 *     e = displacement - simulation
 *     T = s'e' / (sigma |s'|),   s', e': signature and residual, whitened (noise.h), less their projections on
 *                                the nuisance subspace
 *
 * T is the likelihood ratio statistic of one number, its sign that of the amplitude. A second one takes its standard
 * error from the scatter over blocks of time instead (t_blocks): a signature that fits what another effect has left
 * behind gets a large T, but seldom the same amplitude in every block. Only the samples that are not held out speak.
 */
#ifndef EVIDENCE_H
#define EVIDENCE_H

#include "diagnosis/noise/noise.h"
#include "diagnosis/nuisance/nuisance.h"

/** Once it is opened and asked, several threads may use it. */
typedef struct evidence evidence_t;

typedef struct {
    double amplitude; /**< of the signature in the residual */
    double t;         /**< amplitude over its standard error, white residuals */
    double t_blocks;  /**< amplitude over its standard error, from the scatter over blocks */
    double own_um;    /**< root mean square of the whitened signature, at amplitude 1, beyond what the nuisance subspace
                         imitates */
    double own_part;  /**< of the whitened signature: what the nuisance subspace leaves of it */
    double held_share; /**< square of the whitened signature among the samples that are held out, over that among the
                          others */
    double explained;  /**< part of the whitened residual's square that it explains */
} evidence_test_t;

/** Simulates the baseline, which must stay as it is. NULL on failure. */
evidence_t *evidence_open(const model_t *baseline, const samples_t *samples, const noise_t *noise, failure_t *failure);
/** The question: effects that a hysteresis of no shape can imitate (in the beginning); blocks that such a hysteresis
 * can imitate, against the model's own and play operators; all that the model's own numbers cannot imitate. */
typedef enum { ASK_EFFECTS, ASK_SHAPES, ASK_ANYTHING } ask_t;
/** From here on the nuisance subspace has the columns of this question. */
void evidence_ask(evidence_t *evidence, ask_t question);
ask_t evidence_question(const evidence_t *evidence);
void evidence_close(evidence_t *evidence);

const samples_t *evidence_samples(const evidence_t *evidence);
/** displacement - simulation: a column. */
const double *evidence_residual(const evidence_t *evidence);
/** Deviation of the whitened residual beyond the nuisance subspace in um. */
double evidence_sigma_um(const evidence_t *evidence);

/**
 * The signature of a model that differs from the baseline in its block `at`: its simulation less the baseline's, as a
 * column to be freed by the caller. NULL if it cannot be simulated or is not finite.
 */
double *evidence_signature(const evidence_t *evidence, const model_t *altered, size_t at);

/** Tests a signature. All zero where the nuisance subspace imitates all but 1e-6 of it. */
evidence_test_t evidence_test(const evidence_t *evidence, double *signature);
/** Some at a time are cheaper than one by one. */
void evidence_tests(const evidence_t *evidence, size_t count, double *const *signature, evidence_test_t *test);

/** Root mean square of what the nuisance subspace leaves of a signature, times its amplitude. Only stretches of
 * time count in which it is larger than this part of what the nuisance subspace leaves of `found` (a column). */
double evidence_beside(const evidence_t *evidence, const double *signature, double amplitude, const double *found,
                       double part);

/** Cosine between two signatures beyond the nuisance subspace, whitened: 1 means that these recordings cannot tell them
 * apart. */
double evidence_cosine(const evidence_t *evidence, const double *one, const double *other);

/** 2 log of the likelihood ratio of a model that leaves `part` of the whitened residual's square to the baseline. */
double evidence_likelihood(const evidence_t *evidence, double part);

/**
 * The searched parameters of the model's block `at` (probe.h), by Gauss and Newton's method, so that the least of the
 * residual is left beyond the nuisance subspace. Returns which part of its square that is (HUGE_VAL: the model cannot
 * be simulated).
 */
double evidence_refine(const evidence_t *evidence, model_t *altered, size_t at);

#endif
