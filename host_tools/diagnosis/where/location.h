/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A place in the recordings: what locate.h finds, and its parts work with. */
#ifndef LOCATION_H
#define LOCATION_H

#include "recording/recording.h"

enum { LOCATION_MOST_RANGES = 6, LOCATION_MOST_HARMONICS = 8 };

typedef struct {
    double from, to;
} range_t;

typedef struct {
    size_t count; /**< in rising order; gaps that would make more of them are bridged, the smallest first */
    range_t range[LOCATION_MOST_RANGES];
    bool whole; /**< one range that is all that was looked at, or nearly: it says nothing */
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

/** Notes whether the ranges are all from low to high, to within a cell of a drive or of time (a twenty-fourth). */
void ranges_note_whole(ranges_t *ranges, double low, double high);

/** "turning points", "mid branch", "everywhere", "holds". */
const char *loop_part_name(loop_part_t part);

#endif
