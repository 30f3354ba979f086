/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Columns that together imitate a rate-independent hysteresis of any shape, one value a sample: what the reference is a
 * fit of. Groups, x being the drive from -1 to 1:
 *
 * - a constant, a straight line in time, and the logarithm of time;
 * - the curvature of the drive; the slope of the fit, without a lag, is the reference's to fill in;
 * - Chebyshev polynomials of x, degree 1 to 7;
 * - 24 plays with thresholds over half of the range;
 * - the past: exp(-way / L), and hats over the highest and the lowest x so far. What the drive did before the recording
 *   began is in every hysteresis until the drive has been there again; so nothing has to be left out for it;
 * - leaks z' = x' - |x'| z / L, what forgets its path by the way it goes;
 * - bends: Chebyshev polynomials of the plays, degree 2 to 5, smooth over their thresholds;
 * - products of leaks with each other and with x.
 *
 * These are the groups of the universal operator (operator/columns.h), coarser: all weights are free here, and there
 * are few enough for that. Without them what is left of some hysteresis was 40 times the noise, and looked like a lag.
 * The drive between samples is a cubic, in four steps, unless the drive is held.
 */
#ifndef LOOK_REFERENCE_COLUMNS_H
#define LOOK_REFERENCE_COLUMNS_H

#include "look/signal/drive.h"

enum {
    REFERENCE_TRENDS = 2,
    REFERENCE_POWERS = 7,
    REFERENCE_PLAYS = 24,
    REFERENCE_LENGTHS = 4, /**< of the past */
    REFERENCE_EXTREMES = 6,
    REFERENCE_LEAKS = 8,
    REFERENCE_DEGREES = 4,
    REFERENCE_NODES = 6,
    REFERENCE_MULTIPLIED = 4,
    REFERENCE_PRODUCTS = 4
};

/** Where the groups begin. */
enum {
    REFERENCE_BY_TREND = 1,
    REFERENCE_BY_CURVATURE = REFERENCE_BY_TREND + REFERENCE_TRENDS,
    REFERENCE_BY_LAG,
    REFERENCE_BY_POWER,
    REFERENCE_BY_PLAY = REFERENCE_BY_POWER + REFERENCE_POWERS,
    REFERENCE_BY_PAST = REFERENCE_BY_PLAY + REFERENCE_PLAYS,
    REFERENCE_BY_LEAK = REFERENCE_BY_PAST + REFERENCE_LENGTHS + 2 * REFERENCE_EXTREMES,
    REFERENCE_BY_BEND = REFERENCE_BY_LEAK + REFERENCE_LEAKS,
    REFERENCE_BY_PRODUCT = REFERENCE_BY_BEND + REFERENCE_DEGREES * REFERENCE_NODES,
    REFERENCE_COLUMNS = REFERENCE_BY_PRODUCT + REFERENCE_MULTIPLIED * REFERENCE_PRODUCTS
};

/** How many of them a recording of so many samples has: all, or, in a recording so long that they would not fit into
 * memory, those before the leaks. */
size_t reference_columns_of(size_t samples);

/** The columns, `samples` values each, one after the other; that of the lag is 0. shift: whole samples by which the
 * drive is moved (it is later for more than 0). columns: 0 before. */
void reference_columns_fill(const double *u, size_t samples, const drive_look_t *drive, long shift, double *columns);

#endif
