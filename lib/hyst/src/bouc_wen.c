/* SPDX-License-Identifier: MIT */
/*
 * Bounds used below. hyst_bouc_wen_build enforces 2^20 <= d, d + slope_i <= 2^30, hence |slope_i| < 2^30; a length is
 * below 2^31, so one cell's share is below 2^61 and the whole branch travels at most 2^37. All shares lie within 2^59,
 * all climbs within 2^62.
 */
#include "hyst/bouc_wen.h"
#include "hyst/reciprocal.h"

static bool slope_accepted(int64_t slope, hyst_bouc_wen_status_t *status) {
    if (slope < HYST_BOUC_WEN_MIN_SLOPE) {
        *status = HYST_BOUC_WEN_TOO_FLAT;
        return false;
    }
    if (slope > HYST_BOUC_WEN_MAX_SLOPE) {
        *status = HYST_BOUC_WEN_TOO_STEEP;
        return false;
    }
    return true;
}

static hyst_bouc_wen_status_t check(uint32_t cells, hyst_q28_t direct, const hyst_q31_t length[],
                                    const hyst_q28_t slope[], uint32_t *element) {
    hyst_bouc_wen_status_t status = HYST_BOUC_WEN_OK;
    int64_t share = 0; /* |share| <= 2^60, so a cell more is below 2^62 */
    int64_t climb = 0; /* <= 2^62, a cell more below 2^63 */
    if (!slope_accepted(direct, &status)) {
        return status;
    }
    for (uint32_t i = 0; i < cells; i++) {
        *element = i;
        if (length[i] <= 0) {
            return HYST_BOUC_WEN_LENGTH_NOT_POSITIVE;
        }
        if (slope[i] == 0 || (slope[i] < 0) != (slope[0] < 0)) {
            return HYST_BOUC_WEN_SLOPE_SIGN;
        }
        if (!slope_accepted((int64_t)direct + slope[i], &status)) {
            return status;
        }
        share += hyst_product(slope[i], length[i]);
        climb += hyst_product(direct + slope[i], length[i]);
        if (hyst_magnitude(share) > (int64_t)1 << 60 || climb > (int64_t)1 << 62) {
            return HYST_BOUC_WEN_BRANCH_TOO_LONG;
        }
    }
    return HYST_BOUC_WEN_OK;
}

hyst_bouc_wen_status_t hyst_bouc_wen_build(hyst_bouc_wen_t *model, uint32_t cells, hyst_q31_t offset, hyst_q28_t direct,
                                           const hyst_q31_t length[], const hyst_q28_t slope[], uint32_t *element) {
    *element = 0;
    if (cells > HYST_BOUC_WEN_MAX_CELLS) {
        return HYST_BOUC_WEN_TOO_MANY_CELLS;
    }
    const hyst_bouc_wen_status_t status = check(cells, direct, length, slope, element);
    if (status != HYST_BOUC_WEN_OK) {
        return status;
    }
    *element = 0;
    model->cells = cells;
    model->offset = offset;
    model->direct = direct;
    int64_t total = 0;
    for (uint32_t i = 0; i < cells; i++) {
        total += hyst_product(slope[i], length[i]);
    }
    model->climb_reciprocal[cells] = hyst_reciprocal((uint32_t)direct);
    model->place[0] = 0;
    model->share[0] = -(total / 2);
    model->climb[0] = 0;
    for (uint32_t i = 0; i < cells; i++) {
        model->slope[i] = slope[i];
        model->share_reciprocal[i] = hyst_reciprocal((uint32_t)hyst_magnitude(slope[i]));
        model->climb_reciprocal[i] = hyst_reciprocal((uint32_t)(direct + slope[i]));
        model->place[i + 1U] = model->place[i] + length[i];
        model->share[i + 1U] = model->share[i] + hyst_product(slope[i], length[i]);
        model->climb[i + 1U] = model->climb[i] + hyst_product(direct + slope[i], length[i]);
    }
    return HYST_BOUC_WEN_OK;
}

/* The last of `points` rising numbers that is not above x; 0 if there is none. At most 7 probes. */
static uint32_t last_not_above(const int64_t point[], uint32_t points, int64_t x) {
    const int64_t *at = point;
    for (uint32_t left = points - 1U; left > 0;) {
        const uint32_t half = (left + 1U) / 2U;
        at = at[half] <= x ? at + half : at;
        left -= half; /* beyond one that is above lie half - 1 <= left - half */
    }
    return (uint32_t)(at - point);
}

/* The last of `points` falling numbers that is not below x. */
static uint32_t last_not_below(const int64_t point[], uint32_t points, int64_t x) {
    const int64_t *at = point;
    for (uint32_t left = points - 1U; left > 0;) {
        const uint32_t half = (left + 1U) / 2U;
        at = at[half] >= x ? at + half : at;
        left -= half;
    }
    return (uint32_t)(at - point);
}

