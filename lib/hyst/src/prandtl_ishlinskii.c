/* SPDX-License-Identifier: MIT */
/*
 * Bounds used below. hyst_pi_build enforces sum |w_i| <= 4, that is 2^30 in Q28; hence |w_i| <= 2^30 and 2^20 <= S_j <=
 * 2^30. Signals are below 2^31 in magnitude, so products are below 2^61 and the whole weighted sum is too. A corner is
 * a memory plus or minus a threshold, below 2^32, and the responses there are within 2^62. The goals of searches are a
 * position less offset, below 2^60 in Q59, less or plus S_0 growth <= 2^61.
 *
 * A corner outside Q31 is stored as the end of the range, and a drive less or plus the growth is saturated, too. The
 * comparisons stay exact: a drive never lies beyond such a corner, and the end of the range never lies beyond itself.
 * (Going up, a drive's lower end is below every corner, because these are memory plus a positive threshold; going down
 * likewise.)
 *
 * `outward` is a constant, +1 or -1, wherever it is an argument of an inline function: the compiler makes one copy for
 * each direction.
 */
#include "hyst/reciprocal.h"
#include "prandtl_ishlinskii_runs.h"

static inline uint32_t smaller(uint32_t a, uint32_t b) {
    return a < b ? a : b;
}

/* Index of the direction outward, and of the other one. */
#define ALONG(outward)   ((outward) > 0 ? HYST_PI_UP : HYST_PI_DOWN)
#define AGAINST(outward) ((outward) > 0 ? HYST_PI_DOWN : HYST_PI_UP)

/* Outermost run whose first operator is carried by a movement to `edge`, when that of the innermost is. */
static HYST_WITHIN hyst_pi_run_t *last_run_by_drive(hyst_pi_state_t *state, hyst_pi_run_t *behind, hyst_q31_t edge,
                                                    int outward) {
    const uint32_t open = state->runs - 1U;
    hyst_pi_run_t *run = state->run;
#define CARRIED(i)  (outward > 0 ? edge > run[i].corner[ALONG(outward)] : edge < run[i].corner[ALONG(outward)])
#define FIRST(size) run = CARRIED((size)-1) ? run : behind - (size)
#define PROBE(half) run = CARRIED((half)-1) ? run : run + (half)
    HYST_PI_BISECT_RUNS(open, FIRST, PROBE)
#undef CARRIED
    return run;
}

/* The same for a movement that ends where the position is `goal`. */
static HYST_WITHIN const hyst_pi_run_t *last_run_by_position(const hyst_pi_state_t *state, const hyst_pi_run_t *behind,
                                                             int64_t goal, int outward) {
    const uint32_t open = state->runs - 1U;
    const hyst_pi_run_t *run = state->run;
#define CARRIED(i) (outward > 0 ? goal > run[i].response[ALONG(outward)] : goal < run[i].response[ALONG(outward)])
    HYST_PI_BISECT_RUNS(open, FIRST, PROBE)
#undef CARRIED
#undef PROBE
#undef FIRST
    return run;
}

/* Turn of the last operator whose turn is below, if that of operator 0 is; as hyst_pi_last_within. */
static inline const int64_t *last_turn_below(const hyst_pi_t *model, uint64_t reach) {
    const int64_t *at = model->turn;
#define PROBE(half) at = (uint64_t)at[half] < reach ? at + (half) : at
    HYST_PI_PROBE_LEVELS(model->levels, PROBE)
#undef PROBE
    return at;
}

/*
 * The first `end` operators, up to one of `run`, turn round at the drive `edge`, where the position is `response`, both
 * less the growth: they become the innermost run. |edge|: Q31, see above.
 */
static HYST_WITHIN void carry_along(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_pi_run_t *run, uint32_t end,
                                    hyst_q31_t edge, int64_t response, int outward) {
    if (end < run->end) { /* some are left behind */
        if (run->side == 0) {
            (void)hyst_pi_begin_at(model, run, end);
        } else { /* its side is outward: the other way they all turn at one drive still */
            const hyst_q31_t threshold = model->threshold[end];
            const hyst_q31_t memory =
                (hyst_q31_t)((uint32_t)run->level + (uint32_t)outward * (uint32_t)threshold); /* as hyst_pi_memory_in */
            run->first = (uint8_t)end;
            run->response[ALONG(outward)] = run->response[AGAINST(outward)] + outward * model->turn[end];
            run->corner[ALONG(outward)] = outward > 0 ? hyst_add(memory, threshold) : hyst_subtract(memory, threshold);
        }
        run++;
    }
    const hyst_q31_t threshold = model->threshold[0];
    run->response[ALONG(outward)] = response;
    run->response[AGAINST(outward)] = response - outward * model->turn[0]; /* <= 2^62, as every response */
    run->corner[ALONG(outward)] = edge;
    run->corner[AGAINST(outward)] = outward > 0 ? hyst_subtract(hyst_subtract(edge, threshold), threshold)
                                                : hyst_add(hyst_add(edge, threshold), threshold);
    run->level = edge;
    run->end = (uint16_t)end;
    run->side = (int8_t)-outward;
    run->first = 0;
    state->runs = (uint32_t)(run - state->run) + 1U; /* <= operators: every run has at least one */
}

