/* SPDX-License-Identifier: MIT */
/* The validator of the modified play model, and the tables it makes. */
#include "hyst/modified_play.h"

/* 0.9 and 0.1 of a slope, in Q20. */
#define MOST  ((int64_t)HYST_Q20_ONE / 10 * 9)
#define LEAST ((int64_t)HYST_Q20_ONE / 10)

static hyst_modified_play_status_t check_sizes(const hyst_modified_play_parameters_t *p, hyst_q31_t pitch,
                                               uint32_t *element) {
    /* Eleven magnitudes of 2^31 at most. */
    int64_t harmonics = 0;
    int64_t others = hyst_magnitude(p->direct) + hyst_magnitude(p->bilinear);
    for (uint32_t i = 0; i < HYST_MODIFIED_PLAY_HARMONICS; i++) {
        harmonics += hyst_magnitude(p->sine[i]) + hyst_magnitude(p->cosine[i]);
    }
    for (uint32_t i = 0; i < HYST_MODIFIED_PLAY_FEEDBACK; i++) {
        others += hyst_magnitude(p->feedback[i]);
    }
    if (harmonics > HYST_Q28_ONE || others + harmonics > HYST_MODIFIED_PLAY_MAX_COEFFICIENTS) {
        return HYST_MODIFIED_PLAY_COEFFICIENTS_TOO_LARGE;
    }
    int64_t weights = 0; /* <= 2^60 before each addition of at most 2^62 */
    for (uint32_t cell = 0; cell < HYST_MODIFIED_PLAY_CELLS(p->divisions); cell++) {
        weights += hyst_magnitude(hyst_product(p->slope[cell], pitch));
        if (weights > (int64_t)1 << 60) {
            *element = cell;
            return HYST_MODIFIED_PLAY_WEIGHTS_TOO_LARGE;
        }
    }
    return HYST_MODIFIED_PLAY_OK;
}

/* Jury's conditions for z^3 - c1 z^2 - c2 z - c3. |c1| <= 10, so the products are below 2^60. */
static bool stable(int64_t c1, int64_t c2, int64_t c3) {
    const int64_t one = HYST_Q28_ONE;
    return one - c1 - c2 - c3 > 0 && one + c1 - c2 + c3 > 0 && hyst_magnitude(c3) < one &&
           one * one - c3 * c3 > hyst_magnitude(c3 * c1 + c2 * one);
}

/* At least hypot(a, b), at most 9 % more. */
static int64_t hypotenuse(hyst_q28_t a, hyst_q28_t b) {
    const int64_t x = hyst_magnitude(a);
    const int64_t y = hyst_magnitude(b);
    const int64_t larger = x > y ? x : y;
    const int64_t smaller = x > y ? y : x;
    return larger + (smaller * 54 + 127) / 128; /* 54/128 > sqrt(2) - 1, the chord of sqrt(1 + t^2) over 0..1 */
}

/* What the last drive can feed into this sample per unit, L in Q28: below 2^28 * (10 + 1.09 * 5). */
static int64_t drive_feedback(const hyst_modified_play_parameters_t *p) {
    int64_t sum = hyst_magnitude(p->bilinear);
    for (uint32_t i = 0; i < HYST_MODIFIED_PLAY_HARMONICS; i++) {
        sum += (2 * i + 1) * hypotenuse(p->sine[i], p->cosine[i]); /* |d u^n / du| <= n */
    }
    return sum;
}

/* One branch: `slope` with the plays, `direct` without, `growth` the plays' widening per rate. */
static hyst_modified_play_status_t check_branch(const hyst_modified_play_parameters_t *p, int64_t slope,
                                                hyst_q20_t growth) {
    if (slope < HYST_MODIFIED_PLAY_MIN_SLOPE) {
        return HYST_MODIFIED_PLAY_TOO_FLAT;
    }
    if (slope > HYST_MODIFIED_PLAY_MAX_SLOPE) {
        return HYST_MODIFIED_PLAY_TOO_STEEP;
    }
    const int64_t feedback = drive_feedback(p);
    if (feedback * 10 > slope * 9) {
        return HYST_MODIFIED_PLAY_INVERSE_UNSTABLE;
    }
    /* From here on feedback < slope <= 2^30, and |slope - direct| < 2^30. Q48, each term at most 2^62. */
    const bool rate_dependent = p->alpha > 0 || p->beta > 0;
    const int64_t gain = rate_dependent ? p->rate_gain : HYST_Q30_ONE;
    const int64_t widening = (hyst_product(growth, (int32_t)gain) + HYST_Q30_ONE - 1) >> 30; /* Q20, up */
    const int64_t echo = widening * (slope - p->direct);
    const int64_t lag = HYST_Q30_ONE - gain; /* 1 - q */
    const bool decays = echo + (feedback * lag >> 10) <= slope * MOST &&
                        ((HYST_Q30_ONE + lag) * (slope - feedback) >> 10) + 2 * echo >= slope * LEAST;
    return decays ? HYST_MODIFIED_PLAY_OK : HYST_MODIFIED_PLAY_INVERSE_UNSTABLE;
}

/* Cells before row i, 1..N. */
static uint32_t row_begin(uint32_t divisions, uint32_t row) {
    return (row - 1U) * (2U * divisions - row) / 2U;
}

