/* SPDX-License-Identifier: MIT */
/**
 * Bouc-Wen models for tests: random cells, cells of the differential equation, and that equation's own solution.
 */
#ifndef TESTS_BOUC_WEN_MODELS_H
#define TESTS_BOUC_WEN_MODELS_H

#include "hyst/bouc_wen.h"
#include "random.h"

/** The arguments of hyst_bouc_wen_build. */
typedef struct {
    uint32_t cells;
    hyst_q31_t offset;
    hyst_q28_t direct;
    hyst_q31_t length[HYST_BOUC_WEN_MAX_CELLS];
    hyst_q28_t slope[HYST_BOUC_WEN_MAX_CELLS];
} bouc_wen_arguments_t;

hyst_bouc_wen_status_t bouc_wen_build(const bouc_wen_arguments_t *arguments, hyst_bouc_wen_t *model, uint32_t *element);

/** bouc_wen_build, failing the test on a refusal. */
hyst_bouc_wen_t bouc_wen_accept(const bouc_wen_arguments_t *arguments);

/** Cells in any order of slopes, of both loop senses, from one unit long to nearly the whole range. */
bouc_wen_arguments_t bouc_wen_random(random_t *random);

/**
 * Cells for y = direct u + share h, dh/du = A - (beta sgn(u' h) + gamma) |h| with A = beta + gamma, so that |h| <= 1.
 * beta > 0.
 */
bouc_wen_arguments_t bouc_wen_cells(double beta, double gamma, double share, double direct, uint32_t cells);

/** The differential equation, by its solution between reversals. Starts at zero. Fractions of full scale. */
typedef struct {
    double beta, gamma, drive, h;
} bouc_wen_exact_t;

void bouc_wen_exact_advance(bouc_wen_exact_t *exact, double drive);

#endif
