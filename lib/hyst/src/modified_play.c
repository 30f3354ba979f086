/* SPDX-License-Identifier: MIT */
/*
 * Bounds used below, enforced by hyst_modified_play_build, Q59: sum |omega| <= 2, so |H| <= 2^60; sum of all
 * coefficients of signals <= 10, so everything else is below 10 * 2^59 + 2^59 (offset) + 2^27 (remainder). Together
 * below 1.7 * 2^62. A branch's slope is 2^16 to 2^30.
 */
#include "hyst/modified_play.h"
#include "hyst/play.h"
#include "hyst/sine.h"

/* More than two full scales of widening move no play that one full scale more does not. */
#define WIDENING_MAX ((int64_t)1 << 32)

static uint32_t rows_of(const hyst_modified_play_t *model) {
    return model->parameters.divisions - 1U;
}

/* r_i <= 1: rows are counted from 0 here, row i has threshold (i + 1) pitch. */
static hyst_q31_t threshold(const hyst_modified_play_t *model, uint32_t row) {
    return (hyst_q31_t)(row + 1U) * model->pitch;
}

/* alpha |v| (going up) or beta |v| (going down), known before the sample. 0..2^32. */
static int64_t widening(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state, int outward) {
    const hyst_q20_t growth = outward > 0 ? model->parameters.alpha : model->parameters.beta;
    /* Q20 * Q30 = Q50, <= 2^62; 19 bits down is Q31. */
    const int64_t width = hyst_round_shift(growth * hyst_magnitude(state->rate), 19);
    return width < WIDENING_MAX ? width : WIDENING_MAX;
}

/* a * b of two fractions, saturated (only -1 * -1 needs it). */
static hyst_q31_t times(hyst_q31_t a, hyst_q31_t b) {
    return hyst_saturate(hyst_round_shift(hyst_product(a, b), 31));
}

/* A1 u + A3 u^3 + A5 u^5 in Q31; sum |A| <= 1, so it is within 2^31 and the product with a sine within 2^62. */
static int64_t odd_powers(const hyst_q28_t coefficient[HYST_MODIFIED_PLAY_HARMONICS], hyst_q31_t u) {
    const hyst_q31_t square = times(u, u);
    hyst_q31_t power = u;
    int64_t sum = 0;
    for (uint32_t i = 0; i < HYST_MODIFIED_PLAY_HARMONICS; i++) {
        sum += hyst_product(coefficient[i], power);
        power = times(power, square);
    }
    return hyst_round_shift(sum, 28);
}

/* Everything in the next output but 2A u + H, Q59. */
static int64_t known_of(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state) {
    const hyst_modified_play_parameters_t *p = &model->parameters;
    int64_t sum = hyst_product(p->offset, HYST_Q28_ONE) + state->remainder;
    for (uint32_t i = 0; i < HYST_MODIFIED_PLAY_FEEDBACK; i++) {
        sum += hyst_product(p->feedback[i], state->position[i]);
    }
    sum += hyst_product(p->bilinear, times(state->position[0], state->drive));
    const int64_t in_phase = odd_powers(p->sine, state->drive) * hyst_sine(state->phase);
    const int64_t ahead = odd_powers(p->cosine, state->drive) * hyst_sine(state->phase + HYST_PHASE_QUARTER_TURN);
    return sum + hyst_round_shift(in_phase + ahead, 3); /* Q62, sum of all |A| <= 1: within 2^62 */
}

/* H of these plays, Q59. */
static int64_t share_of(const hyst_modified_play_t *model, const hyst_q31_t play[]) {
    const hyst_modified_play_parameters_t *p = &model->parameters;
    const uint32_t rows = rows_of(model);
    const uint32_t width = 2U * (uint32_t)model->pitch;
    int64_t sum = 0;
    uint32_t begin = 0;
    for (uint32_t row = 0; row < rows; row++) {
        const uint32_t cells = rows - row;
        const hyst_q31_t end = (hyst_q31_t)cells * model->pitch; /* 1 - r_i: the cells cover -end .. end */
        const uint32_t above = (uint32_t)((int64_t)hyst_clamp(play[row], -end, end) + end); /* 0 .. 2^32 - 2 */
        const uint32_t along = above / width;
        const uint32_t cell = begin + (along < cells ? along : cells - 1U);
        sum += model->base[cell] + p->slope[cell] * (int64_t)(above - (cell - begin) * width);
        begin += cells;
    }
    return sum;
}

/* Q59 to a signal, halves away from zero: C divides towards zero. divisor > 0; |x| < 1.8 * 2^62. */
static int64_t divide(int64_t x, int64_t divisor) {
    return (x < 0 ? x - divisor / 2 : x + divisor / 2) / divisor;
}

