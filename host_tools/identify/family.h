/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A family of models: a structure of the chain with a hysteresis in it, and the identification of its parameters.
 *
 * To add one, add one file in families/ that defines `const family_t family_NAME = {` with an `order`: the build finds
 * it, and the test host_contract reports what is missing. fit.h does what all families share: splitting off the
 * held-out part, errors by simulation of the finished chain, standard errors, the table of `hyst fit --family all`.
 */
#ifndef FAMILY_H
#define FAMILY_H

#include "base/progress.h"
#include "chain/model.h"
#include "family_list.h" /* generated: every family_t of families/ that has an .order */
#include "recording/recording.h"

#define FAMILY_MAX_NOTES 40
/** Most operators of a job. */
#define FAMILY_MAX_OPERATORS 1000

/** Remarks of a family about its fit, one line each. */
typedef struct {
    size_t count;
    char line[FAMILY_MAX_NOTES][200];
} family_notes_t;

/** The input of a fit. Only samples [0, train_to[i]) of recordings[i] may be used: the rest is held out. */
typedef struct {
    const recording_t *recordings; /**< each has its sample rate */
    size_t count;
    const size_t *train_to; /**< one per recording */
    size_t operators;       /**< requested; 0: the family chooses */
    bool creep;             /**< fit a block creep too; ignored by families without finds_creep */
    progress_t *progress;
} family_job_t;

typedef struct family {
    const char *name; /**< as in --family */
    /** Position in the help and the table, from 1 on; multiples of ten leave room. 0: `hyst fit` does not offer it. */
    unsigned order;
    const char *text; /**< one line: what it is, and what it requires */
    /**
     * Fills *model (initially unused) with the whole chain that fits the training samples, and its sample rate.
     * Standard errors that the family knows are set; fit.h computes the others. On failure *model is unused. A
     * recording that does not suit the family is a failure whose line says what is required ("needs sinusoidal
     * drives"). model->fit may be an object with facts specific to the family, to which fit.h adds the common ones. The
     * number of operators, if the family chose it, is there as "operators" (an integer).
     */
    bool (*fit)(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure);
    bool finds_creep; /**< supports job->creep */
    /** The model holds only for the sine that it was fitted to. The held-out part is that same sine, so the held-out
     * error says nothing about other drives. `--family all` lists such a family last and does not choose it. */
    bool one_sine;
    /** The family without its special feature, or NULL. It is fitted with the same number of operators for comparison:
     * "held out with <name> instead". It need not have an order. */
    const struct family *without;
} family_t;

#define FAMILY_DECLARE(name) extern const family_t family_##name;
FAMILY_LIST(FAMILY_DECLARE)
#undef FAMILY_DECLARE

extern const family_t *const families[];
extern const size_t families_count;

/** "all, prandtl_ishlinskii, ..": the names that `hyst fit --family` takes. */
void family_list_names(char *text, size_t room);

/** The family of that name, or NULL. */
const family_t *family_find(const char *name);

/** Adds a line; one too many is dropped. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
void family_note(family_notes_t *notes, const char *format, ...);

#endif
