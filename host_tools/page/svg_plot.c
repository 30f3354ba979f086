/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "page/svg_plot.h"
#include "base/failure.h"
#include "page/plot_band.h"
#include "page/plot_data.h"
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* Sizes in user units of the picture; one is about a pixel. */
#define WIDTH     460.0
#define HEIGHT    320.0
#define LEFT      66.0
#define RIGHT     12.0
#define TOP       14.0
#define BOTTOM    44.0
#define MAX_TICKS 6.0
#define LETTER    7.2 /* approximate width of a letter of a label */
#define LABEL                                                                                                          \
    13.0 /* from the left edge to the baseline of the vertical label; leaves room for a tick label of -0.005 */

/* Before is orange, after is blue, a third line is dashed: distinguishable without colour vision, too. */
const char plot_style[] =
    ":root{color-scheme:light dark;--paper:#fff;--ink:#1c2330;--soft:#5b6472;--grid:#e3e6eb;--shade:#f1f3f6;"
    "--before:#c2540a;--after:#1260b8;--other:#7c3aa8;--plain:#3c4657}\n"
    "@media(prefers-color-scheme:dark){:root{--paper:#14181f;--ink:#e6e9ee;--soft:#a0a8b5;--grid:#2c333e;"
    "--shade:#1d232c;--before:#f0944d;--after:#6cb0ff;--other:#cf9bf2;--plain:#c3cad5}}\n"
    "@media print{:root{color-scheme:light;--paper:#fff;--ink:#000;--soft:#444;--grid:#ddd;--shade:#f1f3f6;"
    "--before:#c2540a;--after:#1260b8;--other:#7c3aa8;--plain:#333}}\n"
    ".plot text{font:13px system-ui,sans-serif;fill:var(--soft)}.plot .title{font-weight:600;fill:var(--ink)}"
    ".tick,.label{text-anchor:middle}.tick.level{text-anchor:end}\n"
    ".paper{fill:var(--paper)}.grid{stroke:var(--grid);stroke-width:1}.axis{fill:none;stroke:var(--soft);stroke-width:"
    "1}"
    ".shade{fill:var(--shade)}\n"
    "polyline{stroke-linejoin:round}.before,.after,.other,.plain{fill:none;stroke-width:1.6}"
    ".before{stroke:var(--before)}.after{stroke:var(--after)}.other{stroke:var(--other);stroke-dasharray:6 "
    "3}.plain{stroke:var(--plain);stroke-width:1}"
    ".under{stroke-width:4;opacity:.6}.dashed{stroke-dasharray:7 4}.dotted{stroke-dasharray:1.5 3}\n"
    ".minor{stroke:var(--soft);stroke-width:.7}"
    ".band{stroke-width:.5;stroke-dasharray:none;fill-opacity:.8}.band.under{stroke-width:.5;fill-opacity:.4}"
    ".band.before{fill:var(--before)}.band.after{fill:var(--after)}.band.other{fill:var(--other)}"
    ".band.plain{fill:var(--plain)}\n";

typedef struct {
    double low, high, step; /* step between ticks; base-10 logarithms on a logarithmic axis */
    bool logarithmic;
    bool exponents; /* all tick labels are written as powers of ten */
} axis_t;

/* The smallest of 1, 2, 5 times a power of ten that is at least `least`. */
static double round_step(double least) {
    const double power = pow(10.0, floor(log10(least)));
    if (least <= power) {
        return power;
    }
    if (least <= 2.0 * power) {
        return 2.0 * power;
    }
    return least <= 5.0 * power ? 5.0 * power : 10.0 * power;
}

static axis_t axis_over(double low, double high, double margin) {
    axis_t axis = {.low = low, .high = high};
    if (!(high > low)) {
        const double around = fmax(1e-3 * fabs(low), 1e-9);
        axis.low = low - around;
        axis.high = low + around;
    }
    const double widen = margin * (axis.high - axis.low);
    axis.low -= widen;
    axis.high += widen;
    axis.step = round_step((axis.high - axis.low) / MAX_TICKS);
    return axis;
}

