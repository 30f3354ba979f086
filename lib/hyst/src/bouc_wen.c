/* SPDX-License-Identifier: MIT */
/*
 * Bounds used below. hyst_bouc_wen_build enforces 2^20 <= d, d + slope_i <= 2^30, hence |slope_i| < 2^30; a length is
 * below 2^31, so one cell's share is below 2^61 and the whole branch travels at most 2^37. All shares lie within 2^59,
 * all climbs within 2^62.
 */
#include "hyst/bouc_wen.h"

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
    model->place[0] = 0;
    model->share[0] = -(total / 2);
    model->climb[0] = 0;
    for (uint32_t i = 0; i < cells; i++) {
        model->slope[i] = slope[i];
        model->place[i + 1U] = model->place[i] + length[i];
        model->share[i + 1U] = model->share[i] + hyst_product(slope[i], length[i]);
        model->climb[i + 1U] = model->climb[i] + hyst_product(direct + slope[i], length[i]);
    }
    return HYST_BOUC_WEN_OK;
}

/*
 * The last of `points` rising numbers that is not above x; 0 if there is none. sign = -1 reads a falling table as a
 * rising one. At most 7 probes.
 */
static uint32_t last_not_above(const int64_t point[], uint32_t points, int64_t x, int sign) {
    uint32_t low = 0;
    uint32_t high = points;
    while (high - low > 1U) {
        const uint32_t middle = low + (high - low) / 2U;
        if (sign * point[middle] <= sign * x) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

/* s H at a place. A place at a boundary has the same value in both cells. */
static int64_t share_at(const hyst_bouc_wen_t *model, int64_t place) {
    if (model->cells == 0) {
        return 0;
    }
    const uint32_t i = last_not_above(model->place, model->cells, place, 1);
    return model->share[i] + model->slope[i] * (place - model->place[i]); /* within the cell: below 2^61 */
}

static int64_t climb_at(const hyst_bouc_wen_t *model, int64_t place) {
    if (model->cells == 0) {
        return 0;
    }
    const uint32_t i = last_not_above(model->place, model->cells, place, 1);
    return model->climb[i] + (int64_t)(model->direct + model->slope[i]) * (place - model->place[i]); /* <= 2^62 */
}

/* s h as it counts along a branch: what the curve has, and the rest. |result| <= 2^59 + 2^30. */
static int64_t along(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state) {
    return share_at(model, state->place) + state->rest;
}

/* The place on the curve, to a unit of drive, where s H is nearest to `share`; *rest is what is left of it. */
static int64_t place_of(const hyst_bouc_wen_t *model, int64_t share, int64_t *rest) {
    const uint32_t n = model->cells;
    int64_t place = 0;
    if (n > 0) {
        const int sign = model->slope[0] < 0 ? -1 : 1;
        const uint32_t i = last_not_above(model->share, n + 1U, share, sign);
        place = model->place[i];
        const int64_t beyond = sign * (share - model->share[i]); /* |beyond| < 2^61 */
        if (i < n && beyond > 0) {
            const int64_t slope = sign * (int64_t)model->slope[i];
            place += (beyond + slope / 2) / slope; /* < length: beyond < slope * length */
        }
    }
    *rest = share - share_at(model, place);
    return place;
}

/* Turns round: h stays, and the other branch goes on from where it has this h. */
static void turn(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state) {
    state->place = place_of(model, -along(model, state), &state->rest);
    state->side = -state->side;
}

void hyst_bouc_wen_reset(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive) {
    state->place = place_of(model, 0, &state->rest);
    state->side = drive < 0 ? -1 : 1;
    state->drive = 0;
    hyst_bouc_wen_advance(model, state, drive);
}

void hyst_bouc_wen_advance(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive) {
    const int64_t step = (int64_t)drive - state->drive; /* |step| < 2^32 */
    if (step * state->side < 0) {
        turn(model, state);
    }
    const int64_t place = state->place + hyst_magnitude(step);
    const int64_t end = model->place[model->cells];
    state->place = place < end ? place : end;
    state->drive = drive;
}

/* Output less the offset, Q59: 2^61 + 2^59 + 2^30. */
static int64_t response(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state) {
    return hyst_product(model->direct, state->drive) + state->side * along(model, state);
}

hyst_q31_t hyst_bouc_wen_output(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state) {
    const int64_t sum = response(model, state) + hyst_product(model->offset, HYST_Q28_ONE); /* < 2^62 */
    return hyst_saturate(hyst_round_shift(sum, 28));
}

hyst_q31_t hyst_bouc_wen_solve(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state, hyst_q31_t position,
                               bool *saturated) {
    /* |position - offset| < 2^32, so |distance| < 2^60 + 2^61 + 2^60 < 2^62. */
    const int64_t distance = ((int64_t)position - model->offset) * HYST_Q28_ONE - response(model, state);
    hyst_bouc_wen_state_t branch = *state;
    if (distance != 0 && (distance < 0) != (state->side < 0)) {
        turn(model, &branch);
    }
    const uint32_t n = model->cells;
    const int64_t goal = climb_at(model, branch.place) + hyst_magnitude(distance); /* < 2^62 + 2^62 */
    const uint32_t i = last_not_above(model->climb, n + 1U, goal, 1);
    const int64_t slope = i < n ? (int64_t)model->direct + model->slope[i] : model->direct;
    const int64_t place = model->place[i] + (goal - model->climb[i] + slope / 2) / slope; /* < 2^37 + 2^43 */
    const int64_t drive = state->drive + branch.side * (place - branch.place);
    if (drive > HYST_Q31_MAX || drive < HYST_Q31_MIN) {
        *saturated = true;
    }
    return hyst_saturate(drive);
}

hyst_q31_t hyst_bouc_wen_forward(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive) {
    hyst_bouc_wen_advance(model, state, drive);
    return hyst_bouc_wen_output(model, state);
}

hyst_q31_t hyst_bouc_wen_inverse(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t position,
                                 bool *saturated) {
    const hyst_q31_t drive = hyst_bouc_wen_solve(model, state, position, saturated);
    hyst_bouc_wen_advance(model, state, drive);
    return drive;
}

static bool same_curve(const hyst_bouc_wen_t *a, const hyst_bouc_wen_t *b) {
    bool same = a->cells == b->cells;
    for (uint32_t i = 0; same && i <= a->cells; i++) {
        same = a->place[i] == b->place[i] && a->share[i] == b->share[i];
    }
    return same;
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

void hyst_bouc_wen_carry(const hyst_bouc_wen_t *from, const hyst_bouc_wen_state_t *from_state,
                         const hyst_bouc_wen_t *to, hyst_bouc_wen_state_t *to_state) {
    *to_state = *from_state;
    if (!same_curve(from, to)) {
        const int64_t share = rescale(along(from, from_state), from->share[from->cells], to->share[to->cells]);
        to_state->place = place_of(to, share, &to_state->rest);
    }
}
