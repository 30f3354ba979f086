/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A picture of curves, before it is drawn. */
#ifndef PLOT_H
#define PLOT_H

#include <math.h>
#include <stddef.h>

typedef struct {
    const char *class_name; /**< "before", "after", "other" or "plain", " under" for a broad line below the others,
                               " dashed" or " dotted", " spread" for one whose band over x says as much as its line */
    const char *label;      /**< for the legend */
    const double *x, *y;    /**< count values each, finite */
    size_t count;
} plot_line_t;

typedef struct {
    const char *title; /**< also the text for screen readers */
    const char *x_label, *y_label;
    const plot_line_t *line; /**< drawn in this order: the last one is on top */
    size_t lines;
    double shade_from; /**< x from which the background is shaded, or PLOT_NO_SHADE */
} plot_t;

#define PLOT_NO_SHADE ((double)NAN)

#endif
