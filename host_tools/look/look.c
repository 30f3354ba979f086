/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/look.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "look/path/changes_find.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

double look_log_chance_limit(void) {
    return log10(threshold.false_fault);
}

/* Independent parts of one look: each writes to its own place. */
static void look_part(void *context, size_t index) {
    look_t *look = context;
    switch (index) {
    case 0:
        static_map_look(look->recording, &look->drive, &look->map);
        break;
    case 1:
        repetition_look(look->recording, &look->drive, &look->repetition);
        noise_look(look->recording, &look->drive, &look->repetition, &look->noise);
        break;
    case 2:
        response_look(look->recording, &look->drive, &look->response);
        break;
    case 3:
        ring_look(look->recording, &look->drive, &look->ring);
        break;
    case 4:
        holds_look(look->recording, &look->drive, &look->holds);
        break;
    case 5:
        prediction_make(look->recording, &look->drive, &look->prediction);
        break;
    default:
        break;
    }
}

/* What needs the others. */
static void look_again(look_t *look) {
    const recording_t *recording = look->recording;
    wrong_find(recording, &look->drive, &look->map, &look->noise, &look->prediction, look_log_chance_limit(),
               &look->wrong);
    reference_make(recording, &look->drive, &look->repetition, &look->reference);
    lags_make(recording, &look->drive, &look->reference, &look->lags);
    const double noise_um = fmax(look->prediction.noise_um, noise_known_um(&look->noise));
    rails_look(recording, noise_um, &look->rails);
    changes_find(recording, &look->drive, &look->reference, &look->prediction, noise_um, &look->wrong,
                 look_log_chance_limit(), &look->changes);
    reference_columns_free(&look->reference);
}

bool look_at(const recording_t *recording, look_t *look, failure_t *failure) {
    enum { PARTS = 6 };
    memset(look, 0, sizeof *look);
    look->recording = recording;
    if (recording->samples < LOOK_LEAST_SAMPLES) {
        return fail(failure, "%s: %zu samples are too few to look at; %d are needed", recording->name,
                    recording->samples, LOOK_LEAST_SAMPLES);
    }
    if (!drive_look(recording, &look->drive, failure)) {
        return false;
    }
    parallel(PARTS, look_part, look);
    if (!progress_go_on(failure)) {
        look_free(look);
        return false;
    }
    look_again(look);
    return true;
}

void look_free(look_t *look) {
    drive_look_free(&look->drive);
    repetition_free(&look->repetition);
    response_free(&look->response);
    holds_free(&look->holds);
    prediction_free(&look->prediction);
    wrong_free(&look->wrong);
    reference_free(&look->reference);
    lags_free(&look->lags);
    memset(look, 0, sizeof *look);
}

look_t *looks_at(const recording_t *recordings, size_t count, failure_t *failure) {
    look_t *looks = allocate(count, sizeof *looks);
    for (size_t i = 0; i < count; i++) {
        if (!look_at(&recordings[i], &looks[i], failure)) {
            looks_free(looks, i);
            return NULL;
        }
    }
    return looks;
}

void looks_free(look_t *looks, size_t count) {
    for (size_t i = 0; i < count; i++) {
        look_free(&looks[i]);
    }
    free(looks);
}
