/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The look: what recordings show before any model is fitted.
 *
 * One look_t a recording. Each part has one file, whose header says what it computes. All of it is
 * read from drive and displacement alone, so that it holds whatever the actuator is. The faults (look/fault.h) are
 * what the looks at all recordings of a question say about the way they were recorded.
 */
#ifndef LOOK_H
#define LOOK_H

#include "look/holds.h"
#include "look/path/changes.h"
#include "look/path/lags.h"
#include "look/path/static_map.h"
#include "look/path/wrong.h"
#include "look/rails.h"
#include "look/response.h"
#include "look/signal/drive.h"
#include "look/signal/noise.h"
#include "look/signal/repetition.h"
#include "look/steps.h"

enum { LOOK_LEAST_SAMPLES = 64 };

typedef struct {
    const recording_t *recording; /**< the caller's */
    drive_look_t drive;
    static_map_t map;
    repetition_t repetition;
    noise_look_t noise;
    response_t response;
    ring_t ring;
    holds_t holds;
    rails_t rails;
    prediction_t prediction; /**< of each reading from its neighbours: what faults are seen in */
    wrong_t wrong;           /**< readings that are wrong by themselves */
    reference_t reference;   /**< what the path of the drive alone makes of it */
    lags_t lags;             /**< behind that, over time */
    changes_t changes;       /**< instants from which on something is different */
} look_t;

/** log10 of the chance below which something is a fault (threshold.false_fault). */
double look_log_chance_limit(void);

/** A look at one recording, which has to outlive it; to be freed. Fails on fewer than LOOK_LEAST_SAMPLES samples, and
 * on a bad header key drive_between_samples. */
bool look_at(const recording_t *recording, look_t *look, failure_t *failure);
void look_free(look_t *look);

/** The same of several, on all processors; to be freed with looks_free. NULL: failed. */
look_t *looks_at(const recording_t *recordings, size_t count, failure_t *failure);
void looks_free(look_t *looks, size_t count);

#endif