/* A place on the curve and the cell it lies in, or, at a boundary, one of the two: they have the same value there. The
 * end of the last cell may count as cell n. */
typedef struct {
    uint32_t cell;
    int64_t place;
} spot_t;

static spot_t spot_of(const hyst_bouc_wen_t *model, int64_t place) {
    return (spot_t){.cell = model->cells > 0 ? last_not_above(model->place, model->cells, place) : 0U, .place = place};
}

/* How far into its cell: a length, below 2^31. */
static int32_t inset_of(const hyst_bouc_wen_t *model, spot_t spot) {
    return (int32_t)(uint32_t)((uint64_t)spot.place - (uint64_t)model->place[spot.cell]);
}

/* s H there. */
static int64_t share_at(const hyst_bouc_wen_t *model, spot_t spot) {
    return spot.cell < model->cells
               ? model->share[spot.cell] + hyst_product(model->slope[spot.cell], inset_of(model, spot)) /* <= 2^61 */
               : model->share[spot.cell];
}

static int64_t climb_at(const hyst_bouc_wen_t *model, spot_t spot) {
    return spot.cell < model->cells ? model->climb[spot.cell] + hyst_product(model->direct + model->slope[spot.cell],
                                                                             inset_of(model, spot)) /* <= 2^62 */
                                    : model->climb[spot.cell];
}

/* s h as it counts along a branch: what the curve has, and the rest. |result| <= 2^59 + 2^30. */
static int64_t along(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state) {
    return share_at(model, spot_of(model, state->place)) + state->rest;
}

/* The place on the curve, to a unit of drive, where s H is nearest to `share`; *rest is what is left of it. */
static spot_t place_of(const hyst_bouc_wen_t *model, int64_t share, int64_t *rest) {
    const uint32_t n = model->cells;
    spot_t spot = {.cell = 0, .place = 0};
    if (n > 0) {
        const bool falls = model->slope[0] < 0;
        const uint32_t i =
            falls ? last_not_below(model->share, n + 1U, share) : last_not_above(model->share, n + 1U, share);
        const int64_t beyond = falls ? model->share[i] - share : share - model->share[i]; /* |beyond| < 2^61 */
        spot = (spot_t){.cell = i, .place = model->place[i]};
        if (i < n && beyond > 0) {
            const uint32_t slope = (uint32_t)(falls ? -model->slope[i] : model->slope[i]);
            uint32_t remainder; /* beyond < slope * length, so the quotient is below 2^31 + 1 */
            spot.place += hyst_divide((uint64_t)beyond + slope / 2U, slope, model->share_reciprocal[i], &remainder);
        }
    }
    *rest = share - share_at(model, spot);
    return spot;
}

/* Turns round: h, s h = `share` along the branch so far, stays, and the other branch goes on from where it has this h.
 */
static spot_t turn(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, int64_t share) {
    const spot_t spot = place_of(model, -share, &state->rest);
    state->place = spot.place;
    state->side = -state->side;
    return spot;
}

static void go_on(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive) {
    const int64_t step = (int64_t)drive - state->drive; /* |step| < 2^32 */
    const int64_t place = state->place + hyst_magnitude(step);
    const int64_t end = model->place[model->cells];
    state->place = place < end ? place : end;
    state->drive = drive;
}

/* Does a movement to the drive go against the present branch? */
static bool turns(const hyst_bouc_wen_state_t *state, hyst_q31_t drive) {
    return state->side > 0 ? drive < state->drive : drive > state->drive;
}

void hyst_bouc_wen_advance(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive) {
    if (turns(state, drive)) {
        (void)turn(model, state, along(model, state));
    }
    go_on(model, state, drive);
}

HYST_APART void hyst_bouc_wen_follow(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive,
                                     const hyst_bouc_wen_found_t *found) {
    if (!found->turned) {
        hyst_bouc_wen_advance(model, state, drive);
        return;
    }
    if (turns(state, drive)) {
        state->place = found->place;
        state->rest = found->rest;
        state->side = -state->side;
    }
    go_on(model, state, drive);
}

void hyst_bouc_wen_reset(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive) {
    state->place = place_of(model, 0, &state->rest).place;
    state->side = drive < 0 ? -1 : 1;
    state->drive = 0;
    hyst_bouc_wen_advance(model, state, drive);
}

static int64_t response(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state, int64_t share) {
    return hyst_product(model->direct, state->drive) + (state->side > 0 ? share : -share);
}

hyst_q31_t hyst_bouc_wen_output(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state) {
    const int64_t sum =
        response(model, state, along(model, state)) + hyst_product(model->offset, HYST_Q28_ONE); /* < 2^62 */
    return hyst_saturate(hyst_round_shift(sum, 28));
}

