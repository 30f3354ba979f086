/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What the program `reproduce` does with reproductions: collect one, then write all of them. */
#ifndef REPRODUCTION_PAGE_H
#define REPRODUCTION_PAGE_H

#include "base/failure.h"
#include "reproduction.h"
#include <stdio.h>

typedef struct {
    char *quantity, *unit, *explanation; /**< explanation: NULL for none */
    double paper, ours, tolerance;
    met_t criterion;
    bool met;
} reproduction_row_t;

struct reproduction {
    const char *seed, *title; /**< "003" and what SEEDS says of it */
    const char *output;       /**< folder of the page */
    char *folder;             /**< scratch folder of this paper */
    reproduction_row_t *row;
    size_t rows;
    FILE *writer; /**< of the text below; closed when the run has ended */
    char *text;   /**< paragraphs and pictures, in the order in which they were reported */
    size_t text_size;
    bool reduced, failed;
    failure_t failure; /**< the first one, if failed */
};

/** Makes the folder and those in it, if they are missing. The folder it is in has to be there. */
bool reproduction_prepare(const char *output, failure_t *failure);

/** Runs one paper; its scratch folder is made. Free it with reproduction_free, whatever the result. */
bool reproduction_run(reproduction_t *reproduction, const char *seed, const char *title,
                      bool (*reproduce)(reproduction_t *), const char *output, bool reduced, failure_t *failure);
void reproduction_free(reproduction_t *reproduction);

size_t reproduction_met(const reproduction_t *reproduction);

/** Writes OUTPUT/reproduction.json and OUTPUT/REPRODUCTION.md; the pictures are in OUTPUT/pictures already. */
bool reproduction_write(const reproduction_t *reproduction, size_t count, const char *output, failure_t *failure);

#endif
