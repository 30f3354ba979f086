/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Diagnosis: which physics a model of the recordings leaves out. docs/DIAGNOSIS.md.
 *
 * From the baseline on, the block that explains most of what is left of the residual is taken into the chain, the chain
 * is fitted again, and so on, until nothing is significant any more. A block is a finding only if it is significant
 * after the correction for all signatures that were tried, by two standard errors, one of which does not assume white
 * residuals. And it has to lower the error of the held-out samples. In the end each finding is taken out again, and
 * stays out if the others make it superfluous.
 */
#ifndef DIAGNOSE_H
#define DIAGNOSE_H

#include "belief/shape.h"
#include "diagnosis/noise/remainder.h"
#include "identify/family.h"

enum { DIAGNOSIS_MOST_FINDINGS = 6, DIAGNOSIS_MOST_RIVALS = 4 };

/** How exactly it can be said what is missing. */
typedef enum { DETECTED, ISOLATED /* to a group */, NAMED } certainty_t;

typedef struct {
    const block_t *block;
    certainty_t certainty;
    certainty_t settled; /**< as its names were settled, before the verdict made it less */
    double t, t_blocks;
    double margin;  /**< 2 log likelihood to the best block of another name, HUGE_VAL without any */
    double support; /**< 2 log likelihood that the held-out samples give it */
    size_t rivals;  /**< blocks that the recordings cannot tell from this one */
    const block_t *rival[DIAGNOSIS_MOST_RIVALS];
    double held_out_before_percent, held_out_after_percent; /**< NRMSE */
    bool shape;                                             /**< a hysteresis of another shape could imitate it */
    bool in_readings; /**< its numbers come from the readings themselves, not from a fit */
    bool heard;       /**< beside the universal operator; the search beside a model of few numbers has not found it */
} finding_t;

/** What became of a block that was looked at in a round of the search. Appended for the outputs. */
typedef enum {
    TAKEN,
    LESS_LIKELY,
    NOT_SUPPORTED, /**< by the held-out samples */
    NOT_SIGNIFICANT,
    SUPERFLUOUS,
    CONTRADICTED /**< by measured voltage, current or temperature */
} outcome_t;

enum { DIAGNOSIS_MOST_CONSIDERED = 64, DIAGNOSIS_MOST_UNSEEN = 32 };

typedef struct {
    const block_t *block;
    size_t round;                   /**< from 1 on; the last one finds nothing */
    double likelihood, t, t_blocks; /**< of the block at its best (candidate.h) */
    outcome_t outcome;
} considered_t;

/** What a block that was not found would have had to be like. */
typedef struct {
    const block_t *block;
    bool testable;      /**< false: whatever its size, these recordings could not show it */
    const char *why;    /**< they could not, a clause; NULL where it is testable */
    double smallest_um; /**< root mean square of the change of the position that would have been seen */
    size_t parameter;   /**< index of the one that the effect is proportional to; block->parameters: none */
    double value;       /**< of that parameter at this size */
    double form[BLOCK_MAX_PARAMETERS]; /**< all numbers of the block at this size, where it is proportional to some */
} unseen_t;

typedef enum { NOTHING_MISSING, EXPLAINED, PARTLY_EXPLAINED, UNKNOWN_PHYSICS } verdict_t;

typedef struct {
    recording_t *recordings; /**< as they were given, but for clock_s (line_clock.h); their columns are the caller's */
    samples_t samples;       /**< of these */
    noise_t noise;
    bool model_given;
    const family_t *family;  /**< of the baseline's hysteresis; NULL: the given one */
    model_t given;           /**< with a model: as it came in; without: the baseline */
    model_t baseline, model; /**< its numbers fitted again; with everything that was found */
    /** Blocks of the given chain, beside its hysteresis, whose numbers the recordings determine: every fit has them. */
    size_t refitted;
    const block_t *refitted_block[MODEL_MAX_BLOCKS];
    double given_nrmse_percent, given_held_out_percent;
    double baseline_nrmse_percent, baseline_held_out_percent;
    double own_shape_held_out_percent; /**< of a given model with its own hysteresis, fitted again */
    double nrmse_percent, held_out_percent;
    double noise_percent; /**< HUGE_VAL: not known (remainder.h) */
    size_t findings;
    finding_t finding[DIAGNOSIS_MOST_FINDINGS];
    size_t tested;
    remainder_t remainder; /**< whether more than noise, and another shape of the hysteresis, remains */
    /** More is left than noise, but the universal operator explains it: it is the shape of the hysteresis. */
    bool another_shape;
    /** As `hyst simulate` tells them of whole recordings (delivered.h): of both models, a straight line, plays. */
    double baseline_delivered_percent, delivered_percent, line_percent, plays_percent;
    /** The universal operator in the place of the hysteresis: before anything was found, and beside what was. */
    shape_t shape, shape_after;
    verdict_t verdict;
    size_t rounds, considered; /**< of the search; blocks in them, those that explain most of each */
    considered_t consideration[DIAGNOSIS_MOST_CONSIDERED];
    size_t unseen_count;
    unseen_t unseen[DIAGNOSIS_MOST_UNSEEN];
} diagnosis_t;

/**
 * The stages of stages.h, one after another. The recordings must outlive the diagnosis, which is to be freed.
 *
 * given: a chain. It is fitted again, as far as the recordings determine it (refitted.h). Where that is not the whole
 * answer, the search is made also with hystereses of other shapes in the given one's place. Such an answer stands if it
 * is better by naming_margin: a wrong shape of the user's is no missing physics either.
 *
 * NULL: the search begins with the shape of hysteresis (play bank, Bouc-Wen, Preisach) that fits best beside the
 * signatures of all blocks. Where that leaves more than noise, or finds something, also with the others that come near.
 * The answer that leaves the least error of the held-out samples stands: a wrong shape is no missing physics, and
 * physics is no shape.
 */
bool diagnose(const model_t *given, const recording_t *recordings, size_t count, diagnosis_t *diagnosis,
              failure_t *failure);
void diagnosis_free(diagnosis_t *diagnosis);
/** Its models only, of one that shares all else with another. */
void diagnosis_free_models(diagnosis_t *diagnosis);

#endif
