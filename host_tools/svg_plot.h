/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Line plots as SVG: inside a self-contained HTML page, or as a picture of their own.
 *
 * Colours and fonts come from plot_style through class names, so that one picture serves light, dark and paper. It
 * scales with its container and is drawn for about 460 pixels of width.
 */
#ifndef SVG_PLOT_H
#define SVG_PLOT_H

#include <math.h>
#include <stddef.h>
#include <stdio.h>

/**
 * Style sheet of the pictures, to be put into the page once. Defines the colours --paper, --ink, --soft, --grid,
 * --shade, --before, --after, --other and --plain for light, dark and print, and the classes of lines: before, after,
 * other (dashed), plain.
 */
extern const char plot_style[];

typedef struct {
    const char *class_name; /**< "before", "after", "other" or "plain", " under" for a broad line that others run upon,
                               and " dashed" */
    const char *label;      /**< for the legend */
    const double *x, *y;    /**< count values each, finite */
    size_t count;
} plot_line_t;

typedef struct {
    const char *title; /**< also what a screen reader says */
    const char *x_label, *y_label;
    const plot_line_t *line; /**< drawn in this order: the last one is on top */
    size_t lines;
    double shade_from; /**< x from which the background is shaded, or PLOT_NO_SHADE */
} plot_t;

#define PLOT_NO_SHADE ((double)NAN)

/**
 * Writes one <figure>. Axes include all points; a plot without extent in one direction gets a small one. Points closer
 * than the picture can show are left out, extremes are not. Write errors show in ferror(file).
 */
void plot_write(FILE *file, const plot_t *plot);

/** The same with both axes logarithmic. All points are positive. */
void plot_write_logarithmic(FILE *file, const plot_t *plot);

/** Writes an SVG document with the plots in rows of `columns`, titles above. One legend stands at the top if it is that
 * of all plots, else each plot has its own. */
void plot_write_sheet(FILE *file, const plot_t *plot, size_t plots, size_t columns);

/** Writes text with the characters that HTML reserves replaced. */
void write_escaped(FILE *file, const char *text);

#endif
