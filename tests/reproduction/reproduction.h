/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Reproductions: what each of the five papers reports, beside what this project reaches on the same work.
 *
 * One file a paper, seed_NNN.c, with one function reproduce_NNN, and one line in SEEDS. It makes the paper's recordings
 * from a twin (twins/twin_NNN.[ch]), which is written from what the paper reports and shares no code and no formula
 * with the models under test, runs the project's own tools on them and reports rows, text and pictures. The program
 * `reproduce` writes them as a page, as pictures and as JSON. Everything is seeded: the same run gives the same bytes.
 */
#ifndef REPRODUCTION_H
#define REPRODUCTION_H

#include "page/svg_plot.h"
#include <stdbool.h>
#include <stddef.h>

/* One line a paper: its number, as three digits, and a short title for the page. */
#define SEEDS(SEED)                                                                                                    \
    SEED(000, "A stack as a mass on a spring of stops, 10 to 200 Hz, 0 to 12 N")                                       \
    SEED(001, "A bimorph with odd harmonics and interleaved hysteresis, 1 to 110 Hz")                                  \
    SEED(002, "A stack with a density of stops and with a Preisach model, 0.1 to 100 Hz")                              \
    SEED(003, "A family of ellipses for the loops of a stack, 0.5 to 300 Hz")                                          \
    SEED(004, "Rate-dependent Prandtl-Ishlinskii model of a cantilever, 0.1 to 200 Hz")

typedef struct reproduction reproduction_t;

/** Whether the run is of reduced length (fewer frequencies, shorter recordings): then nothing is claimed on the page.
 */
bool reproduction_reduced(const reproduction_t *reproduction);

/** How `ours` has to stand to `paper` for the row to be met. */
typedef enum {
    MET_AT_MOST,  /**< ours <= paper: errors */
    MET_AT_LEAST, /**< ours >= paper: fits, factors */
    MET_EQUAL,    /**< |ours - paper| <= tolerance: printed numbers */
    MET_ABOVE     /**< like AT_LEAST, where the paper's number is a bad result that has to show up here too */
} met_t;

/**
 * One row. `quantity` says what is compared, in words that stand alone ("largest tracking error, 18 um sine, 200 Hz, of
 * peak to peak"). tolerance is used by MET_EQUAL. A row that is not met stays in the list with met = false.
 */
void reproduction_row(reproduction_t *reproduction, const char *quantity, double paper, double ours, const char *unit,
                      met_t met, double tolerance);

/** Why the row reported last is not met (Markdown, one paragraph, at most 1999 characters). Says nothing on the page if
 * it is met; a row that is neither met nor explained fails a run at full length. */
void reproduction_explain(reproduction_t *reproduction, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 2, 3)))
#endif
    ;

/** A paragraph (Markdown) of this paper's section: what the twin is, what is reported, what was chosen, what is off. */
void reproduction_text(reproduction_t *reproduction, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 2, 3)))
#endif
    ;

/** A sheet of plots with a caption; stored as reproduction-NNN-name.svg. */
void reproduction_picture(reproduction_t *reproduction, const char *name, const char *caption, const plot_t *plots,
                          size_t count, size_t columns);

/** "path of a scratch folder", existing and writable, for files between the tools. */
const char *reproduction_folder(const reproduction_t *reproduction);

/* false: the run itself failed (not: a row is not met), with a line on stderr. */
#define SEED_DECLARE(number, title) bool reproduce_##number(reproduction_t *reproduction);
SEEDS(SEED_DECLARE)
#undef SEED_DECLARE

#endif
