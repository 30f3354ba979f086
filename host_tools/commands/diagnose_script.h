/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The Python script that repeats a run of `hyst diagnose`, over the package hyst (docs/PYTHON.md). */
#ifndef DIAGNOSE_SCRIPT_H
#define DIAGNOSE_SCRIPT_H

#include "base/failure.h"

/** What the command was given; NULL: without that option. */
typedef struct {
    char *const *recordings;
    size_t count;
    double from_s, to_s; /**< infinite: not given */
    const char *model, *json, *report, *title, *output;
    bool columns_are_right;
    unsigned long samples; /**< at most; 0: as usual */
    size_t sure;           /**< 0: not asked */
    unsigned long seed;
} diagnose_script_t;

bool diagnose_script_write(const diagnose_script_t *script, const char *path, failure_t *failure);

#endif
