/* SPDX-License-Identifier: MIT */
/*
 * The modified play model with its tables against sums over all cells and bisection over all drives, in the same
 * integers: every bit of plays, shares and drives. Histories go anywhere, and to where a play begins to move, where a
 * column begins, and one unit beside.
 */
#include "modified_play_models.h"
#include "unity.h"
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

/* Plays that no type limits, of rows 1.. */
typedef struct {
    int64_t play[HYST_MODIFIED_PLAY_MAX_ROWS];
} plays_t;

static int64_t limited(int64_t x, int64_t low, int64_t high) {
    return x < low ? low : x > high ? high : x;
}

static plays_t plays_of(const hyst_modified_play_state_t *state, uint32_t divisions) {
    plays_t plays = {{0}};
    for (uint32_t i = 0; i + 1U < divisions; i++) {
        plays.play[i] = state->play[i];
    }
    return plays;
}

static int64_t widening(hyst_q20_t growth, hyst_q30_t rate) {
    return limited(hyst_round_shift(growth * llabs((int64_t)rate), 19), 0, (int64_t)1 << 32);
}

/* After a drive that may lie one unit out of the range. */
static plays_t moved(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state, int64_t drive) {
    const hyst_modified_play_parameters_t *p = &model->parameters;
    plays_t plays = plays_of(state, p->divisions);
    for (uint32_t i = 0; i + 1U < p->divisions; i++) {
        const int64_t r = (i + 1) * (int64_t)model->pitch;
        plays.play[i] = limited(plays.play[i], drive - r - widening(p->alpha, state->rate),
                                drive + r + widening(p->beta, state->rate));
    }
    return plays;
}

/* Share of the rows behind the first m in H, Q59: omega ramp((p - center) N), cell by cell. */
static int64_t share_behind(const hyst_modified_play_t *model, const plays_t *plays, uint32_t m) {
    const int n = (int)model->parameters.divisions;
    const int64_t pitch = model->pitch;
    int64_t sum = 0;
    uint32_t cell = 0;
    for (int i = 1; i < n; i++) {
        for (int j = 0; j < n - i; j++) {
            const int64_t past_center = plays->play[i - 1] - (2 * j + 1 - (n - i)) * pitch;
            const int64_t ramp = limited(past_center, -pitch, pitch);
            sum += i > (int)m ? model->parameters.slope[cell] * ramp : 0;
            cell++;
        }
    }
    return sum;
}

/* y at the next sample, Q59. */
static int64_t output_at(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state, int64_t drive) {
    const plays_t plays = moved(model, state, drive);
    return state->known + model->parameters.direct * drive + share_behind(model, &plays, 0);
}

/* -1, 1: from `drive` to the next one carries the first play down, up; 0: none. */
static int direction_at(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state, int64_t drive) {
    if (model->parameters.divisions == 1U) {
        return 0;
    }
    const int64_t up = state->play[0] + (int64_t)model->pitch + widening(model->parameters.alpha, state->rate);
    const int64_t down = state->play[0] - (int64_t)model->pitch - widening(model->parameters.beta, state->rate);
    return drive >= up ? 1 : drive < down ? -1 : 0;
}

/*
 * Bends lie at whole drives, so that from one to the next y is straight. Halves are rounded in the direction of travel,
 * and away from zero where no play moves.
 */
static hyst_q31_t plain_solve(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state,
                              hyst_q31_t position, bool *saturated) {
    const int64_t goal = hyst_product(position, HYST_Q28_ONE);
    int64_t low = (int64_t)INT32_MIN - 1;
    int64_t high = (int64_t)INT32_MAX + 1;
    if (output_at(model, state, low) >= goal || output_at(model, state, high) <= goal) {
        *saturated = true;
        return output_at(model, state, high) <= goal ? INT32_MAX : INT32_MIN;
    }
    while (high - low > 1) {
        const int64_t middle = low + (high - low) / 2;
        if (output_at(model, state, middle) <= goal) {
            low = middle;
        } else {
            high = middle;
        }
    }
    const int64_t before = output_at(model, state, low);
    const int64_t twice = 2 * (goal - before);
    const int64_t step = output_at(model, state, high) - before;
    const int direction = direction_at(model, state, low);
    const bool half_up = direction > 0 || (direction == 0 && low >= 0);
    const int64_t nearest = twice > step || (twice == step && half_up) ? high : low;
    *saturated = *saturated || nearest > INT32_MAX || nearest < INT32_MIN;
    return hyst_saturate(nearest);
}

/* As the header says, with the compiler's divisions. */
static plays_t plain_carry(const hyst_modified_play_t *from, const hyst_modified_play_state_t *state,
                           const hyst_modified_play_t *to) {
    const int64_t pitch = to->pitch;
    const uint32_t old_rows = from->parameters.divisions - 1U;
    plays_t plays = plays_of(state, from->parameters.divisions);
    if (from->parameters.divisions == to->parameters.divisions) {
        return plays;
    }
    for (uint32_t row = to->parameters.divisions - 1U; row-- > 0;) {
        const int64_t r = (row + 1) * pitch;
        const uint32_t below = (uint32_t)(r / from->pitch);
        int64_t play =
            below > 0 && old_rows > 0 ? state->play[(below < old_rows ? below : old_rows) - 1U] : state->drive;
        if (below < old_rows) {
            play += (state->play[below] - play) * (r % from->pitch) / from->pitch;
        }
        play = limited(limited(play, INT32_MIN, INT32_MAX), r - INT32_MAX, INT32_MAX - r);
        plays.play[row] = row + 2U < to->parameters.divisions
                              ? limited(play, plays.play[row + 1U] - pitch, plays.play[row + 1U] + pitch)
                              : play;
    }
    return plays;
}