/* Carries along all operators that the drive less the growth, `edge`, lies beyond; the innermost is one of them. */
static HYST_WITHIN void move_outward(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_pi_run_t *behind,
                                     hyst_q31_t edge, int outward) {
    hyst_pi_run_t *run = last_run_by_drive(state, behind, edge, outward);
    /* Beyond the corner of its first operator by 1 .. 2^32 - 1, modulo 2^32. */
    uint32_t beyond = outward > 0 ? (uint32_t)edge - (uint32_t)run->corner[ALONG(outward)]
                                  : (uint32_t)run->corner[ALONG(outward)] - (uint32_t)edge;
    uint32_t end = run->end;
    int64_t response;
    if (run->side == -outward) {
        response = run->response[ALONG(outward)];
    } else {
        /* Corner i lies |side + outward| (a_i - a_first) further out. Up to 2^31 + (2^32 - 2) / 2; or, where the memory
         * is the level, edge - level - 1 in all: below 2^32. */
        const uint32_t nearest = (uint32_t)model->threshold[run->first];
        const unsigned twice = (unsigned)run->side & 1U;
        const uint32_t reach = nearest + ((beyond - 1U) >> twice);
        beyond += nearest << twice; /* modulo 2^32, until the last one's corner is taken off */
        /* Thresholds rise over all runs: within this one it is that, or its last. */
        end = smaller(end, 1U + hyst_pi_last_within(model, reach));
        if (run->side != 0) {
            beyond -= 2U * (uint32_t)model->threshold[end - 1U];
            response = run->response[AGAINST(outward)] + outward * model->turn[end - 1U];
        } else {
            beyond -= (uint32_t)model->threshold[end - 1U];
            const int64_t turned = model->turn[end - 1U] - model->turn[run->first]; /* both even */
            response = run->response[ALONG(outward)] + outward * (turned >> 1);
        }
    }
    /* Behind the corner of the last one the slope is S_end: 2^32 * 2^30 = 2^62 at most; the sum is a response. */
    response += outward * (int64_t)((uint64_t)beyond * (uint32_t)model->slope[end].value);
    carry_along(model, state, run, end, edge, response, outward);
}

static inline void move(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t drive, hyst_q31_t growth) {
    if (state->runs == 0) {
        return;
    }
    /* At most one of the two finds anything. Not only the sign of the step decides: thresholds may also have shrunk. */
    hyst_pi_run_t *behind = state->run + state->runs; /* the innermost run */
    const hyst_q31_t up = hyst_subtract(drive, growth);
    const hyst_q31_t down = hyst_add(drive, growth);
    if (up > behind[-1].corner[HYST_PI_UP]) {
        move_outward(model, state, behind, up, 1);
    } else if (down < behind[-1].corner[HYST_PI_DOWN]) {
        move_outward(model, state, behind, down, -1);
    }
}

/* (a - b) / 2, rounded down: fits. Bit by bit a - b is a ^ b, less twice what b has and a has not. */
static inline int32_t half_difference(int32_t a, int32_t b) {
    return ((a ^ b) >> 1) - (b & ~a);
}

/* The drive's past. */
static inline void remember(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t drive) {
    if (model->beta != 0) {
        /* Step in Q30, |step| <= 2^31. Two products of at most 2^31 * 2^30. */
        int64_t change = HYST_Q30_ONE / 2; /* half a unit: rounds to nearest */
        change += hyst_product(half_difference(drive, state->drive), model->rate_gain);
        change += hyst_product(state->rate, -model->rate_gain);
        /* The new rate lies between the old one and the step, so it fits; the change alone may need 33 bits. */
        state->rate = (hyst_q30_t)((uint32_t)state->rate + (uint32_t)((uint64_t)change >> 30));
        state->growth = hyst_pi_growth(model, state->rate);
    }
    state->drive = drive;
}

void hyst_pi_reset(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t drive) {
    state->runs = 0;
    state->rate = 0;
    state->growth = 0;
    state->drive = drive;
    if (model->operators > 0) {
        hyst_pi_run_t *all = &state->run[0];
        all->level = 0;
        all->side = 0;
        all->end = (uint16_t)model->operators;
        all->response[HYST_PI_DOWN] = all->response[HYST_PI_UP] = 0; /* at drive 0 the position is the offset */
        (void)hyst_pi_begin_at(model, all, 0);
        state->runs = 1;
    }
    move(model, state, drive, 0);
}

