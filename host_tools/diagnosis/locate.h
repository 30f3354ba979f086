/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Where an effect acts: at which times, frequencies, drive levels and drive rates, and in which part of the loop.
 *
 * It is read from a difference of two simulations, with and without the effect, or from what remains of a measured
 * displacement. Ranges are the fewest that hold 80 % of what there is: of its energy, for time and frequency; of its
 * mean square at each level, for the drive and its rate (drive_rate.h), because a drive does not stay equally long
 * everywhere. What takes more than half of the time, of the drive's range or of its rates has no place there: then the
 * range is all of it.
 */
#ifndef LOCATE_H
#define LOCATE_H

#include "recording.h"

enum { LOCATION_MOST_RANGES = 6, LOCATION_MOST_HARMONICS = 8 };

typedef struct {
    double from, to;
} range_t;

typedef struct {
    size_t count; /**< in rising order; gaps that would make more of them are bridged, the smallest first */
    range_t range[LOCATION_MOST_RANGES];
} ranges_t;

/**
 * The part of the loop whose mean square is more than twice that of every other one. Turning points: the first and last
 * 15 % of the way from one reversal of the drive to the next (ways below 1 % of its range do not count). Holds: the
 * drive stays within 0.002 % of its range (a step of 16 bits), for at least 20 samples and a twentieth of the mean time
 * between reversals.
 */
typedef enum { LOOP_EVERYWHERE, LOOP_TURNING_POINTS, LOOP_MID_BRANCH, LOOP_HOLDS } loop_part_t;

typedef struct {
    bool somewhere;   /**< false: there is nothing above the floor, and the rest is empty */
    size_t recording; /**< the one with most of it per sample, which time_s and the harmonics are of */
    ranges_t time_s, frequency_hz, drive_v;
    ranges_t drive_rate_v_per_s; /**< 0 to 0: where the drive rests */
    double fundamental_hz;       /**< of that recording's drive, 0 if it does not repeat itself */
    size_t harmonics;
    unsigned
        harmonic[LOCATION_MOST_HARMONICS]; /**< of the first 40, those with at least 5 % of the energy of what varies */
    loop_part_t loop;
} location_t;

/**
 * difference[i][k] is in um, k from from[i] to the end of recording i. Of a residual, floor_um is the deviation of the
 * noise in it, and the part that white noise of this deviation would have is taken out first; 0 for simulations.
 */
void locate(const recording_t *recordings, size_t count, double *const *difference, const size_t *from, double floor_um,
            location_t *location);

/** "turning points", "mid branch", "everywhere", "holds". */
const char *loop_part_name(loop_part_t part);

#endif
