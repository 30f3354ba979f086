/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * How sure an answer is, by recordings like the user's that were simulated and asked again (interface/sure.h): what
 * was counted, in words and as JSON.
 */
#ifndef SURE_REPORT_H
#define SURE_REPORT_H

#include "diagnosis/diagnose.h"
#include <jansson.h>
#include <stdio.h>

enum { SURE_MOST_QUESTIONS = 16, SURE_MOST_OTHERS = 6 };

/** What became of recordings that had one thing in them. */
typedef struct {
    const block_t *hidden;      /**< NULL: nothing was missing */
    const block_t *in_place_of; /**< the finding in whose place it stood, or itself; NULL: nothing was found */
    double limits;              /**< its size, in detection limits; 0: as it fits the recordings */
    size_t parameter;           /**< of a size in limits: what the effect is proportional to */
    double value;
    size_t right;   /**< answers that name it alone; or, of nothing, say so */
    size_t open;    /**< those that name it as one of several */
    size_t nothing; /**< those that find nothing in its place */
    size_t others;
    struct {
        const block_t *block;
        size_t count;
    } other[SURE_MOST_OTHERS]; /**< those that name another block, without it */
} sure_question_t;

typedef struct {
    unsigned long seed;
    size_t each;  /**< recordings, or sets of them, simulated for each question */
    bool whole;   /**< only noise is left of the recordings themselves: the simulated ones are like them */
    bool columns; /**< the recordings have measured columns, which the simulated ones are without */
    size_t count;
    sure_question_t question[SURE_MOST_QUESTIONS];
} sure_t;

void sure_print(FILE *file, const sure_t *sure);
/** A new reference: key `sure` of hyst-diagnosis-1. */
json_t *sure_to_json(const sure_t *sure);

#endif