void hyst_pi_advance(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t drive) {
    const hyst_q31_t growth = state->growth;
    remember(model, state, drive);
    move(model, state, drive, growth);
}

HYST_APART void hyst_pi_follow(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t drive,
                               const hyst_pi_found_t *found) {
    const hyst_q31_t growth = state->growth;
    remember(model, state, drive);
    if (drive != found->drive || hyst_pi_leaves_open(found)) {
        move(model, state, drive, growth);
    } else if (found->outward != 0) {
        hyst_pi_run_t *run = state->run + (found->run - state->run);
        if (found->outward > 0) {
            carry_along(model, state, run, found->last + 1U, drive - growth, found->goal + found->missed, 1);
        } else {
            carry_along(model, state, run, found->last + 1U, drive + growth, found->goal - found->missed, -1);
        }
    }
}

hyst_q31_t hyst_pi_memory(const hyst_pi_t *model, const hyst_pi_state_t *state, uint32_t index) {
    uint32_t k = state->runs - 1U;
    while (state->run[k].end <= index) {
        k--;
    }
    return hyst_pi_memory_in(model, &state->run[k], index);
}

/* W = sum of all w_i z_i, |W| <= 2^61: the position in the middle between the innermost corners, less what the drive
 * gives there by itself. */
static inline int64_t memory_sum(const hyst_pi_t *model, const hyst_pi_state_t *state) {
    if (state->runs == 0) {
        return 0;
    }
    const hyst_pi_run_t *innermost = &state->run[state->runs - 1U];
    const int64_t middle = innermost->response[HYST_PI_UP] - (model->turn[0] >> 1); /* at drive = z_1 */
    return middle - hyst_product(model->slope[0].value, hyst_pi_memory_in(model, innermost, 0));
}

hyst_q31_t hyst_pi_output(const hyst_pi_t *model, const hyst_pi_state_t *state) {
    /* |w_0 u + W| <= 2^61 together, offset < 2^59 in Q59. */
    const int64_t sum = hyst_product(model->slope[0].value, state->drive) + memory_sum(model, state);
    return hyst_saturate(hyst_round_shift(sum + model->wide_offset, 28));
}

static inline hyst_q31_t out_of_reach(int outward, hyst_pi_found_t *found) {
    found->unreachable = true;
    found->drive = outward > 0 ? HYST_Q31_MAX : HYST_Q31_MIN;
    found->outward = (int8_t)outward;
    found->further = 0;
    return found->drive;
}

/* distance / w_0, rounded to nearest; false if it is out of range. */
static inline bool by_first_slope(const hyst_pi_t *model, int64_t distance, hyst_q31_t *drive) {
    /* w_0 = S_0 > 0 and |distance| < 2^62. Half a divisor away from zero, then toward zero. */
    const uint32_t slope = (uint32_t)model->slope[0].value;
    const uint64_t dividend = (uint64_t)hyst_magnitude(distance) + slope / 2U;
    if (dividend >> 32 >= slope) { /* 2^32 or more */
        return false;
    }
    uint32_t remainder;
    const int64_t size = hyst_divide(dividend, slope, model->slope[0].reciprocal, &remainder);
    const int64_t quotient = distance < 0 ? -size : size;
    *drive = (hyst_q31_t)quotient;
    return *drive == quotient;
}

/* What the weighted sum has to be: |position - offset| < 2^32, |goal| < 2^60. */
static inline int64_t goal_of(const hyst_pi_t *model, hyst_q31_t position) {
    return hyst_times_q28(position) - model->wide_offset;
}

/* The drive inside the gap of the first operator: w_0 u + W = goal. */
static inline hyst_q31_t within_gap(const hyst_pi_t *model, const hyst_pi_state_t *state, int64_t goal,
                                    hyst_pi_found_t *found) {
    const int64_t distance = goal - memory_sum(model, state);
    if (!by_first_slope(model, distance, &found->drive)) {
        return out_of_reach(distance < 0 ? -1 : 1, found);
    }
    found->outward = 0; /* the gap ends at integers, so rounding does not leave it */
    found->unreachable = false;
    return found->drive;
}

