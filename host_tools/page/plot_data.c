/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "page/plot_data.h"
#include "base/failure.h"
#include <stdlib.h>
#include <string.h>

enum { DIGITS = 6, EACH = 4 /* points of a stretch */ };

/* A JSON string that cannot end the element it stands in. */
static void write_string(FILE *file, const char *text) {
    fputc('"', file);
    for (; *text != '\0'; text++) {
        if ((unsigned char)*text < ' ' || strchr("\"\\<>&", *text) != NULL) {
            fprintf(file, "\\u%04x", (unsigned)(unsigned char)*text);
        } else {
            fputc(*text, file);
        }
    }
    fputc('"', file);
}

static void write_numbers(FILE *file, const double *number, size_t count) {
    for (size_t k = 0; k < count; k++) {
        fprintf(file, "%s%.*g", k > 0 ? "," : "", DIGITS, number[k]);
    }
}

static void write_four(FILE *file, const char *name, const double number[4]) {
    fprintf(file, ",\"%s\":[", name);
    write_numbers(file, number, 4);
    fputc(']', file);
}

/* Indices of the points that stand for a line. Returns how many; at most PLOT_DATA_POINTS and a few. */
static size_t choose(const plot_line_t *line, size_t *index) {
    const size_t each = line->count <= PLOT_DATA_POINTS ? 1 : (line->count * EACH - 1) / PLOT_DATA_POINTS + 1;
    size_t chosen = 0;
    for (size_t first = 0, next; first < line->count; first = next) {
        next = first + each < line->count ? first + each : line->count;
        size_t lowest = first, highest = first;
        for (size_t k = first; k < next; k++) {
            lowest = line->y[k] < line->y[lowest] ? k : lowest;
            highest = line->y[k] > line->y[highest] ? k : highest;
        }
        const size_t points[EACH] = {first, lowest < highest ? lowest : highest, lowest < highest ? highest : lowest,
                                     next - 1};
        for (size_t i = 0; i < EACH; i++) {
            if (i == 0 || points[i] > points[i - 1]) {
                index[chosen++] = points[i];
            }
        }
    }
    return chosen;
}

static void write_line(FILE *file, const plot_line_t *line, bool same_x) {
    size_t *index = allocate(line->count * EACH + EACH, sizeof *index);
    double *x = allocate(line->count * EACH + EACH, sizeof *x);
    const size_t count = choose(line, index);
    fprintf(file, "{\"name\":");
    write_string(file, line->label);
    fprintf(file, ",\"class\":");
    write_string(file, line->class_name);
    fprintf(file, ",\"of\":%zu", line->count);
    if (!same_x) {
        for (size_t i = 0; i < count; i++) {
            x[i] = line->x[index[i]];
        }
        fprintf(file, ",\"x\":[");
        write_numbers(file, x, count);
        fputc(']', file);
    }
    for (size_t i = 0; i < count; i++) {
        x[i] = line->y[index[i]];
    }
    fprintf(file, ",\"y\":[");
    write_numbers(file, x, count);
    fprintf(file, "]}");
    free(x);
    free(index);
}

void plot_data_write(FILE *file, const plot_t *plot, const plot_frame_t *frame) {
    fprintf(file, "<script type=\"application/json\" class=\"data\">\n{\"title\":");
    write_string(file, plot->title);
    fprintf(file, ",\"x\":");
    write_string(file, plot->x_label);
    fprintf(file, ",\"y\":");
    write_string(file, plot->y_label);
    write_four(file, "frame", frame->corner);
    write_four(file, "range", frame->range);
    fprintf(file, ",\"log\":[%d,%d],\"lines\":[", frame->logarithmic[0], frame->logarithmic[1]);
    for (size_t i = 0; i < plot->lines; i++) {
        const plot_line_t *line = &plot->line[i];
        /* Of a line that is thinned out, which points stay is a matter of its y. */
        const bool same_x =
            i > 0 && line->x == line[-1].x && line->count == line[-1].count && line->count <= PLOT_DATA_POINTS;
        fprintf(file, "%s", i > 0 ? ",\n" : "\n");
        write_line(file, line, same_x);
    }
    fprintf(file, "]}\n</script>\n");
}
