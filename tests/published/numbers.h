/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What follows from published numbers without any model of ours: the numbers that decide between causes, and that the
 * prose of questions.json quotes by name. Each function adds one object a question to *numbers.
 */
#ifndef NUMBERS_H
#define NUMBERS_H

#include "base/failure.h"
#include <jansson.h>

typedef struct {
    const char *name; /**< as questions.json quotes it; the unit is part of it */
    double value;
} number_t;

/** Adds the object `question` with these numbers. Fails where one of them is not finite. */
bool numbers_add(json_t *numbers, const char *question, const number_t *list, size_t count, failure_t *failure);

/** From what the papers print. */
bool numbers_printed(json_t *numbers, failure_t *failure);

/** From the real recordings in the folder; those that are not there are left out. */
bool numbers_measured(const char *folder, json_t *numbers, failure_t *failure);

/** The delay that widens the loop of 004's printed plays, with fixed thresholds, to the 17.5 um that are printed for
 * 200 Hz. */
double numbers_004_delay_s(void);

#endif
