/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/path.h"
#include "base/failure.h"
#include "base/progress.h"
#include "operator/turns.h"
#include "recording/recording.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

void operator_path_open(operator_path_t *path, const double *level_v, const double *slack_v, size_t samples) {
    *path = (operator_path_t){.samples = samples, .level_v = level_v, .slack_v = slack_v};
    path->way_v = allocate(samples, sizeof(double));
    double *moved = allocate(samples, sizeof(double));
    for (size_t k = 0; k < samples; k++) {
        moved[k] = level_v[k] - (slack_v != NULL ? slack_v[k] : 0.0);
    }
    turns_find(moved, samples, path->way_v);
    values_range(moved, samples, path->range_v);
    for (size_t k = 0; k < samples; k++) {
        path->range_v[0] = fmin(path->range_v[0], path->way_v[k]); /* fmin, fmax: not of NAN */
        path->range_v[1] = fmax(path->range_v[1], path->way_v[k]);
    }
    free(moved);
}

void operator_path_close(operator_path_t *path) {
    free(path->way_v);
    path->way_v = NULL;
}

double path_moved_v(const operator_path_t *path, size_t k) {
    return path->level_v[k] - (path->slack_v != NULL ? path->slack_v[k] : 0.0);
}

hike_t hike_begin(const operator_path_t *paths, size_t count, bool turns) {
    return (hike_t){.paths = paths, .count = count, .path = SIZE_MAX, .turns = turns};
}

/* To the next sample; false behind the last one. */
bool hike_on(hike_t *hike, const operator_t *operator) {
    if (progress_cancelled()) {
        return false;
    }
    if (hike->path == SIZE_MAX || hike->k + 1 == hike->paths[hike->path].samples) {
        if (++hike->path == hike->count) {
            return false;
        }
        const operator_path_t *path = &hike->paths[hike->path];
        hike->at += hike->path > 0 ? 1 : 0;
        hike->k = 0;
        operator_begin(&hike->walk, operator, hike->path, path_moved_v(path, 0), path->range_v);
        return true;
    }
    const operator_path_t *path = &hike->paths[hike->path];
    hike->k++;
    hike->at++;
    if (hike_turned(hike)) {
        operator_move(&hike->walk, path->way_v[hike->k]);
    }
    operator_move(&hike->walk, path_moved_v(path, hike->k));
    return true;
}

bool hike_turned(const hike_t *hike) {
    return hike->turns && !isnan(hike->paths[hike->path].way_v[hike->k]);
}

double hike_level(const hike_t *hike) {
    return hike->paths[hike->path].level_v[hike->k];
}