HYST_APART hyst_q31_t hyst_bouc_wen_find(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state,
                                         hyst_q31_t position, bool *saturated, hyst_bouc_wen_found_t *found) {
    spot_t spot = spot_of(model, state->place);
    const int64_t share = share_at(model, spot) + state->rest;
    /* |position - offset| < 2^32, so |distance| < 2^60 + 2^61 + 2^60 < 2^62. */
    const int64_t distance = ((int64_t)position - model->offset) * HYST_Q28_ONE - response(model, state, share);
    int32_t side = state->side;
    found->turned = distance != 0 && (distance < 0) != (side < 0);
    if (found->turned) {
        hyst_bouc_wen_state_t branch = *state;
        spot = turn(model, &branch, share);
        found->place = branch.place;
        found->rest = branch.rest;
        side = branch.side;
    }
    const int64_t goal = climb_at(model, spot) + hyst_magnitude(distance); /* < 2^62 + 2^62 */
    const uint32_t i = last_not_above(model->climb, model->cells + 1U, goal);
    const uint32_t slope = (uint32_t)(i < model->cells ? model->direct + model->slope[i] : model->direct);
    const uint64_t dividend = (uint64_t)(goal - model->climb[i]) + slope / 2U; /* goal >= climb[0] = 0 */
    if (dividend >> 32 >= slope) { /* 2^32 or more further than the place, which lies before the last cell's end */
        *saturated = true;
        return side > 0 ? HYST_Q31_MAX : HYST_Q31_MIN;
    }
    uint32_t remainder;
    const int64_t place =
        model->place[i] + (int64_t)hyst_divide(dividend, slope, model->climb_reciprocal[i], &remainder); /* < 2^38 */
    const int64_t drive = side > 0 ? state->drive + (place - spot.place) : state->drive - (place - spot.place);
    if (drive > HYST_Q31_MAX || drive < HYST_Q31_MIN) {
        *saturated = true;
    }
    return hyst_saturate(drive);
}

hyst_q31_t hyst_bouc_wen_solve(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state, hyst_q31_t position,
                               bool *saturated) {
    hyst_bouc_wen_found_t found;
    return hyst_bouc_wen_find(model, state, position, saturated, &found);
}

hyst_q31_t hyst_bouc_wen_forward(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive) {
    hyst_bouc_wen_advance(model, state, drive);
    return hyst_bouc_wen_output(model, state);
}

hyst_q31_t hyst_bouc_wen_inverse(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t position,
                                 bool *saturated) {
    hyst_bouc_wen_found_t found;
    const hyst_q31_t drive = hyst_bouc_wen_find(model, state, position, saturated, &found);
    hyst_bouc_wen_follow(model, state, drive, &found);
    return drive;
}

/* How many corners from the first on both curves share, looking from `corner` on at `most` of them. */
static uint32_t alike_up_to(const hyst_bouc_wen_t *a, const hyst_bouc_wen_t *b, uint32_t corner, uint32_t most) {
    const uint32_t end = corner + most < a->cells + 1U ? corner + most : a->cells + 1U;
    while (corner < end && a->place[corner] == b->place[corner] && a->share[corner] == b->share[corner]) {
        corner++;
    }
    return corner;
}

/* `share` of the one curve's end, taken from the other: Q59. */
static int64_t rescale(int64_t share, int64_t from_end, int64_t to_end) {
    const int64_t from_q31 = from_end / HYST_Q28_ONE; /* |.| <= 2^31 */
    if (from_q31 == 0) {
        return 0;
    }
    /* |share| <= 2^59 + 2^30: the quotient of Q59 and Q31 is Q28; cut to 1 where rounding exceeds it. */
    const int32_t fraction = hyst_clamp(hyst_saturate(share / from_q31), -HYST_Q28_ONE, HYST_Q28_ONE);
    return fraction * (to_end / HYST_Q28_ONE); /* 2^28 * 2^31 */
}

bool hyst_bouc_wen_carry(const hyst_bouc_wen_t *from, const hyst_bouc_wen_state_t *from_state,
                         const hyst_bouc_wen_t *to, hyst_bouc_wen_state_t *to_state, uint32_t *carried) {
    bool same = from->cells == to->cells;
    if (same) {
        const uint32_t begin = *carried;
        *carried = alike_up_to(from, to, begin, HYST_BOUC_WEN_CARRY_CORNERS);
        same = *carried == from->cells + 1U;
        if (!same && *carried == begin + HYST_BOUC_WEN_CARRY_CORNERS) {
            return false; /* so far they are */
        }
    }
    *to_state = *from_state;
    if (!same) {
        const int64_t share = rescale(along(from, from_state), from->share[from->cells], to->share[to->cells]);
        to_state->place = place_of(to, share, &to_state->rest).place;
    }
    return true;
}