/* The drive outside of it, on the side `outward`. `goal`: less the growth. */
static HYST_WITHIN hyst_q31_t beyond_gap(const hyst_pi_t *model, const hyst_pi_state_t *state,
                                         const hyst_pi_run_t *behind, int64_t goal, int outward,
                                         hyst_pi_found_t *found) {
    const hyst_pi_run_t *run = last_run_by_position(state, behind, goal, outward);
    /* Beyond the corner of the last operator passed: > 0, < 2^63 by the bounds above. */
    uint64_t rest;
    uint32_t last = run->end - 1U;
    if (run->side == -outward) { /* all of them turn at once */
        rest = (uint64_t)(outward > 0 ? goal - run->response[ALONG(outward)] : run->response[ALONG(outward)] - goal);
    } else {
        /* Operator i is passed if |side + outward| T_i < rest, the goal's distance from the position at the level.
         * Where side is 0, that is within 2^61, and twice the distance below 2^64: both are even then. */
        uint64_t from, to;
        if (run->side != 0) {
            from = (uint64_t)run->response[AGAINST(outward)];
            to = (uint64_t)goal;
        } else {
            from = (uint64_t)run->response[HYST_PI_DOWN] + (uint64_t)run->response[HYST_PI_UP]; /* 2 B */
            to = 2U * (uint64_t)goal;
        }
        uint64_t reach = outward > 0 ? to - from : from - to;
        const int64_t *turn = last_turn_below(model, reach);
        turn = turn < model->turn + last ? turn : model->turn + last;
        last = (uint32_t)(turn - model->turn);
        reach -= (uint64_t)*turn;
        rest = run->side != 0 ? reach : reach >> 1;
    }
    /* Behind its corner, memory + outward (threshold + growth), the slope is S_end. */
    const uint32_t slope = (uint32_t)model->slope[last + 1U].value;
    const uint64_t dividend = rest + slope / 2U;
    if (dividend >> 32 >= slope) { /* 2^32 further at least */
        return out_of_reach(outward, found);
    }
    uint32_t remainder;
    const uint32_t further = hyst_divide(dividend, slope, model->slope[last + 1U].reciprocal, &remainder);
    const hyst_q31_t memory = hyst_pi_memory_in(model, run, last);
    const uint32_t room =
        outward > 0 ? (uint32_t)HYST_Q31_MAX - (uint32_t)memory : (uint32_t)memory + (UINT32_C(1) << 31);
    const uint32_t threshold = (uint32_t)model->threshold[last] + (uint32_t)state->growth; /* <= HYST_Q31_MAX */
    const uint32_t distance = threshold + further;
    if (distance < threshold || distance > room) { /* 2^32 or more, or beyond the range */
        return out_of_reach(outward, found);
    }
    const hyst_q31_t drive = (hyst_q31_t)(outward > 0 ? (uint32_t)memory + distance : (uint32_t)memory - distance);
    *found = (hyst_pi_found_t){.goal = goal,
                               .drive = drive,
                               .run = run,
                               .missed = (int32_t)(slope * further - (uint32_t)rest), /* <= slope / 2 in magnitude */
                               .further = further,
                               .last = (uint16_t)last,
                               .outward = (int8_t)outward,
                               .unreachable = false};
    return drive;
}

HYST_APART hyst_q31_t hyst_pi_find(const hyst_pi_t *model, const hyst_pi_state_t *state, hyst_q31_t position,
                                   hyst_pi_found_t *found) {
    const int64_t goal = goal_of(model, position);
    if (state->runs > 0) {
        const hyst_pi_run_t *behind = state->run + state->runs; /* the innermost run */
        /* Behind a corner the position is S_0 growth further than without growth: nothing but w_0 u knows of it. */
        const int64_t growth = hyst_product(model->slope[0].value, state->growth);
        if (goal - growth > behind[-1].response[HYST_PI_UP]) {
            return beyond_gap(model, state, behind, goal - growth, 1, found);
        }
        if (goal + growth < behind[-1].response[HYST_PI_DOWN]) {
            return beyond_gap(model, state, behind, goal + growth, -1, found);
        }
    }
    return within_gap(model, state, goal, found);
}

/* Inline where the program is compiled as a whole. */
inline hyst_q31_t hyst_pi_solve_line(const hyst_pi_t *model, hyst_q31_t position, bool *saturated) {
    const int64_t goal = goal_of(model, position);
    hyst_q31_t drive;
    if (!by_first_slope(model, goal, &drive)) {
        *saturated = true;
        return goal < 0 ? HYST_Q31_MIN : HYST_Q31_MAX;
    }
    return drive;
}

hyst_q31_t hyst_pi_solve(const hyst_pi_t *model, const hyst_pi_state_t *state, hyst_q31_t position, bool *saturated) {
    hyst_pi_found_t found;
    const hyst_q31_t drive = hyst_pi_find(model, state, position, &found);
    *saturated = *saturated || found.unreachable;
    return drive;
}

hyst_q31_t hyst_pi_forward(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t drive) {
    hyst_pi_advance(model, state, drive);
    return hyst_pi_output(model, state);
}

hyst_q31_t hyst_pi_inverse(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t position, bool *saturated) {
    hyst_pi_found_t found;
    const hyst_q31_t drive = hyst_pi_find(model, state, position, &found);
    *saturated = *saturated || found.unreachable;
    hyst_pi_follow(model, state, drive, &found);
    return drive;
}
