/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Line plots as SVG: inside a self-contained HTML page, or as a separate picture.
 *
 * Colours and fonts come from plot_style through class names, so that one picture serves light, dark and paper. It
 * scales with its container and is drawn for about 460 pixels of width.
 */
#ifndef SVG_PLOT_H
#define SVG_PLOT_H

#include "page/plot.h"
#include <stdio.h>

/**
 * Style sheet of the pictures, to be put into the page once. Defines the colours --paper, --ink, --soft, --grid,
 * --shade, --before, --after, --other and --plain for light, dark and print, and the classes of lines: before, after,
 * other (dashed), plain.
 */
extern const char plot_style[];

/**
 * Writes one <figure>. Axes include all points; a plot without extent in one direction gets a small one. Points closer
 * than the resolution of the picture are omitted, except extremes; a trace denser than the pixels is drawn as the band
 * that it covers (plot_band.h). The data follow the picture, for the script of a page (plot_data.h). Write errors show
 * in ferror(file).
 */
void plot_write(FILE *file, const plot_t *plot);

/** The same with both axes logarithmic. All points are positive. */
void plot_write_logarithmic(FILE *file, const plot_t *plot);

/** The same with only the x axis logarithmic: a phase over frequency. All x are positive. */
void plot_write_over_frequency(FILE *file, const plot_t *plot);

/** Writes an SVG document, without data or script, with the plots in rows of `most_columns`, or of all where there are
 * fewer, titles above. Plots with the same legend share one at the top, else each plot has one. */
void plot_write_sheet(FILE *file, const plot_t *plot, size_t plots, size_t most_columns);

/** Writes text with the reserved characters of HTML escaped. */
void write_escaped(FILE *file, const char *text);

#endif
