/* SPDX-License-Identifier: MIT */
#include "bouc_wen_models.h"
#include "unity.h"
#include <math.h>

hyst_bouc_wen_status_t bouc_wen_build(const bouc_wen_arguments_t *a, hyst_bouc_wen_t *model, uint32_t *element) {
    return hyst_bouc_wen_build(model, a->cells, a->offset, a->direct, a->length, a->slope, element);
}

hyst_bouc_wen_t bouc_wen_accept(const bouc_wen_arguments_t *a) {
    hyst_bouc_wen_t model;
    uint32_t element = 0;
    TEST_ASSERT_EQUAL_INT_MESSAGE(HYST_BOUC_WEN_OK, bouc_wen_build(a, &model, &element),
                                  "the test's model must be accepted");
    return model;
}

bouc_wen_arguments_t bouc_wen_random(random_t *random) {
    bouc_wen_arguments_t a = {.cells = (uint32_t)(random_bits(random) % (HYST_BOUC_WEN_MAX_CELLS + 1U)),
                              .offset = random_q31(random) / 8};
    const bool negative = random_unit(random) < 0.5;
    const double direct = negative ? 0.1 + 2.0 * random_unit(random) : 0.01 + random_unit(random);
    const double largest = negative ? direct - 0.005 : 3.9 - direct;
    const double reach = fmin(1.9, 7.5 / fmax(direct, direct + (negative ? 0.0 : largest))) / fmax(1.0, largest);
    a.direct = (hyst_q28_t)(direct * HYST_Q28_ONE);
    for (uint32_t i = 0; i < a.cells; i++) {
        const double slope = largest * pow(random_unit(random), 3.0);
        a.slope[i] = (negative ? -1 : 1) * (1 + (hyst_q28_t)(slope * HYST_Q28_ONE));
        const double length = fmin(reach / a.cells, 0.999) * random_unit(random);
        a.length[i] = random_unit(random) < 0.1 ? 1 : 1 + (hyst_q31_t)(length * 0x1p31);
    }
    return a;
}

/*
 * Cells for dh/du = A - (beta sgn + gamma) |h| with A = beta + gamma, so |h| <= 1. Places where sqrt|H''| integrates to
 * equal parts, which makes the chords' errors equal; the last place is where 1 - h has become as small as that error.
 */
static double branch(double beta, double gamma, double v) {
    const double a = beta + gamma;
    const double c = gamma - beta;
    if (v >= 0.0) {
        return 1.0 - exp(-a * v);
    }
    return fabs(c) < 1e-9 ? a * v : a / c * expm1(c * v);
}

static double place(double beta, double gamma, double h) {
    const double a = beta + gamma;
    const double c = gamma - beta;
    if (h >= 0.0) {
        return -log1p(-h) / a;
    }
    return fabs(c) < 1e-9 ? h / a : log1p(c / a * h) / c;
}

/* Integral of sqrt|H''| from h = 0: with f = dH/dv, |H''| = |f f'| and dv = dh / f, so it is sqrt|f'| 2 (sqrt f..). */
static double bend(double beta, double gamma, double h) {
    const double a = beta + gamma;
    const double rate = h >= 0.0 ? -a : gamma - beta;
    const double f = a + rate * h;
    return fabs(rate) < 1e-9 ? 0.0 : 2.0 / rate * sqrt(fabs(rate)) * (sqrt(f) - sqrt(a));
}

bouc_wen_arguments_t bouc_wen_cells(double beta, double gamma, double share, double direct, uint32_t cells) {
    bouc_wen_arguments_t a = {.cells = cells, .direct = (hyst_q28_t)(direct * HYST_Q28_ONE)};
    /* From rest no history gets beyond what the whole range of drives adds to h = 0. */
    const double end = fmin(1.0 - 0.5 / (cells * (double)cells), branch(beta, gamma, 2.0));
    const double from = bend(beta, gamma, -end);
    const double to = bend(beta, gamma, end);
    double before = -end;
    for (uint32_t i = 0; i < cells; i++) {
        double low = before;
        double high = end;
        for (int k = 0; k < 60;
             k++) { /* bend rises with h, except where the curve is straight: there any place will do */
            const double middle = 0.5 * (low + high);
            if (bend(beta, gamma, middle) < from + (to - from) * (i + 1.0) / cells) {
                low = middle;
            } else {
                high = middle;
            }
        }
        const double h = i + 1U < cells ? low : end;
        const double length = place(beta, gamma, h) - place(beta, gamma, before);
        a.length[i] = (hyst_q31_t)lround(length * 0x1p31);
        a.slope[i] = (hyst_q28_t)lround(share * (h - before) / (a.length[i] * 0x1p-31) * HYST_Q28_ONE);
        before = h;
    }
    return a;
}

void bouc_wen_exact_advance(bouc_wen_exact_t *exact, double drive) {
    const double side = drive < exact->drive ? -1.0 : 1.0;
    const double v = place(exact->beta, exact->gamma, side * exact->h) + fabs(drive - exact->drive);
    exact->h = side * branch(exact->beta, exact->gamma, v);
    exact->drive = drive;
}