void hyst_modified_play_set_phase(const hyst_modified_play_t *model, hyst_modified_play_state_t *state,
                                  uint32_t phase) {
    state->phase = phase;
    state->known = known_of(model, state);
}

void hyst_modified_play_reset(const hyst_modified_play_t *model, hyst_modified_play_state_t *state, hyst_q31_t drive) {
    const hyst_modified_play_parameters_t *p = &model->parameters;
    for (uint32_t row = 0; row < rows_of(model); row++) {
        state->play[row] = hyst_play(threshold(model, row), drive, 0);
    }
    /* At rest y (1 - c1 - c2 - c3 - g u) = offset + 2A u + H. Jury's first condition at c1 + |g|: the bracket is > 0.
     */
    int64_t bracket = HYST_Q28_ONE - hyst_round_shift(hyst_product(p->bilinear, drive), 31);
    for (uint32_t i = 0; i < HYST_MODIFIED_PLAY_FEEDBACK; i++) {
        bracket -= p->feedback[i];
    }
    state->share = share_of(model, state->play);
    const int64_t sum =
        hyst_product(p->offset, HYST_Q28_ONE) + hyst_product(p->direct, drive) + state->share; /* < 2^62 */
    for (uint32_t i = 0; i < HYST_MODIFIED_PLAY_FEEDBACK; i++) {
        state->position[i] = hyst_saturate(divide(sum, bracket));
    }
    state->remainder = 0;
    state->drive = drive;
    state->rate = 0;
    hyst_modified_play_set_phase(model, state, p->phase);
}

void hyst_modified_play_advance(const hyst_modified_play_t *model, hyst_modified_play_state_t *state,
                                hyst_q31_t drive) {
    const hyst_modified_play_parameters_t *p = &model->parameters;
    const int64_t low = drive - widening(model, state, 1);
    const int64_t high = drive + widening(model, state, -1);
    for (uint32_t row = 0; row < rows_of(model); row++) {
        /* A bound that saturates does not bind: the play is within the range. */
        const hyst_q31_t r = threshold(model, row);
        state->play[row] = hyst_clamp(state->play[row], hyst_saturate(low - r), hyst_saturate(high + r));
    }
    state->share = share_of(model, state->play);
    const int64_t sum = state->known + hyst_product(p->direct, drive) + state->share;
    const int64_t rounded = hyst_round_shift(sum, 28);
    state->position[2] = state->position[1];
    state->position[1] = state->position[0];
    state->position[0] = hyst_saturate(rounded);
    state->remainder = state->position[0] == rounded ? (int32_t)(sum - rounded * HYST_Q28_ONE) : 0;
    /* As in prandtl_ishlinskii.c: a step in Q30 fits, and the new rate lies between the old one and the step. */
    const int64_t step = ((int64_t)drive - state->drive) >> 1;
    state->rate = (hyst_q30_t)(state->rate + hyst_round_shift((step - state->rate) * p->rate_gain, 30));
    state->drive = drive;
    hyst_modified_play_set_phase(model, state, state->phase + p->phase_step);
}

hyst_q31_t hyst_modified_play_output(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state) {
    (void)model;
    return state->position[0];
}

/*
 * Outward from where the drive begins to carry the first play. Lengths are measured outward (times +1 or -1) and
 * without the widening, so that up and down are one walk; the play i begins to move at outward p_i + r_i, which rises
 * with i (nesting), and columns begin at (2 J - N) / N. `remaining` >= 0 is what the output has left to go. Returns
 * where that is used up. At most 2 N steps: each passes a column or takes up a row.
 */
static int64_t walk(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state, int outward,
                    int64_t remaining) {
    const uint32_t rows = rows_of(model);
    const uint32_t zones = model->parameters.divisions + 1U; /* the last zone, behind all columns */
    const int64_t width = 2 * (int64_t)model->pitch;
    const int64_t first = -(int64_t)model->parameters.divisions * model->pitch; /* beginning of column 0 */
    int64_t here = (int64_t)outward * state->play[0] + threshold(model, 0);     /* |here| <= 2^32 */
    uint32_t moving = 1;
    uint32_t zone = here < first ? 0U : (uint32_t)((here - first) / width) + 1U;
    zone = zone < zones ? zone : zones;
    for (;;) {
        const int64_t column = zone < zones ? first + zone * width : INT64_MAX;
        const int64_t play =
            moving < rows ? (int64_t)outward * state->play[moving] + threshold(model, moving) : INT64_MAX;
        const int64_t next = column < play ? column : play;
        const int64_t slope = model->branch[outward > 0 ? 0 : 1][zone][moving];
        /* next - here < 2^32 + 2^32, slope <= 2^30. */
        if (next == INT64_MAX || slope * (next - here) >= remaining) {
            return here + divide(remaining, slope);
        }
        remaining -= slope * (next - here);
        here = next;
        zone += next == column ? 1U : 0U;
        moving += next == play ? 1U : 0U;
    }
}

