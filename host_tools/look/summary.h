/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a recording holds in one line, so that a wrong column, unit or rate shows before anything is fitted: ranges,
 * kind of drive, periods, straightness and noise. Each number is that of the look's part of that name.
 *
 * Of a long recording every so many samples are looked at; only its beginning, where the drive is too fast for that.
 */
#ifndef LOOK_SUMMARY_H
#define LOOK_SUMMARY_H

#include "look/signal/drive.h"
#include <jansson.h>
#include <stdio.h>

typedef struct {
    double range_v[2], stroke_um[2]; /**< of all samples */
    double looked_at_s;              /**< all that follows is of this time from the beginning on */
    bool whole;                      /**< that is the whole recording */
    drive_kind_t kind;
    double period_s; /**< 0: nothing is repeated */
    size_t periods;
    double line_error_percent, width_percent; /**< of the stroke: beside a straight line; of the loop, 0: not known */
    double noise_um;
    const char *noise_from; /**< "at rest", "between passes", or "between neighbours" */
} summary_t;

/** false: too short, or its keys are wrong (look.h); *failure says which. */
bool summary_make(const recording_t *recording, summary_t *summary, failure_t *failure);

/** "it holds     drive -20 to 120 V, is one sine over and over, 40 periods of 1 s (1 Hz)", and a line of the position.
 */
void summary_print(FILE *file, const summary_t *summary);
json_t *summary_to_json(const summary_t *summary);

#endif
