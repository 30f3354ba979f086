/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Single readings that are wrong by themselves. Two things have to hold. The prediction from the neighbours misses by
 * more than an exponential tail through the 90 and 98 % quantiles of its errors explains (for normal noise in 10^5
 * samples 9.4 deviations: an exponential tail is heavier). And, beside a straight line through seven, the reading
 * leaves their median by four times what the position moves per sample there, and by twice what the drive does so: a
 * corner of the drive leaves it by two.
 */
#ifndef LOOK_WRONG_H
#define LOOK_WRONG_H

#include "look/path/prediction.h"
#include "look/path/static_map.h"
#include "look/signal/noise.h"

typedef struct {
    size_t count;
    size_t *at;        /**< samples, in order */
    double largest_um; /**< error of the prediction; beside others, no more than the distance from the neighbours */
    double scales;     /**< the smaller of both, in scales of the tail */
    double log_chance; /**< of the one with the least chance, all samples counted */
} wrong_t;

/** Those whose chance is below 10^log_chance_limit; to be freed. */
void wrong_find(const recording_t *recording, const drive_look_t *drive, const static_map_t *map,
                const noise_look_t *noise, const prediction_t *prediction, double log_chance_limit, wrong_t *wrong);
void wrong_free(wrong_t *wrong);

#endif