/* What 2A u has to be at the next sample while no play moves, Q59. */
static int64_t goal_of(const hyst_modified_play_state_t *state, hyst_q31_t position) {
    return hyst_product(position, HYST_Q28_ONE) - state->known - state->share;
}

static hyst_q31_t within_range(int64_t drive, bool *saturated) {
    if (drive > HYST_Q31_MAX || drive < HYST_Q31_MIN) {
        *saturated = true;
    }
    return hyst_saturate(drive);
}

hyst_q31_t hyst_modified_play_solve(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state,
                                    hyst_q31_t position, bool *saturated) {
    const hyst_q28_t direct = model->parameters.direct;
    const int64_t rest = goal_of(state, position);
    for (int outward = -1; outward <= 1 && rows_of(model) > 0; outward += 2) {
        /* Where the drive begins to carry the first play. Out of the range it carries none. */
        const int64_t growth = widening(model, state, outward);
        const int64_t corner = outward * ((int64_t)outward * state->play[0] + model->pitch + growth);
        if (corner >= HYST_Q31_MIN && corner <= HYST_Q31_MAX) {
            const int64_t remaining = outward * (rest - direct * corner); /* |direct u| <= 2^61, counted in the 1.7 */
            if (remaining > 0) {
                return within_range(outward * (walk(model, state, outward, remaining) + growth), saturated);
            }
        }
    }
    return within_range(divide(rest, direct), saturated);
}

hyst_q31_t hyst_modified_play_direct_inverse(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state,
                                             hyst_q31_t position, bool *saturated) {
    const int64_t rest = goal_of(state, position);
    return within_range(divide(rest, model->parameters.direct), saturated);
}

hyst_q31_t hyst_modified_play_forward(const hyst_modified_play_t *model, hyst_modified_play_state_t *state,
                                      hyst_q31_t drive) {
    hyst_modified_play_advance(model, state, drive);
    return hyst_modified_play_output(model, state);
}

hyst_q31_t hyst_modified_play_inverse(const hyst_modified_play_t *model, hyst_modified_play_state_t *state,
                                      hyst_q31_t position, bool *saturated) {
    const hyst_q31_t drive = hyst_modified_play_solve(model, state, position, saturated);
    hyst_modified_play_advance(model, state, drive);
    return drive;
}

/* The old plays as a curve over the threshold, straight between them, from the drive at 0. */
static int64_t read_curve(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state, hyst_q31_t at) {
    const uint32_t rows = rows_of(model);
    const uint32_t below = (uint32_t)(at / model->pitch);
    const int64_t low = below > 0 ? state->play[(below < rows ? below : rows) - 1U] : state->drive;
    if (below >= rows) {
        return rows > 0 ? low : state->drive;
    }
    const int64_t beyond = at - (int64_t)below * model->pitch; /* < pitch <= 2^31; the product is below 2^63 */
    return low + (state->play[below] - low) * beyond / model->pitch;
}

void hyst_modified_play_carry(const hyst_modified_play_t *from, const hyst_modified_play_state_t *from_state,
                              const hyst_modified_play_t *to, hyst_modified_play_state_t *to_state) {
    *to_state = *from_state;
    const bool same_rows = from->parameters.divisions == to->parameters.divisions;
    for (uint32_t row = same_rows ? 0 : rows_of(to); row-- > 0;) {
        /* A play can be displaced as far as |p| + r <= 1, and from the next outer one by the pitch: nesting. */
        const hyst_q31_t r = threshold(to, row);
        const hyst_q31_t farthest = HYST_Q31_MAX - r;
        hyst_q31_t play = hyst_clamp(hyst_saturate(read_curve(from, from_state, r)), -farthest, farthest);
        if (row + 1U < rows_of(to)) {
            const hyst_q31_t outer = to_state->play[row + 1U];
            play = hyst_clamp(play, hyst_subtract(outer, to->pitch), hyst_add(outer, to->pitch));
        }
        to_state->play[row] = play;
    }
    to_state->share = share_of(to, to_state->play);
    hyst_modified_play_set_phase(to, to_state, from_state->phase);
}
