/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/rails.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_fit.h>
#include <gsl/gsl_math.h>
#include <math.h>

/* Levels a range, and how many of them are looked at from either end. */
enum { LEVELS = 64, LOOKED_AT = LEVELS / 2 };
/* The way into an excursion is so much of the range. */
enum { WAY = 16 };
/* Samples that an excursion needs, and all of a level. */
enum { LEAST_RUN = 8, LEAST_SAMPLES = 40 };

/* Sums of excursions, each less its own mean. */
typedef struct {
    double drive, position;
    size_t samples;
} spread_t;

static void add_run(const double *drive, const double *position, size_t samples, spread_t *spread) {
    double mean[2] = {0.0, 0.0};
    for (size_t k = 0; k < samples; k++) {
        mean[0] += drive[k] / (double)samples;
        mean[1] += position[k] / (double)samples;
    }
    for (size_t k = 0; k < samples; k++) {
        spread->drive += gsl_pow_2(drive[k] - mean[0]);
        spread->position += gsl_pow_2(position[k] - mean[1]);
    }
    spread->samples += samples;
}

/* An excursion: samples beyond a level, upwards for end = 1, downwards for -1. */
typedef struct {
    const double *drive, *position;
    double end, level_v;
    size_t first, samples;
} excursion_t;

static excursion_t before_all(const recording_t *recording, double end, double level_v) {
    return (excursion_t){recording->column[COLUMN_DRIVE], recording->column[COLUMN_DISPLACEMENT], end, level_v, 0, 0};
}

static bool is_beyond(const excursion_t *e, size_t sample) {
    return e->end * (e->drive[sample] - e->level_v) > 0.0;
}

/* Goes on to the next one of LEAST_RUN samples or more. */
static bool next_excursion(const recording_t *recording, excursion_t *e) {
    size_t k = e->first + e->samples;
    do {
        while (k < recording->samples && !is_beyond(e, k)) {
            k++;
        }
        e->first = k;
        while (k < recording->samples && is_beyond(e, k)) {
            k++;
        }
        e->samples = k - e->first;
    } while (e->samples > 0 && e->samples < LEAST_RUN);
    return e->samples > 0;
}

static spread_t spread_beyond(const recording_t *recording, double end, double level_v) {
    spread_t spread = {0};
    excursion_t e = before_all(recording, end, level_v);
    while (next_excursion(recording, &e)) {
        add_run(e.drive + e.first, e.position + e.first, e.samples, &spread);
    }
    return spread;
}

/* Samples of the way into an excursion, without turning round. */
static size_t way_into(const excursion_t *e, double way_v) {
    size_t way = 0;
    while (way < e->first) {
        const size_t k = e->first - way - 1;
        if (!(e->end * (e->drive[k + 1] - e->drive[k]) > 0.0 && e->end * (e->level_v - e->drive[k]) < way_v)) {
            break;
        }
        way++;
    }
    return way;
}

/* Its farthest drive, and the mean position of its outer half. */
static void stop_of(const excursion_t *e, double *farthest_v, double *stop_um) {
    double sum = 0.0;
    size_t outer = 0;
    *farthest_v = e->level_v;
    for (size_t k = e->first; k < e->first + e->samples; k++) {
        *farthest_v = e->end * (e->drive[k] - *farthest_v) > 0.0 ? e->drive[k] : *farthest_v;
    }
    for (size_t k = e->first; k < e->first + e->samples; k++) {
        if (e->end * (e->drive[k] - 0.5 * (e->level_v + *farthest_v)) > 0.0) {
            sum += e->position[k];
            outer++;
        }
    }
    *stop_um = sum / (double)outer; /* the farthest one is in it */
}

/* Where the line of the way into it meets the position at which it stops. false: the way is too short. */
static bool meets(const excursion_t *e, double way_v, double *rail_v) {
    const size_t way = way_into(e, way_v), from = e->first - way;
    double farthest_v, stop_um, slope, offset, ignored;
    if (way < LEAST_RUN) {
        return false;
    }
    stop_of(e, &farthest_v, &stop_um);
    gsl_fit_linear(e->drive + from, 1, e->position + from, 1, way, &offset, &slope, &ignored, &ignored, &ignored,
                   &ignored);
    *rail_v = (stop_um - offset) / slope;
    return e->end * (*rail_v - e->level_v) > -way_v && e->end * (farthest_v - *rail_v) > 0.0;
}

/* The mean of all excursions; the level where none tells. */
static double sharpened(const recording_t *recording, double end, double level_v, double way_v) {
    double sum_v = 0.0, here_v;
    size_t met = 0;
    excursion_t e = before_all(recording, end, level_v);
    while (next_excursion(recording, &e)) {
        if (meets(&e, way_v, &here_v)) {
            sum_v += here_v;
            met++;
        }
    }
    return met > 0 ? sum_v / (double)met : level_v;
}

static bool find_rail(const recording_t *recording, const double range_v[2], double gain_um_per_v, double noise_um,
                      double end, double *rail_v) {
    const double all_v = range_v[1] - range_v[0];
    bool found = false;
    for (int i = 1; i <= LOOKED_AT; i++) {
        const double level_v = (end > 0.0 ? range_v[1] : range_v[0]) - end * all_v * i / LEVELS;
        const spread_t spread = spread_beyond(recording, end, level_v);
        const double samples = (double)spread.samples, line = gsl_pow_2(gain_um_per_v) * spread.drive;
        const double moved = fmax(0.0, spread.position - samples * gsl_pow_2(noise_um));
        if (spread.samples >= LEAST_SAMPLES && line > samples * gsl_pow_2(threshold.rail_seen * noise_um) &&
            moved < gsl_pow_2(threshold.rail_stops) * line) {
            *rail_v = level_v;
            found = true;
        }
    }
    *rail_v = found ? sharpened(recording, end, *rail_v, all_v / WAY) : 0.0;
    return found;
}

/* The gain of a straight line through all of it, if that is below the given one of the ranges. Where a mode swings, the
 * stroke is many times what the drive moves elsewhere. Beside that any motion is a stop. */
static double gain_of_line(const recording_t *recording, double gain_of_ranges) {
    double offset, slope, ignored;
    gsl_fit_linear(recording->column[COLUMN_DRIVE], 1, recording->column[COLUMN_DISPLACEMENT], 1, recording->samples,
                   &offset, &slope, &ignored, &ignored, &ignored, &ignored);
    return fmin(gain_of_ranges, fabs(slope));
}

void rails_look(const recording_t *recording, double noise_um, rails_t *rails) {
    double range_v[2], stroke_um[2];
    values_range(recording->column[COLUMN_DRIVE], recording->samples, range_v);
    values_range(recording->column[COLUMN_DISPLACEMENT], recording->samples, stroke_um);
    *rails = (rails_t){0};
    if (range_v[1] > range_v[0]) {
        const double gain_um_per_v = gain_of_line(recording, (stroke_um[1] - stroke_um[0]) / (range_v[1] - range_v[0]));
        rails->low = find_rail(recording, range_v, gain_um_per_v, noise_um, -1.0, &rails->low_v);
        rails->high = find_rail(recording, range_v, gain_um_per_v, noise_um, 1.0, &rails->high_v);
    }
}
