/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "chain/fit_ranges.h"
#include <math.h>
#include <stdlib.h>

/* Of a model, which may be none. */
static bool known_range(const model_t *known, const char *key, double range[2]) {
    return known != NULL && model_fit_range(known, key, range);
}

/* Reads LO:HI with LO < HI. */
static bool read_pair(const char *text, double range[2]) {
    char *end;
    range[0] = strtod(text, &end);
    if (end == text || *end != ':') {
        return false;
    }
    text = end + 1;
    range[1] = strtod(text, &end);
    return end != text && *end == '\0' && range[0] < range[1];
}

static void set_covered(json_t *fit, const char *key, const recording_t *recordings, size_t count, column_t column,
                        const model_t *known) {
    double range[2], before[2];
    recordings_range(recordings, count, column, range);
    if (known_range(known, key, before)) {
        range[0] = fmin(range[0], before[0]);
        range[1] = fmax(range[1], before[1]);
    }
    json_object_set_new(fit, key, json_pack("[f, f]", range[0], range[1]));
}

static void set_converter(json_t *fit, const char *key, const recording_t *recordings, size_t count,
                          const model_t *known) {
    double range[2], other[2];
    bool have = false;
    for (size_t i = 0; i < count; i++) {
        const char *text = recording_key(&recordings[i], key);
        if (text == NULL || !read_pair(text, other)) {
            continue;
        }
        if (have && (range[0] != other[0] || range[1] != other[1])) {
            return;
        }
        range[0] = other[0];
        range[1] = other[1];
        have = true;
    }
    if (have || known_range(known, key, range)) {
        json_object_set_new(fit, key, json_pack("[f, f]", range[0], range[1]));
    }
}

void fit_ranges_set(json_t *fit, const recording_t *recordings, size_t count, const model_t *known) {
    set_covered(fit, "drive_range_v", recordings, count, COLUMN_DRIVE, known);
    set_covered(fit, "displacement_range_um", recordings, count, COLUMN_DISPLACEMENT, known);
    set_converter(fit, DRIVE_CONVERTER_KEY, recordings, count, known);
    set_converter(fit, POSITION_CONVERTER_KEY, recordings, count, known);
}