/* Ticks at powers of ten, at least one. */
static axis_t logarithmic_axis_over(double low, double high, double margin) {
    axis_t axis = axis_over(low, high, margin);
    axis.step = fmax(1.0, ceil((axis.high - axis.low) / MAX_TICKS));
    if (ceil(axis.low) > axis.high) {
        axis.low = floor(axis.low);
    }
    axis.logarithmic = true;
    const double first = ceil(axis.low / axis.step) * axis.step, last = floor(axis.high / axis.step) * axis.step;
    axis.exponents = first < -2.5 || last > 4.5; /* plain numbers would be too long */
    return axis;
}

static double on_axis(const axis_t *axis, double value) {
    return axis->logarithmic ? log10(value) : value;
}

static double to_x(const axis_t *axis, double x) {
    return LEFT + (on_axis(axis, x) - axis->low) / (axis->high - axis->low) * (WIDTH - LEFT - RIGHT);
}

static double to_y(const axis_t *axis, double y) {
    return HEIGHT - BOTTOM - (on_axis(axis, y) - axis->low) / (axis->high - axis->low) * (HEIGHT - TOP - BOTTOM);
}

static axis_t choose_axis(bool logarithmic, double low, double high, double margin) {
    return (logarithmic ? logarithmic_axis_over : axis_over)(low, high, margin);
}

/* Value and text of a tick, with as many decimals as distinguish neighbours. */
static double tick_at(const axis_t *axis, long index, char *text, size_t size) {
    const double tick = (double)index * axis->step;
    const int decimals = (int)-floor(log10(axis->step) + 1e-9);
    if (axis->logarithmic) {
        if (axis->exponents) {
            snprintf(text, size, "1e%.0f", tick);
        } else {
            snprintf(text, size, "%g", pow(10.0, tick));
        }
        return pow(10.0, tick);
    }
    snprintf(text, size, "%.*f", decimals > 0 ? decimals : 0, tick);
    return tick;
}

/*
 * Between the decades of a logarithmic axis: short ticks at 2 to 9 times a power of ten. Where the axis has fewer than
 * two decades, 2 and 5 have their number, too, since one number alone does not show a scale. Of too many decades for a
 * tick each there are none.
 */
static void write_minor_ticks(FILE *file, const axis_t *axis, bool horizontal) {
    if (!axis->logarithmic || axis->step > 1.0) {
        return;
    }
    const bool labelled = axis->high - axis->low < 2.0;
    for (long decade = lround(floor(axis->low)); (double)decade <= axis->high; decade++) {
        for (int times = 2; times <= 9; times++) {
            const double value = times * pow(10.0, (double)decade);
            if (log10(value) < axis->low || log10(value) > axis->high) {
                continue;
            }
            char text[32] = "";
            if (labelled && (times == 2 || times == 5)) {
                if (axis->exponents) {
                    snprintf(text, sizeof text, "%de%ld", times, decade);
                } else {
                    snprintf(text, sizeof text, "%g", value);
                }
            }
            if (horizontal) {
                const double at = to_x(axis, value);
                fprintf(file, "<path class=\"minor\" d=\"M%.1f %.1fv4\"/>", at, HEIGHT - BOTTOM);
                if (text[0] != '\0') {
                    fprintf(file, "<text class=\"tick\" x=\"%.1f\" y=\"%.1f\">%s</text>", at, HEIGHT - BOTTOM + 16.0,
                            text);
                }
            } else {
                const double at = to_y(axis, value);
                fprintf(file, "<path class=\"minor\" d=\"M%.1f %.1fh-4\"/>", LEFT, at);
                if (text[0] != '\0') {
                    fprintf(file, "<text class=\"tick level\" x=\"%.1f\" y=\"%.1f\">%s</text>", LEFT - 6.0, at + 4.0,
                            text);
                }
            }
        }
    }
}

