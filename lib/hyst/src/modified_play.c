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

/* Share in H of a play whose row has these cells, Q59. width: 2 pitch, below 2^31, as rows are there from two divisions
 * on. */
static inline int64_t share_of_row(const int64_t base[], const hyst_q28_t slope[], hyst_q31_t play, uint32_t cells,
                                   uint32_t width) {
    const hyst_q31_t end = (hyst_q31_t)(cells * (width / 2U)); /* 1 - r_i: the cells cover -end .. end */
    const uint32_t above = (uint32_t)hyst_clamp(play, -end, end) + (uint32_t)end; /* 0 .. 2^32 - 2 */
    const uint32_t along = above / width;
    const uint32_t cell = along < cells ? along : cells - 1U;
    return base[cell] + hyst_product(slope[cell], (int32_t)(above - cell * width)); /* 0 .. width */
}

/* H of these plays, Q59. */
static int64_t share_of(const hyst_modified_play_t *model, const hyst_q31_t play[]) {
    const uint32_t width = 2U * (uint32_t)model->pitch;
    const int64_t *base = model->base;
    const hyst_q28_t *slope = model->parameters.slope;
    int64_t sum = 0;
    for (uint32_t cells = rows_of(model); cells > 0; cells--) {
        sum += share_of_row(base, slope, *play++, cells, width);
        base += cells;
        slope += cells;
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

/* All plays, and their share. A bound that saturates does not bind: the play is within the range. */
static inline void move_plays(const hyst_modified_play_t *model, hyst_modified_play_state_t *state, hyst_q31_t drive) {
    const hyst_q31_t pitch = model->pitch;
    const int64_t *base = model->base;
    const hyst_q28_t *slope = model->parameters.slope;
    hyst_q31_t low = hyst_saturate(drive - widening(model, state, 1));
    hyst_q31_t high = hyst_saturate(drive + widening(model, state, -1));
    hyst_q31_t *play = state->play;
    int64_t sum = 0;
    for (uint32_t cells = rows_of(model); cells > 0; cells--) {
        low = hyst_subtract(low, pitch); /* less r_i */
        high = hyst_add(high, pitch);
        *play = hyst_clamp(*play, low, high);
        sum += share_of_row(base, slope, *play++, cells, 2U * (uint32_t)pitch);
        base += cells;
        slope += cells;
    }
    state->share = sum;
}

HYST_APART void hyst_modified_play_advance(const hyst_modified_play_t *model, hyst_modified_play_state_t *state,
                                           hyst_q31_t drive) {
    const hyst_modified_play_parameters_t *p = &model->parameters;
    move_plays(model, state, drive);
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

/* No column or row lies farther out. */
#define NOTHING UINT32_MAX

/*
 * Outward from where the drive begins to carry the first play. Lengths are measured outward (times +1 or -1) and
 * without the widening, so that up and down are one walk. The play i begins to move at outward p_i + r_i, which rises
 * with i (nesting), and columns begin at (2 j - N) / N. `remaining` > 0 is what the output has left to go. Returns
 * where that is used up, or 2^32 further than where the last step began if it is more. At most 2 N steps: each passes a
 * column or takes up a row.
 *
 * All places are within -1 .. 1 (|p_i| + r_i <= 1), so distances are below 2^32 - 1.
 */
static int64_t walk(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state, int outward,
                    uint64_t remaining) {
    const uint32_t divisions = model->parameters.divisions;
    const uint32_t pitch = (uint32_t)model->pitch;
    const hyst_q31_t *play = state->play;
    const hyst_q31_t *const last_play = play + rows_of(model) - 1U;
    const int64_t start = (int64_t)outward * *play + model->pitch;
    const int64_t beyond = start + (int64_t)divisions * model->pitch; /* the beginning of column 0 */
    uint32_t zone = beyond < 0 ? 0U : (uint32_t)beyond / (2U * pitch) + 1U;
    zone = zone < divisions + 1U ? zone : divisions + 1U; /* the last zone, behind all columns */
    uint32_t columns = divisions + 1U - zone;             /* that begin farther out */
    const hyst_q28_t *slope = &model->branch[outward > 0 ? 0 : 1][zone][1];
    uint32_t to_column = columns > 0 ? (uint32_t)((int64_t)zone * 2 * model->pitch - beyond) : NOTHING;
    uint32_t to_row = 0;
    uint32_t travelled = 0;
#define NEXT_ROW()                                                                                                     \
    (play < last_play ? (play++, pitch + (uint32_t)outward * ((uint32_t)play[0] - (uint32_t)play[-1])) : NOTHING)
    to_row = NEXT_ROW();
    for (;;) {
        const uint32_t step = to_column < to_row ? to_column : to_row;
        const uint64_t change = (uint64_t)(uint32_t)*slope * step;
        if (change >= remaining || step == NOTHING) {
            return start + travelled + (int64_t)hyst_divide_once(remaining + (uint32_t)*slope / 2U, (uint32_t)*slope);
        }
        remaining -= change;
        travelled += step;
        const bool takes_up = to_row == step;
        if (to_column == step) {
            slope += HYST_MODIFIED_PLAY_MAX_ROWS + 1;
            columns--;
            to_column = columns > 0 ? 2U * pitch : NOTHING;
        } else if (to_column != NOTHING) {
            to_column -= step;
        }
        if (takes_up) {
            slope++;
            to_row = NEXT_ROW();
        } else if (to_row != NOTHING) {
            to_row -= step;
        }
    }
#undef NEXT_ROW
}

/* What 2A u has to be at the next sample while no play moves, Q59. */
static int64_t goal_of(const hyst_modified_play_state_t *state, hyst_q31_t position) {
    return hyst_product(position, HYST_Q28_ONE) - state->known - state->share;
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

HYST_APART hyst_q31_t hyst_modified_play_solve(const hyst_modified_play_t *model,
                                               const hyst_modified_play_state_t *state, hyst_q31_t position,
                                               bool *saturated) {
    const hyst_q28_t direct = model->parameters.direct;
    const int64_t rest = goal_of(state, position);
    for (int outward = -1; outward <= 1 && rows_of(model) > 0; outward += 2) {
        /* Where the drive begins to carry the first play. Out of the range it carries none. */
        const int64_t growth = widening(model, state, outward);
        const int64_t corner = outward * ((int64_t)outward * state->play[0] + model->pitch + growth);
        if (corner >= HYST_Q31_MIN && corner <= HYST_Q31_MAX) {
            const int64_t remaining = outward * (rest - direct * corner); /* |direct u| <= 2^61, counted in the 1.7 */
            if (remaining > 0) {
                return within_range(outward * (walk(model, state, outward, (uint64_t)remaining) + growth), saturated);
            }
        }
    }
    return within_range(quotient(rest, direct), saturated);
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
