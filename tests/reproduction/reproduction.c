/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "reproduction_page.h"
#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* A new text, like sprintf. */
#if defined(__GNUC__)
__attribute__((format(printf, 1, 2)))
#endif
static char *
new_text(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    const size_t size = (size_t)vsnprintf(NULL, 0, format, arguments) + 1;
    va_end(arguments);
    char *text = allocate(size, 1);
    va_start(arguments, format);
    vsnprintf(text, size, format, arguments);
    va_end(arguments);
    return text;
}

/* Keeps the first failure: what follows is often its consequence. */
#define FAIL_ONCE(reproduction, ...)                                                                                   \
    do {                                                                                                               \
        if (!(reproduction)->failed) {                                                                                 \
            fail(&(reproduction)->failure, __VA_ARGS__);                                                               \
            (reproduction)->failed = true;                                                                             \
        }                                                                                                              \
    } while (0)

bool reproduction_reduced(const reproduction_t *reproduction) {
    return reproduction->reduced;
}

const char *reproduction_folder(const reproduction_t *reproduction) {
    return reproduction->folder;
}

static bool is_met(double paper, double ours, met_t criterion, double tolerance) {
    switch (criterion) {
    case MET_AT_MOST:
        return ours <= paper;
    case MET_AT_LEAST:
    case MET_ABOVE:
        return ours >= paper;
    case MET_EQUAL:
        break;
    }
    return fabs(ours - paper) <= tolerance;
}

void reproduction_row(reproduction_t *reproduction, const char *quantity, double paper, double ours, const char *unit,
                      met_t met, double tolerance) {
    for (size_t i = 0; i < reproduction->rows; i++) {
        if (strcmp(reproduction->row[i].quantity, quantity) == 0) {
            FAIL_ONCE(reproduction, "two rows are called \"%s\"", quantity);
        }
    }
    reproduction->row = reallocate(reproduction->row, reproduction->rows + 1, sizeof *reproduction->row);
    reproduction->row[reproduction->rows++] = (reproduction_row_t){.quantity = copy_text(quantity),
                                                                   .unit = copy_text(unit),
                                                                   .paper = paper,
                                                                   .ours = ours,
                                                                   .tolerance = tolerance,
                                                                   .criterion = met,
                                                                   .met = is_met(paper, ours, met, tolerance)};
}

void reproduction_explain(reproduction_t *reproduction, const char *format, ...) {
    if (reproduction->rows == 0) {
        FAIL_ONCE(reproduction, "an explanation without a row");
        return;
    }
    char text[2000];
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (length < 0 || (size_t)length >= sizeof text) {
        FAIL_ONCE(reproduction, "an explanation is too long: %.60s...", text);
    }
    reproduction_row_t *row = &reproduction->row[reproduction->rows - 1];
    free(row->explanation);
    row->explanation = copy_text(text);
}

void reproduction_text(reproduction_t *reproduction, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vfprintf(reproduction->writer, format, arguments);
    va_end(arguments);
    fputs("\n\n", reproduction->writer);
}

void reproduction_picture(reproduction_t *reproduction, const char *name, const char *caption, const plot_t *plots,
                          size_t count, size_t columns) {
    char *path = new_text("pictures/reproduction-%s-%s.svg", reproduction->seed, name);
    char *file_name = new_text("%s/%s", reproduction->output, path);
    FILE *file = fopen(file_name, "w");
    if (file == NULL) {
        FAIL_ONCE(reproduction, "%s: %s", file_name, strerror(errno));
    } else {
        plot_write_sheet(file, plots, count, columns);
        const bool failed = ferror(file) != 0;
        if (fclose(file) != 0 || failed) {
            FAIL_ONCE(reproduction, "cannot write %s", file_name);
        }
        fprintf(reproduction->writer, "![%s](%s)\n\n*%s*\n\n", caption, path, caption);
    }
    free(file_name);
    free(path);
}

static bool make_folder(const char *path, failure_t *failure) {
    return mkdir(path, 0777) == 0 || errno == EEXIST || fail(failure, "%s: %s", path, strerror(errno));
}

bool reproduction_prepare(const char *output, failure_t *failure) {
    char *pictures = new_text("%s/pictures", output);
    char *scratch = new_text("%s/scratch", output);
    const bool made = make_folder(output, failure) && make_folder(pictures, failure) && make_folder(scratch, failure);
    free(scratch);
    free(pictures);
    return made;
}

/* At full length nothing that is not met may stand there without a reason. */
static void demand_explanations(reproduction_t *reproduction) {
    for (size_t i = 0; !reproduction->reduced && i < reproduction->rows; i++) {
        if (!reproduction->row[i].met && reproduction->row[i].explanation == NULL) {
            FAIL_ONCE(reproduction, "neither met nor explained: %s", reproduction->row[i].quantity);
        }
    }
}

bool reproduction_run(reproduction_t *reproduction, const char *seed, const char *title,
                      bool (*reproduce)(reproduction_t *), const char *output, bool reduced, failure_t *failure) {
    *reproduction = (reproduction_t){.seed = seed,
                                     .title = title,
                                     .output = output,
                                     .folder = new_text("%s/scratch/%s", output, seed),
                                     .reduced = reduced};
    reproduction->writer = open_memstream(&reproduction->text, &reproduction->text_size);
    if (reproduction->writer == NULL) {
        FAIL_ONCE(reproduction, "the text cannot be kept: %s", strerror(errno));
    } else if (!make_folder(reproduction->folder, &reproduction->failure)) {
        reproduction->failed = true;
    } else if (!reproduce(reproduction)) {
        FAIL_ONCE(reproduction, "the run has failed");
    }
    if (reproduction->writer != NULL && fclose(reproduction->writer) != 0) {
        FAIL_ONCE(reproduction, "the text cannot be kept: %s", strerror(errno));
    }
    demand_explanations(reproduction);
    return !reproduction->failed || fail(failure, "%s: %s", seed, reproduction->failure.text);
}

void reproduction_free(reproduction_t *reproduction) {
    for (size_t i = 0; i < reproduction->rows; i++) {
        free(reproduction->row[i].quantity);
        free(reproduction->row[i].unit);
        free(reproduction->row[i].explanation);
    }
    free(reproduction->row);
    free(reproduction->text);
    free(reproduction->folder);
    *reproduction = (reproduction_t){0};
}

size_t reproduction_met(const reproduction_t *reproduction) {
    size_t met = 0;
    for (size_t i = 0; i < reproduction->rows; i++) {
        met += reproduction->row[i].met ? 1 : 0;
    }
    return met;
}