static void write_axes(FILE *file, const axis_t *x, const axis_t *y) {
    char text[32];
    write_minor_ticks(file, x, true);
    write_minor_ticks(file, y, false);
    for (long i = lround(ceil(x->low / x->step)); (double)i * x->step <= x->high; i++) {
        const double at = to_x(x, tick_at(x, i, text, sizeof text));
        fprintf(file,
                "<path class=\"grid\" d=\"M%.1f %.1fV%.1f\"/><text class=\"tick\" x=\"%.1f\" y=\"%.1f\">%s</text>\n",
                at, TOP, HEIGHT - BOTTOM, at, HEIGHT - BOTTOM + 16.0, text);
    }
    for (long i = lround(ceil(y->low / y->step)); (double)i * y->step <= y->high; i++) {
        const double at = to_y(y, tick_at(y, i, text, sizeof text));
        fprintf(file,
                "<path class=\"grid\" d=\"M%.1f %.1fH%.1f\"/><text class=\"tick level\" x=\"%.1f\" "
                "y=\"%.1f\">%s</text>\n",
                LEFT, at, WIDTH - RIGHT, LEFT - 6.0, at + 4.0, text);
    }
    fprintf(file, "<path class=\"axis\" d=\"M%.1f %.1fV%.1fH%.1f\"/>\n", LEFT, TOP, HEIGHT - BOTTOM, WIDTH - RIGHT);
}

static void write_point(FILE *file, const plot_line_t *line, size_t k, const axis_t *x, const axis_t *y) {
    fprintf(file, "%.1f,%.1f ", to_x(x, line->x[k]), to_y(y, line->y[k]));
}

/* A trace that is denser than the pixels: what it covers in each column of them. false: it is a line. */
static bool write_band(FILE *file, const plot_line_t *line, const axis_t *x, const axis_t *y) {
    double *at_x = allocate(line->count, sizeof *at_x), *at_y = allocate(line->count, sizeof *at_y);
    for (size_t k = 0; k < line->count; k++) {
        at_x[k] = to_x(x, line->x[k]);
        at_y[k] = to_y(y, line->y[k]);
    }
    plot_band_t band;
    const bool dense = plot_band(at_x, at_y, line->count, (const double[]){LEFT, TOP, WIDTH - RIGHT, HEIGHT - BOTTOM},
                                 strstr(line->class_name, " spread") != NULL, &band);
    free(at_x);
    free(at_y);
    if (!dense) {
        return false;
    }
    fprintf(file, "<path class=\"band %s\" d=\"M", line->class_name);
    for (size_t i = 0; i < band.columns; i++) {
        fprintf(file, "%.0f %.1f ", band.at[i], band.top[i]);
    }
    for (size_t i = band.columns; i > 0; i--) {
        fprintf(file, "%.0f %.1f ", band.at[i - 1], band.bottom[i - 1]);
    }
    fprintf(file, "Z\"/>\n");
    plot_band_free(&band);
    return true;
}

/*
 * Of consecutive points in one pixel column only the first, the lowest, the highest and the last are written, in their
 * order. The picture looks the same, and a spike of one sample keeps its height.
 */
static void write_line(FILE *file, const plot_line_t *line, const axis_t *x, const axis_t *y) {
    if (write_band(file, line, x, y)) {
        return;
    }
    fprintf(file, "<polyline class=\"%s\" points=\"", line->class_name);
    for (size_t first = 0, next; first < line->count; first = next) {
        const double column = floor(to_x(x, line->x[first]));
        size_t lowest = first, highest = first;
        for (next = first + 1; next < line->count && floor(to_x(x, line->x[next])) == column; next++) {
            lowest = line->y[next] < line->y[lowest] ? next : lowest;
            highest = line->y[next] > line->y[highest] ? next : highest;
        }
        const size_t earlier = lowest < highest ? lowest : highest, later = lowest < highest ? highest : lowest;
        write_point(file, line, first, x, y);
        if (earlier > first) {
            write_point(file, line, earlier, x, y);
        }
        if (later > earlier) {
            write_point(file, line, later, x, y);
        }
        if (next - 1 > later) {
            write_point(file, line, next - 1, x, y);
        }
    }
    fprintf(file, "\"/>\n");
}

