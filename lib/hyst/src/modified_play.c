/* SPDX-License-Identifier: MIT */
/*
 * Bounds used below, enforced by hyst_modified_play_build, Q59: sum |omega| <= 2, so |H| <= 2^60; sum of all
 * coefficients of signals <= 10, so everything else is below 10 * 2^59 + 2^59 (offset) + 2^27 (remainder). Together
 * below 1.7 * 2^62. A branch's slope is 2^16 to 2^30.
 */
#include "hyst/modified_play.h"
#include "hyst/play.h"
#include "hyst/reciprocal.h"
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

/* u, u^3 and u^5. */
typedef struct {
    hyst_q31_t odd[HYST_MODIFIED_PLAY_HARMONICS];
} powers_t;

static inline powers_t odd_powers(hyst_q31_t u) {
    powers_t power;
    const hyst_q31_t square = times(u, u);
    power.odd[0] = u;
    for (uint32_t i = 1; i < HYST_MODIFIED_PLAY_HARMONICS; i++) {
        /* Not both are -1: the square is not negative. So it fits. */
        power.odd[i] = (hyst_q31_t)hyst_round_shift(hyst_product(power.odd[i - 1U], square), 31);
    }
    return power;
}

/* A1 u + A3 u^3 + A5 u^5 in Q31; sum |A| <= 1, so it is within 2^31 and the product with a sine within 2^62. */
static inline int64_t harmonics(const hyst_q28_t coefficient[HYST_MODIFIED_PLAY_HARMONICS], const powers_t *power) {
    int64_t sum = 0;
    for (uint32_t i = 0; i < HYST_MODIFIED_PLAY_HARMONICS; i++) {
        sum += hyst_product(coefficient[i], power->odd[i]);
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
    const powers_t power = odd_powers(state->drive);
    const int64_t in_phase = harmonics(p->sine, &power) * hyst_sine(state->phase);
    const int64_t ahead = harmonics(p->cosine, &power) * hyst_sine(state->phase + HYST_PHASE_QUARTER_TURN);
    return sum + hyst_round_shift(in_phase + ahead, 3); /* Q62, sum of all |A| <= 1: within 2^62 */
}

/* A reach (see hyst_modified_play_t): its zone's entry in the tables, without rows, and how far it is into the zone. */
typedef struct {
    uint32_t entry;
    hyst_q31_t inset; /* below 2 pitch: behind all columns there are N units at most */
} spot_t;

/* Of models with rows: with one division a column's width, 2 pitch, is nearly 2^32. */
static HYST_WITHIN uint32_t zone_of(const hyst_modified_play_t *model, uint32_t reach, uint32_t width) {
    const uint32_t along = reach / width;
    return along < model->parameters.divisions ? along : model->parameters.divisions;
}

static HYST_WITHIN spot_t spot_of(const hyst_modified_play_t *model, uint32_t reach) {
    const uint32_t width = 2U * (uint32_t)model->pitch;
    const uint32_t zone = zone_of(model, reach, width);
    return (spot_t){.entry = HYST_MODIFIED_PLAY_ZONE(zone), .inset = (hyst_q31_t)(reach - zone * width)};
}

/* 2A reach (going down: -2A reach) and the share of the first `rows` rows, for a reach that carries them. Q59 */
static HYST_WITHIN int64_t level_at(const hyst_modified_play_t *model, int outward, spot_t spot, uint32_t rows) {
    const unsigned down = outward > 0 ? 0 : 1;
    return model->level[down][spot.entry + rows] +
           hyst_product(model->branch[down][spot.entry + rows], outward * spot.inset);
}

/* The reach that begins to carry a row. 0 .. 2^32 - 1, as |p| + r <= 2^31. */
static HYST_WITHIN uint32_t corner_of(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state,
                                      int outward, uint32_t row) {
    return (uint32_t)(outward * state->play[row]) + (model->parameters.divisions + row + 1U) * (uint32_t)model->pitch;
}

/* The shares of all plays. What the tables have for a row more is that row's share, if the drive's part is the same. */
static void sum_shares(const hyst_modified_play_t *model, hyst_modified_play_state_t *state) {
    int64_t sum = 0;
    state->share[rows_of(model)] = 0;
    for (uint32_t row = rows_of(model); row-- > 0;) {
        const spot_t spot = spot_of(model, corner_of(model, state, 1, row));
        const int64_t *const level = &model->level[0][spot.entry + row];
        const hyst_q28_t *const branch = &model->branch[0][spot.entry + row];
        sum += level[1] - level[0] + hyst_product(branch[1] - branch[0], spot.inset); /* the slope of its cell */
        state->share[row] = sum;
    }
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
    sum_shares(model, state);
    const int64_t sum =
        hyst_product(p->offset, HYST_Q28_ONE) + hyst_product(p->direct, drive) + state->share[0]; /* < 2^62 */
    const hyst_q31_t position = hyst_saturate(divide(sum, bracket));
    for (uint32_t i = 0; i < HYST_MODIFIED_PLAY_FEEDBACK; i++) {
        state->position[i] = position;
    }
    state->remainder = 0;
    state->drive = drive;
    state->rate = 0;
    hyst_modified_play_set_phase(model, state, p->phase);
}

/*
 * A reach that carries the first row. By nesting, the rows that it carries are the first ones. The others keep their
 * share, and of these the table has it.
 */
static HYST_WITHIN void carry_rows(const hyst_modified_play_t *model, hyst_modified_play_state_t *state, int outward,
                                   uint32_t reach) {
    const uint32_t all = rows_of(model);
    const hyst_q31_t pitch = model->pitch;
    hyst_q31_t *const play = state->play;
    /* Where the next row is carried to, outward. It is above where the last one stood, less the pitch: -2^31 or more.
     */
    hyst_q31_t to = (hyst_q31_t)(reach - (model->parameters.divisions + 1U) * (uint32_t)pitch);
    uint32_t rows = 0;
    do {
        play[rows++] = outward * to;
        to -= pitch;
    } while (rows < all && outward * play[rows] < to);
    const spot_t spot = spot_of(model, reach);
    const int64_t sum = state->share[rows] + level_at(model, outward, spot, rows);
    for (uint32_t row = 0; row < rows; row++) {
        state->share[row] = sum - level_at(model, outward, spot, row);
    }
}

/* At most one of both directions carries anything: the widening is not negative. */
static inline void move_plays(const hyst_modified_play_t *model, hyst_modified_play_state_t *state, hyst_q31_t drive) {
    if (rows_of(model) == 0) {
        return;
    }
    const int64_t ahead = (int64_t)drive - state->play[0];
    if (ahead > model->pitch) {
        const int64_t beyond = ahead - model->pitch - widening(model, state, 1);
        if (beyond > 0) {
            carry_rows(model, state, 1, corner_of(model, state, 1, 0) + (uint32_t)beyond);
        }
    } else if (-ahead > model->pitch) {
        const int64_t beyond = -ahead - model->pitch - widening(model, state, -1);
        if (beyond > 0) {
            carry_rows(model, state, -1, corner_of(model, state, -1, 0) + (uint32_t)beyond);
        }
    }
}

HYST_APART void hyst_modified_play_advance(const hyst_modified_play_t *model, hyst_modified_play_state_t *state,
                                           hyst_q31_t drive) {
    const hyst_modified_play_parameters_t *p = &model->parameters;
    move_plays(model, state, drive);
    const int64_t sum = state->known + hyst_product(p->direct, drive) + state->share[0];
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
 * The reach at which 2A reach + H (going down: -2A reach + H) is `goal`, which lies beyond the first row's corner. 2^32
 * further than its zone begins, or more: out of the range. At a corner the row that is taken up still stands where it
 * stood, so H there is the share of the rows within, carried, and that of the memory from this row on. By nesting,
 * corners lie further out from row to row, and by slopes > 0, so do levels. From the last corner that is passed, a zone
 * or two begin before the next, and between them all is straight.
 *
 * Outward, in units of 2^59: levels with their shares are -2 .. 10 (2A <= 4), the goal is between that of the first
 * corner and 12. So differences fit.
 */
static HYST_WITHIN int64_t reach_of(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state,
                                    int outward, int64_t goal) {
    const uint32_t all = rows_of(model);
    const unsigned down = outward > 0 ? 0 : 1;
    uint32_t row = 0;
    for (uint32_t step = (HYST_MODIFIED_PLAY_MAX_ROWS + 1) / 2; step > 0; step /= 2U) {
        const uint32_t next = row + step;
        if (next < all) {
            const spot_t spot = spot_of(model, corner_of(model, state, outward, next));
            const int64_t there = level_at(model, outward, spot, next) + state->share[next];
            row = outward > 0 ? (there < goal ? next : row) : (there > goal ? next : row);
        }
    }
    const uint32_t width = 2U * (uint32_t)model->pitch;
    uint32_t zone = zone_of(model, corner_of(model, state, outward, row), width);
    const int64_t *level = &model->level[down][row + 1U];
    goal -= state->share[row + 1U];
    while (zone < model->parameters.divisions && outward * (goal - level[HYST_MODIFIED_PLAY_ZONE(zone + 1U)]) > 0) {
        zone++;
    }
    const uint32_t entry = HYST_MODIFIED_PLAY_ZONE(zone);
    const uint32_t slope = (uint32_t)model->branch[down][entry + row + 1U];
    const uint64_t left = (uint64_t)(outward * (goal - level[entry]));
    return (int64_t)zone * width + (int64_t)hyst_divide_once(left + slope / 2U, slope);
}

/* What 2A u has to be at the next sample while no play moves, Q59. */
static int64_t goal_of(const hyst_modified_play_state_t *state, hyst_q31_t position) {
    return hyst_product(position, HYST_Q28_ONE) - state->known - state->share[0];
}

/* As divide, or 2^32 and its sign where that is more. divisor: 32 bits. */
static int64_t quotient(int64_t x, hyst_q28_t divisor) {
    const uint64_t dividend = (uint64_t)hyst_magnitude(x) + (uint32_t)divisor / 2U;
    const int64_t size = (int64_t)hyst_divide_once(dividend, (uint32_t)divisor);
    return x < 0 ? -size : size;
}

static hyst_q31_t within_range(int64_t drive, bool *saturated) {
    if (drive > HYST_Q31_MAX || drive < HYST_Q31_MIN) {
        *saturated = true;
    }
    return hyst_saturate(drive);
}

/* True if the position lies where a drive outward carries plays. *drive is that drive, in the range or out of it. */
static HYST_WITHIN bool solve_outward(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state,
                                      int outward, int64_t rest, int64_t *drive) {
    const hyst_q28_t direct = model->parameters.direct;
    /* Where the drive begins to carry the first play. Out of the range it carries none. */
    const int64_t from_reach = widening(model, state, outward) - (int64_t)model->parameters.divisions * model->pitch;
    const int64_t corner = outward * (corner_of(model, state, outward, 0) + from_reach);
    if (corner < HYST_Q31_MIN || corner > HYST_Q31_MAX) {
        return false;
    }
    if (outward * (rest - direct * corner) <= 0) { /* |direct u| <= 2^61, counted in the 1.7 */
        return false;
    }
    const int64_t goal = rest + state->share[0] - outward * direct * from_reach; /* |from_reach| <= 2^31, as corner */
    *drive = outward * (reach_of(model, state, outward, goal) + from_reach);
    return true;
}

HYST_APART hyst_q31_t hyst_modified_play_solve(const hyst_modified_play_t *model,
                                               const hyst_modified_play_state_t *state, hyst_q31_t position,
                                               bool *saturated) {
    const int64_t rest = goal_of(state, position);
    int64_t drive = 0;
    if (rows_of(model) == 0 ||
        (!solve_outward(model, state, 1, rest, &drive) && !solve_outward(model, state, -1, rest, &drive))) {
        drive = quotient(rest, model->parameters.direct);
    }
    return within_range(drive, saturated);
}

hyst_q31_t hyst_modified_play_direct_inverse(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state,
                                             hyst_q31_t position, bool *saturated) {
    const int64_t rest = goal_of(state, position);
    return within_range(quotient(rest, model->parameters.direct), saturated);
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

/* The old plays as a curve over the threshold, straight between them, from the drive at 0. The pitch's reciprocal. */
static HYST_WITHIN hyst_q31_t read_curve(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state,
                                         hyst_q31_t at, uint32_t reciprocal) {
    const uint32_t rows = rows_of(model);
    const uint32_t pitch = (uint32_t)model->pitch;
    const uint32_t below = (uint32_t)at / pitch;
    if (below >= rows) {
        return rows > 0 ? state->play[rows - 1U] : state->drive;
    }
    const hyst_q31_t near = below > 0 ? state->play[below - 1U] : state->drive;
    const hyst_q31_t far = state->play[below];
    const uint32_t beyond = (uint32_t)at - below * pitch; /* < pitch */
    /* Distances are below 2^32, and a part of one is no farther than the whole: what it leads to fits. */
    const uint32_t whole = far < near ? (uint32_t)near - (uint32_t)far : (uint32_t)far - (uint32_t)near;
    uint32_t rest;
    const uint32_t part = hyst_divide((uint64_t)whole * beyond, pitch, reciprocal, &rest);
    return (hyst_q31_t)(far < near ? (uint32_t)near - part : (uint32_t)near + part);
}

static HYST_WITHIN void read_plays(const hyst_modified_play_t *from, const hyst_modified_play_state_t *from_state,
                                   const hyst_modified_play_t *to, hyst_modified_play_state_t *to_state) {
    const uint32_t reciprocal = hyst_reciprocal((uint32_t)from->pitch);
    hyst_q31_t r = threshold(to, rows_of(to)) - to->pitch;
    /* A play can be displaced as far as |p| + r <= 1, and from the next outer one by the pitch: nesting. */
    hyst_q31_t high = HYST_Q31_MAX - r;
    hyst_q31_t low = -high;
    for (uint32_t row = rows_of(to); row-- > 0;) {
        const hyst_q31_t play = hyst_clamp(read_curve(from, from_state, r, reciprocal), low, high);
        to_state->play[row] = play;
        low = play - to->pitch; /* |p| + pitch <= 1, as r is the pitch or more */
        high = play + to->pitch;
        r -= to->pitch;
    }
}

HYST_APART void hyst_modified_play_carry(const hyst_modified_play_t *from, const hyst_modified_play_state_t *from_state,
                                         const hyst_modified_play_t *to, hyst_modified_play_state_t *to_state) {
    *to_state = *from_state;
    if (from->parameters.divisions != to->parameters.divisions) {
        read_plays(from, from_state, to, to_state);
    }
    sum_shares(to, to_state);
    hyst_modified_play_set_phase(to, to_state, from_state->phase);
}
