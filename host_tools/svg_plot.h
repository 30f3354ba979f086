/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Line plots as inline SVG, for a self-contained HTML page.
 *
 * Colours and fonts come from the page's style sheet through class names (plot, axis, grid, shade, and each line's
 * own), so that one picture serves light, dark and paper. The picture scales with its container; it is drawn for about
 * 460 pixels of width.
 */
#ifndef SVG_PLOT_H
#define SVG_PLOT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

typedef struct {
    const char *class_name; /**< of the style sheet */
    const char *label;      /**< for the legend */
    const double *x, *y;    /**< count values each, finite */
    size_t count;
} plot_line_t;

typedef struct {
    const char *title; /**< also what a screen reader says */
    const char *x_label, *y_label;
    const plot_line_t *line; /**< drawn in this order: the last one is on top */
    size_t lines;
    double shade_from; /**< x from which the background is shaded; NAN for none */
} plot_t;

/**
 * Writes one <figure>. Axes include all points; a plot without extent in one direction gets a small one. Points closer
 * than the picture can show are left out, extremes are not. Write errors show in ferror(file).
 */
void plot_write(FILE *file, const plot_t *plot);

/** Writes text with the characters that HTML reserves replaced. */
void write_escaped(FILE *file, const char *text);

#endif