/* Where a play begins to move, where it changes its cell, where the drive changes its column. */
static int64_t bend(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state) {
    const uint32_t n = model->parameters.divisions;
    const int64_t pitch = model->pitch;
    const int outward = random_unit(&rng) < 0.5 ? 1 : -1;
    const int64_t width = widening(outward > 0 ? model->parameters.alpha : model->parameters.beta, state->rate);
    if (n == 1U || random_unit(&rng) < 0.4) {
        return (2 * (int64_t)(random_bits(&rng) % (n + 1U)) - n) * pitch + outward * width;
    }
    const uint32_t row = (uint32_t)(random_bits(&rng) % (n - 1U));
    return state->play[row] + outward * ((row + 1) * pitch + width);
}

static hyst_q31_t any_drive(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state) {
    const double kind = random_unit(&rng);
    if (kind < 0.1) {
        return kind < 0.05 ? INT32_MIN : INT32_MAX;
    }
    return kind < 0.3   ? random_q31(&rng)
           : kind < 0.5 ? hyst_add(state->drive, random_q31(&rng) >> (random_bits(&rng) % 31U))
                        : hyst_saturate(bend(model, state) + random_between(&rng, -2, 2));
}

static hyst_q31_t any_position(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state) {
    if (random_unit(&rng) < 0.1) {
        return random_q31(&rng);
    }
    const int64_t there = output_at(model, state, any_drive(model, state));
    return hyst_saturate(hyst_round_shift(there, 28) + random_between(&rng, -2, 2));
}

static void check_memory(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state,
                         const plays_t *plays) {
    for (uint32_t m = 0; m < model->parameters.divisions; m++) {
        if (m + 1U < model->parameters.divisions) {
            TEST_ASSERT_EQUAL_INT64(plays->play[m], state->play[m]);
        }
        TEST_ASSERT_EQUAL_INT64(share_behind(model, plays, m), state->share[m]);
    }
}

/* Slopes that are few halves of a unit: goals half-way between two drives are frequent, and flat cells. */
static void coarse(hyst_modified_play_t *model) {
    hyst_modified_play_parameters_t p = modified_play_plain(0.5, 0.0);
    p.divisions = 1U + (uint32_t)(random_bits(&rng) % 14U);
    for (uint32_t cell = 0; cell < HYST_MODIFIED_PLAY_CELLS(p.divisions); cell++) {
        p.slope[cell] = (hyst_q28_t)(random_bits(&rng) % 2U) * (HYST_Q28_ONE / 4);
    }
    *model = modified_play_accept(&p);
}

static void any_model(hyst_modified_play_t *model) {
    if (random_unit(&rng) < 0.3) {
        coarse(model);
    } else {
        (void)modified_play_random(&rng, model);
    }
}

static void test_equals_sums_over_all_cells(void) {
    unsigned carried = 0;
    unsigned saturations = 0;
    unsigned count = 0;
    for (int run = 0; run < 2000; run++) {
        hyst_modified_play_t model, other;
        any_model(&model);
        any_model(&other);
        hyst_modified_play_state_t state, after;
        hyst_modified_play_reset(&model, &state, any_drive(&model, &(hyst_modified_play_state_t){0}));
        plays_t plays = plays_of(&state, model.parameters.divisions);
        check_memory(&model, &state, &plays);
        for (int k = 0; k < 200; k++) {
            const hyst_q31_t position = any_position(&model, &state);
            bool wanted = false;
            bool saturated = false;
            const hyst_q31_t drive = hyst_modified_play_solve(&model, &state, position, &saturated);
            TEST_ASSERT_EQUAL_INT32(plain_solve(&model, &state, position, &wanted), drive);
            TEST_ASSERT_EQUAL_INT(wanted, saturated);
            saturations += saturated ? 1U : 0U;
            const hyst_q31_t next = random_unit(&rng) < 0.5 ? drive : any_drive(&model, &state);
            const int64_t output = output_at(&model, &state, next);
            plays = moved(&model, &state, next);
            hyst_modified_play_advance(&model, &state, next);
            check_memory(&model, &state, &plays);
            TEST_ASSERT_EQUAL_INT32(hyst_saturate(hyst_round_shift(output, 28)), state.position[0]);
            count++;
        }
        plays = plain_carry(&model, &state, &other);
        hyst_modified_play_carry(&model, &state, &other, &after);
        check_memory(&other, &after, &plays);
        carried += model.parameters.divisions != other.parameters.divisions ? 1U : 0U;
    }
    printf("%u samples, %u out of reach, and %u memories carried to other grids: the same bits\n", count, saturations,
           carried);
    TEST_ASSERT_TRUE(saturations > 100U && carried > 100U);
}

int main(void) {
    rng = random_start("test_modified_play_plain", 20261128);
    UNITY_BEGIN();
    RUN_TEST(test_equals_sums_over_all_cells);
    return UNITY_END();
}