/* Which axes are logarithmic. */
typedef struct {
    bool x, y;
} scale_t;

static const scale_t linear = {false, false};

static bool plot_extent(const plot_t *plot, scale_t logarithmic, double low[2], double high[2]) {
    low[0] = low[1] = HUGE_VAL;
    high[0] = high[1] = -HUGE_VAL;
    for (size_t i = 0; i < plot->lines; i++) {
        for (size_t k = 0; k < plot->line[i].count; k++) {
            const double x = logarithmic.x ? log10(plot->line[i].x[k]) : plot->line[i].x[k];
            const double y = logarithmic.y ? log10(plot->line[i].y[k]) : plot->line[i].y[k];
            low[0] = fmin(low[0], x);
            high[0] = fmax(high[0], x);
            low[1] = fmin(low[1], y);
            high[1] = fmax(high[1], y);
        }
    }
    return low[0] <= high[0];
}

/* Everything inside the picture's frame of WIDTH by HEIGHT. *shown: the frame, for what redraws it. */
static void write_contents(FILE *file, const plot_t *plot, scale_t logarithmic, const double low[2],
                           const double high[2], plot_frame_t *shown) {
    const axis_t x = choose_axis(logarithmic.x, low[0], high[0], 0.02);
    const axis_t y = choose_axis(logarithmic.y, low[1], high[1], 0.05);
    *shown = (plot_frame_t){
        {LEFT, TOP, WIDTH - RIGHT, HEIGHT - BOTTOM}, {x.low, x.high, y.low, y.high}, {logarithmic.x, logarithmic.y}};
    if (plot->shade_from < x.high) {
        const double from = to_x(&x, fmax(plot->shade_from, x.low));
        fprintf(file, "<rect class=\"shade\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>\n", from, TOP,
                WIDTH - RIGHT - from, HEIGHT - TOP - BOTTOM);
    }
    write_axes(file, &x, &y);
    for (size_t i = 0; i < plot->lines; i++) {
        write_line(file, &plot->line[i], &x, &y);
    }
    fprintf(file, "<text class=\"label\" x=\"%.1f\" y=\"%.1f\">", 0.5 * (LEFT + WIDTH - RIGHT), HEIGHT - 8.0);
    write_escaped(file, plot->x_label);
    fprintf(file, "</text><text class=\"label\" transform=\"translate(%.0f %.1f) rotate(-90)\">", LABEL,
            0.5 * (TOP + HEIGHT - BOTTOM));
    write_escaped(file, plot->y_label);
    fprintf(file, "</text>\n");
}

static void write_figure(FILE *file, const plot_t *plot, scale_t logarithmic) {
    double low[2], high[2];
    plot_frame_t frame;
    if (!plot_extent(plot, logarithmic, low, high)) {
        return;
    }
    fprintf(file, "<figure>\n<figcaption><strong>");
    write_escaped(file, plot->title);
    fprintf(file, "</strong>");
    for (size_t i = 0; plot->lines > 1 && i < plot->lines; i++) {
        fprintf(file,
                " <span class=\"key\"><svg viewBox=\"0 0 20 8\" aria-hidden=\"true\"><path class=\"%s\" d=\"M0 "
                "4H20\"/></svg> ",
                plot->line[i].class_name);
        write_escaped(file, plot->line[i].label);
        fprintf(file, "</span>");
    }
    fprintf(file, "</figcaption>\n<svg class=\"plot\" viewBox=\"0 0 %.0f %.0f\" role=\"img\" aria-label=\"", WIDTH,
            HEIGHT);
    write_escaped(file, plot->title);
    fprintf(file, "\">\n<g>\n");
    write_contents(file, plot, logarithmic, low, high, &frame);
    fprintf(file, "</g>\n</svg>\n");
    plot_data_write(file, plot, &frame);
    fprintf(file, "</figure>\n");
}

