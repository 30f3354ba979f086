/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The answer of a diagnosis: all that text, JSON and page tell, as the last stage left it. Who reads it has it as
 * const, and needs neither the state of the search (state.h) nor its stages.
 */
#ifndef ANSWER_H
#define ANSWER_H

#include "diagnosis/question/question.h"
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
    CONTRADICTED, /**< by measured voltage, current or temperature */
    A_BEND        /**< a curve that only comes near, as the hysteresis' own bends do */
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
    const question_t *question; /**< that it answers; goes with it */
    const family_t *family;     /**< of the baseline's hysteresis; NULL: the given one */
    model_t given;              /**< with a model: as it came in; without: the baseline */
    model_t baseline, model;    /**< its numbers fitted again; with everything that was found */
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
    double ring_left_um; /**< amplitude of what the look saw ring and the model does not; 0: none (seen.h) */
    /** As `hyst simulate` tells them of whole recordings (delivered.h): of both models, a straight line, plays. */
    double baseline_delivered_percent, delivered_percent, line_percent, plays_percent;
    double past_percent; /**< what the past explains of the samples that count, NRMSE of the worst one; 0: known */
    shape_t shape_after; /**< the universal operator in the place of the hysteresis, beside what was found */
    verdict_t verdict;
    size_t rounds, considered; /**< of the search; blocks in them, those that explain most of each */
    considered_t consideration[DIAGNOSIS_MOST_CONSIDERED];
    size_t unseen_count;
    unseen_t unseen[DIAGNOSIS_MOST_UNSEEN];
    const char *written_to; /**< the file that has its model, of the caller; NULL: none yet */
} answer_t;

/** How often the drives turn round by at least half of their range. */
size_t answer_reversals(const answer_t *answer);
/** Whether that is so seldom that no loop occurs twice, and any verdict is a guess. */
bool answer_has_too_little(const answer_t *answer);
/** Whether more was put down to drives before the recordings than all that is left. The drive that goes further with
 * time tells their past from nothing that is slow. */
bool answer_rests_on_past(const answer_t *answer);

/** Whether anything was found beside the universal operator alone (finding_t.heard). */
bool answer_has_heard(const answer_t *answer);

/** Whether it only describes what no physical effect explains (empirical.h). */
bool finding_is_empirical(const finding_t *finding);
/** How many findings name a physical effect: these come first. */
size_t findings_named(const answer_t *answer);
/** Error of the held-out samples with these alone. */
double findings_named_held_out_percent(const answer_t *answer);
/** Whether the outputs tell a number of what was found: searched, or what the searched ones refer to (the middle or
 * half of a range, the duration of a trend). */
bool number_is_told(const model_block_t *block, size_t parameter);
bool finding_has_rival(const finding_t *finding, const block_t *rival);
/** The finding that put this block in the chain, or NULL. */
const finding_t *finding_of(const answer_t *answer, const block_t *block);
/** Whether a block was found, or a finding can be confused with it. */
bool finding_may_be(const answer_t *answer, const block_t *block);
/** Index of a finding's block in answer->model. */
size_t finding_index(const answer_t *answer, const finding_t *finding);
/** The answer's model without the finding's block; to be freed. */
void finding_left_out(const answer_t *answer, const finding_t *finding, model_t *without);
/** Of a relaxation (probe_t.times): the times in s in which it acts and the recordings show it. false: it is none. */
bool finding_times(const answer_t *answer, const finding_t *finding, double time_s[2]);

/** Whether a number of a given chain's block has changed by more than two of its standard errors (refitted.h). */
bool refitted_changed(const model_block_t *given, const model_block_t *fitted, size_t parameter);

/** The answer with its question. */
void answer_free(answer_t *answer);
/** Its models only. */
void answer_free_models(answer_t *answer);

#endif
