/* SPDX-License-Identifier: MIT */
/* Bounds as in lib/hyst/src/bouc_wen.c. */
#include "bouc_wen_plain.h"

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

void bouc_wen_plain_reset(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive) {
    state->place = place_of(model, 0, &state->rest);
    state->side = drive < 0 ? -1 : 1;
    state->drive = 0;
    bouc_wen_plain_advance(model, state, drive);
}

void bouc_wen_plain_advance(const hyst_bouc_wen_t *model, hyst_bouc_wen_state_t *state, hyst_q31_t drive) {
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

hyst_q31_t bouc_wen_plain_output(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state) {
    const int64_t sum = response(model, state) + hyst_product(model->offset, HYST_Q28_ONE); /* < 2^62 */
    return hyst_saturate(hyst_round_shift(sum, 28));
}

hyst_q31_t bouc_wen_plain_solve(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state, hyst_q31_t position,
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
