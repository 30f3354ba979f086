/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A family of models: a structure of the chain with a hysteresis in it, and how its numbers are found from recordings.
 *
 * Adding one is one file in families/ that defines a family_t, and one line in FAMILIES. What all have in common stands
 * in fit.h: cutting off the held-out part, judging by simulating the finished chain, standard errors, the table of
 * `hyst fit --family all`.
 */
#ifndef FAMILY_H
#define FAMILY_H

#include "model.h"
#include "progress.h"
#include "recording.h"

/* In the order in which the help and the table list them. */
#define FAMILIES(FAMILY)                                                                                               \
    FAMILY(prandtl_ishlinskii)                                                                                         \
    FAMILY(rate_dependent_prandtl_ishlinskii)                                                                          \
    FAMILY(stop_density)                                                                                               \
    FAMILY(preisach)                                                                                                   \
    FAMILY(stop_prandtl_ishlinskii)                                                                                    \
    FAMILY(inertial_hysteresis)                                                                                        \
    FAMILY(inertial_prandtl_ishlinskii)                                                                                \
    FAMILY(bouc_wen)                                                                                                   \
    FAMILY(ellipse)                                                                                                    \
    FAMILY(modified_play)                                                                                              \
    FAMILY(truncated_modified_play)                                                                                    \
    FAMILY(recursive_bouc_wen)

#define FAMILY_MAX_NOTES 40
/** Most operators that a job may ask for. */
#define FAMILY_MAX_OPERATORS 1000

/** What a family has to say about its fit, a line each. */
typedef struct {
    size_t count;
    char line[FAMILY_MAX_NOTES][200];
} family_notes_t;

/** What a family fits to. It may look at samples [0, train_to[i]) of recordings[i], and at nothing behind them. */
typedef struct {
    const recording_t *recordings; /**< one sample rate, checked */
    size_t count;
    const size_t *train_to; /**< one a recording */
    size_t operators;       /**< asked for; 0: the family chooses */
    bool creep;             /**< find a block creep too; only families that find creep look at it */
    progress_t *progress;
} family_job_t;

typedef struct family {
    const char *name; /**< as in --family */
    const char *text; /**< one line: what it is, and what it takes */
    /**
     * Fills *model (an unused one) with the whole chain, sample rate included, that fits the training samples.
     * Parameters whose standard errors the family knows carry them; fit.h finds the others. On failure *model is
     * unused. A recording that the family is not made for is a failure whose line says what it needs ("needs sinusoidal
     * drives"). model->fit may be an object with facts of the family's own; fit.h adds what all have in common. A
     * number of operators that the family chose stands there as "operators" (an integer).
     */
    bool (*fit)(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure);
    bool finds_creep; /**< knows what to do with job->creep */
    /** What remains of the family without what is special about it, or NULL. It is fitted with the same number of
     * operators and judged beside it: "held out with <name> instead". It need not be in FAMILIES. */
    const struct family *without;
} family_t;

#define FAMILY_DECLARE(name) extern const family_t family_##name;
FAMILIES(FAMILY_DECLARE)
#undef FAMILY_DECLARE

extern const family_t *const families[];
extern const size_t families_count;

/** The family of that name, or NULL. */
const family_t *family_find(const char *name);

/** Adds a line; one too many is dropped. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
void family_note(family_notes_t *notes, const char *format, ...);

#endif
