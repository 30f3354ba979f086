/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The way of a drive through recordings, for the operator. */
#ifndef OPERATOR_PATH_H
#define OPERATOR_PATH_H

#include "operator/columns.h"

/** A recording as the operator takes it. */
typedef struct {
    size_t samples;
    const double *level_v; /**< the drive at the hysteresis */
    const double *slack_v; /**< what is hysteretic sees level_v - slack_v; NULL: level_v */
    double *way_v;         /**< turns between samples (turns.h), of what is hysteretic */
    double range_v[2];     /**< that it reaches, with these */
} operator_path_t;

/** Finds its turns and its range. To be freed. */
void operator_path_open(operator_path_t *path, const double *level_v, const double *slack_v, size_t samples);
void operator_path_close(operator_path_t *path);

/** What is hysteretic sees this at sample k. */
double path_moved_v(const operator_path_t *path, size_t k);

/** Goes along paths with the operator, sample by sample. */
typedef struct {
    const operator_path_t *paths;
    size_t count, path, k, at; /**< now: path, sample of it, sample of all paths one after the other */
    bool turns;
    operator_walk_t walk;
} hike_t;

/** turns: also to where the drive turned between samples. */
hike_t hike_begin(const operator_path_t *paths, size_t count, bool turns);
/** To the first sample, or the next one; false behind the last, and when the work is to end (progress.h). */
bool hike_on(hike_t *hike, const operator_t *operator);
/** Whether the drive turned since the sample before. */
bool hike_turned(const hike_t *hike);
/** level_v here. */
double hike_level(const hike_t *hike);

#endif
