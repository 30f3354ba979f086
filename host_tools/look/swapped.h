/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Whether drive and displacement of a recording look exchanged. */
#ifndef LOOK_SWAPPED_H
#define LOOK_SWAPPED_H

#include "look/path/prediction.h"
#include "look/path/static_map.h"

typedef struct {
    bool suspected;    /**< all that follows holds, and by chance less often than threshold.false_fault */
    double levels;     /**< of the drive, at which both branches are seen */
    double turned;     /**< at how many of these the loop turns the wrong way, less those at which it turns the right */
    double noise_v;    /**< of what is called the drive */
    double log_chance; /**< log10, of so many by chance */
} swapped_t;

/** The recording with drive and displacement exchanged; its memory is the recording's. */
recording_t swapped_turned(const recording_t *recording);

/** A command is exact and leads, a reading has noise and lags: looks whether it is the other way round. */
void swapped_look(const recording_t *recording, const drive_look_t *drive, const static_map_t *map,
                  const prediction_t *prediction, swapped_t *swapped);

/** The same of a recording that was not looked at; nothing else of a look is made. false: too short to tell, too. */
bool swapped_suspected(const recording_t *recording);

#endif
