/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The numbers of a picture, in the page beside it: what the script of a page (plot.js) reads out under the pointer,
 * draws when one zooms in, and gives to copy.
 *
 *     <script type="application/json" class="data">
 *     {"title":, "x":, "y":, "frame": [left, top, right, bottom], "range": [x low, x high, y low, y high],
 *      "log": [0 | 1, 0 | 1], "lines": [{"name":, "class":, "of": samples, "x": [..], "y": [..]}]}
 *
 * range is in logarithms to the base 10 on a logarithmic axis. A line without "x" has the x of the one before. Of a
 * line with more than PLOT_DATA_POINTS samples each stretch is represented by its first, lowest, highest and last one.
 */
#ifndef PLOT_DATA_H
#define PLOT_DATA_H

#include "page/plot.h"
#include <stdio.h>

/* Two screens of pixels across: a page with six pictures of three lines stays below a megabyte. */
enum { PLOT_DATA_POINTS = 2400 };

typedef struct {
    double corner[4]; /**< left, top, right, bottom, in units of the picture */
    double range[4];  /**< of x and y */
    int logarithmic[2];
} plot_frame_t;

void plot_data_write(FILE *file, const plot_t *plot, const plot_frame_t *frame);

#endif