void plot_write(FILE *file, const plot_t *plot) {
    write_figure(file, plot, linear);
}

void plot_write_logarithmic(FILE *file, const plot_t *plot) {
    write_figure(file, plot, (scale_t){true, true});
}

void plot_write_over_frequency(FILE *file, const plot_t *plot) {
    write_figure(file, plot, (scale_t){true, false});
}

static bool same_legend(const plot_t *a, const plot_t *b) {
    bool same = a->lines == b->lines;
    for (size_t i = 0; same && i < a->lines; i++) {
        same = strcmp(a->line[i].class_name, b->line[i].class_name) == 0 &&
               strcmp(a->line[i].label, b->line[i].label) == 0;
    }
    return same;
}

/* One row of the legend, centred at y. */
static void write_legend(FILE *file, const plot_t *plot, double y) {
    double x = LEFT;
    for (size_t i = 0; i < plot->lines; i++) {
        fprintf(file, "<path class=\"%s\" d=\"M%.0f %.0fh24\"/><text x=\"%.0f\" y=\"%.0f\">", plot->line[i].class_name,
                x, y, x + 30.0, y + 4.0);
        write_escaped(file, plot->line[i].label);
        fprintf(file, "</text>\n");
        x += 60.0 + LETTER * (double)strlen(plot->line[i].label);
    }
}

void plot_write_sheet(FILE *file, const plot_t *plot, size_t plots, size_t most_columns) {
    const size_t columns = plots > 0 && plots < most_columns ? plots : most_columns; /* no empty ones */
    bool common = true; /* one legend at the top for all plots; else one below the title of each */
    for (size_t i = 1; i < plots; i++) {
        common = common && same_legend(&plot[0], &plot[i]);
    }
    const double top = common ? 30.0 : 0.0, title = common ? 24.0 : 46.0, cell = HEIGHT + title;
    const size_t rows = (plots + columns - 1) / columns;
    const double width = WIDTH * (double)columns, height = top + cell * (double)rows;
    fprintf(file,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot\" viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" "
            "height=\"%.0f\">\n"
            "<style>\n%s</style>\n<rect class=\"paper\" width=\"%.0f\" height=\"%.0f\"/>\n",
            width, height, width, height, plot_style, width, height);
    if (plots > 0 && common) {
        write_legend(file, &plot[0], 18.0);
    }
    for (size_t i = 0; i < plots; i++) {
        const size_t row = i / columns, column = i % columns;
        double low[2], high[2];
        plot_frame_t frame;
        if (!plot_extent(&plot[i], linear, low, high)) {
            continue;
        }
        fprintf(file, "<g transform=\"translate(%.0f %.0f)\"><text class=\"title\" x=\"%.0f\" y=\"16\">",
                WIDTH * (double)column, top + cell * (double)row, LEFT);
        write_escaped(file, plot[i].title);
        fprintf(file, "</text>\n");
        if (!common) {
            write_legend(file, &plot[i], 36.0);
        }
        fprintf(file, "<g transform=\"translate(0 %.0f)\">\n", title);
        write_contents(file, &plot[i], linear, low, high, &frame);
        fprintf(file, "</g></g>\n");
    }
    fprintf(file, "</svg>\n");
}

void write_escaped(FILE *file, const char *text) {
    for (; *text != '\0'; text++) {
        switch (*text) {
        case '<':
            fputs("&lt;", file);
            break;
        case '>':
            fputs("&gt;", file);
            break;
        case '&':
            fputs("&amp;", file);
            break;
        case '"':
            fputs("&quot;", file);
            break;
        default:
            fputc(*text, file);
        }
    }
}
