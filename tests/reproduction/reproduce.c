/* SPDX-License-Identifier: GPL-3.0-or-later */
/* reproduce --output FOLDER [--reduced] [SEED...]: all papers, or those named. */
#include "command_line/print.h"
#include "reproduction_page.h"
#include <stdlib.h>
#include <string.h>

typedef struct {
    const char *seed, *title;
    bool (*reproduce)(reproduction_t *reproduction);
} paper_t;

#define SEED_PAPER(number, title) {#number, title, reproduce_##number},
static const paper_t papers[] = {SEEDS(SEED_PAPER){NULL, NULL, NULL}};
#undef SEED_PAPER

enum { ROOM = sizeof papers / sizeof papers[0] }; /* papers, and the end of the list */

typedef struct {
    const char *output;
    bool reduced;
    bool named; /* only the wanted ones */
    bool wanted[ROOM];
} arguments_t;

static int usage(void) {
    fprintf(stderr, "usage: reproduce --output FOLDER [--reduced] [SEED...]\nseeds:");
    for (const paper_t *paper = papers; paper->seed != NULL; paper++) {
        fprintf(stderr, " %s", paper->seed);
    }
    fputc('\n', stderr);
    return STATUS_USAGE;
}

static bool want(arguments_t *arguments, const char *seed) {
    for (const paper_t *paper = papers; paper->seed != NULL; paper++) {
        if (strcmp(paper->seed, seed) == 0) {
            arguments->named = arguments->wanted[paper - papers] = true;
            return true;
        }
    }
    return false;
}

static bool read_arguments(arguments_t *arguments, int argc, char **argv) {
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--reduced") == 0) {
            arguments->reduced = true;
        } else if (strcmp(argv[i], "--output") == 0 && i + 1 < argc) {
            arguments->output = argv[++i];
        } else if (!want(arguments, argv[i])) {
            return false;
        }
    }
    return arguments->output != NULL;
}

int main(int argc, char **argv) {
    arguments_t arguments = {0};
    if (!read_arguments(&arguments, argc, argv)) {
        return usage();
    }
    reproduction_t reproduction[ROOM] = {{0}};
    size_t count = 0;
    int status = STATUS_DONE;
    failure_t failure;
    if (!reproduction_prepare(arguments.output, &failure)) {
        return failure_print(&failure);
    }
    for (const paper_t *paper = papers; paper->seed != NULL; paper++) {
        if (arguments.named && !arguments.wanted[paper - papers]) {
            continue;
        }
        printf("%s: ", paper->seed); /* minutes, at full length */
        (void)fflush(stdout);
        /* One that fails does not keep the others from the page. */
        if (!reproduction_run(&reproduction[count], paper->seed, paper->title, paper->reproduce, arguments.output,
                              arguments.reduced, &failure)) {
            status = failure_print(&failure);
        }
        printf("%zu of %zu rows met\n", reproduction_met(&reproduction[count]), reproduction[count].rows);
        count++;
    }
    if (!reproduction_write(reproduction, count, arguments.output, &failure)) {
        status = failure_print(&failure);
    }
    for (size_t i = 0; i < count; i++) {
        reproduction_free(&reproduction[i]);
    }
    return status;
}
