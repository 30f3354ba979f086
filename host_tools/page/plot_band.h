/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A trace that is denser than the pixels, as the band that it covers.
 *
 * A trace goes up and down within one column of pixels where there is noise, or an oscillation, faster than the picture
 * can show. Its line is then a scribble that hides every other line. What can be read from it is its lowest and its
 * highest point in each column: the band.
 *
 * A trace over time is dense when it passes the height of most columns at least four times. Any other is dense when its
 * line hardly leaves a gap. Whether a band says the same is for the caller to know: an error over the drive is a
 * spread, but a loop has two branches, and stays a line.
 */
#ifndef PLOT_BAND_H
#define PLOT_BAND_H

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    size_t columns;
    double *at, *top, *bottom; /**< x of each column that has points, its least and its largest y */
} plot_band_t;

/** x, y: points in units of the picture, about a pixel each, within frame: left, top, right, bottom. spread: a band
 * says the same also where x does not rise all the way. true where the trace is dense; *band is then to be freed. */
bool plot_band(const double *x, const double *y, size_t count, const double frame[4], bool spread, plot_band_t *band);
void plot_band_free(plot_band_t *band);

#endif