/*
 * The cell that row m contributes when the drive is in a column, 0..N-1 counted in the direction of travel. Row m
 * stands r_m behind the drive, which is m / 2 cells of width 2 / N, and its own cells begin m / 2 cells later than
 * those of row 0. So it is in cell column - m as counted in that direction. False where it has none.
 */
static bool cell_of(uint32_t divisions, bool down, uint32_t column, uint32_t row, uint32_t *cell) {
    if (row > column) {
        return false;
    }
    const uint32_t along = column - row;
    const uint32_t last = divisions - 1U - row;
    *cell = row_begin(divisions, row) + (down ? last - along : along);
    return true;
}

static hyst_modified_play_status_t check_branches(const hyst_modified_play_parameters_t *p, uint32_t *element) {
    hyst_modified_play_status_t status = check_branch(p, p->direct, 0);
    for (uint32_t down = 0; down < 2U; down++) {
        for (uint32_t column = 0; column < p->divisions; column++) {
            int64_t slope = p->direct;
            for (uint32_t row = 1; row < p->divisions && status == HYST_MODIFIED_PLAY_OK; row++) {
                uint32_t cell = 0;
                if (cell_of(p->divisions, down != 0, column, row, &cell)) {
                    slope += p->slope[cell]; /* within 4 before, so within 12 */
                    *element = cell;
                    status = check_branch(p, slope, down != 0 ? p->beta : p->alpha);
                }
            }
        }
    }
    return status;
}

/* Share of row i in H where its play is at the lower end of cell `cell`, or at the upper end of the last. Q59, in all
 * rows together within 2^60. */
static int64_t share_at(const hyst_modified_play_parameters_t *p, hyst_q31_t pitch, uint32_t row, uint32_t cell) {
    const hyst_q28_t *slope = p->slope + row_begin(p->divisions, row);
    int64_t share = 0;
    for (uint32_t i = 0; i < p->divisions - row; i++) {
        const int64_t weight = hyst_product(slope[i], pitch);
        share += i < cell ? weight : -weight;
    }
    return share;
}

static void fill_tables(hyst_modified_play_t *model) {
    const hyst_modified_play_parameters_t *p = &model->parameters;
    const uint32_t n = p->divisions;
    for (uint32_t down = 0; down < 2U; down++) {
        for (uint32_t zone = 0; zone <= n; zone++) {
            int64_t *level = model->level[down] + HYST_MODIFIED_PLAY_ZONE(zone);
            hyst_q28_t *branch = model->branch[down] + HYST_MODIFIED_PLAY_ZONE(zone);
            const int64_t carried = hyst_product(p->direct, model->pitch) * 2 * zone; /* below 2^62 */
            level[0] = down != 0 ? -carried : carried;
            branch[0] = p->direct;
            for (uint32_t row = 1; row < n && row <= zone + 1U; row++) {
                uint32_t cell = 0;
                const bool within = zone < n && cell_of(n, down != 0, zone, row, &cell);
                branch[row] = branch[row - 1U] + (within ? p->slope[cell] : 0); /* accepted: 2^16 .. 2^30 */
                const uint32_t passed = zone > row ? zone - row : 0;            /* cells, n - row at most */
                level[row] = level[row - 1U] + share_at(p, model->pitch, row, down != 0 ? n - row - passed : passed);
            }
        }
    }
}

hyst_modified_play_status_t hyst_modified_play_build(hyst_modified_play_t *model,
                                                     const hyst_modified_play_parameters_t *parameters,
                                                     uint32_t *element) {
    const hyst_modified_play_parameters_t *p = parameters;
    *element = 0;
    if (p->divisions < 1U || p->divisions > HYST_MODIFIED_PLAY_MAX_DIVISIONS) {
        return HYST_MODIFIED_PLAY_DIVISIONS_OUT_OF_RANGE;
    }
    const hyst_q31_t pitch = HYST_Q31_MAX / (hyst_q31_t)p->divisions;
    hyst_modified_play_status_t status = check_sizes(p, pitch, element);
    if (status != HYST_MODIFIED_PLAY_OK) {
        return status;
    }
    const bool rate_dependent = p->alpha > 0 || p->beta > 0;
    if (p->alpha < 0 || p->beta < 0 || (rate_dependent && (p->rate_gain <= 0 || p->rate_gain > HYST_Q30_ONE))) {
        return HYST_MODIFIED_PLAY_RATE_OUT_OF_RANGE;
    }
    const int64_t bilinear = hyst_magnitude(p->bilinear);
    if (!stable(p->feedback[0] - bilinear, p->feedback[1], p->feedback[2]) ||
        !stable(p->feedback[0] + bilinear, p->feedback[1], p->feedback[2])) {
        return HYST_MODIFIED_PLAY_FILTER_UNSTABLE;
    }
    status = check_branches(p, element);
    if (status != HYST_MODIFIED_PLAY_OK) {
        return status;
    }
    *element = 0;
    model->parameters = *p;
    if (!rate_dependent) {
        model->parameters.rate_gain = HYST_Q30_ONE;
    }
    model->pitch = pitch;
    fill_tables(model);
    return HYST_MODIFIED_PLAY_OK;
}
